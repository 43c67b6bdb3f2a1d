"""Contacts between any grains against theory: the tables of docs/tables/contacts.md.

python tests/validation/contacts_study.py [--write | --check]
"""

import math
import sys
from functools import cache, partial

import attrs
import numpy as np
from study_tables import DOCS, Table, each, main

import grainlaw as gl
from grainlaw.laws import Friction

sys.path.insert(0, str(DOCS.parent / "tests"))
sys.path.insert(0, str(DOCS / "examples"))
import jointed_slope
import rocking_block
from bodies import GRAVITY, RIGID, SOFT, total
from scenes import (
    DILATING,
    JOINT,
    MEETINGS,
    PRESSURE,
    RUBBING,
    SLOPE,
    SLOWLY,
    TAN,
    TAN_30,
    UNDAMPED,
    WIDTH,
    Shaken,
    bricks,
    collided,
    grazed,
    leaned,
    lift,
    over_joints,
    over_teeth,
    rebound,
    ridden,
    rocking,
    sheared,
    slid,
    stayed,
    taken,
    thrown_at_floor,
    thrown_at_random,
)  # fmt: skip

BOTH = RIGID, SOFT
STIFFNESSES = (1e9, 1e10, 1e11)  #: Pa/m
LIFTS = (4.5e-4, 5.5e-4, 7.9e-4)  #: m of slip at which a joint is looked at; it is handed over at 5e-4
SHARES = (0.9, 0.75, 0.6, 0.45, 0.3, 0.15)
SAFETIES = (0.9, 0.3, 0.1)  #: shares of the stable step; `FreeMotion` takes the second


# --- motion: theory and found ----------------------------------------------------------------------------------------


def incline():
    theory = GRAVITY * (0.5 - math.cos(math.pi / 6) * math.tan(math.radians(20)))
    return f"{theory:.4f}", each(map(slid, BOTH), ".4f")


def toppling():
    """Halving an interval of shares of tan 30 six times."""
    found = []
    for material in BOTH:
        topples, stays = 0.9, 1.1
        while stays - topples > 0.004:
            middle = (topples + stays) / 2
            topples, stays = (middle, stays) if leaned(material, middle) > 2 else (topples, middle)
        found.append((topples + stays) / 2 * TAN_30)
    return f"{TAN_30:.3f}", each(found, ".3f")


def bedding():
    frictions = (20, 30, 34)
    theory = each(map(jointed_slope.acceleration, frictions), ".4f")
    return theory, each((jointed_slope.run(friction, 0.5)[2] for friction in frictions), ".4f")


@cache
def rocked(stiffness):
    """s of the first passage of the upright and from there to the next, rad of the turning point between them."""
    result, angle = rocking_block.run(1.5, 0.0, stiffness)
    first, second = rocking_block.passages(result.curves["time"], angle)[:2]
    return first, second - first, -angle[result.curves["time"] < second].min()


def quarter():
    exact = rocking_block.theory(np.linspace(0, 0.7, 10), 0.7)[1][0]
    found = each((rocked(stiffness)[0] for stiffness in STIFFNESSES), ".4f")
    return f"{rocking_block.HOUSNER:.4f}; {exact:.4f} without his small angles", found


def half():
    """Over Housner's for a block that turns back at the same angle."""
    ratios = []
    for stiffness in STIFFNESSES:
        _, time, top = rocked(stiffness)
        ratios.append(time * rocking_block.P / 2 / math.acosh(1 / (1 - top / rocking_block.ALPHA)))
    return "1.000", each(ratios, ".3f")


def restitution():
    found, theory = np.array([rebound(share)[:2] for share in (0.1, 0.2, 0.5, 0.9)]).T
    return each(theory, ".3f"), each(found, ".3f")


def impulses():
    return f"{TAN_30:.4f}", each(map(grazed, (0.1, 0.5, 1.0)), ".4f")


def climbing():
    """On both flanks, and the most that a tip takes."""
    _, run = over_teeth(20, **SLOWLY)
    flanks = [run["drag"][(run["x"] > low) & (run["x"] < high)].mean() for low, high in ((0.15, 0.45), (0.6, 0.9))]
    tip = np.abs(run["drag"][np.abs(run["x"] - 0.5) < 0.1]).max()
    return "1.000 / -1.000", f"{each(flanks, '.3f')}, at the tips up to {tip:.2f}"


@cache
def joint(law, damping):
    """Lift (m) at some slips, and shear over pressure before and after the hand-over."""
    result, (slip, pressure, shear) = sheared(DILATING[law], gl.Detection(hand_over=0.01, damping=damping))
    sliding, before = slip > 1e-4, slip < 0.01 * WIDTH
    ratios = [(shear[part] / pressure[part]).mean() for part in (sliding & before, sliding & ~before)]
    return np.interp(LIFTS, result.curves["displacement"], lift(result.curves)), ratios


def lifted(law, damping):
    theory = SLOPE * (np.array(LIFTS) - TAN * PRESSURE / JOINT["ks"])
    return each(theory * 1e6, ".2f"), each(joint(law, damping)[0] * 1e6, ".2f")


def rubbed(law, damping):
    return f"{TAN:.4f}", each(joint(law, damping)[1], ".4f")


@cache
def climbed(law):
    """(4, 2) lift over way, acceleration (m/s2) of a rigid and a deformable block, without and with dashpots."""
    found = [ridden(DILATING[law], material, damping) for material in BOTH for damping in (0.0, 0.2)]
    return np.array([(up[-1] / way[-1], acceleration) for way, up, acceleration in found])


def ridden_up(law, place):
    angle = math.radians(40)
    theory = SLOPE, GRAVITY * (math.sin(angle) - TAN * math.cos(angle)) / (1 + TAN * SLOPE)
    return f"{theory[place]:.4f}", each(climbed(law)[:, place], ".4f")


KINDS = {
    f"{law}{', dashpots' * bool(damping)}": (law, damping) for law in ("Mohr-Coulomb", "Barton-Bandis")
    for damping in (0.0, 0.5)
}  # fmt: skip
MOTION = {
    "block on an incline of 30 degrees, friction 20: acceleration (m/s2), rigid / deformable": incline,
    "block on an incline of 30 degrees: width over height below which it topples, rigid / deformable": toppling,
    "blocks on bedding that dips 35 degrees, friction 20 / 30 / 34: acceleration of the lowest (m/s2)": bedding,
    "rocking block: first quarter (s) at 1e9 / 1e10 / 1e11 Pa/m": quarter,
    "its half swing after the first impact, over Housner's for the same angle": half,
    "restitution with dashpots of 0.1 / 0.2 / 0.5 / 0.9 of the critical": restitution,
    "ratio of impulses of an impact that slides all the time, friction 30, dashpots 0.1 / 0.5 / 1": impulses,
    "corner pulled over teeth of 20 degrees without friction: drag over weight times slope, up / down": climbing,
    **{
        f"dilating joint, {kind}: lift (um) at 0.45 / 0.55 / 0.79 mm of slip": partial(lifted, *how)
        for kind, how in KINDS.items()
    },
    **{f"dilating joint, {kind}: its shear over its pressure, before / after": partial(rubbed, *how)
       for kind, how in KINDS.items()},
    **{
        f"dilating block, {law}: {what}, rigid and deformable, each without and with dashpots":
            partial(ridden_up, law, place)
        for law in ("Mohr-Coulomb", "Barton-Bandis")
        for place, what in enumerate(("lift over way", "acceleration (m/s2)"))
    },
}  # fmt: skip


# --- errors: what theory says is zero --------------------------------------------------------------------------------


def at_rest():
    return (each((np.ptp(stayed(material)[10:]) for material in BOTH), ".0e"),)


def bedding_at_rest():
    return (f"{jointed_slope.run(36, 0.5)[1]:.0e}",)


def momenta():
    met = [collided(material, *meeting)[1:] for material in BOTH for meeting in MEETINGS]
    return (f"{max(np.abs(after - before).max() / np.abs(before).max() for before, after in met):.0e}",)


def energies(faces, safety):
    """The largest change, of blocks that meet with their faces, or with a corner of one at least."""
    changes = []
    for material in BOTH:
        for turn, height in MEETINGS:
            if (turn == 0) == faces:
                run, *_ = collided(material, turn, height, safety)
                energy = run["kinetic"] + run["zones"]
                changes.append(abs(energy[-1] / energy[0] - 1))
    return max(changes)


def kept(faces):
    return (each((energies(faces, safety) for safety in SAFETIES), ".0e"),)


def polygons():
    changes = np.array([abs(run["kinetic"][-1] / given - 1) for run, given in map(thrown_at_random, range(200))])
    return (f"{np.median(changes):.0e} / {changes.max():.1e}, {np.count_nonzero(changes > 1e-3)} above 1e-3",)


def gained():
    """Over the weight times half the width."""
    scale = 2 * 2600 * GRAVITY * 0.5
    return (each((total(rocking(safety)).max() / scale for safety in SAFETIES), ".0e"),)


def ripple(damping):
    """The larger of a rigid and a deformable block: of what drags, and of what carries."""
    return (each(np.max([over_joints(material, 0.0, damping, None)[:2] for material in BOTH], axis=0), ".0e"),)


def beyond_coulomb():
    """The largest excess of shear over its limit, over the largest shear, at any step."""
    excess = []
    for law in RUBBING.values():
        for damping in (0.3, 1.0):
            pressure, shear = thrown_at_floor(law, RIGID, 20, damping)[0].T
            excess.append((shear - TAN_30 * pressure).max() / shear.max())
    return (f"{max(*excess, 0.0):.0e}",)


ERRORS = {
    "block on an incline of 30 degrees, friction 35: way after it has settled (m), rigid / deformable": at_rest,
    "blocks on bedding that dips 35 degrees, friction 36: mean way (m)": bedding_at_rest,
    "two blocks collide: momentum and its moment, over what they were": momenta,
    "their energy, a face on a face, at 0.9 / 0.3 / 0.1 of the stable step": partial(kept, True),
    "their energy where a corner meets a face, an edge or a corner": partial(kept, False),
    "200 random convex polygons thrown at each other, at 0.3: energy, median / largest": polygons,
    "rocking block: energy it gains, over weight times half its width": gained,
    "block pulled over level blocks: ripple of what drags / of what carries it, over its weight": partial(ripple, 0.0),
    "the same with dashpots of half the critical": partial(ripple, 0.5),
    "oblique impacts with dashpots: shear force beyond Coulomb's limit, over the largest": beyond_coulomb,
}

PAGE = DOCS / "tables/contacts.md"
# --- contacts that open and close -------------------------------------------------------------------------------------


def shaken(safety):
    """Energy of motion and of grains over what was put in, after 0.2 ms; friction of 0 and of 30 degrees."""
    cells = []
    for angle in (0, 30):
        test = Shaken(duration=2e-4, integrator=attrs.evolve(UNDAMPED, safety=safety))
        result = gl.simulate(bricks(), Friction(kn=1e15, ks=1e15, friction_angle=angle), test, frames=1)
        cells += [f"{1 - taken(result)[-1]:.3f}", f"{result.summary['energy_returned']:.0e}"]
    return f"{result.summary['steps']:,}", *cells


TABLES = [
    Table(
        page=PAGE,
        name="contacts: shaken",
        columns=("safety", "steps", "smooth: energy", "`energy_returned`", "30 degrees: energy", "`energy_returned`"),
        rows={f"{safety:g}": partial(shaken, safety) for safety in SHARES},
        checked=("0.9",),
    ),
    Table(page=PAGE, name="contacts: motion", columns=("", "theory", "found"), rows=MOTION, firm=("theory", "found")),
    Table(page=PAGE, name="contacts: errors", columns=("", "error"), rows=ERRORS),
]

if __name__ == "__main__":
    main(TABLES)
