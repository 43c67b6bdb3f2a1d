"""The shapes of common rock tests: their sides have the lengths and places of the test, or are refused."""

from __future__ import annotations

import inspect

import attrs
import numpy as np
import pytest
from tiling import BEAM, BEND

from grainlaw import geometry
from grainlaw.fields import ParameterError
from grainlaw.geometry import Hexagonal, disc, notched_beam, plate_with_hole, polygon, rectangle, semi_disc, shear_box
from grainlaw.region import Region


def lengths(region: Region) -> dict[str, float]:
    size = np.hypot(*(region.end - region.start).T)
    return {name: float(size[np.array(region.names) == name].sum()) for name in region.boundary_names}


def test_disc_has_flat_ends_over_the_loaded_angle() -> None:
    region = disc(2.0, loaded=20, sides=720)
    long = lengths(region)
    assert long["top"] == long["bottom"] == pytest.approx(2 * np.sin(np.radians(10)))
    assert region.names.count("top") == 1
    assert long["rim"] == pytest.approx(2 * np.radians(160), rel=1e-5)
    assert np.hypot(*region.start.T) == pytest.approx(1)
    assert np.ptp(region.bounds[:, 1]) == pytest.approx(2 * np.cos(np.radians(10)))


def test_disc_has_curved_ends() -> None:
    region = disc(2.0, loaded=30, flat=False, sides=360)
    assert region.area == pytest.approx(180 * np.sin(np.pi / 180))
    assert lengths(region)["top"] == pytest.approx(60 * np.sin(np.pi / 360))
    assert region.names.count("top") == 30


def test_beam_carries_its_pieces_where_they_belong() -> None:
    long = lengths(BEAM)
    assert long == pytest.approx(
        {"bottom": 0.2 - 0.01 - 1e-4, "support_left": 0.005, "notch": 0.0401, "support_right": 0.005}
        | {"right": 0.06, "top": 0.195, "load": 0.005, "left": 0.06}
    )
    assert BEAM.area == pytest.approx(0.2 * 0.06 - 0.02 * 1e-4)
    for name, x, y in (("support_left", 0.02, 0), ("support_right", 0.18, 0), ("load", 0.1, 0.06)):
        k = BEAM.names.index(name)
        assert (BEAM.start[k] + BEAM.end[k]) / 2 == pytest.approx([x, y])


def test_semi_disc_stands_on_its_flat_side() -> None:
    long = lengths(BEND)
    assert long["notch"] == pytest.approx(2 * 0.019 + 0.001)
    assert long["bottom"] == pytest.approx(0.076 - 2 * 0.004 - 0.001)
    assert BEND.bounds == pytest.approx(np.array([[-0.038, 0], [0.038, 0.038]]))
    load = BEND.start[[k for k, name in enumerate(BEND.names) if name == "load"]]
    assert load[0] == pytest.approx([0.002, np.sqrt(0.038**2 - 0.002**2)])
    k = BEND.names.index("support_right")
    assert (BEND.start[k] + BEND.end[k]) / 2 == pytest.approx([0.023, 0])


def test_shear_box_is_split_at_half_its_height() -> None:
    assert lengths(shear_box(2, 1)) == {
        "bottom": 2, "right_lower": 0.5, "right_upper": 0.5, "top": 2, "left_upper": 0.5, "left_lower": 0.5,
    }  # fmt: skip
    assert lengths(shear_box(2, 1, gap=0.25))["left_gap"] == 0.25


def test_a_circle_may_have_many_sides():
    """By pairs of sides that are near: all pairs of so many take 18 GB."""
    region = disc(50e-3, sides=20_000)
    assert len(region.start) == 2 * 8889 + 2  # two arcs of 160 degrees, two flat ends
    outline = region.outline.copy()
    outline[[100, 200]] = outline[[200, 100]]
    with pytest.raises(ParameterError, match="outline crosses or touches itself at its sides 99 and"):
        attrs.evolve(region, outline=outline)


@pytest.mark.parametrize(
    ("shape", "arguments", "message"),
    [
        (disc, {"diameter": 0}, r"disc: diameter = 0 m is not allowed, it must be a finite number above 0"),
        (disc, {"diameter": 1, "loaded": 180}, "disc: loaded = 180 degrees is not allowed, .* below 180"),
        (disc, {"diameter": 1, "sides": 7}, "disc: sides = 7 is not allowed, .* from 8 to 100000"),
        (shear_box, {"width": 1, "height": 1, "gap": -0.1}, "gap = -0.1 m is not allowed, .* at least 0"),
        (shear_box, {"width": 1, "height": 1, "gap": 1}, "gap = 1 m is not allowed, .* below 1"),
        (notched_beam, {"notch_depth": 1}, "notched_beam: notch_depth = 1 m is not allowed, .* below 1"),
        (notched_beam, {"span": 3.95}, "notched_beam: bearing = 0.1 m is not allowed, .* below 0.05"),
        (notched_beam, {"notch_width": 3}, "notched_beam: notch_width = 3 m is not allowed, .* below 2.9"),
        (semi_disc, {"notch_depth": 2}, "semi_disc: notch_depth = 2 m is not allowed, .* below 2"),
        (semi_disc, {"sides": 100_001}, "semi_disc: sides = 100001 is not allowed, .* from 8 to 100000"),
        (disc, {"diameter": 10**400}, "disc: diameter = .* m is not allowed"),
        (semi_disc, {"span": np.nan}, "semi_disc: span = nan m is not allowed, .* below 4"),
    ],
)
def test_shapes_refuse(shape, arguments: dict, message: str) -> None:
    common = {"notch_depth": 0.3, "notch_width": 0.01, "span": 3, "bearing": 0.1}
    if shape is notched_beam:
        arguments = {"length": 4, "height": 1} | common | arguments
    elif shape is semi_disc:
        arguments = {"diameter": 4} | common | arguments
    with pytest.raises(ParameterError, match=message):
        shape(**arguments)


def test_the_hole_of_a_plate_has_the_area_of_its_circle() -> None:
    plate = Hexagonal(grains=400).tessellate(plate_with_hole(0.1, 0.06, 0.02))
    assert plate.areas.sum() == pytest.approx(0.1 * 0.06 - np.pi * 0.01**2)
    with pytest.raises(ParameterError, match="plate_with_hole: diameter"):
        plate_with_hole(0.1, 0.06, 0.06)


def test_all_shapes_are_tried() -> None:
    shapes = {disc, notched_beam, plate_with_hole, polygon, rectangle, semi_disc, shear_box}
    functions = {each for each in map(vars(geometry).get, geometry.__all__) if inspect.isfunction(each)}
    assert shapes == {each for each in functions if inspect.signature(each, eval_str=True).return_annotation is Region}
