"""
A block on an incline
=====================

Contacts between any grains are found while they move: a smooth block slides, a slender one topples, a rough one stays.
"""

import numpy as np
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure

import grainlaw as gl
from grainlaw.geometry import block, moved, together
from grainlaw.laws import Friction
from grainlaw.protocols import FreeMotion


def box(left, width, height, phase=0):
    right = left + width
    return block([(left, 0), (right, 0), (right, height), (left, height)], phase=phase)


base = block([(0, -0.4), (10, -0.4), (10, 0), (0, 0)], "base")
blocks = together(base, box(4, 1, 0.5, phase=1), box(6, 0.5, 1.2), box(8.5, 1, 0.5))
specimen = gl.Specimen(moved(blocks, turn=30), gl.Rigid(density=2600))
smooth, rough = (Friction(kn=1e9, ks=1e9, friction_angle=angle) for angle in (20, 35))
motion = FreeMotion(duration=1.2, settle=0.3, fixed=[0], tracked=[1])
result = gl.simulate(
    specimen,
    {(0, 0): rough, (0, 1): smooth},
    motion,
    detection=gl.Detection(damping=0.5),
    frames=60,
    time_step_factor=0.3,  # grains that fall on others: at 1 these impacts make 0.6 % of the energy
)

# %%
# Four moments. The blocks come to rest first; then the time begins.
figure = Figure(figsize=(9, 6), layout="constrained")
for axes, time in zip(figure.subplots(2, 2).flat, np.linspace(0.3, 1.5, 4), strict=True):
    frame = min(result.frames, key=lambda frame: abs(frame.time - time))
    place, ends = result.mesh.nodes + frame.displacement, result.mesh.first_node
    outlines = [
        place[ends[g] : ends[g + 1] - 1] for g in range(4)
    ]  # the last node of a grain is its middle
    axes.add_collection(
        PolyCollection(
            outlines, facecolor=["0.85", "#0077bb", "#ee7733", "#009988"], edgecolor="0.2"
        )
    )
    axes.set(
        aspect="equal", xlim=(-0.2, 9.5), ylim=(-0.5, 6), title=f"{frame.time - 0.3:.2f} s"
    )
figure

# %%
# **Check.** The smooth block gains speed by g (sin 30 - tan 20 cos 30).
free = result.curves["stage"] == 1
time, x, y = (result.curves[name][free] for name in ("time", "x_1", "y_1"))
distance = np.hypot(x - x[0], y - y[0])
acceleration = 2 * np.polyfit(time, distance, 2)[0]
theory = 9.81 * (np.sin(np.radians(30)) - np.tan(np.radians(20)) * np.cos(np.radians(30)))
print(f"{acceleration:.5f} m/s2, theory {theory:.5f} m/s2")
assert abs(acceleration / theory - 1) < 1e-3
