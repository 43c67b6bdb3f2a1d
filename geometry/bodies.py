"""Specimens of several bodies that share no edge: blocks, moved and turned, side by side; platens; grains that part."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterable, Mapping, Sequence, Set
from itertools import pairwise
from typing import Any

import attrs
import numpy as np

from grainlaw.arguments import checked
from grainlaw.fields import ParameterError, checked_number, checked_vector, checked_whole_number
from grainlaw.geometry.cells.convex import Polygon, polygon_of, split
from grainlaw.geometry.cells.sides import is_convex, turns
from grainlaw.geometry.region import check_sizes, polygon, rectangle
from grainlaw.geometry.regular import Bricks
from grainlaw.messages import refusal
from grainlaw.polygon import following
from grainlaw.region import ROUNDING, Region
from grainlaw.tessellation import LOOSE, Tessellation


@checked
def together(*bodies: Tessellation) -> Tessellation:
    """Bodies side by side, their grains in this order; they share no vertex, also where they touch.

    A boundary whose name a body before it has is renamed, left to left_2 and so on: to drive "left" moves one body
    alone. ``region`` is that of the first. A block that will slide down an incline of 30 degrees::

        base = block([(0, -1), (4, -1), (4, 0), (0, 0)], "base")
        slider = block([(3, 0), (4, 0), (4, 0.5), (3, 0.5)], "slider")
        grains = moved(together(base, slider), turn=30)

    Raises :class:`~grainlaw.fields.ParameterError`, also for bodies that lie in each other.
    """
    if not bodies:
        raise ParameterError("together: there are no bodies, it must be given at least one Tessellation")
    taken: set[str] = set()
    named = []
    for body in bodies:
        own = dict.fromkeys(name for region in body.regions for name in region.names)
        new = {name: _free(name, taken | own.keys()) for name in own if name in taken}
        taken |= {new.get(name, name) for name in own}
        named.append(renamed(body, new) if new else body)
    made = side_by_side(*named)
    if found := made.deepest_overlap():
        *grains, depth = found
        (x, y), (one, other) = made.centroids[grains].mean(axis=0), made.body[grains]
        raise ParameterError(
            f"together: bodies {one} and {other} are not allowed to lie in each other, they do by {depth:.3g} m "
            f"near {x:.4g}, {y:.4g} m: move one with moved(..., by=)"
        )
    return made


def _free(name: str, taken: Set[str]) -> str:
    return next(other for number in itertools.count(2) if (other := f"{name}_{number}") not in taken)


def side_by_side(*bodies: Tessellation) -> Tessellation:
    """As :func:`together`, but boundaries of one name become one boundary."""
    vertex, corner, number = (
        np.cumsum([0, *counts])
        for counts in zip(*((len(b.vertices), len(b.corners), len(b.regions)) for b in bodies), strict=True)
    )
    region, *others = [region for body in bodies for region in body.regions]
    names, phases = _phases(bodies)
    parents = [int(body.parent.max()) + 1 for body in bodies]
    joints: dict[str, np.ndarray] = {}
    for body, v in zip(bodies, vertex, strict=False):
        for name, edges in body.joints.items():
            joints[name] = np.concatenate([joints.get(name, np.zeros((0, 2), dtype=np.int64)), edges + v])

    def counted(arrays: Iterable[np.ndarray], before: np.ndarray) -> np.ndarray:
        return np.concatenate([array + b for array, b in zip(arrays, before, strict=False)])

    return Tessellation(
        region, np.concatenate([body.vertices for body in bodies]), counted((b.corners for b in bodies), vertex),
        np.concatenate([[0], counted((b.first[1:] for b in bodies), corner)]), phases, others,
        counted((b.body for b in bodies), number), np.concatenate([body.loose for body in bodies]),
        counted((b.parent for b in bodies), np.cumsum([0, *parents])), names, joints,
    )  # fmt: skip


def _phases(bodies: Sequence[Tessellation]) -> tuple[tuple[str, ...], np.ndarray]:
    """Names of all phases, and the phases of all grains by them; numbers stay where no body has names."""
    if not any(body.phase_names for body in bodies):
        return (), np.concatenate([body.phase for body in bodies])
    every = [body.phase_names or tuple(str(k) for k in range(int(body.phase.max()) + 1)) for body in bodies]
    names = tuple(dict.fromkeys(name for each in every for name in each))
    return names, np.concatenate([
        np.array([names.index(name) for name in each])[body.phase] for body, each in zip(bodies, every, strict=True)
    ])  # fmt: skip


@checked
def block(corners: Any, name: str | Sequence[str] = "block", phase: int = 0) -> Tessellation:
    """A single convex grain with ``corners`` (n, 2) m, clockwise or not.

    ``name`` is that of the boundary of all its sides, or has one for the side from each corner to the next. A base
    whose upper side is a boundary of its own::

        grains = block([(0, 0), (2, 0), (2, 1), (0, 1)], ["base", "base", "incline", "base"])

    Raises :class:`~grainlaw.fields.ParameterError`.
    """
    phase = checked_whole_number("block: phase", phase, at_least=0)
    region = polygon(corners, name)
    if not is_convex(region):
        x, y = region.end[turns(region).argmin()]
        raise ParameterError(f"block: corners must be convex, they do not turn left at {x:g}, {y:g}")
    count = len(region.outline)
    return Tessellation(region, region.outline, np.arange(count), np.array([0, count]), np.array([phase]))


@checked
def moved(grains: Tessellation, by: Any = (0.0, 0.0), turn: float = 0.0) -> Tessellation:
    """Grains and their regions, turned about the origin by ``turn`` (degrees, counter-clockwise), then moved ``by`` m.

    A specimen on top of an equal one::

        lower = Voronoi(grains=100).tessellate(rectangle(0.1, 0.1))
        grains = together(lower, moved(lower, by=(0, 0.1)))

    Raises :class:`~grainlaw.fields.ParameterError`.
    """
    shift, turn = checked_vector("moved: by", by), checked_number("moved: turn", turn, "degrees")
    cosine, sine = math.cos(math.radians(turn)), math.sin(math.radians(turn))

    def placed(points: np.ndarray) -> np.ndarray:
        x, y = points.T
        return np.column_stack([cosine * x - sine * y, sine * x + cosine * y]) + shift

    return _moved(grains, placed)


def _moved(grains: Tessellation, placed: Callable[[np.ndarray], np.ndarray]) -> Tessellation:
    """Grains and their regions, by what gives points (n, 2) m their new places."""
    region, *others = (
        attrs.evolve(each, outline=placed(each.outline), holes=[placed(hole) for hole in each.holes])
        for each in grains.regions
    )
    return attrs.evolve(grains, region=region, bodies=others, vertices=placed(grains.vertices))


@checked
def lying(grains: Tessellation) -> Tessellation:
    """Grains laid on their side, so that any test loads them along what was x: turned by a quarter, counter-clockwise.

    The lower left corner of the box round them stays. Boundaries of the names bottom, right, top and left, also with
    more after them, as in left_upper, take those of their new places. What the material says of directions, such as a
    foliation angle, turns with the grains only if 90 degrees are added to it. A core pulled across its length::

        grains = lying(Bricks(rows=4).tessellate(rectangle(0.02, 0.04)))
    """
    low, high = grains.region.bounds

    def placed(points: np.ndarray) -> np.ndarray:
        x, y = (points - low).T
        return np.column_stack([high[1] - low[1] - y, x]) + low

    places = {"bottom": "right", "right": "top", "top": "left", "left": "bottom"}
    names = {
        name: places[side] + rest
        for region in grains.regions for name in region.names
        for side, mark, more in [name.partition("_")] for rest in [mark + more] if side in places
    }  # fmt: skip
    return renamed(_moved(grains, placed), names)


def renamed(grains: Tessellation, names: Mapping[str, str]) -> Tessellation:
    """Grains whose regions have other names for some boundaries, old to new."""

    def named(region: Region) -> Region:
        sides, *holes = (tuple(names.get(name, name) for name in ring) for ring in (region.sides, *region.hole_sides))
        return attrs.evolve(region, sides=sides, hole_sides=tuple(holes))

    region, *others = (named(each) for each in grains.regions)
    return attrs.evolve(grains, region=region, bodies=others)


@checked
def between_platens(
    grains: Tessellation, thickness: float, overhang: float = 0.0, phase: int | str | None = None, columns: int = 1,
    rigid: bool = False,
) -> Tessellation:  # fmt: skip
    """Grains between two platens (m) that touch the box round it, above and below, as bodies of their own.

    Boundaries top and bottom become the outer sides of the platens, so that tests load through them; those of the
    grains are then rock_top and rock_bottom. The inner sides of the platens are platen_top and platen_bottom, their
    ends platen_side: such platens bend and shorten, as only their outer sides are driven. A ``rigid`` platen has all
    its sides in the boundary top, or bottom, so that its whole rim is driven and keeps its shape; only the middles of
    its bricks are free. Platens are as wide as the grains and an ``overhang`` on either side, each of ``columns``
    bonded bricks, and of a mineral ``phase`` of their own: a number, unless given 1, or where phases have names a name,
    unless given "platen". Steel and rock meet by the law between their phases::

        grains = Voronoi(grains=500).tessellate(rectangle(0.05, 0.1))
        specimen = gl.Specimen(between_platens(grains, 0.02, columns=4), {0: rock, 1: steel})
        bond = gl.laws.Linear(kn=1e14, ks=1e14)
        law = {(0, 0): bond, (0, 1): gl.laws.Friction(kn=1e14, ks=1e14, friction_angle=10), (1, 1): bond}

    Raises :class:`~grainlaw.fields.ParameterError`.
    """
    check_sizes("between_platens", thickness=thickness)
    check_sizes("between_platens", zero=True, overhang=overhang)
    if grains.phase_names:
        phase = "platen" if phase is None else phase
        if not isinstance(phase, str) or phase in grains.phase_names:
            wanted = f"a name of their own, as the phases of these grains have ({', '.join(grains.phase_names)})"
            raise refusal("between_platens: phase", phase, wanted)
        of_platens: dict[str, Any] = {"phase_names": (phase,)}
    else:
        number = checked_whole_number("between_platens: phase", 1 if phase is None else phase, at_least=0)
        of_platens = {"phase": np.full(columns, number)}
    low = np.min([region.bounds[0] for region in grains.regions], axis=0)
    high = np.max([region.bounds[1] for region in grains.regions], axis=0)
    left, right = low[0] - overhang, high[0] + overhang

    def platen(bottom: float, top: float, outer: str, *sides: str) -> Tessellation:
        sides = (outer,) * 4 if rigid else sides
        region = Region(np.array([(left, bottom), (right, bottom), (right, top), (left, top)]), sides)
        return attrs.evolve(Bricks(rows=1, columns=columns).tessellate(region), **of_platens)

    return side_by_side(
        renamed(grains, {"top": "rock_top", "bottom": "rock_bottom"}),
        platen(high[1], high[1] + thickness, "top", "platen_top", "platen_side", "top", "platen_side"),
        platen(low[1] - thickness, low[1], "bottom", "bottom", "platen_side", "platen_bottom", "platen_side"),
    )


MOST_BRICKS = 10_000  #: along a side of a wall


@checked
def apart(grains: Tessellation, gap: float = 0.0) -> Tessellation:
    """Every grain loose, with vertices of its own; sides that face each other are moved ``gap`` m apart.

    Sides of grains on sides of the region stay there and keep the boundary's name, all others are the boundary
    "grains". Edges too short for the gap vanish. A slope of blocks without bond between them::

        slope = polygon([(0, 0), (40, 0), (40, 10), (20, 10), (10, 30), (0, 30)])
        grains = apart(Voronoi(grain_size=1.0).tessellate(slope))

    Raises :class:`~grainlaw.fields.ParameterError` for a gap in which a grain would vanish, with its number.
    """
    check_sizes("apart", zero=True, gap=gap)
    edges = grains.edges
    inward = np.full(len(grains.corners), gap / 2)
    names = np.array(edges.boundary_names)
    kept = (edges.right < 0) & (names[edges.side] != LOOSE)
    inward[edges.left_corners[kept, 0]] = 0.0
    points, first = _shrunk(grains.vertices[grains.corners], grains.first, inward, gap)
    return attrs.evolve(
        grains, vertices=points, corners=np.arange(len(points)), first=first, loose=np.ones(grains.count, dtype=bool),
        joints={},
    )  # fmt: skip


def _shrunk(points: np.ndarray, first: np.ndarray, inward: np.ndarray, gap: float) -> tuple[np.ndarray, np.ndarray]:
    """Corners in a row of convex polygons whose sides, from each corner on, are moved ``inward`` (m)."""
    after = following(first)
    before = np.argsort(after)
    along = points[after] - points
    shortest = ROUNDING * np.hypot(*along.T)
    along /= np.hypot(*along.T)[:, None]
    b = np.column_stack([-along[:, 1], along[:, 0]])
    a = b[before]
    mean, half = (inward[before] + inward) / 2, (inward[before] - inward) / 2
    # The corner moves by w with w.a = mean + half and w.b = mean - half; a + b and a - b are at right angles.
    with np.errstate(divide="ignore", invalid="ignore"):
        part = np.where(half == 0, 0.0, 2 * half / ((a - b) ** 2).sum(axis=1))
        made = points + (2 * mean / ((a + b) ** 2).sum(axis=1))[:, None] * (a + b) + part[:, None] * (a - b)
        length = ((made[after] - made) * along).sum(axis=1)
        intact = np.isfinite(made).all(axis=1) & (length > shortest)
    grain = np.repeat(np.arange(len(first) - 1), np.diff(first))
    faulty = np.unique(grain[~intact])
    if not len(faulty):
        return made, first
    pieces = np.split(made, first[1:-1])
    for g in faulty:
        row = slice(first[g], first[g + 1])
        left = _cut(points[row], along[row], b[row], inward[row])
        if not left:
            raise ParameterError(f"apart: gap = {gap:g} m is not allowed, grain {g} would vanish in it")
        pieces[g] = np.array(left)
    return np.concatenate(pieces), np.cumsum([0, *map(len, pieces)])


def _cut(points: np.ndarray, along: np.ndarray, normal: np.ndarray, inward: np.ndarray) -> Polygon:
    """What is left of a polygon inside all its sides moved inward; an empty list for nothing."""
    left = polygon_of(points)
    near = ROUNDING * float(np.ptp(points, axis=0).max())
    for k in np.flatnonzero(inward):
        if left:
            on, direction = polygon_of(np.array([points[k] + inward[k] * normal[k], along[k]]))
            left = split(left, on, direction, near)[0]
    return left


@checked
def wall(width: float, height: float, brick_width: float, brick_height: float, gap: float = 0.0) -> Tessellation:
    """A wall (m) of loose bricks in running bond, lower left corner at the origin, its joints ``gap`` m wide.

    Every other course begins with half a brick, so bricks and gaps are counted within ``width``, which must be a whole
    number of half bricks, and ``height`` one of bricks. The outside has boundaries bottom, right, top and left; the
    sides in the joints are the boundary "grains". Ten courses of bricks of 24 cm by 8 cm::

        grains = wall(2.4, 0.8, brick_width=0.24, brick_height=0.08)

    Raises :class:`~grainlaw.fields.ParameterError`.
    """
    check_sizes("wall", width=width, height=height, brick_width=brick_width, brick_height=brick_height)
    check_sizes("wall", below=min(brick_width / 2, brick_height), zero=True, gap=gap)
    halves = _times("width", width, brick_width / 2, "half bricks", least=2)
    courses = _times("height", height, brick_height, "bricks", least=1)
    x, y = np.linspace(0, width, halves + 1), np.linspace(0, height, courses + 1)
    joints = ([*range(0, halves, 2), halves], [0, *range(1, halves, 2), halves])  # of even and odd courses
    boxes = [
        (x[left], y[course], x[right], y[course + 1])
        for course in range(courses)
        for left, right in pairwise(joints[course % 2])
    ]
    corners = np.array(boxes)[:, [0, 1, 2, 1, 2, 3, 0, 3]].reshape(-1, 2)
    bricks = Tessellation(
        rectangle(width, height), corners, np.arange(len(corners)), np.arange(0, len(corners) + 1, 4),
        loose=np.ones(len(boxes), dtype=bool),
    )  # fmt: skip
    return apart(bricks, gap)


def _times(name: str, whole: float, part: float, kind: str, *, least: int) -> int:
    count = round(whole / part)
    if not least <= count <= MOST_BRICKS or abs(whole / part - count) > 1e-6:
        raise ParameterError(
            f"wall: {name} = {whole:g} m is not allowed, it must be {part:g} m times a whole number of {kind}, "
            f"from {least} to {MOST_BRICKS}"
        )
    return count
