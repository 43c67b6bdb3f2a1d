"""A slope in jointed rock: loose blocks between bedding that dips out of the face, and cross joints.

    python docs/examples/jointed_slope.py [--quick] [--out FOLDER]

Plane failure of a dry slope without cohesion: blocks slide on the bedding where tan(phi) / tan(dip), the factor of
safety, is below 1. Blocks above the bedding plane that comes to light in the face are loose; what lies below is held.
They settle under gravity with damped motion, then go on without. Prints how far they go and how the lowest, free in
front, accelerates; writes jointed_slope.png, and files for ParaView to jointed_slope/.
"""

import numpy as np
from matplotlib.figure import Figure
from moments import command_line, draw

import grainlaw as gl
from grainlaw.geometry import JointSet, JointSets, apart, polygon
from grainlaw.laws import Friction
from grainlaw.protocols import FreeMotion

DIP, GRAVITY, SETTLE = 35, 9.81, 0.5  # degrees, m/s2, s
SLOPE = polygon([(0, 0), (40, 0), (40, 6), (24, 6), (12, 24), (0, 24)])
DAYLIGHT = np.array([20.0, 12.0])  # on the face
FRICTION = 20, 30, 34, 36, 40, 50  # degrees


def factor_of_safety(friction):
    """Of a plane failure along the bedding."""
    return np.tan(np.radians(friction)) / np.tan(np.radians(DIP))


def acceleration(friction):
    """m/s2, of a block on the bedding that slides; 0 where it stays."""
    dip = np.radians(DIP)
    return GRAVITY * max(np.sin(dip) - np.tan(np.radians(friction)) * np.cos(dip), 0.0)


def blocks(bedding, cross):
    """The slope cut by its joints (spacings in m), the numbers of the blocks that are held, and that of the lowest."""
    sets = [
        JointSet(dip=-DIP, spacing=bedding, through=DAYLIGHT),
        JointSet(dip=90 - DIP, spacing=cross, through=DAYLIGHT),
    ]
    grains = apart(JointSets(sets=sets).tessellate(SLOPE))
    height = (grains.centroids - DAYLIGHT) @ (np.sin(np.radians(DIP)), np.cos(np.radians(DIP)))
    held = (height < 0) | (grains.centroids[:, 0] > SLOPE.outline[3, 0])
    away = np.hypot(*(grains.centroids - DAYLIGHT).T)
    return grains, np.flatnonzero(held), int(np.where(held, np.inf, away).argmin())


def run(friction, duration, bedding=2.5, cross=5.0):
    """Result, mean displacement (m) of the loose blocks after settling, acceleration of the lowest (m/s2)."""
    grains, held, lowest = blocks(bedding, cross)
    law = Friction(kn=1e9, ks=1e9, friction_angle=friction)
    motion = FreeMotion(duration=duration, settle=SETTLE, fixed=held, tracked=[lowest], samples=100)
    specimen = gl.Specimen(grains, gl.Rigid(density=2600))
    result = gl.simulate(specimen, law, motion, detection=gl.Detection(damping=0.2))
    curves = {name: column[result.curves["stage"] == 1] for name, column in result.curves.items()}

    def distance(x, y):
        return np.hypot(curves[x] - curves[x][0], curves[y] - curves[y][0])

    first = curves["time"] < curves["time"][0] + 0.4
    fit = np.polyfit(curves["time"][first], distance(f"x_{lowest}", f"y_{lowest}")[first], 2)
    return result, distance("centre_x", "centre_y")[-1], 2 * fit[0]


def main():
    options = command_line(__doc__)
    figure = Figure(figsize=(12, 5.8), layout="constrained")
    print("friction  factor of safety  mean path (m)  acceleration of the lowest block (m/s2, theory)  energy error")
    for friction, axes in zip(FRICTION, figure.subplots(2, 3).flat, strict=True):
        result, mean, found = run(friction, 0.5 if options.quick else 3.0)
        safety, error = factor_of_safety(friction), result.summary["energy_error"]
        found = round(found, 4) + 0.0  # never -0
        print(
            f"{friction:8d}  {safety:16.3f}  {mean:13.1e}  {found:35.4f}  {acceleration(friction):10.4f}  {error:12.1e}"
        )
        colors = np.full(result.specimen.grains.count, "#e8b04a", dtype="U7")
        colors[list(result.protocol.fixed)] = "#d9d9d9"
        draw(axes, result, result.frames[-1], colors)
        axes.set(xlim=(0, 40), ylim=(0, 25))
        axes.set_title(f"friction {friction} degrees, factor of safety {safety:.2f}", fontsize=9)
    figure.savefig(options.out / "jointed_slope.png", dpi=100)
    result.write_vtk(options.out / "jointed_slope")


if __name__ == "__main__":
    main()
