"""Stress intensity factors and J against closed forms: the tables of docs/tables/stress-intensity.md.

python tests/validation/crack_study.py [--write | --check]
"""

from functools import partial

import attrs
import numpy as np
from study_tables import DOCS, Table, each, main
from water_study import HALF, KN, PRESSURE, ROCK, opened

import grainlaw as gl
from grainlaw.geometry import Bricks, Jointed, Voronoi, rectangle, semi_disc
from grainlaw.laws import Linear
from grainlaw.protocols.bending import toughness
from grainlaw.units import mm

STRESS = 1e6  #: Pa
OPEN = Linear(kn=1e3, ks=1e3)  #: of the crack, which bears nothing
RINGS = ((4 * mm, 8 * mm), (4 * mm, 10 * mm), (6 * mm, 10 * mm))


@attrs.frozen(kw_only=True)
class Pull(gl.LoadingProtocol):
    """Tension along y beyond the rim, by a static solution."""

    def stages(self, specimen):
        rim = [gl.loads.Traction(boundary=name, stress=(0, STRESS, 0), ramp=1e-9) for name in specimen.mesh.boundaries]
        return [gl.Stage(name="pull", loads=rim, until=[gl.conditions.AtRest()], interval=1e-9, static=True)]

    def measure(self, state):
        return {}

    def summary(self, curves, specimen):
        return {}


@attrs.frozen(kw_only=True)
class Bend(Pull):
    """Half a disc under a load between two supports, by a static solution."""

    def stages(self, specimen):
        load = gl.loads.Hold(boundary="load", axis=1, stress=-STRESS, ramp=1e-9)
        rollers = [("load", 0), ("support_left", 1), ("support_right", 1)]
        drives = [load, *(gl.loads.Drive(boundary=name, axis=axis, speed=0.0, roller=True) for name, axis in rollers)]
        return [gl.Stage(name="bend", loads=drives, until=[gl.conditions.AtRest()], interval=1e-9, static=True)]


def solved(width, height, size, law, angle=0.0):
    """Result, half of the crack (m), and for both tips their rings; a crack of 20 mm in the middle of a plate."""
    centre, along = np.array([width, height]) / 2, np.array([np.cos(angle), np.sin(angle)])
    trace = [tuple(centre - HALF * along), tuple(centre + HALF * along)]
    grains = Jointed(Voronoi(grains=round(width * height / size**2), seed=1), {"crack": [trace]})
    specimen = gl.Specimen(grains.tessellate(rectangle(width, height)), ROCK)
    result = gl.simulate(specimen, {"crack": OPEN, ...: law}, Pull(), detection=None, frames=2)
    place = (specimen.grains.vertices[specimen.grains.joints["crack"]] - centre) @ along
    tips = []
    for end, turn in ((place.max(), 0), (place.min(), 180)):
        at, direction = centre + end * along, np.degrees(angle) + turn
        tips.append([gl.CrackTip(position=at, direction=direction, inner=i, outer=o) for i, o in RINGS])
    return result, np.ptp(place) / 2, tips


def factors(result, tips, law, whole=None):
    """(tip, ring, 3): K_I, K_II and sqrt(E* J), Pa sqrt(m); E* of the same grains without the crack, or of others."""
    found = gl.elastic_properties(whole or result.specimen, law)
    moduli = {"apparent_modulus": found.apparent_modulus, "apparent_poisson": found.apparent_poisson}
    rows = []
    for rings in tips:
        rows.append([])
        for tip in rings:
            k, j = gl.stress_intensity(result, tip, **moduli), gl.j_integral(result, tip)
            rows[-1].append((k.mode_i, k.mode_ii, np.sqrt(found.apparent_modulus * j)))
    return np.array(rows), found.apparent_modulus


def tension(size, stiffness):
    law = Linear(kn=stiffness, ks=0.9 * stiffness)
    width, height = 50 * mm, 100 * mm
    result, half, tips = solved(width, height, size * mm, law)
    share = 2 * half / width
    tada = (1 - 0.025 * share**2 + 0.06 * share**4) / np.sqrt(np.cos(np.pi * share / 2))  # Tada 2.1, to 0.1 %
    found, modulus = factors(result, tips, law)
    found /= STRESS * np.sqrt(np.pi * half) * tada
    return (
        f"{result.specimen.grains.count:,}",
        f"{modulus / 1e9:.1f}",
        each(found[:, 0, 0], ".3f"),
        each(found[:, 0, 1], "z.3f"),
        each(found[:, 0, 2], ".3f"),
        f"{100 * np.ptp(found[:, :, 0], axis=1).max():.1f}",
    )


def inclined(angle):
    law = Linear(kn=1.05e14, ks=9.45e13)
    result, half, tips = solved(120 * mm, 120 * mm, 1.5 * mm, law, np.radians(angle))
    found, _ = factors(result, tips, law)
    found /= STRESS * np.sqrt(np.pi * half)
    cosine, sine = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    return (
        each(found[:, 0, 0], ".3f"),
        f"{cosine**2:.3f}",
        each(found[:, 0, 1], "z.3f"),
        f"{sine * cosine:.3f}",
        each(found[:, 0, 2], ".3f"),
        f"{cosine:.3f}",
    )


def half_disc(grains, stiffness):
    law, radius = Linear(kn=stiffness, ks=0.9 * stiffness), 25 * mm
    region = semi_disc(2 * radius, notch_depth=radius / 2, notch_width=1 * mm, span=30 * mm, bearing=3 * mm)
    specimen = gl.Specimen(Voronoi(grains=grains, seed=1).tessellate(region), ROCK)
    result = gl.simulate(specimen, law, Bend(), detection=None, frames=2)
    whole = gl.Specimen(Voronoi(grains=grains, seed=1).tessellate(rectangle(31 * mm, 31 * mm)), ROCK)
    tips = [[gl.notch_tip(specimen, inner=i, outer=o) for i, o in RINGS]]
    found, modulus = factors(result, tips, law, whole)
    found /= toughness(STRESS * specimen.mesh.boundary_lengths["load"], specimen)
    return f"{modulus / 1e9:.1f}", *(f"{found[0, 0, k]:z.3f}" for k in (0, 1, 2))


def pressurised(along):
    """The crack of docs/tables/water.md, whose other half lies beyond the left edge."""
    result, _, _ = opened(20, along)
    whole = gl.Specimen(Bricks().tessellate(rectangle(HALF, HALF)), ROCK, tied=...)
    tips = [[gl.CrackTip(position=(HALF, 20 * HALF), inner=4 * mm, outer=8 * mm)]]
    found, _ = factors(result, tips, Linear(kn=KN, ks=KN), whole)
    found /= PRESSURE * np.sqrt(np.pi * HALF)
    return f"{result.specimen.grains.count:,}", f"{found[0, 0, 0]:.3f}", f"{found[0, 0, 2]:.3f}"


PAGE = DOCS / "tables/stress-intensity.md"
TABLES = [
    Table(
        page=PAGE,
        name="crack in tension",
        columns=("grain size (mm), $k_n$ (Pa/m)", "grains", "$E^*$ (GPa)", "$K_I$ over Tada's", "$K_{II}$ over it",
                 "$\\sqrt{E^* J}$ over it", "$K_I$ of three rings differs by (%)"),
        rows={f"{size:g}, {kn:g}": partial(tension, size, kn) for kn in (1e17, 1.05e14) for size in (2, 1.4, 1)},
        firm=("$K_I$ over Tada's",),
        checked=("2, 1.05e+14",),
    ),
    Table(
        page=PAGE,
        name="inclined crack",
        columns=("angle (deg)", "$K_I$", "$\\cos^2$", "$K_{II}$", "$\\sin\\cos$", "$\\sqrt{E^* J}$", "$\\cos$"),
        rows={f"{angle}": partial(inclined, angle) for angle in (30, 60)},
        firm=("$K_I$",),
        checked=("30",),
    ),
    Table(
        page=PAGE,
        name="half disc",
        columns=("grains, $k_n$ (Pa/m)", "$E^*$ (GPa)", "$K_I$ over that of the load", "$K_{II}$ over it",
                 "$\\sqrt{E^* J}$ over it"),
        rows={f"{n}, {kn:g}": partial(half_disc, n, kn) for kn in (1e17, 1.05e14) for n in (300, 1200)},
        firm=("$K_I$ over that of the load",),
        checked=("300, 1.05e+14",),
    ),
    Table(
        page=PAGE,
        name="crack under pressure",
        columns=("bricks in half of the crack", "bricks", "$K_I$ over $p\\sqrt{\\pi a}$", "$\\sqrt{E^* J}$ over it"),
        rows={f"{along}": partial(pressurised, along) for along in (4, 8, 16, 32)},
        firm=("$K_I$ over $p\\sqrt{\\pi a}$",),
        checked=("4",),
    ),
]  # fmt: skip

if __name__ == "__main__":
    main(TABLES)
