"""Grains from label maps: power cells of the labels' areas, and fine cells with the label of most pixels."""

import re

import attrs
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from matplotlib.path import Path
from tiling import assert_tiles, polygon_of

from grainlaw.fields import ParameterError
from grainlaw.geometry import (
    Voronoi,
    disc,
    from_labels,
    from_polygons,
    label_agreement,
    plate_with_hole,
    polygon,
    rectangle,
)
from grainlaw.geometry.cells.label_map import label_map
from grainlaw.geometry.labels import _in_one_part_each


def drawn(grains, columns):
    """A label map, row 0 at the top, in which grain g is label g + 1; and the size of its pixels."""
    width, height = grains.region.bounds[1]
    pixel = width / columns
    rows = round(height / pixel)
    x, y = np.meshgrid(np.arange(columns) + 0.5, rows - np.arange(rows) - 0.5)
    image = np.zeros((rows, columns), dtype=int)
    for g in range(grains.count):
        inside = Path(polygon_of(grains, g)).contains_points(np.column_stack([x.ravel(), y.ravel()]) * pixel)
        image[inside.reshape(rows, columns)] = g + 1
    return image, pixel


def by_label(grains):
    """(n,) m2 of the labels from 1."""
    return np.bincount(grains.parent, grains.areas)[1:]


@pytest.mark.thorough
@settings(max_examples=12)
@given(count=st.integers(1, 20), seed=st.integers(1, 1000), height=st.sampled_from([0.01, 0.02]))
def test_drawn_grains_come_back_with_their_areas(count, seed, height):
    grains = Voronoi(grains=count, seed=seed).tessellate(rectangle(0.02, height))
    image, pixel = drawn(grains, 600)
    made = from_labels(image, pixel, fill=True)
    assert_tiles(made)
    assert not made.is_breakable
    assert by_label(made) == pytest.approx(grains.areas, rel=0.01)
    agreement = label_agreement(made, image, pixel, fill=True)
    assert agreement.share > 0.95
    assert abs(agreement.area_errors).max() < 0.01


@pytest.mark.thorough
@settings(max_examples=8)
@given(count=st.integers(2, 20), seed=st.integers(1, 1000))
def test_drawn_cells_come_back_with_their_centroids(count, seed):
    """Voronoi cells are power cells, which areas and centroids decide, until short edges are merged."""
    grains = Voronoi(grains=count, seed=seed, merge=0).tessellate(rectangle(0.02, 0.02))
    image, pixel = drawn(grains, 400)
    made = from_labels(image, pixel, merge=0, fill=True)
    centroids = np.empty_like(grains.centroids)
    centroids[made.parent - 1] = made.centroids
    away = np.hypot(*(centroids - grains.centroids).T)
    assert away.max() < 0.02 * np.sqrt(grains.areas.mean())
    assert label_agreement(made, image, pixel, fill=True).share > 0.98


@pytest.mark.thorough
@settings(max_examples=8)
@given(count=st.integers(2, 12), seed=st.integers(1, 1000))
def test_fine_cells_have_the_label_of_most_of_their_pixels(count, seed):
    grains = Voronoi(grains=count, seed=seed).tessellate(rectangle(0.02, 0.02))
    image, pixel = drawn(grains, 200)
    made = from_labels(image, pixel, cell_size=0.001, fill=True)
    assert_tiles(made)
    assert made.is_breakable
    assert set(made.parent) == set(range(1, count + 1))
    coarse = label_agreement(from_labels(image, pixel, cell_size=0.002, fill=True), image, pixel, fill=True)
    fine = label_agreement(made, image, pixel, fill=True)
    # Half a cell or so on both sides of every boundary may be wrong.
    boundary = grains.edges.length[grains.edges.right >= 0].sum()
    assert 1 - fine.share < 0.5 * 0.001 * boundary / 0.02**2
    assert fine.share > coarse.share


def test_agreement_is_counted_pixel_by_pixel():
    image = np.repeat([[1, 1, 1, 2]], 4, axis=0)
    made = from_labels(image, 0.25)
    assert by_label(made) == pytest.approx([0.75, 0.25])
    agreement = label_agreement(made, image, 0.25)
    assert agreement.share == 1
    shifted = label_agreement(made, np.repeat([[1, 1, 2, 2]], 4, axis=0), 0.25)
    assert shifted.share == 0.75
    assert shifted.shares.tolist() == [1, 0.5]
    assert shifted.area_errors == pytest.approx([0.5, -0.5])
    assert "75.00% of the pixels agree" in str(shifted)


def test_row_0_is_at_the_top_and_phases_go_with_labels():
    made = from_labels(np.array([[7, 7], [3, 3], [3, 3]]), 1e-3, {3: "quartz", 7: "mica"})
    assert made.region.bounds.tolist() == [[0, 0], [0.002, 0.003]]
    top = made.centroids[:, 1].argmax()
    assert made.parent[top] == 7
    assert made.phase_name(made.phase[top]) == "mica"
    assert by_label(made)[[2, 6]] == pytest.approx([4e-6, 2e-6])


def test_a_concave_label_keeps_its_shape_in_fine_cells():
    image = np.ones((60, 60), dtype=int)
    image[:30, 30:] = 2
    cells = from_labels(image, 1e-3, cell_size=2e-3)
    power = from_labels(image, 1e-3)
    assert label_agreement(cells, image, 1e-3).share > 0.95 > label_agreement(power, image, 1e-3).share
    assert by_label(power) == pytest.approx([0.0027, 0.0009], rel=0.01)


def test_a_cell_has_the_label_of_most_of_its_pixels():
    """One cell, 41 of its 100 pixels in label 2, which gets none."""
    image = np.ones((10, 10), dtype=int)
    image[:4] = 2
    image[4, 0] = 2
    with pytest.raises(ParameterError, match=r"the label 2 at .* gets no cell"):
        from_labels(image, 1e-3, cell_size=0.01)
    middle = np.ones((10, 10), dtype=int)
    middle[2:8, 2:8] = 2  # in the middle of the cell, but of fewer pixels
    with pytest.raises(ParameterError, match=r"the label 2 at .* gets no cell"):
        from_labels(middle, 1e-3, cell_size=0.01)


def test_every_label_of_cells_hangs_together():
    """A bridge of one pixel between two squares is lost to the cells: of the two parts the largest stays."""
    image = np.ones((60, 60), dtype=int)
    image[5:25, 5:25] = image[30:55, 5:55] = 2
    image[25:30, 15] = 2
    made = from_labels(image, 1e-3, cell_size=6e-3)
    edges = made.edges
    inside = edges.kind == 1
    parts = np.arange(made.count)
    for _ in range(made.count):
        for a, b in zip(edges.left[inside], edges.right[inside], strict=True):
            parts[a] = parts[b] = min(parts[a], parts[b])
    assert len(set(parts)) == 2


def test_specks_and_background_go_to_what_is_round_them():
    image = np.repeat([[1] * 20 + [2] * 20], 40, axis=0)
    clean = image.copy()
    image[5:7, 5:7] = 2
    image[10, 19] = image[12, 19] = 0
    image[30, 5] = 2
    assert np.array_equal(from_labels(image, 1e-3, fill=True).vertices, from_labels(clean, 1e-3).vertices)
    with pytest.raises(ParameterError, match="the label 2 has a part of 4 pixels apart from its largest, at row 5, c"):
        from_labels(image, 1e-3, fill=True, speck=3)


def corner():
    image = np.ones((20, 20), dtype=int)
    image[5:10, 5:10] = image[10:15, 10:15] = 2
    return image


def ring():
    image = np.ones((20, 20), dtype=int)
    image[5:15, 5:15] = 2
    return image


def rings():
    """Two labels with a ring round each: the left pair is named."""
    return np.concatenate([ring(), ring() + 2], axis=1)


def pairs():
    """Parts of 49 and 4 pixels touch at a corner; one of 9 lies apart, the first that is at fault."""
    image = np.ones((20, 20), dtype=int)
    image[1:8, 1:8] = image[8:10, 8:10] = image[14:17, 2:5] = 2
    return image


def with_zero():
    image = np.ones((20, 20), dtype=int)
    image[3:, 8] = 0
    return image


@pytest.mark.parametrize(
    ("image", "options", "said"),
    [
        (corner(), {}, "the label 2 has parts that touch at a corner only, at row 9, column 9 (0.0095, 0.0105) m"),
        (
            corner()[:, ::-1],
            {},
            "the label 2 has parts that touch at a corner only, at row 9, column 9 (0.0095, 0.0105)",
        ),
        (
            np.repeat([[1, 2, 1]], 9, axis=0),
            {},
            "the label 1 has a part of 9 pixels apart from its largest, at row 0, co",
        ),
        (
            pairs(),
            {},
            "the label 2 has a part of 9 pixels apart from its largest, at row 14, column 2 (0.0025,",
        ),
        (with_zero(), {}, "the label 0 at row 3, column 8 (0.0085, 0.0165) m is background, 17 pixels in all"),
        (-np.eye(3, dtype=int), {}, "the label -1 at row 0, column 0 (0.0005, 0.0025) m is not allowed"),
        (np.zeros((3, 3), dtype=int), {"fill": True}, "the label 0 at row 0, column 0"),
        (np.ones((3, 3)) * 1.5, {}, "image = an array of shape (3, 3) is not allowed"),
        (np.ones((3, 3, 3)), {}, "image = an array of shape (3, 3, 3) is not allowed"),
        (np.ones((3, 3), dtype=bool), {}, "image = an array of shape (3, 3) is not allowed"),
        (np.array([[1, 2]]), {"phases": {1: "quartz"}}, "phases has no entry for the label 2"),
        (np.repeat([[1] * 19 + [2]], 20, axis=0), {"cell_size": 0.01}, "the label 2 at (0.0195, 0.01) m gets no cell"),
        (ring(), {}, "the labels 1 and 2 have the same centroid (0.01, 0.01) m, one lies round the other"),
        (rings(), {}, "the labels 1 and 2 have the same centroid (0.01, 0.01) m, one lies round the other"),
        ("absent.png", {}, "absent.png cannot be read as an image"),
    ],
)
def test_other_images_are_refused_with_their_place(image, options, said):
    with pytest.raises(ParameterError, match=re.escape(said)):
        from_labels(image, 1e-3, **options)


@pytest.mark.parametrize("name", ["x.npy", "x8.png", "x16.png"])
def test_files(name, tmp_path):
    from PIL import Image

    image = np.repeat([[3, 3, 3, 200, 200 if "8" in name else 60001]], 3, axis=0)
    if name == "x.npy":
        np.save(tmp_path / name, image)
    else:
        Image.fromarray(image.astype(np.uint8 if "8" in name else np.uint16)).save(tmp_path / name)
    made = from_labels(str(tmp_path / name), 1e-3, speck=0)
    assert set(made.parent) == set(image.ravel())
    assert np.array_equal(made.vertices, from_labels(image, 1e-3, speck=0).vertices)


def test_colours_are_refused(tmp_path):
    from PIL import Image

    Image.fromarray(np.dstack([np.eye(4) * 200, np.ones((4, 4)), np.ones((4, 4))]).astype(np.uint8)).save(
        tmp_path / "x.png"
    )
    with pytest.raises(ParameterError, match=r"x\.png has colours, it must be grey"):
        from_labels(tmp_path / "x.png", 1e-3)


def test_agreement_needs_the_region_of_the_image():
    made = from_labels(np.ones((4, 4), dtype=int), 1e-3)
    with pytest.raises(ParameterError, match=r"grains fill another region than the image, 0\.008 m x 0\.008 m"):
        label_agreement(made, np.ones((8, 8), dtype=int), 1e-3)
    with pytest.raises(ParameterError, match="pixel = 0 m is not allowed"):
        label_agreement(attrs.evolve(made), np.ones((4, 4), dtype=int), 0)


def test_cells_have_the_label_of_most_pixels_by_counting():
    x, y = np.meshgrid(np.arange(40), np.arange(40))
    image = 1 + (y > 12 + 0.3 * x) + 2 * (x > 22 + 0.2 * y)
    made = from_labels(image, 1e-3, cell_size=3.3e-3)
    middles = np.column_stack([x.ravel() + 0.5, 39.5 - y.ravel()]) * 1e-3
    for g in range(made.count):
        inside = Path(polygon_of(made, g)).contains_points(middles)
        assert made.parent[g] == np.bincount(image.ravel()[inside]).argmax()


def test_cells_smaller_than_a_pixel_have_the_label_at_their_middle():
    image = np.array([[1, 2, 2], [3, 4, 4]])
    made = from_labels(image, 5.0, cell_size=1.3)
    column, row = (made.centroids // 5).astype(int).T
    assert made.parent.tolist() == image[1 - row, column].tolist()


def test_the_smaller_part_of_a_label_goes_to_that_with_the_most_edge_in_common():
    """Along 2 m with the second cell, along 1 m with the third, which lies between it and the large part."""
    boxes = [(0, 0, 2, 1), (0, 1, 2, 2), (2, 0, 3, 2), (0, 2, 3, 4)]
    cells = from_polygons([[(x, y), (u, y), (u, v), (x, v)] for x, y, u, v in boxes])
    assert _in_one_part_each(cells, np.array([0, 1, 2, 0])).tolist() == [1, 1, 2, 0]
    assert _in_one_part_each(cells, np.array([3, 1, 2, 0])).tolist() == [3, 1, 2, 0]


# --- specimens of any outline ----------------------------------------------------------------------------------------


def disc_in_a_picture(pixels, labels=4, blank=0):
    """A core section of 40 mm in a picture of 50 mm, background 0: quadrants 1 to 4, or left and right of a line."""
    pixel = 0.05 / pixels
    x, y = np.meshgrid((np.arange(pixels) + 0.5) * pixel - 0.025, 0.025 - (np.arange(pixels) + 0.5) * pixel)
    image = 1 + (x > 0) + 2 * (y > 0) if labels == 4 else 1 + (x > 0.0061237)
    if blank is not None:
        image[np.hypot(x, y) > 0.0202] = blank
    return image, pixel


def right_of(ring, x):
    """m2 of a convex ring beyond a vertical line, by clipping and the shoelace formula."""
    kept = []
    for (x0, y0), (x1, y1) in zip(ring, np.roll(ring, -1, axis=0), strict=True):
        if x0 >= x:
            kept.append((x0, y0))
        if (x0 - x) * (x1 - x) < 0:
            kept.append((x, y0 + (y1 - y0) * (x - x0) / (x1 - x0)))
    a, b = np.array(kept), np.roll(kept, -1, axis=0)
    return 0.5 * abs((a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum())


def test_quadrants_of_a_disc_are_cut_out_of_their_background():
    """Each has a quarter of the area, and its centroid at 4 R/(3 pi) from both axes (of the circle, to 0.3 %)."""
    section = disc(0.04)
    image, pixel = disc_in_a_picture(200)
    made = from_labels(image, pixel, region=section, merge=0)
    assert_tiles(made)
    assert made.region is section
    assert by_label(made) == pytest.approx([section.area / 4] * 4, rel=1e-3)
    away = 4 * 0.02 / (3 * np.pi)
    centroids = made.centroids[np.argsort(made.parent)]
    assert centroids == pytest.approx(away * np.array([(-1, -1), (1, -1), (-1, 1), (1, 1)]), rel=5e-3)
    assert label_agreement(made, image, pixel, region=section).share > 0.99
    assert {"top", "bottom", "rim"} == set(made.region.boundary_names)


def test_areas_of_cut_labels_tend_to_those_of_the_pieces():
    """Of a disc left and right of a line, at which the edge of a pixel lies within half a pixel: of first order."""
    section = disc(0.04)
    right, chord = right_of(section.outline, 0.0061237), 2 * np.sqrt(0.02**2 - 0.0061237**2)
    for pixels in (50, 100, 200, 400, 800):
        image, pixel = disc_in_a_picture(pixels, labels=2)
        made = label_map("test", image, pixel, speck=4, fill=False, region=section)
        assert made.areas.sum() == pytest.approx(section.area, rel=1e-12)
        assert made.areas[1] == pytest.approx(right, abs=chord * pixel / 2)
    assert made.areas[1] == pytest.approx(right, rel=1e-4)


def test_specks_at_the_rim_go_to_a_label_or_are_cut_off():
    """The top of a diamond touches outside on three sides; a sharp corner has pixels that touch nothing else."""
    image = np.ones((41, 41), dtype=int)
    image[20:] = 2
    image[10, 20] = 2
    diamond = polygon([(20.5, 9.8), (31.2, 20.5), (20.5, 31.2), (9.8, 20.5)])
    made = label_map("test", image, 1.0, speck=4, fill=False, region=diamond)
    assert made.inside[10, 20]
    assert made.image[10, 20] == 1
    assert made.counts.sum() == diamond.contains(np.argwhere(image)[:, ::-1] + 0.5).sum()
    wedge = polygon([(0.3, 0.3), (39.0, 30.0), (39.0, 38.0)])
    found = label_map("test", np.ones((41, 41), dtype=int), 1.0, speck=4, fill=False, region=wedge, corner=(0, 0))
    inside = wedge.contains(np.argwhere(image)[:, ::-1] + 0.5).sum()
    assert inside - 10 < found.counts.sum() < inside
    assert found.areas == pytest.approx([wedge.area])


def test_what_is_cut_off_does_not_matter():
    """Neither background nor labels nor parts of labels outside change anything."""
    section = disc(0.04)
    image, pixel = disc_in_a_picture(200)
    made = from_labels(image, pixel, region=section)
    for blank in (4, 77, -5):
        assert np.array_equal(
            from_labels(disc_in_a_picture(200, blank=blank)[0], pixel, region=section).vertices, made.vertices
        )


@pytest.mark.thorough
@pytest.mark.parametrize("shape", ["disc", "plate with a hole", "corner"])
def test_cells_fill_a_region_of_any_outline(shape):
    angle = [(0, 0), (0.04, 0), (0.04, 0.02), (0.02, 0.02), (0.02, 0.04), (0, 0.04)]
    section = {"disc": disc(0.04), "plate with a hole": plate_with_hole(0.04, 0.04, 0.012), "corner": polygon(angle)}[
        shape
    ]
    image, pixel = disc_in_a_picture(200, blank=0 if shape == "disc" else None)
    made = from_labels(image, pixel, cell_size=1.5e-3, region=section)
    assert_tiles(made)
    assert made.region is section
    assert label_agreement(made, image, pixel, region=section).share > 0.95
    if shape != "corner":
        assert by_label(made) == pytest.approx([section.area / 4] * 4, rel=0.05)


def test_the_image_lies_in_the_middle_or_where_its_corner_is():
    """Pixels of 0.5 mm; of the box of 2 mm label 1 has the left half, or three of four columns."""
    image = np.repeat([[1] * 4 + [2] * 4], 8, axis=0)
    box = polygon([(1.0, 1.0), (1.002, 1.0), (1.002, 1.002), (1.0, 1.002)])
    assert by_label(from_labels(image, 5e-4, region=box)) == pytest.approx([2e-6, 2e-6])
    left = from_labels(image, 5e-4, region=box, corner=(0.9995, 0.999))
    assert by_label(left) == pytest.approx([3e-6, 1e-6])
    assert left.centroids[left.parent == 2] == pytest.approx(np.array([[1.00175, 1.001]]))
    agreement = label_agreement(left, image, 5e-4, region=box, corner=(0.9995, 0.999))
    assert (agreement.share, agreement.shares.tolist()) == (1, [1, 1])
    assert agreement.area_errors == pytest.approx([0, 0], abs=1e-9)


def notched():
    """Background inside the section, from row 60 to 69 and column 130 to 139."""
    image, pixel = disc_in_a_picture(200)
    image[60:70, 130:140] = 0
    return image, pixel


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"region": disc(0.06)}, "region reaches 0.004965 m beyond the image, which is 0.05 m x 0.05 m"),
        ({"region": disc(0.04), "corner": (0, 0)}, "region reaches 0.01998 m beyond the image"),
        ({"region": disc(0.04), "corner": 3}, "corner = 3 is not allowed, it must be two finite numbers (x, y) in m"),
        ({"corner": (0, 0)}, "corner is of no use without a region"),
        ({"region": 3}, "region = 3 is not allowed, it must be a Region or None"),
        (
            {"region": disc(0.04)},
            "the label 0 at row 60, column 130 (0.007625, 0.009875) m is background, 100 pixels",
        ),
        ({}, "is background, 19576 pixels in all; region=... cuts it off (fill=True gives"),
        (
            {"region": plate_with_hole(0.02, 0.02, 0.005), "fill": True},
            "region is not convex, for which grains are made of",
        ),
    ],
)
def test_regions_that_do_not_fit_an_image_are_refused(options, said):
    image, pixel = notched()
    with pytest.raises(ParameterError, match=re.escape(said)):
        from_labels(image, pixel, **options)


def test_background_within_the_region_is_filled_when_asked():
    image, pixel = notched()
    made = from_labels(image, pixel, region=disc(0.04), fill=True)
    assert by_label(made) == pytest.approx([disc(0.04).area / 4] * 4, rel=1e-3)
