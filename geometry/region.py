"""Regions of common shape, and those of the specimens of common rock tests."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from grainlaw.arguments import checked, is_number
from grainlaw.fields import ParameterError, checked_points, checked_whole_number
from grainlaw.messages import in_python, short
from grainlaw.polygon import ring_area
from grainlaw.region import Region


def check_sizes(shape: str, *, below: float = math.inf, unit: str = "m", zero: bool = False, **values: Any) -> None:
    """Refuse values that are no numbers above 0 (or 0) and below a bound."""
    least = "at least 0" if zero else "above 0"
    limit = "" if below == math.inf else f" and below {below:g}"
    for name, value in values.items():
        if not is_number(value) or not (0 < value < below or (zero and value == 0)):
            measured = "" if isinstance(value, str) else f" {unit}"
            raise ParameterError(
                f"{shape}: {name} = {short(value)}{measured} is not allowed, it must be a finite number {least}{limit}"
                f"{in_python(value)}"
            )


@checked
def rectangle(width: float, height: float) -> Region:
    """Upright rectangle (m), lower left corner at the origin; sides bottom, right, top and left.

    Raises :class:`~grainlaw.fields.ParameterError`.
    """
    check_sizes("rectangle", width=width, height=height)
    corners = np.array([(0, 0), (width, 0), (width, height), (0, height)], dtype=float)
    return Region(corners, ("bottom", "right", "top", "left"))


@checked
def polygon(points: Any, names: str | Sequence[str] = "boundary", holes: Mapping[str, Any] | None = None) -> Region:
    """Simple polygon with corners ``points`` (n, 2) m, clockwise or not.

    ``names`` has the name of the side from each corner to the next, or one for all; ``holes`` has an outline for each
    name. Raises :class:`~grainlaw.fields.ParameterError`.
    """
    outline = checked_points("polygon: points", points)
    sides = (names,) * len(outline) if isinstance(names, str) else tuple(names)
    if _clockwise(outline) and len(sides) == len(outline):
        outline, sides = outline[::-1], (*sides[-2::-1], sides[-1])
    rings = {name: checked_points(f"polygon: hole {short(name)}", ring) for name, ring in (holes or {}).items()}
    clockwise = [ring if _clockwise(ring) else ring[::-1] for ring in rings.values()]
    return Region(outline, sides, clockwise, [(name,) * len(ring) for name, ring in rings.items()])


def _clockwise(ring: np.ndarray) -> bool:
    """Whether a ring runs clockwise; one of too few corners, which the region refuses, runs nowhere."""
    return len(ring) > 2 and ring_area(ring.astype(float)) < 0


@checked
def shear_box(width: float, height: float, gap: float = 0.0) -> Region:
    """Upright rectangle (m) whose sides are split at half its height, for a shear box in halves.

    Sides bottom, right_lower, right_upper, top, left_upper and left_lower; with a ``gap`` between the halves of the box
    the free pieces right_gap and left_gap too. Raises :class:`~grainlaw.fields.ParameterError`.
    """
    check_sizes("shear_box", width=width, height=height)
    check_sizes("shear_box", below=height, zero=True, gap=gap)
    low, high = (height - gap) / 2, (height + gap) / 2
    right, left = [(width, low), (width, high)], [(0, high), (0, low)]
    between = ["right_gap"], ["left_gap"]
    if gap == 0:
        right, left, between = right[:1], left[:1], ([], [])
    corners = [(0, 0), (width, 0), *right, (width, height), (0, height), *left]
    names = ["bottom", "right_lower", *between[0], "right_upper", "top", "left_upper", *between[1], "left_lower"]
    return Region(np.array(corners, dtype=float), tuple(names))


MOST_SIDES = 100_000  #: of a circle


def _arc(radius: float, begin: float, end: float, longest: float) -> np.ndarray:
    """(n, 2) m, equally apart, counter-clockwise about the origin from one angle (degrees) up to, without, another."""
    count = math.ceil((end - begin) / longest - 1e-9)
    angles = np.radians(begin + (end - begin) * np.arange(count) / count)
    return radius * np.column_stack([np.cos(angles), np.sin(angles)])


def _ring(*pieces: tuple[str, list[tuple[float, float]] | np.ndarray]) -> Region:
    """Region from pieces of outline, each with the name of the sides that begin in its corners."""
    outline = np.concatenate([np.asarray(corners, dtype=float) for _, corners in pieces])
    return Region(outline, tuple(name for name, corners in pieces for _ in corners))


@checked
def disc(diameter: float, *, loaded: float = 20.0, flat: bool = True, sides: int = 64) -> Region:
    """Disc (m) about the origin for the Brazilian test, as a polygon of about so many ``sides``.

    Boundaries top and bottom, where jaws touch it over an angle ``loaded`` (degrees, at the centre), and rim. ``flat``
    ends are ground off straight: a crack starts in the middle from 20 degrees on (Wang, Jia, Kou, Zhang and Lindqvist
    2004, doi:10.1016/S1365-1609(03)00093-5); others follow the circle, as under curved jaws. The circle passes through
    the corners. Raises :class:`~grainlaw.fields.ParameterError`.
    """
    check_sizes("disc", diameter=diameter)
    check_sizes("disc", below=180, unit="degrees", loaded=loaded)
    sides = checked_whole_number("disc: sides", sides, at_least=8, at_most=MOST_SIDES)
    radius, half, step = diameter / 2, loaded / 2, 360 / sides
    jaw = loaded if flat else step
    return _ring(
        ("rim", _arc(radius, half - 90, 90 - half, step)),
        ("top", _arc(radius, 90 - half, 90 + half, jaw)),
        ("rim", _arc(radius, 90 + half, 270 - half, step)),
        ("bottom", _arc(radius, 270 - half, 270 + half, jaw)),
    )


@checked
def plate_with_hole(width: float, height: float, diameter: float, *, sides: int = 32) -> Region:
    """Upright rectangle (m) about the origin with a circular hole in its middle, a polygon of so many ``sides``.

    Boundaries bottom, right, top, left and hole. The area of the polygon is that of the circle. Each of its corners
    cuts the grain beside it in two: sides as long as these grains give rounder ones, and a longer time step. Raises
    :class:`~grainlaw.fields.ParameterError`.
    """
    check_sizes("plate_with_hole", width=width, height=height)
    check_sizes("plate_with_hole", below=min(width, height), diameter=diameter)
    sides = checked_whole_number("plate_with_hole: sides", sides, at_least=8, at_most=MOST_SIDES)
    x, y = width / 2, height / 2
    radius = diameter / 2 * math.sqrt(2 * math.pi / sides / math.sin(2 * math.pi / sides))
    corners = np.array([(-x, -y), (x, -y), (x, y), (-x, y)])
    return Region(corners, ("bottom", "right", "top", "left"), (_arc(radius, 0, 360, 360 / sides)[::-1],))


@checked
def semi_disc(
    diameter: float, *, notch_depth: float, notch_width: float, span: float, bearing: float, sides: int = 64
) -> Region:
    """Half disc (m) on its flat side, the middle of which is the origin, for semi-circular bend.

    A notch runs up from the origin; supports, ``span`` apart between their middles, and the load at the top are
    ``bearing`` wide. Boundaries bottom, support_left, support_right, notch, rim and load. ``sides`` counts those of a
    whole circle. Raises :class:`~grainlaw.fields.ParameterError`. Kuruppu, Obara, Ayatollahi, Chong and Funatsu
    2014, doi:10.1007/s00603-013-0422-7.
    """
    check_sizes("semi_disc", diameter=diameter)
    check_sizes("semi_disc", below=diameter / 2, notch_depth=notch_depth)
    check_sizes("semi_disc", below=diameter, span=span)
    sides = checked_whole_number("semi_disc: sides", sides, at_least=8, at_most=MOST_SIDES)
    radius = diameter / 2
    supports = _supported("semi_disc", -radius, radius, 0.0, span, bearing, notch_width, notch_depth)
    half = math.degrees(math.asin(bearing / diameter))
    return _ring(
        *supports,
        ("rim", _arc(radius, 0, 90 - half, 360 / sides)),
        ("load", _arc(radius, 90 - half, 90 + half, 360 / sides)),
        ("rim", _arc(radius, 90 + half, 180, 360 / sides)),
    )


@checked
def notched_beam(
    length: float, height: float, *, notch_depth: float, notch_width: float, span: float, bearing: float
) -> Region:
    """Upright rectangle (m), lower left corner at the origin, with a notch from the middle of its bottom.

    For bending at three points: the two supports, ``span`` apart between their middles, and the load in the middle
    of the top are ``bearing`` wide. Boundaries bottom, support_left, support_right, notch, right, top, load and left.
    Raises :class:`~grainlaw.fields.ParameterError`.
    """
    check_sizes("notched_beam", length=length, height=height)
    check_sizes("notched_beam", below=height, notch_depth=notch_depth)
    check_sizes("notched_beam", below=length, span=span)
    middle = length / 2
    return _ring(
        *_supported("notched_beam", 0.0, length, middle, span, bearing, notch_width, notch_depth),
        ("right", [(length, 0)]),
        ("top", [(length, height)]),
        ("load", [(middle + bearing / 2, height)]),
        ("top", [(middle - bearing / 2, height)]),
        ("left", [(0, height)]),
    )


def _supported(
    shape: str, left: float, right: float, middle: float, span: float, bearing: float, notch_width: float,
    notch_depth: float,
) -> list[tuple[str, list[tuple[float, float]]]]:  # fmt: skip
    """Pieces of a bottom at height 0 from left to right, with two supports and a notch between them."""
    room = min(right - left - span, span)
    check_sizes(shape, below=room, bearing=bearing)
    check_sizes(shape, below=span - bearing, notch_width=notch_width)
    one, other, half, slit = middle - span / 2, middle + span / 2, bearing / 2, notch_width / 2
    return [
        ("bottom", [(left, 0)]),
        ("support_left", [(one - half, 0)]),
        ("bottom", [(one + half, 0)]),
        ("notch", [(middle - slit, 0), (middle - slit, notch_depth), (middle + slit, notch_depth)]),
        ("bottom", [(middle + slit, 0)]),
        ("support_right", [(other - half, 0)]),
        ("bottom", [(other + half, 0)]),
    ]
