"""Waves and openings against their closed forms: tables of docs/tables/waves.md.

python tests/validation/waves_study.py [--write | --check]
"""

import sys
from functools import cache, partial
from pathlib import Path

import attrs
import numpy as np
from study_tables import DOCS, Table, main

import grainlaw as gl
from grainlaw.geometry import Bricks, Graded, Laguerre, plate_with_hole, rectangle
from grainlaw.laws import Linear
from grainlaw.protocols import Excavation, PlaneWave, Wave

sys.path.insert(0, str(Path(__file__).parents[1]))
from bars import GLUED, P_SPEED, ROCK, S_SPEED, bar, bell
from support import with_quiet

PAGE, SIZE = DOCS / "tables/waves.md", 10e-3
SPEED = {Wave.P: P_SPEED, Wave.S: S_SPEED}

# --- quiet ends ------------------------------------------------------------------------------------------------------


def reflected(wave, bricks, soft=False):
    """Velocity that comes back to the middle of a bar over that which passed; the largest sizes of both."""
    speed, length, law = SPEED[wave], 0.6, GLUED
    if soft:  # joints as soft as the bricks: both in series have half the stiffness
        modulus = ROCK.density * speed**2
        law, speed = Linear(kn=modulus / SIZE, ks=modulus / SIZE), speed / np.sqrt(2)
    duration = bricks * SIZE / speed

    @attrs.frozen(kw_only=True)
    class Pulse(PlaneWave):
        def stages(self, specimen):
            (stage,) = super().stages(specimen)
            known = {"p_speed": speed, "s_speed": speed} if soft else {}
            return [with_quiet(stage, gl.loads.Quiet(boundary="right", **known))]

    test = Pulse(
        stress=bell(duration, -1e6), wave=wave, gauges=(length / 2,), samples=800,
        duration=1.6 * length / speed + 1.5 * duration,
    )  # fmt: skip
    curves = gl.simulate(bar(60), law, test, frames=1).curves
    passed = curves["time"] < length / 2 / speed + 1.25 * duration
    velocity = np.abs(curves["velocity_0"])
    return velocity[~passed].max() / velocity[passed].max()


def quiet_row(bricks):
    found = [reflected(Wave.P, bricks), reflected(Wave.S, bricks), reflected(Wave.P, bricks, soft=True)]
    return [f"{100 * one:.2f}" for one in found]


# --- a joint ---------------------------------------------------------------------------------------------------------

COLUMNS, GAUGES = 120, (0.3, 0.9)  # the joint is in the middle, at 0.6 m
PULSE = 8  # bricks: the spectrum reaches to waves of half as many


@cache
def spectra(wave, jointed, stiffness):
    """Of the velocities at both gauges, by time step and times."""
    grains = Bricks(rows=1, columns=COLUMNS).tessellate(rectangle(COLUMNS * SIZE, SIZE))
    phase = (np.arange(COLUMNS) >= COLUMNS // 2).astype(int)
    halves = gl.Specimen(attrs.evolve(grains, phase=phase), ROCK)
    joint = Linear(kn=stiffness, ks=stiffness) if jointed else GLUED
    laws = {(0, 0): GLUED, (1, 1): GLUED, (0, 1): joint}
    speed = SPEED[wave]
    test = PlaneWave(
        stress=bell(PULSE * SIZE / speed, -1e6), wave=wave, gauges=GAUGES, quiet=("left", "right"), samples=2000,
        duration=1.9 * COLUMNS * SIZE / speed,
    )  # fmt: skip
    curves = gl.simulate(halves, laws, test, frames=1).curves
    time = np.linspace(0, curves["time"][-1], 4000)
    return time, [np.interp(time, curves["time"], curves[f"velocity_{k}"]) for k in (0, 1)]


def joint_row(ratio):
    """|T| and |R| at a frequency at which omega Z / 2 k is ``ratio``; theory, and of P and S waves here."""
    cells = [f"{1 / np.hypot(1, ratio):.4f}", f"{1 / np.hypot(1, 1 / ratio):.4f}"]
    found = []
    for wave in (Wave.P, Wave.S):
        impedance = ROCK.density * SPEED[wave]
        reference = 2 * np.pi * SPEED[wave] / (30 * SIZE)  # at which a wave is 30 bricks long
        omega, stiffness = reference * ratio, impedance * reference / 2
        time, plain = spectra(wave, False, stiffness)
        _, jointed = spectra(wave, True, stiffness)
        at = np.exp(-1j * omega * time)
        through = abs(jointed[1] @ at) / abs(plain[1] @ at)
        back = abs((jointed[0] - plain[0]) @ at) / abs(plain[0] @ at)
        found.append((f"{through:.4f}", f"{back:.4f}"))
    bricks = f"{30 / ratio:.0f}"
    return [bricks, cells[0], found[0][0], found[1][0], cells[1], found[0][1], found[1][1]]


# --- an opening ------------------------------------------------------------------------------------------------------

RADIUS, FAR_X, FAR_Y = 10e-3, -0.3e6, -0.6e6
YOUNG, POISSON = ROCK.youngs_modulus, ROCK.poissons_ratio


@cache
def plate(share, refinement, diameters=10, seed=1):
    """A plate of so many diameters; grains at the rim of a ``share`` of the radius. Bonds add 0.5 % of compliance."""
    angle = np.linspace(0, 2 * np.pi, 65)
    circle = RADIUS * np.column_stack([np.cos(angle), np.sin(angle)])
    size = Graded(place=circle, size=share * RADIUS, growth=0.3, largest=1.5 * RADIUS)
    grains = Laguerre(grain_size=size, seed=seed).tessellate(
        plate_with_hole(2 * diameters * RADIUS, 2 * diameters * RADIUS, 2 * RADIUS, sides=64)
    )
    stiffness = 200 * YOUNG / (share * RADIUS)
    return gl.Specimen(grains, ROCK, refinement=refinement), Linear(kn=stiffness, ks=stiffness)


def hoop(x, y):
    """Pa, of an elastic rock (Kirsch 1898)."""
    r, angle = np.hypot(x, y), np.arctan2(y, x)
    mean, half = (FAR_X + FAR_Y) / 2, (FAR_X - FAR_Y) / 2
    return mean * (1 + (RADIUS / r) ** 2) - half * (1 + 3 * (RADIUS / r) ** 4) * np.cos(2 * angle)


@attrs.frozen(kw_only=True)
class Kirsch(gl.LoadingProtocol):
    """The plate under the far stress by a static solution, with its rim loaded as by the rock or free."""

    rim: float = gl.parameter("1", at_least=0)

    def stages(self, specimen):
        factors = {name: self.rim if name == "hole" else 1.0 for name in specimen.mesh.boundaries}
        loads = [
            gl.loads.Traction(boundary=name, stress=(FAR_X, FAR_Y, 0), factor=factor)
            for name, factor in factors.items()
        ]
        return [gl.Stage(name="load", loads=loads, until=[gl.conditions.AtRest(1e-3)], interval=1e-10, static=True)]

    def measure(self, state):
        mesh = state.mesh
        stress, place = state.zone_state()[0], mesh.nodes[mesh.zones].mean(axis=1)
        rim = np.isin(mesh.zones, mesh.boundaries["hole"]).sum(axis=1) >= 2
        side = rim & (np.abs(place[:, 1]) < np.abs(place[:, 0]) * np.tan(np.radians(15)))  # where it is largest
        x, y = place[side].T
        cos, sin = x / np.hypot(x, y), y / np.hypot(x, y)
        found = stress[side, 0] * sin**2 + stress[side, 1] * cos**2 - 2 * stress[side, 2] * sin * cos
        areas = mesh.zone_areas[side]
        opening = Excavation().measure(state)
        return {"hoop": float(areas @ found / areas.sum()), "there": float(areas @ hoop(x, y) / areas.sum()), **opening}

    def summary(self, curves, specimen):
        return {name: curves[name][-1] for name in ("hoop", "there", "width", "height")}


def closures():
    """m, along x and y, of an excavated opening (plane strain)."""
    mean, half = -(FAR_X + FAR_Y) / 2, -(FAR_X - FAR_Y) / 2
    scale = 2 * (1 + POISSON) / YOUNG * RADIUS
    share = np.sinc(2 * 10 / 180)  # of cos 2 theta, as means over 10 degrees to both sides
    return scale * (mean + (3 - 4 * POISSON) * half * share), scale * (mean - (3 - 4 * POISSON) * half * share)


def kirsch_row(share, refinement, released=False):
    specimen, law = plate(share, refinement)
    if released:
        test = Excavation(xx=FAR_X, yy=FAR_Y, release=1e-4, rest=1e-3)
        found = gl.simulate(specimen, law, test, detection=None, frames=1).summary
        closed = [found["closure_x"], found["closure_y"]]
        cells = ["", ""]
    else:
        free, full = (
            gl.simulate(specimen, law, Kirsch(rim=rim), detection=None, frames=1).summary for rim in (0.0, 1.0)
        )
        closed = [full[name] - free[name] for name in ("width", "height")]
        cells = [f"{free['hoop'] / (3 * FAR_Y - FAR_X):.3f}", f"{free['hoop'] / free['there']:.3f}"]
    return [str(specimen.grains.count), *cells, *(f"{a / b:.3f}" for a, b in zip(closed, closures(), strict=True))]


def plate_row(diameters):
    """Closures over Kirsch, with boundaries that are free under the stress, then held where they are."""
    cells = []
    for held in (False, True):
        test = Excavation(xx=FAR_X, yy=FAR_Y, rest=1e-3, held=held)
        runs = [gl.simulate(*plate(0.4, 0, diameters, seed), test, detection=None, frames=1) for seed in (1, 2, 3)]
        for axis, whole in zip("xy", closures(), strict=True):
            each = [run.summary[f"closure_{axis}"] / whole for run in runs]
            cells.append(f"{np.mean(each):.2f} ({min(each):.2f} to {max(each):.2f})")
    return cells


KIRSCH = {
    "0.8": (0.8, 0), "0.4": (0.4, 0), "0.2": (0.2, 0), "0.4, zones cut into 4": (0.4, 1),
    "0.4, zones cut into 16": (0.4, 2), "0.4, let go slowly": (0.4, 0, True),
}  # fmt: skip

TABLES = [
    Table(
        page=PAGE,
        name="quiet ends",
        columns=("length (bricks)", "P wave (%)", "S wave (%)", "P wave, soft joints and their speed (%)"),
        rows={str(bricks): partial(quiet_row, bricks) for bricks in (8, 12, 20, 30)},
        checked=("20",),
    ),
    Table(
        page=PAGE,
        name="joint",
        columns=(
            "$\\omega Z / 2 k_n$", "wave (bricks)", "T", "P wave", "S wave", "R", "P wave back", "S wave back",
        ),
        rows={f"{ratio:g}": partial(joint_row, ratio) for ratio in (0.25, 0.5, 1.0, 2.0, 3.0)},
        firm=("T", "P wave", "S wave", "R"),
        checked=("1",),
    ),
    Table(
        page=PAGE,
        name="Kirsch",
        columns=(
            "grain size / radius", "grains", "hoop stress / (3 s1 - s3)", "/ Kirsch in the same zones",
            "closure along x / Kirsch", "along y / Kirsch",
        ),
        rows={name: partial(kirsch_row, *given) for name, given in KIRSCH.items()},
        firm=("closure along x / Kirsch", "along y / Kirsch"),
        checked=("0.4",),
    ),
    Table(
        page=PAGE,
        name="plates",
        columns=("side / diameter", "free: along x", "free: along y", "held: along x", "held: along y"),
        rows={str(diameters): partial(plate_row, diameters) for diameters in (4, 6, 10, 15)},
        firm=("free: along x", "free: along y", "held: along x", "held: along y"),
        checked=("4",),
    ),
]  # fmt: skip

if __name__ == "__main__":
    main(TABLES)
