"""A dry brick wall in running bond, hit by a flying block.

    python docs/examples/brick_wall.py [--quick] [--out FOLDER]

Loose bricks settle under their weight, which the floor carries, then the block is thrown. Prints both loads and what
the energies leave open; writes brick_wall.png, and files for ParaView to brick_wall/.
"""

import numpy as np
from moments import command_line, frame_at, moments

import grainlaw as gl
from grainlaw.geometry import block, moved, together, wall
from grainlaw.laws import Friction
from grainlaw.protocols import FreeMotion

GRAVITY, DENSITY = 9.81, 2000
BRICK = 0.24, 0.08  # m
LAW = Friction(kn=1e10, ks=1e10, friction_angle=35)


def bodies(length, courses):
    """The floor, the flying block, and the wall between; grains 0, 1 and the rest."""
    width, height = length * BRICK[0], courses * BRICK[1]
    floor = block([(-4, -0.3), (8, -0.3), (8, 0), (-4, 0)], "floor")
    angle = np.radians(22.5 + 45 * np.arange(8))
    ball = block(0.18 * np.column_stack([np.cos(angle), np.sin(angle)]), "ball")
    return together(floor, moved(ball, by=(-0.3, 0.6 * height)), wall(width, height, *BRICK))


def run(length, courses, speed, duration, settle=0.3, material=None):
    """Result of the wall that is hit at ``speed`` m/s."""
    specimen = gl.Specimen(bodies(length, courses), material or gl.Rigid(density=DENSITY))
    motion = FreeMotion(duration=duration, settle=settle, fixed=[0], velocity={1: (speed, 0)}, tracked=[1])
    return gl.simulate(specimen, LAW, motion, detection=gl.Detection(damping=0.2), frames=60)


def on_the_floor(result, time):
    """N/m that contacts of the floor carry upwards at the frame nearest to a time."""
    contacts = frame_at(result, time).contacts
    mine = (contacts["grains"] == 0).any(axis=1)
    tx, ty = contacts["tangent"][mine].T  # along an edge of the lower grain, the floor's upper side: to the left
    normal, shear = (contacts[name][mine] * contacts["length"][mine] for name in ("normal", "shear"))
    return float(np.sum(normal * tx - shear * ty))


def main():
    options = command_line(__doc__)
    size = (2, 4) if options.quick else (4, 14)
    result = run(*size, speed=20, duration=0.3 if options.quick else 1.5)
    weight = DENSITY * GRAVITY * size[0] * size[1] * BRICK[0] * BRICK[1]
    print(f"{result.specimen.grains.count - 2} bricks, weight {weight:.2f} N/m")
    settled = result.curves["stage"] == 0
    print(f"on the floor when settled {on_the_floor(result, result.curves['time'][settled][-1]):.2f} N/m")
    print(f"mean speed when settled {result.curves['mean_speed'][settled][-1]:.1e} m/s")
    print(f"energy error {result.summary['energy_error']:.1e}, {result.summary['seconds']:.1f} s")
    start, end = result.curves["time"][settled][-1], result.curves["time"][-1]
    times = start + (end - start) * np.array([0, 0.02, 0.06, 0.15, 0.4, 1])
    courses = np.round(result.specimen.grains.centroids[:, 1] / BRICK[1] - 0.5).astype(int)
    colors = np.array(["#c98a63", "#b5694a"])[courses % 2]
    colors[:2] = "0.85", "#1f5fbf"
    figure = moments(result, times, colors, columns=3, view=(-1, 5.2, -0.2, 1.7))
    figure.savefig(options.out / "brick_wall.png", dpi=100)
    result.write_vtk(options.out / "brick_wall")


if __name__ == "__main__":
    main()
