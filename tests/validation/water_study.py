"""Cracks under fluid pressure against closed forms: the tables of docs/tables/water.md.

python tests/validation/water_study.py [--write | --check]
"""

import sys
from functools import cache, partial
from pathlib import Path

import attrs
import numpy as np
from scipy.integrate import quad
from scipy.special import beta
from study_tables import DOCS, Table, main

import grainlaw as gl
from grainlaw.geometry import Bricks, rectangle
from grainlaw.laws import CohesiveCrack, Friction, Linear, LinearSoftening
from grainlaw.protocols import DirectShear, HydraulicFracturing, Saturated

sys.path.append(str(Path(__file__).parents[1]))
from bodies import sectors

HALF = 10e-3  #: m, of the crack
ROCK = gl.Elastic(youngs_modulus=60e9, poissons_ratio=0.25, density=2700)
MODULUS = ROCK.youngs_modulus / (1 - ROCK.poissons_ratio**2)  #: Pa, E', of plane strain
KN = 1e15
PRESSURE = 10e6  #: Pa
GROWTH = 1.15  #: of a brick over that before it


@attrs.frozen(kw_only=True)
class Pressurize(gl.LoadingProtocol):
    """A crack from the left edge, which is a plane of symmetry; the right edge is held in its middle, against drift."""

    far: float = gl.parameter("Pa", default=0.0, at_least=0)  #: pressure on the lower and upper edge

    def stages(self, specimen):
        drives = [
            gl.loads.Drive(boundary="left", axis=0, speed=0.0),
            gl.loads.Drive(boundary="right", axis=1, speed=0.0, roller=True),
        ]
        far = (
            [gl.loads.Pressure(boundary=name, pressure=self.far, ramp=2e-5) for name in ("bottom", "top")]
            if self.far
            else []
        )
        water = gl.loads.FluidPressure(boundary="left", pressure=PRESSURE, ramp=2e-5, cracks_only=True)
        return [
            gl.Stage(
                name="pressurize", loads=[*drives, *far, water], until=[gl.conditions.AtRest(1e-4)], interval=2e-5,
                integrator=gl.integration.DynamicRelaxation(),
            )
        ]  # fmt: skip

    def measure(self, state):
        return {"wet": int((state.fluid_pressure > 0).sum())}

    def summary(self, curves, specimen):
        return {"wet": int(curves["wet"][-1])}


def grown(size, count, to):
    """Sizes of bricks from a crack to ``to``: ``count`` of ``size``, then each larger than the one before."""
    sizes = [size]
    while count * size + sum(sizes[1:]) < to:
        sizes.append(min(GROWTH * sizes[-1], to / 15))
    larger = np.array(sizes[1:])
    return [size] * count + list(larger * (to - count * size) / larger.sum())


def plate(size, width, half, fine):
    """Half of a tied square plate, 2 ``width`` wide: only its middle row is a joint, of the crack up to ``half``.

    Bricks have the ``size`` along the row up to ``fine``, and in three rows on either side; the others are larger. What
    is beyond the crack in its row is the joint "seam".
    """
    up, along = grown(size, 3, width), grown(size, round(fine / size), width)
    grains = Bricks(rows=[*up[::-1], *up], columns=along).tessellate(rectangle(width, 2 * width))
    edges = grains.edges
    pairs = np.stack([edges.start, edges.end], axis=1)
    ends = grains.vertices[pairs]
    row, inner = (np.abs(ends[:, :, 1] - width) < 1e-9).all(axis=1), (ends[:, :, 0] < half + 1e-9).all(axis=1)
    joints = {"crack": pairs[row & inner], "seam": pairs[row & ~inner]}
    return gl.Specimen(attrs.evolve(grains, joints=joints), ROCK, tied=["between"])


@cache
def opened(across, along, far=0.0):
    specimen = plate(HALF / along, across * HALF, HALF, 2 * HALF)
    laws = {"crack": Friction(kn=KN, ks=KN, friction_angle=30), "seam": Linear(kn=KN, ks=KN)}
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
    theory = 4 * HALF / MODULUS * (PRESSURE - far) * np.sqrt(1 - (x / HALF) ** 2)
    middle = x < HALF / 2
    return (
        f"{result.specimen.grains.count:,}",
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


# --- a hole that is pumped until it breaks ----------------------------------------------------------------------------

HARD = gl.Elastic(youngs_modulus=35e9, poissons_ratio=0.27, density=2500)
HOLE, FAR = 50e-3, 4.0  #: m, radii of the hole and of the plate
TENSILE = 5e6  #: Pa


def breakdown(cells, xx, yy, energy):
    """A tied plate, whose only joints lie on both axes; ``cells`` stand round the hole."""
    count = round(np.log(FAR / HOLE) / np.log1p(2 * np.pi / cells))
    plate = gl.Specimen(sectors(np.geomspace(HOLE, FAR, count + 1), cells), HARD, tied=["between"])
    stiffness = 1e13 * cells
    bond = CohesiveCrack(
        kn=stiffness, ks=stiffness, tensile_strength=TENSILE, cohesion=24e6, friction_angle=38,
        residual_friction_angle=38, mode_i_energy=energy, mode_ii_energy=10 * energy, softening=LinearSoftening(),
    )  # fmt: skip
    test = HydraulicFracturing(xx=-xx, yy=-yy, rate=2e-2, largest_volume=1e-4, samples=2000)
    found = gl.simulate(plate, bond, test, detection=None, frames=2)
    first, expected = found.summary["initiation_pressure"], 3 * min(xx, yy) - max(xx, yy) + TENSILE
    x, y = np.abs(found.cracks.position[0])
    return (
        f"{first / 1e6:.2f}",
        f"{expected / 1e6:.2f}",
        f"{100 * (first / expected - 1):+.1f}",
        "x" if x > y else "y",
        f"{found.summary['breakdown_pressure'] / 1e6:.1f}",
        f"{found.summary['energy_error']:.0e}",
    )


# --- a crack that is pumped open (Khristianovich, Geertsma and de Klerk) ----------------------------------------------

WIDTH, FINE = 0.6, 80e-3  #: m, of half of the plate, and of its row of small bricks
RATE = 4e-3  #: m2/s, into both wings
START = 30e-3  #: m, half-length of the crack that a thin fluid makes longer
TOUGHNESS = 10e6  #: Pa m^0.5
ZONE = 3.5  #: bricks in (toughness / strength)^2, by which the strength is chosen
STIFF = 2.5e12  #: Pa, stiffness of the bonds times the size of the bricks
THIN, THICK = 1e-6, 1e-3  #: Pa s
CLOSING = 100e6  #: Pa, across the crack that a thick fluid opens
WINDOW = 40e-3, 55e-3  #: m, half-lengths by theory between which it is compared


@attrs.frozen(kw_only=True)
class Grow(gl.LoadingProtocol):
    """Half of a crack from the left edge, a plane of symmetry, that half of the rate is pumped into."""

    viscosity: float = gl.parameter("Pa s")
    entry_damage: float = gl.parameter("1", default=1.0)
    far: float = gl.parameter("Pa", default=0.0, at_least=0)  #: stress across the crack
    aperture: float = gl.parameter("m", default=1e-6)  #: residual, of closed joints
    bulk_modulus: float = gl.parameter("Pa", default=5e9)  #: of the fluid
    time: float = gl.parameter("s")

    def stages(self, specimen):
        held = [
            gl.loads.Drive(boundary="left", axis=0, speed=0.0),
            gl.loads.Drive(boundary="right", axis=1, speed=0.0, roller=True),
        ]
        far = [gl.loads.Traction(boundary=name, stress=(0.0, -self.far, 0.0)) for name in ("bottom", "top") if self.far]
        pump = gl.loads.Injection(
            boundary="left", rate=RATE / 2, ramp=self.time / 50, bulk_modulus=self.bulk_modulus,
            viscosity=self.viscosity, residual_aperture=self.aperture, entry_damage=self.entry_damage,
            volume=1e-9, cracks_only=True,
        )  # fmt: skip
        rising = [attrs.evolve(load, ramp=1e-3) for load in far]
        press = gl.Stage(
            name="press", loads=[*held, *rising], until=[gl.conditions.AtRest(1e-4)], interval=1e-5, static=True
        )
        grow = gl.Stage(
            name="pump",
            loads=[*held, *far, pump],
            until=[gl.conditions.Reaches("pumped", self.time)],
            interval=self.time / 100,
        )
        return [press, grow] if far else [grow]

    def measure(self, state):
        place = state.mesh.nodes[state.bonds.ends][:, :2]
        x = place[:, :, 0] @ [[0.75, 0.25], [0.25, 0.75]]
        middle = np.ptp(state.mesh.nodes[:, 1]) / 2
        row = np.tile((np.abs(place[:, :, 1] - middle) < 1e-9).all(axis=1), 2)
        end, damage = x.T.ravel() + state.contact_lengths / 2, state.memory("damage")
        inlet = np.argsort(np.where(row, end, np.inf))[:2]

        def farthest(some):
            return float(end[row & some].max(initial=0.0))

        return {
            "pumped": state.pumped["injected"] / (RATE / 2), "pressure": state.pumped["injection_pressure"],
            "width": state.opening[inlet].mean(), "open": farthest(state.opening > 0),
            "torn": max(farthest(damage >= 1), START), "softened": max(farthest(damage >= 1e-3), START),
        }  # fmt: skip

    def summary(self, curves, specimen):
        return {}


@cache
def thin(size, entry_damage=1e-3):
    """A fluid so thin that it has one pressure opens a row of cohesive bonds, and enters their cohesive zone."""
    energy, strength, stiffness = TOUGHNESS**2 / MODULUS, TOUGHNESS / np.sqrt(ZONE * size), STIFF / size
    seam = CohesiveCrack(
        kn=stiffness, ks=stiffness, tensile_strength=strength, cohesion=10 * strength, friction_angle=30,
        residual_friction_angle=30, mode_i_energy=energy, mode_ii_energy=10 * energy, softening=LinearSoftening(),
    )  # fmt: skip
    laws = {"crack": Friction(kn=stiffness, ks=stiffness, friction_angle=30), "seam": seam}
    test = Grow(viscosity=THIN, entry_damage=entry_damage, time=1.9e-3)
    return gl.simulate(plate(size, WIDTH, START, FINE), laws, test, detection=None, frames=2)


@cache
def thick(size):
    """A thick fluid opens a joint without strength under a stress.

    So high that the part of the crack without fluid is short: time over 12 mu E'^2 / stress^3 is above 14 (Garagash
    2006). The residual aperture is so small that little fluid flows ahead in the closed joint.
    """
    laws = {"crack": Friction(kn=KN, ks=KN, friction_angle=30), "seam": Linear(kn=KN, ks=KN)}
    test = Grow(viscosity=THICK, far=CLOSING, aperture=2e-7, bulk_modulus=2e10, time=1.15e-3)
    return gl.simulate(plate(size, WIDTH, 1.25 * FINE, FINE), laws, test, detection=None, frames=2)


def by_toughness(time):
    """Half-length, opening and pressure at the inlet where toughness rules: p = K / sqrt(pi a), both wings hold all."""
    half = (MODULUS * RATE * time / (2 * np.sqrt(np.pi) * TOUGHNESS)) ** (2 / 3)
    pressure = TOUGHNESS / np.sqrt(np.pi * half)
    return half, 4 * pressure * half / MODULUS, pressure


def by_viscosity(time):
    """The same where viscosity rules, without toughness: Adachi and Detournay (2002), to first order."""
    a0, a1, b = np.sqrt(3), -0.156, 0.0663

    def opening(r):
        root = np.sqrt(1 - r * r)
        return (
            a0 * root ** (4 / 3) + a1 * root ** (10 / 3) + b * (4 * root + 2 * r * r * np.log((1 - root) / (1 + root)))
        )

    gamma = 1 / np.sqrt(2 * quad(opening, 0, 1)[0])  # the volume of both wings
    small = (12 * THICK / (MODULUS * time)) ** (1 / 3)
    length = (MODULUS * RATE**3 * time**4 / (12 * THICK)) ** (1 / 6)
    inlet = a0 + a1 + 4 * b, beta(1 / 2, 2 / 3) / (3 * np.pi) * (a0 + 10 / 7 * a1) + 2 * b
    return gamma * length, gamma * inlet[0] * small * length, inlet[1] * small * MODULUS


def over_theory(run, size, theory, far, *lengths):
    """Means, lowest and highest of what was found over theory, while that has a half-length within ``WINDOW``."""
    result = run(size)
    curves = result.curves
    pumping = (curves["stage"] == curves["stage"][-1]) & (curves["pumped"] > 0)
    half, width, pressure = theory(curves["pumped"][pumping])
    seen = (half > WINDOW[0]) & (half < WINDOW[1])
    pairs = [(curves[name], half) for name in lengths]
    pairs += [(curves["width"], width), (curves["pressure"] - far, pressure)]
    ratios = [(found[pumping] / expected)[seen] for found, expected in pairs]
    cells = [f"{ratio.mean():.3f} ({ratio.min():.2f} to {ratio.max():.2f})" for ratio in ratios]
    return f"{result.specimen.grains.count:,}", *cells, f"{result.summary['energy_error']:.0e}"


PAGE = DOCS / "tables/water.md"
TABLES = [
    Table(
        page=PAGE,
        name="pressurised crack",
        columns=("plate over crack, bricks in half of it", "bricks", "opening (µm)", "Sneddon (µm)", "error (%)",
                 "error of the energies"),
        rows={f"{w}, {n}": partial(crack, w, n) for w, n in ((5, 4), (10, 4), (20, 4), (20, 8), (20, 16), (20, 32))},
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
    Table(
        page=PAGE,
        name="breakdown",
        columns=("stress along x, y (MPa); fracture energy (J/m2); cells round the hole", "first damage (MPa)",
                 "Hubbert and Willis (MPa)", "error (%)", "first crack along", "breakdown (MPa)",
                 "error of the energies"),
        rows={
            f"{xx / 1e6:g}, {yy / 1e6:g}; {energy}; {cells}": partial(breakdown, cells, xx, yy, energy)
            for cells, xx, yy, energy in ((48, 6.8e6, 4.6e6, 10), (96, 6.8e6, 4.6e6, 10), (48, 6.8e6, 4.6e6, 80),
                                          (48, 4.6e6, 4.6e6, 10), (48, 4.6e6, 6.8e6, 10))
        },
        firm=("first damage (MPa)", "breakdown (MPa)"),
        checked=("6.8, 4.6; 10; 48",),
    ),
    Table(
        page=PAGE,
        name="thin fluid",
        columns=("brick (mm)", "bricks", "half-length to the end of the broken points", "of the cohesive zone",
                 "opening", "pressure", "error of the energies"),
        rows={
            **{
                f"{1e3 * size:g}": partial(over_theory, thin, size, by_toughness, 0.0, "torn", "softened")
                for size in (2.5e-3, 1.25e-3, 0.625e-3)
            },
            "2.5, the cohesive zone dry": partial(
                over_theory, partial(thin, entry_damage=1.0), 2.5e-3, by_toughness, 0.0, "torn", "softened"
            ),
        },
        firm=("opening", "pressure"),
        checked=("2.5",),
    ),
    Table(
        page=PAGE,
        name="thick fluid",
        columns=("brick (mm)", "bricks", "half-length of the open points", "opening", "pressure",
                 "error of the energies"),
        rows={
            f"{1e3 * size:g}": partial(over_theory, thick, size, by_viscosity, CLOSING, "open")
            for size in (5e-3, 2.5e-3, 1.25e-3)
        },
        firm=("opening", "pressure"),
        checked=("5",),
    ),
]  # fmt: skip

if __name__ == "__main__":
    main(TABLES)
