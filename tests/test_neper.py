"""Tessellation files of Neper: what is read, written, and refused."""

import itertools
import re

import attrs
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tess_files import GROUPS, ORIENTED, PERIODIC, SCALES, tess
from tiling import BEAM, assert_tiles

from grainlaw.fields import ParameterError
from grainlaw.geometry import (
    Bricks,
    Cracked,
    Voronoi,
    apart,
    disc,
    moved,
    polygon,
    read_tess,
    rectangle,
    together,
    write_tess,
)

pytestmark = pytest.mark.filterwarnings("ignore::grainlaw.geometry.SliverWarning")


def read(folder, text, **options):
    file = folder / "x.tess"
    file.write_text(text)
    return read_tess(file, **options)


@pytest.mark.parametrize("format", ["2.0", "3.3", "3.4", "3.5"])
@pytest.mark.parametrize("cell", ["", ORIENTED, GROUPS + ORIENTED])
def test_formats_hold_the_same_grains(format, cell, tmp_path):
    grains = read(tmp_path, tess(format, cell=cell, more=PERIODIC))
    assert_tiles(grains)
    middle = (0.812345678901 + 1.123456789012) / 2
    assert grains.areas == pytest.approx([1, middle / 2, (2 - middle) / 2])
    assert not grains.is_breakable
    on = {name: grains.edges.side == k for k, name in enumerate(grains.boundary_names)}
    low, high = grains.vertices[grains.edges.start], grains.vertices[grains.edges.end]
    assert (low[on["bottom"], 1] == 0).all()
    assert not np.signbit(grains.vertices).any()  # the file has -0.0, which would make other numbers of equal grains
    assert (high[on["right"], 0] == 2).all()
    assert {name: int(found.sum()) for name, found in on.items()} == {"bottom": 1, "right": 2, "top": 2, "left": 2}


def test_edges_of_the_domain_need_no_type(tmp_path):
    plain, typed = (read(tmp_path, tess("3.4", kind=kind)) for kind in ("", "line 0"))
    assert plain.boundary_names == typed.boundary_names
    assert np.array_equal(plain.edges.side, typed.edges.side)


def test_an_empty_cell_is_no_grain(tmp_path):
    """It has a number and a group, but no vertices."""
    text = tess(cell="  *group\n   2 1 2 1\n").replace(
        " **face\n 3\n", " **face\n 4\n   4 0\n     0\n     0 0 0 1\n     0 -1 0 0 0\n"
    )
    assert " **face\n 4\n" in text
    grains = read(tmp_path, text)
    assert_tiles(grains)
    assert grains.count == 3


def test_groups_are_phases_with_names(tmp_path):
    numbered = read(tmp_path, tess(cell=GROUPS))
    assert [numbered.phase_names[p] for p in numbered.phase] == ["2", "1", "2"]
    named = read(tmp_path, tess(cell=GROUPS), phases={1: "quartz", 2: "mica"})
    assert [named.phase_names[p] for p in named.phase] == ["mica", "quartz", "mica"]


def test_cells_of_the_first_scale_are_the_grains(tmp_path):
    grains = read(tmp_path, tess(more=SCALES))
    assert grains.parent.tolist() == [0, 1, 1]
    inside = grains.edges.kind == 1
    assert grains.edges.length[inside] == pytest.approx(np.hypot(0.5, 1.123456789012 - 0.812345678901))


def test_lengths_are_in_the_unit_of_the_file(tmp_path):
    assert read(tmp_path, tess(), unit=1e-3).region.bounds.tolist() == [[0, 0], [2e-3, 1e-3]]


def test_a_side_has_the_name_of_its_domain_edge(tmp_path):
    assert set(read(tmp_path, tess(south="base")).boundary_names) == {"base", "right", "top", "left"}


@pytest.mark.thorough
@settings(max_examples=20)
@given(
    region=st.sampled_from([rectangle(0.05, 0.1), disc(1.0), BEAM, polygon([(0, 0), (3, 1), (2, 4)], "rim")]),
    seed=st.integers(1, 1000), minerals=st.integers(1, 3), size=st.integers(1, 4),
)  # fmt: skip
def test_what_is_written_is_read_to_the_last_bit(tmp_path_factory, region, seed, minerals, size):
    folder = tmp_path_factory.mktemp("tess")
    grains = Voronoi(grains=20, seed=seed).tessellate(region)
    random = np.random.default_rng(seed)
    grains = attrs.evolve(
        grains, phase=np.arange(grains.count) % minerals, phase_names=tuple("abc"[:minerals]),
        parent=random.permutation(grains.count) // size,
    )  # fmt: skip
    write_tess(grains, folder / "one.tess")
    again = read_tess(folder / "one.tess", phases={1: "a", 2: "b", 3: "c"})
    assert again.vertices.tobytes() == grains.vertices.tobytes()
    for name in ("corners", "first", "phase"):
        assert np.array_equal(getattr(again, name), getattr(grains, name))
    assert again.phase_names == grains.phase_names
    assert np.array_equal(*(each.parent[:, None] == each.parent for each in (grains, again)))
    assert set(again.boundary_names) == set(grains.boundary_names)
    write_tess(again, folder / "two.tess")
    numbered = read_tess(folder / "one.tess")
    write_tess(numbered, folder / "three.tess")
    one, two, three = ((folder / f"{n}.tess").read_text() for n in ("one", "two", "three"))
    assert two.partition("**domain")[0] == one.partition("**domain")[0] == three.partition("**domain")[0]
    write_tess(read_tess(folder / "two.tess"), folder / "four.tess")
    assert (folder / "four.tess").read_text() == two


def test_each_edge_of_the_domain_has_the_corners_of_its_side(tmp_path):
    """A bench of five corners: edge k goes from vertex k to the next, the last back to the first."""
    outline = [(0, 0), (3, 0), (3, 1), (1, 1), (0, 2)]
    write_tess(Voronoi(grains=12).tessellate(polygon(outline, "a b c d e".split())), tmp_path / "x.tess")
    domain = (tmp_path / "x.tess").read_text().partition("**domain")[2].partition("*edge")[2].split("\n")
    rows = [row.split() for row in domain]
    edges = [row for row, after in itertools.pairwise(rows) if after == ["line"]]
    assert edges == [[str(k), "2", str(k), str(k % 5 + 1)] for k in range(1, 6)]


def test_a_file_numbers_from_one_and_names_the_vertices_and_edges_of_each(tmp_path):
    """Two squares of 1 and a half: their faces, the region's corners at its vertices, its sides by their edges."""
    write_tess(Bricks(rows=2, columns=1).tessellate(rectangle(2.0, 1.0)), tmp_path / "x.tess")
    grains, domain = (tmp_path / "x.tess").read_text().split("**domain")
    rows = [row.split() for row in grains.splitlines()]

    def of(name):
        """Rows of a part, after its count."""
        at = rows.index([name])
        end = next((k for k in range(at + 1, len(rows)) if rows[k] and rows[k][0].startswith("*")), len(rows))
        return [row for row in rows[at + 2 : end] if row]

    places = {row[0]: (float(row[1]), float(row[2])) for row in of("**vertex")}
    edges = {row[0]: row[1:3] for row in of("**edge")}
    faces = of("**face")[::4]
    assert [(face[0], face[1]) for face in faces] == [("1", "4"), ("2", "4")]
    assert list(places) == [str(k + 1) for k in range(6)]
    assert list(edges) == [str(k + 1) for k in range(7)]
    for face, round_it in zip(faces, of("**face")[1::4], strict=True):
        corners = face[2:]
        for k, edge in enumerate(round_it[1:]):
            ends = edges[edge.lstrip("-")][:: -1 if edge.startswith("-") else 1]
            assert ends == [corners[k], corners[(k + 1) % 4]]
    rows = [row.split() for row in domain.splitlines()]
    corners = rows[rows.index(["*vertex"]) + 2 : rows.index(["*edge"])]
    for at, held in zip(corners[::2], corners[1::2], strict=True):
        assert places[held[1]] == (float(at[1]), float(at[2]))
    rows = rows[rows.index(["*edge"]) + 2 :]
    found = {rows[k + 3][0]: rows[k + 4] for k in range(0, 20, 5)}  # by the label of the side
    lies = {"x0": (0, 0.0), "x1": (0, 2.0), "y0": (1, 0.0), "y1": (1, 1.0)}
    for label, (axis, value) in lies.items():
        on = [name for name, ends in edges.items() if all(places[end][axis] == value for end in ends)]
        assert found[label] == [str(len(on)), *on]


def test_the_digits_of_a_file_stay(tmp_path):
    write_tess(read(tmp_path, tess(cell=GROUPS, more=SCALES)), tmp_path / "y.tess")
    words = (tmp_path / "y.tess").read_text().split()
    for text in ("0.812345678901", "1.123456789012"):
        assert text in words
    again = words[words.index("*cellid") + 1 :]
    assert again == "1 1 1 2 2 1 3 2 2 ***end".split()
    assert words[words.index("*group") + 1 :][:3] == ["2", "1", "2"]


FULL = tess(cell=GROUPS, more=SCALES)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (tess(dimension=3), "has 3 dimensions, it must have 2"),
        (tess("1.9"), "has the format 1.9, it must be 2.0 to 3.5"), (tess("4.0"), "has the format 4.0"),
        (tess(z="0.100000000000"), "vertex 8 has z other than 0"), ("", "does not begin with"),
        ("***tesr\n **format\n 2.1", "does not begin with"),
        (FULL.replace("3 4 8 3 4 5", "3 4 8 3 4 11"), "numbers of the 8 vertices"),
        (FULL.replace("3 4 8 3 4 5", "3 4 8 3 4 6"), "polygons 1 and 2 overlap at the"),
        (FULL.replace("2 4 7 8 5 6", "2 4 7 5 8 6"), "polygon 1 crosses or touches itself near"),
        (FULL.replace("   3 2 2\n", ""), "no complete tessellation file"),
        (FULL.replace("***end", ""), "no complete tessellation file"),
        (FULL.replace("   2 1 2\n", "   2 1\n"), "no complete tessellation file"),
        (FULL[: FULL.index("**edge")] + "***end", "no complete tessellation file"),
        (FULL.replace("   4 4 5 0", "   4 4 9 0"), "no complete tessellation file"),
        (FULL.replace("   4 4 5 0", "   4 0 5 0"), "no complete tessellation file"),
        (FULL.replace("   4 4 5 0", "   4 4 5.5 0"), "no complete tessellation file"),
        (FULL.replace("     2 4 5\n", "     2 0 5\n"), "no complete tessellation file"),
        (FULL.replace("8  1.12", "8  x1.12"), "no complete tessellation file"),
        (FULL.replace("8  1.12", "9  1.12"), "no complete tessellation file"),
    ],
)  # fmt: skip
def test_other_files_are_refused(text, said, tmp_path):
    with pytest.raises(ParameterError, match=re.escape(said)) as refused:
        read(tmp_path, text)
    assert "x.tess" in str(refused.value)


def test_phases_must_fit_the_groups(tmp_path):
    with pytest.raises(ParameterError, match="no name for the group 1"):
        read(tmp_path, tess(cell=GROUPS), phases={2: "mica"})
    with pytest.raises(ParameterError, match="the file has no groups"):
        read(tmp_path, tess(), phases={2: "mica"})


def test_what_the_format_does_not_know_is_not_written(tmp_path):
    grains = Voronoi(grains=5).tessellate(rectangle(1, 1))
    plate = polygon([(0, 0), (1, 0), (1, 1), (0, 1)], holes={"well": [(0.4, 0.4), (0.6, 0.4), (0.5, 0.6)]})
    with pytest.raises(ParameterError, match="several bodies"):
        write_tess(together(grains, moved(grains, by=(9, 0))), tmp_path / "x.tess")
    with pytest.raises(ParameterError, match="loose grains"):
        write_tess(apart(grains, 1e-3), tmp_path / "x.tess")
    cracked = Cracked(Voronoi(grains=12), share=0.3).tessellate(rectangle(1, 1))
    with pytest.raises(ParameterError, match="joints or cracks"):
        write_tess(cracked, tmp_path / "x.tess")
    with pytest.raises(ParameterError, match="holes"):
        write_tess(Voronoi(grains=30).tessellate(plate), tmp_path / "x.tess")
    assert not (tmp_path / "x.tess").exists()
