"""Traces that cut grains, names of joint sets, slivers; what is refused."""

import math
import warnings

import attrs
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support import ROCK
from tiling import SLOPE, assert_sides_complete, assert_tiles, shoelace

import grainlaw as gl
from grainlaw.fields import ParameterError, UnitWarning
from grainlaw.geometry import (
    Breakable,
    Bricks,
    Hexagonal,
    Jointed,
    JointSet,
    JointSets,
    Minerals,
    Trigons,
    Voronoi,
    disc,
    polygon,
    rectangle,
)
from grainlaw.geometry.joints import cut_by
from grainlaw.laws import MohrCoulomb
from grainlaw.protocols import BiaxialCompression, UniaxialTension
from grainlaw.tessellation import TilingError
from grainlaw.units import mm

REGIONS = {
    "rectangle": rectangle(4, 3), "disc": disc(3.0), "slope": SLOPE,
    "hole": polygon([(0, 0), (4, 0), (4, 4), (0, 4)], holes={"hole": [(1, 1), (3, 1.2), (2.5, 3)]}),
}  # fmt: skip
places = st.tuples(*[st.integers(-50, 450).map(lambda cm: cm / 100)] * 2)
traces = st.lists(places, min_size=2, max_size=6, unique=True)


def has_each_trace_in_one_set(network):
    sets = [{min(tuple(trace), tuple(trace[::-1])) for trace in each} for each in network.values()]
    return len(set.union(*sets)) == sum(map(len, sets))


networks = st.dictionaries(
    st.sampled_from(["bedding", "cross"]), st.lists(traces, min_size=1, max_size=6), min_size=1
).filter(has_each_trace_in_one_set)
TESSELLATORS = [
    Voronoi(grains=60), Hexagonal(grains=40), Breakable(Voronoi(grains=12), Trigons(count=6)),
    JointSets(sets=[JointSet(dip=30, spacing=0.8), JointSet(dip=-50, spacing=0.7)]),
]  # fmt: skip


@pytest.mark.parametrize("missing", [[(0, 10), (25, 40)], [(-30, -10), (30, 34)], [(0.01, 0.01), (0.0101, 0.0101)]])
def test_a_set_that_cuts_no_grain_is_warned_of(missing):
    """In mm, beside the region though its box meets it, and shorter than half a grain."""
    traces = {"j": [missing], "k": [[(0.0, 0.01), (0.025, 0.03)], [(1.0, 1.0), (2.0, 3.0)]]}
    with pytest.warns(UnitWarning) as told:
        made = Jointed(Voronoi(grains=12), traces).tessellate(rectangle(0.025, 0.05))
    assert [str(each.message) for each in told] == [
        "Jointed: no trace of j cuts a grain of the region, which has x from 0 to 0.025 m and y from 0 to 0.05 m: is "
        "the unit right, and is one as long as a grain?"
    ]
    assert len(made.joints["k"])


def test_a_trace_that_short_edges_turn_is_warned_of():
    """It passes beside corners of bricks so that no short edge can vanish on it: two of its three pieces lean."""
    height, width, rise = 0.06, 0.016, math.tan(math.radians(55))
    trace = [
        (-0.001, height / 2 - rise * (width / 2 + 0.001)),
        (width + 0.001, height / 2 + rise * (width / 2 + 0.001)),
    ]
    bricks, region = Bricks(rows=12, columns=3), rectangle(width, height)
    with pytest.warns(UserWarning, match=r"^Jointed: a trace of j is turned by 6\.2 degrees at .*, and 59% of its set"):
        made = Jointed(bricks, {"j": [trace]}).tessellate(region)
    ends = made.vertices[made.joints["j"]]
    dips = np.degrees(np.arctan2(*(ends[:, 1] - ends[:, 0]).T[::-1])) % 180
    assert 55 - dips.min() == pytest.approx(6.2, abs=0.05)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        straight = Jointed(bricks, {"j": [trace]}, merge=0).tessellate(region)
    assert length_of(straight, "j") == pytest.approx(width / math.cos(math.radians(55)))


def length_of(grains, name):
    """m of all edges of a joint."""
    return grains.edges.length[grains.edges.kind == grains.kinds.index(name)].sum()


@pytest.mark.thorough
@pytest.mark.parametrize("region", REGIONS.values(), ids=REGIONS)
@settings(max_examples=25)
@given(network=networks, tessellator=st.sampled_from(TESSELLATORS))
def test_traces_cut_grains_that_tile(region, network, tessellator):
    made = Jointed(tessellator, network).tessellate(region)
    assert_tiles(made)
    assert_sides_complete(made)
    assert set(network) <= set(made.joints)
    assert set(made.parent) <= set(tessellator.tessellate(region).parent)


@settings(max_examples=20)
@given(height=st.floats(0.1, 2.9), dip=st.floats(-0.5, 0.5), tessellator=st.sampled_from(TESSELLATORS[:3]))
def test_a_trace_through_the_whole_region_is_straight_and_whole(height, dip, tessellator):
    """It would be shorter were a part of it missing, and longer were it bent."""
    ends = np.array([(-1.0, height - 3 * dip), (5.0, height + 3 * dip)])
    made = Jointed(tessellator, {"fault": [ends]}, merge=0).tessellate(REGIONS["rectangle"])
    x = np.sort([0, 4, *((y - height) / dip + 2 if dip else 0 for y in (0, 3))])[1:3] if dip else np.array([0, 4])
    slope = np.hypot(1, dip)
    assert length_of(made, "fault") == pytest.approx(np.diff(np.clip(x, 0, 4))[0] * slope, rel=1e-6)


def test_merging_keeps_a_trace_straight():
    made = Jointed(Voronoi(grains=300), {"fault": [[(-1, 0.5), (5, 2.6)]]}).tessellate(REGIONS["rectangle"])
    e = made.edges
    ends = made.vertices[np.column_stack([e.start, e.end])[e.kind == 2]]
    assert length_of(made, "fault") == pytest.approx(np.hypot(4, 1.4))
    assert abs(ends[..., 1] - 0.5 - (ends[..., 0] + 1) * 0.35).max() < 1e-9
    assert e.length.min() > 0.2 * made.grain_size
    assert_tiles(made)


@pytest.mark.parametrize(("reach", "cuts"), [(0.49, 1), (0.51, 2), (0.3, 1), (0.8, 2)])
def test_a_trace_ends_where_a_grain_ends(reach, cuts):
    """Through a row of bricks 1 m wide: the second is cut if the trace runs through half of it."""
    bricks, region = Bricks(rows=1, columns=4), rectangle(4, 1)
    made = Jointed(bricks, {"crack": [[(-1, 0.5), (1 + reach, 0.5)]]}).tessellate(region)
    assert made.count == 4 + cuts
    assert length_of(made, "crack") == pytest.approx(cuts)
    assert np.bincount(made.parent).tolist() == [2] * cuts + [1] * (4 - cuts)
    assert_tiles(made)


@pytest.mark.thorough
def test_traces_are_neither_longer_nor_shorter_on_average():
    random, ratios = np.random.default_rng(1), []
    for seed in range(12):
        begin, angle = random.uniform(0.3, 0.7, (6, 2)), random.uniform(0, np.pi, 6)
        way = 0.25 * np.column_stack([np.cos(angle), np.sin(angle)])
        made = Jointed(Voronoi(grains=400, seed=seed), {"joints": list(np.stack([begin, begin + way], axis=1))})
        ratios.append(length_of(made.tessellate(rectangle(1, 1)), "joints") / (6 * 0.25))
    assert np.mean(ratios) == pytest.approx(1, abs=3 * np.std(ratios) / np.sqrt(12))


def test_a_bend_moves_to_the_boundaries_of_grains():
    made = Jointed(Bricks(rows=1, columns=1), {"bent": [[(-1, 0.2), (0.5, 0.5), (2, 0.2)]]}).tessellate(rectangle(1, 1))
    assert made.areas == pytest.approx([0.6, 0.4]) or made.areas == pytest.approx([0.4, 0.6])


def test_a_trace_along_a_boundary_of_grains_names_it():
    made = Jointed(Bricks(rows=2, columns=3), {"bedding": [[(0, 0.5), (3, 0.5)]]}).tessellate(rectangle(3, 1))
    assert made.count == 6
    assert length_of(made, "bedding") == pytest.approx(3)


def test_an_edge_is_of_one_set():
    trace = [(0.0, 0.01), (0.02, 0.012)]
    for other in (trace, trace[::-1]):
        with pytest.raises(ParameterError, match=r"the trace from .* is in one and in two; an edge is of one set"):
            Jointed(Voronoi(grains=10, seed=1), {"one": [trace], "two": [other]})
    Jointed(Voronoi(grains=10, seed=1), {"one": [trace, trace]})
    whole = Voronoi(grains=4, seed=1).tessellate(rectangle(1, 1))
    for joints, words in (
        ({"one": [[0, 10**6]]}, "joints must be vertex numbers below"),
        ({"one": [[0, -1]]}, "joints must be vertex numbers below"),
    ):
        with pytest.raises(TilingError, match=words):
            attrs.evolve(whole, joints=joints)


def test_phases_are_those_of_the_grains_cut():
    minerals = Minerals(Voronoi(grains=100), {"quartz": 0.5, "mica": 0.5})
    made = Jointed(minerals, {"fault": [[(0, 0), (4, 3)]]}, merge=0).tessellate(REGIONS["rectangle"])
    assert made.phase_names == ("quartz", "mica")
    assert np.array_equal(made.phase, minerals.tessellate(REGIONS["rectangle"]).phase[made.parent])


def test_joints_of_the_grains_stay_where_traces_cut_them():
    """Two horizontal joints, and a trace across both."""
    sets = JointSets(sets=[JointSet(dip=0, spacing=1.0, name="bedding")])
    before = sets.tessellate(rectangle(2, 3))
    made = Jointed(sets, {"fault": [[(1.0, -1.0), (1.1, 4.0)]]}).tessellate(rectangle(2, 3))
    assert length_of(before, "bedding") > 3.9
    assert length_of(made, "bedding") == pytest.approx(length_of(before, "bedding"))
    assert length_of(made, "fault") == pytest.approx(np.hypot(3, 0.06))


# --- joint sets ------------------------------------------------------------------------------------------------------

OBLIQUE = [JointSet(dip=20, spacing=0.5, name="bedding"), JointSet(dip=-35, spacing=0.6), JointSet(dip=80, spacing=0.7)]


def test_oblique_sets_leave_no_slivers():
    region = rectangle(20, 20)
    slivers, made = (JointSets(sets=OBLIQUE, merge=m).tessellate(region) for m in (0, 0.05))
    assert slivers.areas.min() < 1e-6 * np.median(slivers.areas)
    assert slivers.edges.length.min() < 0.001 * 0.5
    assert made.edges.length.min() > 0.05 * 0.5
    assert made.areas.min() > 1e-3 * np.median(made.areas)
    assert_tiles(made)


def test_sets_have_names_and_the_first_stays_straight():
    made = JointSets(sets=OBLIQUE, merge=0.05).tessellate(rectangle(20, 20))
    assert tuple(made.joints) == ("bedding", "set 2", "set 3")
    assert not (made.edges.kind == 0)[made.edges.right >= 0].any()
    e = made.edges
    along = (made.vertices[e.end] - made.vertices[e.start])[e.kind == 2]
    turned = (np.degrees(np.arctan2(along[:, 1], along[:, 0])) - 20 + 90) % 180 - 90
    assert abs(turned).max() < 1e-6


def test_sets_that_meet_at_right_angles_stay_as_they_are():
    sets = [JointSet(dip=0, spacing=0.5), JointSet(dip=90, spacing=1)]
    plain, merged = (JointSets(sets=sets, merge=m).tessellate(rectangle(5, 3)) for m in (0, 0.05))
    assert np.array_equal(plain.vertices, merged.vertices)
    assert np.array_equal(plain.corners, merged.corners)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Jointed(Bricks(), {}), "traces = {} is not allowed, it must be a mapping"),
        (lambda: Jointed(Bricks(), [[(0, 0), (1, 1)]]), "traces = .* is not allowed, it must be a mapping"),
        (lambda: Jointed(Bricks(), {"inside": [[(0, 0), (1, 1)]]}), "name = 'inside' is not allowed"),
        (lambda: Jointed(Bricks(), {"a": []}), r"traces of a = \[\] is not allowed"),
        (lambda: Jointed(Bricks(), {"a": [[(0, 0)]]}), "trace 0 of a = .* is not allowed, it must be two or more"),
        (lambda: Jointed(Bricks(), {"a": [[(0, 0), (0, 0)]]}), "each different from the one before"),
        (lambda: Jointed(Bricks(), {"a": [[(0, 0), (1, 1)], [(0, np.nan), (1, 1)]]}), "trace 1 of a = .* is not"),
        (lambda: JointSets(sets=[attrs.evolve(OBLIQUE[0])] * 2), "names = .* is not allowed, it must be different"),
        (lambda: JointSets(sets=[attrs.evolve(OBLIQUE[0], name="inside")]), "names = .* is not allowed"),
        (lambda: JointSets(sets=OBLIQUE, merge=0.5), "merge = 0.5 spacings is not allowed"),
        (lambda: JointSet(dip=0, spacing=0.01, through=(np.nan, 0)), "JointSet: through = .*nan.* is not allowed"),
    ],
)
def test_what_is_refused(make, words):
    with pytest.raises(ParameterError, match=words):
        make()


@pytest.mark.parametrize(
    ("dip", "through", "areas"),
    [
        (0, (3, 0.2), [0.2, 0.5, 0.3]),
        (90, (0.3, 7), [0.2, 0.5, 0.3]),  # from right to left
        (45, (0.75, 1.25), [0.125, 0.375, 0.375, 0.125]),  # y - x = -1/2, 0 and 1/2
    ],
)
def test_a_square_between_the_joints_of_a_set(dip, through, areas):
    spacing = 0.5 if dip != 45 else 0.5 / np.sqrt(2)
    strips = JointSet(dip=dip, spacing=spacing, through=through).cut([(0, 0), (1, 0), (1, 1), (0, 1)], 1e-9)
    assert [shoelace(np.array(strip)) for strip in strips] == pytest.approx(areas)


def test_a_trace_that_comes_back_cuts_a_grain_twice():
    square, chords = [[[(0, 0), (1, 0), (1, 1), (0, 1)]]], [((0, 0.3), (1, 0.3)), ((1, 0.7), (0, 0.7))]
    assert cut_by(square, np.array([(-1, 0.3), (2, 0.3), (2, 0.7), (-1, 0.7)]), 1e-9) == [
        tuple(pytest.approx(end) for end in chord) for chord in chords
    ]
    assert sorted(shoelace(np.array(part)) for part in square[0]) == pytest.approx([0.3, 0.3, 0.4])


@pytest.mark.parametrize(("height", "count"), [(0.25, 2), (0.24, 1)])
def test_a_thin_triangle_that_a_trace_leaves_vanishes_below_half_of_an_edge_by_a_grain_size(height, count):
    """Cut off a brick of 4 m by 1 m, whose size is 2 m: the limit is 0.49 m2 for a merge of 0.245."""
    trace = [(-4, 2 * height), (4, 0)]
    made = Jointed(Bricks(rows=1, columns=1), {"fault": [trace]}, merge=0.245).tessellate(rectangle(4, 1))
    assert made.count == count


def test_cracks_of_a_joint_have_its_name(tmp_path):
    """Pulled across, a plate breaks in its weak joint alone; saved, read, chosen, and by number in the table."""
    made = Jointed(Voronoi(grains=20, seed=1), {"fault": [[(-1.0, 0.02), (1.0, 0.02)]]})
    specimen = gl.Specimen(made.tessellate(rectangle(0.02, 0.04)), ROCK)
    bond = MohrCoulomb(kn=1e14, ks=1e14, tensile_strength=13e6, cohesion=29e6, friction_angle=50)
    law = {"fault": attrs.evolve(bond, tensile_strength=1e6), ...: bond}
    pull = UniaxialTension(loading=gl.Constant(speed=0.05), maximum_strain=1e-4, samples=40)
    result = gl.simulate(specimen, law, pull, checkpoint=tmp_path / "run", progress=False)
    assert len(result.cracks)
    assert set(result.cracks.kind) == {"fault"}
    assert len(result.cracks[result.cracks.kind == "between"]) == 0
    result.save(tmp_path / "run.npz")
    assert gl.Result.load(tmp_path / "run.npz").cracks.kind.tolist() == result.cracks.kind.tolist()
    head, *rows = (tmp_path / "run" / "cracks.csv").read_text().splitlines()
    assert {row.split(",")[head.split(",").index("kind")] for row in rows} == {
        str(specimen.grains.kinds.index("fault"))
    }


def test_a_set_without_a_joint_in_the_region_is_told():
    """Spaced by 5 m in 20 mm; one joint that goes through is what one may ask for."""
    region = rectangle(0.02, 0.04)
    with pytest.warns(
        UnitWarning, match=r"JointSets: no joint of JointSet\(dip=30 deg, spacing=5 m.* is left in the region"
    ):
        JointSets(sets=[JointSet(dip=30, spacing=5.0, through=(1.0, 1.0))]).tessellate(region)
    with pytest.warns(UnitWarning, match="is left in the region"):  # a tenth of the spacing may vanish
        JointSets(sets=[JointSet(dip=0, spacing=5.0, through=(0, 0.02))]).tessellate(region)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        one = JointSets(sets=[JointSet(dip=0, spacing=0.03, through=(0, 0.02))]).tessellate(region)
    assert one.count == 2


def test_contact_points_of_a_joint_lie_on_it_with_what_they_bear():
    """From bottom to top, 3 mm apart from the left side then 7 mm; slip may count from the second stage on."""
    trace = [(3 * mm, -1 * mm), (7 * mm, 21 * mm)]
    grains = Jointed(Voronoi(grains=30, seed=2), {"fault": [trace]}).tessellate(rectangle(10 * mm, 20 * mm))
    law = MohrCoulomb(kn=1e14, ks=5e13, tensile_strength=1e9, cohesion=1e9, friction_angle=30)
    test = BiaxialCompression(confinement=5e6, maximum_strain=2e-4, samples=20)
    result = gl.simulate(gl.Specimen(grains, ROCK), {"fault": attrs.evolve(law, kn=1e13), ...: law}, test)
    points, before = result.contact_points(), result.frame_before("", "axial").bonds
    assert {len(row) for row in points.values()} == {2 * len(result.mesh.interfaces)}
    fault = points["kind"] == "fault"
    along = np.subtract(trace[1], trace[0]) / np.hypot(*np.subtract(trace[1], trace[0]))
    away = (points["x"] - trace[0][0]) * along[1] - (points["y"] - trace[0][1]) * along[0]
    assert np.abs(away[fault]).max() < 1e-9
    assert points["angle"][fault] == pytest.approx(np.arctan2(along[1], along[0]))
    assert points["length"][fault].sum() == pytest.approx(20 * mm / along[1])
    pairs = {tuple(sorted(pair)) for pair in result.mesh.interface_grains.tolist()}
    assert {tuple(sorted(pair)) for pair in zip(points["grain_a"], points["grain_b"], strict=True)} == pairs
    sides = grains.centroids[np.stack([points["grain_a"], points["grain_b"]])][:, fault] - trace[0]
    assert np.all(np.prod(sides[..., 0] * along[1] - sides[..., 1] * along[0], axis=0) < 0)  # one on either side
    assert np.array_equal(points["normal"], result.frames[-1].bonds["normal"])
    since = result.contact_points(since="axial")
    assert np.array_equal(since["slip"], points["slip"] - before["slip"])
    assert np.array_equal(since["opening"], points["opening"] - before["opening"])
    assert np.array_equal(since["shear"], points["shear"])
    assert np.array_equal(result.contact_points(0)["slip"], result.frames[0].bonds["slip"])
