"""Cracks under fluid pressure against closed forms: the tables of docs/water.md.

python tests/validation/water_study.py [--write | --check]
"""

from functools import cache, partial

import attrs
import numpy as np
from study_tables import DOCS, Table, main

import grainlaw as gl
from grainlaw.geometry import Bricks, rectangle
from grainlaw.laws import Friction, Linear
from grainlaw.protocols import DirectShear, Saturated

HALF = 10e-3  #: m, of the crack
ROCK = gl.Elastic(youngs_modulus=60e9, poissons_ratio=0.25, density=2700)
KN = KS = 1e15
PRESSURE = 10e6  #: Pa


@attrs.frozen(kw_only=True)
class Pressurize(gl.LoadingProtocol):
    """A crack from the left edge, which is a plane of symmetry; the right edge is held in its middle, against drift."""

    far: float = gl.parameter("Pa", default=0.0, at_least=0)  #: pressure on the lower and upper edge

    def stages(self, specimen):
        drives = [
            gl.Drive(boundary="left", axis=0, speed=0.0),
            gl.Drive(boundary="right", axis=1, speed=0.0, roller=True),
        ]
        far = (
            [gl.Pressure(boundary=name, pressure=self.far, ramp=2e-5) for name in ("bottom", "top")] if self.far else []
        )
        water = gl.FluidPressure(boundary="left", pressure=PRESSURE, ramp=2e-5, cracks_only=True)
        return [
            gl.Stage(
                name="pressurize", loads=[*drives, *far, water], until=[gl.AtRest(1e-4)], interval=2e-5,
                integrator=gl.DynamicRelaxation(),
            )
        ]  # fmt: skip

    def measure(self, state):
        return {"wet": int((state.fluid_pressure > 0).sum())}

    def summary(self, curves, specimen):
        return {"wet": int(curves["wet"][-1])}


def plate(across, along):
    """Half of a square plate ``across`` times as wide as the crack, with ``along`` bricks in half of the crack."""
    count, size = across * along, across * HALF
    grains = Bricks(rows=2 * count, columns=count).tessellate(rectangle(size, 2 * size))
    edges = grains.edges
    ends = grains.vertices[np.stack([edges.start, edges.end], axis=1)]
    on = (np.abs(ends[:, :, 1] - size) < 1e-9).all(axis=1) & (ends[:, :, 0] < HALF + 1e-9).all(axis=1)
    crack = np.stack([edges.start, edges.end], axis=1)[on]
    return gl.Specimen(attrs.evolve(grains, joints={"crack": crack}), ROCK)


def widest(spacing):
    """m over Pa, 4 a / E*: Sneddon's (1946), with the modulus of a plate whose two sets of joints comply.

    1 / E* by Sih, Paris and Irwin (1965) from the compliances of plane strain; without joints (1 - nu^2) / E.
    """
    e, nu = ROCK.youngs_modulus, ROCK.poissons_ratio
    b11 = (1 - nu**2) / e + 1 / (KN * spacing)
    b12, b66 = -nu * (1 + nu) / e, 2 * (1 + nu) / e + 2 / (KS * spacing)
    return 4 * HALF * np.sqrt(b11 * b11 / 2) * np.sqrt(1 + (2 * b12 + b66) / (2 * b11))


@cache
def opened(across, along, far=0.0):
    specimen = plate(across, along)
    laws = {"crack": Friction(kn=KN, ks=KS, friction_angle=30), ...: Linear(kn=KN, ks=KS)}
    result = gl.simulate(specimen, laws, Pressurize(far=far), detection=None, frames=2)
    frame, bonds = result.frames[-1], result.interfaces
    place = specimen.mesh.nodes[bonds]
    first, second = place[:, 0, 0], place[:, 1, 0]
    weight = 0.5 - 0.5 / np.sqrt(3)
    x = np.concatenate([first + weight * (second - first), second + weight * (first - second)])
    wet = frame.bonds["fluid_pressure"] > 0
    return result, x[wet], frame.bonds["opening"][wet]


def crack(across, along, far=0.0):
    result, x, opening = opened(across, along, far)
    theory = widest(HALF / along) * (PRESSURE - far) * np.sqrt(1 - (x / HALF) ** 2)
    middle = x < HALF / 2
    return (
        f"{across * along * across * along * 2:,}",
        f"{opening[middle].mean() * 1e6:.3f}",
        f"{theory[middle].mean() * 1e6:.3f}",
        f"{100 * (np.mean(opening[middle] / theory[middle]) - 1):+.1f}",
        f"{result.summary['energy_error']:.0e}",
    )


def held(far):
    result, x, opening = opened(5, 4, far)
    _, _, bare = opened(5, 4)
    middle, wet = x < HALF / 2, result.frames[-1].bonds["fluid_pressure"] > 0
    pressure = -result.frames[-1].bonds["normal"][wet][middle].mean()
    return (
        f"{np.maximum(opening, 0)[middle].mean() / bare[middle].mean():.3f}",
        f"{max(1 - far / PRESSURE, 0):.3f}",
        f"{abs(pressure) / 1e6:.2f}",
        f"{max(far - PRESSURE, 0) / 1e6:.2f}",
    )


def friction(pressure):
    """Two bricks with a joint of 30 degrees under 10 MPa."""
    specimen = gl.Specimen(Bricks(rows=2).tessellate(rectangle(10e-3, 4e-3)), ROCK)
    test = DirectShear(normal_stress=10e6, loading=gl.Constant(speed=0.02), maximum_slip=10e-6)
    wet = Saturated(test=test, pressure=pressure, boundaries="left") if pressure else test
    found = gl.simulate(specimen, Friction(kn=1e14, ks=1e14, friction_angle=30), wet, frames=2).summary
    return (
        f"{found['residual_stress'] / 1e6:.3f}",
        f"{np.tan(np.radians(30)) * (10e6 - pressure) / 1e6:.3f}",
        f"{found['energy_error']:.0e}",
    )


PAGE = DOCS / "water.md"
TABLES = [
    Table(
        page=PAGE,
        name="pressurised crack",
        columns=("plate over crack, bricks in half of it", "bricks", "opening (µm)", "Sneddon (µm)", "error (%)",
                 "error of the energies"),
        rows={f"{w}, {n}": partial(crack, w, n) for w, n in ((5, 4), (10, 4), (20, 4), (5, 8), (10, 8), (5, 16))},
        firm=("opening (µm)", "Sneddon (µm)"),
        checked=("5, 4",),
    ),
    Table(
        page=PAGE,
        name="held crack",
        columns=("stress across the crack (MPa)", "opening over that without", "1 - stress / pressure",
                 "pressure between its faces (MPa)", "stress - pressure (MPa)"),
        rows={f"{far / 1e6:g}": partial(held, far) for far in (4e6, 8e6, 12e6)},
        firm=("opening over that without",),
        checked=("8",),
    ),
    Table(
        page=PAGE,
        name="wet joint",
        columns=("fluid (MPa)", "shear strength (MPa)", "tan 30° (10 MPa - fluid)", "error of the energies"),
        rows={f"{p / 1e6:g}": partial(friction, p) for p in (0, 2e6, 4e6, 6e6, 8e6)},
        firm=("shear strength (MPa)",),
        checked=("4",),
    ),
]  # fmt: skip

if __name__ == "__main__":
    main(TABLES)
