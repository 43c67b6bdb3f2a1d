"""Three blocks on an incline of 30 degrees: one slides, one topples, one stays.

    python docs/examples/incline.py [--quick] [--out FOLDER]

A block slides where the friction angle is below the inclination, by g (sin a - tan(phi) cos a); it topples where its
width over its height is below tan(a). Some seconds. Prints what was measured next to that; writes incline.png, and
files for ParaView to incline/.
"""

import numpy as np
from moments import command_line, moments

import grainlaw as gl
from grainlaw.geometry import block, moved, together
from grainlaw.laws import Friction
from grainlaw.protocols import FreeMotion

INCLINE, SMOOTH, ROUGH = 30, 20, 35  # degrees: the slope, and the friction angles of its blocks
GRAVITY = 9.81
SETTLE = 0.3  # s
ACCELERATION = GRAVITY * (np.sin(np.radians(INCLINE)) - np.tan(np.radians(SMOOTH)) * np.cos(np.radians(INCLINE)))
BASE, SLIDES, TOPPLES, STAYS = range(4)


def box(left, width, height, phase=0):
    """A block on the incline before it is tilted."""
    right = left + width
    return block([(left, 0), (right, 0), (right, height), (left, height)], phase=phase)


def run(duration, stiffness=1e9):
    """Result of three blocks on the incline; the smooth one is of a phase of its own, with a law of its own."""
    base = block([(0, -0.4), (10, -0.4), (10, 0), (0, 0)], "base")
    blocks = together(base, box(4, 1, 0.5, phase=1), box(6, 0.5, 1.2), box(8.5, 1, 0.5))
    rough, smooth = (Friction(kn=stiffness, ks=stiffness, friction_angle=angle) for angle in (ROUGH, SMOOTH))
    motion = FreeMotion(duration=duration, settle=SETTLE, fixed=[BASE], tracked=[SLIDES, TOPPLES, STAYS])
    specimen = gl.Specimen(moved(blocks, turn=INCLINE), gl.Rigid(density=2600))
    detection = gl.Detection(damping=0.5)  # of critical: without it what falls would bounce back
    return gl.simulate(specimen, {(0, 0): rough, (0, 1): smooth}, motion, detection=detection)


def measured(result):
    """Acceleration (m/s2) of the first block, rotation (degrees) of the second, displacement (m) of the third."""
    curves = {name: column[result.curves["stage"] == 1] for name, column in result.curves.items()}
    distance = {k: np.hypot(*(curves[f"{axis}_{k}"] - curves[f"{axis}_{k}"][0] for axis in "xy")) for k in (1, 3)}
    acceleration = 2 * np.polyfit(curves["time"], distance[SLIDES], 2)[0]
    return acceleration, np.degrees(curves[f"rotation_{TOPPLES}"][-1]), distance[STAYS][-1]


def main():
    options = command_line(__doc__)
    result = run(0.5 if options.quick else 1.5)
    acceleration, rotation, distance = measured(result)
    print(f"acceleration of the smooth block  {acceleration:.6f} m/s2 (theory {ACCELERATION:.6f})")
    print(f"rotation of the slender block     {rotation:.2f} degrees")
    print(f"displacement of the rough block   {distance:.1e} m")
    print(f"energy error                      {result.summary['energy_error']:.1e}")
    times = np.linspace(SETTLE, result.curves["time"][-1], 4)
    figure = moments(result, times, ["0.85", "#e8b04a", "#c8281e", "#1f5fbf"], columns=2)
    figure.savefig(options.out / "incline.png", dpi=100)
    result.write_vtk(options.out / "incline")


if __name__ == "__main__":
    main()
