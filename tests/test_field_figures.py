"""Fields on a specimen, by displacements and stresses whose values are known; and what results say of themselves."""

import attrs
import matplotlib.figure
import numpy as np
import pytest
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.quiver import Quiver
from support import BRITTLE, PULL, small_sample

import grainlaw as gl
from grainlaw.drawing.grains import FILLS
from grainlaw.geometry import Bricks, rectangle
from grainlaw.laws import Linear
from grainlaw.results.crack_pattern import FailurePlane, Rose
from grainlaw.results.figures.fields import BOTH_SIGNS, ONE_SIGN
from grainlaw.results.fragments import Fragments
from grainlaw.results.result import Cracks

GRADIENT = np.array([[2e-4, 1e-4], [-3e-4, 5e-4]])  #: du_i/dx_j
STRESS = np.array([-20e6, -40e6, 5e6])
#: by Mohr's circle: middle -30 MPa, radius sqrt(10^2 + 5^2)
LARGER, SMALLER = -30 + np.sqrt(125), -30 - np.sqrt(125)
ANGLE = 0.5 * np.arctan2(2 * 5, 20)  #: of the larger one


@pytest.fixture(scope="module")
def made():
    """Two minerals in six bricks; a stage after which nothing had moved, and one with known fields."""
    bricks = attrs.evolve(
        Bricks(rows=3, columns=2).tessellate(rectangle(0.02, 0.03)), phase=np.array([0, 1, 0, 1, 0, 1]),
        phase_names=("quartz", "mica"),
    )  # fmt: skip
    rock = gl.Elastic(youngs_modulus=60e9, poissons_ratio=0.25, density=3100)
    specimen = gl.Specimen(bricks, {"quartz": rock, "mica": rock})
    result = gl.simulate(specimen, Linear(kn=1e14, ks=1e14), attrs.evolve(PULL, samples=10), frames=2)
    first = attrs.evolve(
        result.frames[0], stage="before", displacement=np.tile([1e-5, 2e-5], (len(result.mesh.nodes), 1)),
        stress=np.tile([1e6, 2e6, 0.0], (6, 1)),
    )  # fmt: skip
    last = attrs.evolve(
        result.frames[-1], stage="after", displacement=first.displacement + result.mesh.nodes @ GRADIENT.T,
        stress=np.tile(STRESS, (6, 1)), time=3e-3,
    )  # fmt: skip
    return attrs.evolve(result, frames=[first, last])


def shown(figure):
    """Values in colours, and the words beside them."""
    axes, bar = figure.axes
    return np.array(axes.collections[0].get_array()), bar.get_ylabel()


def test_displacements_are_those_of_the_nodes(made):
    moved = made.mesh.nodes @ GRADIENT.T
    values, words = shown(gl.plot_field(made, "displacement", since="after"))
    assert words == "displacement since after (µm)"
    assert values == pytest.approx(1e6 * np.hypot(*moved.T))
    whole, words = shown(gl.plot_field(made, "displacement_y"))
    assert words == "displacement along y (µm)"
    assert whole == pytest.approx(20 + 1e6 * moved[:, 1])
    assert shown(gl.plot_field(made, "displacement_x", frame=0, since="before"))[0] == pytest.approx(10)


@pytest.mark.parametrize(
    ("field", "value"),
    [("stress_1", LARGER), ("stress_2", SMALLER), ("stress_xx", -20), ("stress_yy", -40), ("stress_xy", 5)],
)
def test_stresses_are_those_of_the_circle_of_mohr(made, field, value):
    values, words = shown(gl.plot_field(made, field))
    assert words.endswith(", tension positive (MPa)")
    assert values == pytest.approx(np.full(len(made.mesh.zones), value))


def test_a_change_of_stress_has_principal_values_of_its_own(made):
    """Of (-21, -42, 5) MPa, not the difference of principal values."""
    values, words = shown(gl.plot_field(made, "stress_1", since="after"))
    assert words == "stress 1, tension positive since after (MPa)"
    assert values == pytest.approx(np.full(len(made.mesh.zones), -31.5 + np.hypot(10.5, 5)))


def test_a_rotation_is_half_the_curl(made):
    """(dv/dx - du/dy) / 2 to the first order: -2e-4; the translation before does not turn."""
    values, words = shown(gl.plot_field(made, "rotation"))
    assert words == "rotation (rad)"
    assert values == pytest.approx(np.full(len(made.mesh.zones), (-3e-4 - 1e-4) / 2), rel=1e-3)


def test_arrows_are_means_of_grains(made):
    """In bricks these are the displacements of their centroids, in a linear field; the key is a round length."""
    axes = gl.plot_field(made, "displacement", since="after", vectors=True).axes[0]
    [arrows] = [each for each in axes.collections if isinstance(each, Quiver)]
    wanted = made.specimen.grains.centroids @ GRADIENT.T
    assert np.sort(arrows.U) == pytest.approx(np.sort(wanted[:, 0]), abs=1e-12)
    assert np.sort(arrows.V) == pytest.approx(np.sort(wanted[:, 1]), abs=1e-12)
    [key] = [each for each in axes.get_children() if hasattr(each, "label") and hasattr(each, "text")]
    assert key.text.get_text() == "10 µm"


def test_crosses_lie_along_the_principal_stresses(made):
    axes = gl.plot_field(made, "stress_1", vectors=True).axes[0]
    larger, smaller = [np.array(each.get_segments()) for each in axes.collections if isinstance(each, LineCollection)][
        -2:
    ]
    ways = [np.diff(lines, axis=1)[:, 0] for lines in (larger, smaller)]
    for way, angle, size in zip(ways, (ANGLE, ANGLE + np.pi / 2), (LARGER, SMALLER), strict=True):
        assert np.arctan2(*way.T[::-1]) % np.pi == pytest.approx(np.full(len(way), angle))
        assert np.hypot(*way.T) == pytest.approx(np.full(len(way), np.hypot(*ways[1][0]) * size / SMALLER))


def test_minerals_are_shown_under_contacts_and_where_they_meet(made):
    figure = gl.plot_field(made, "normal", phases=True)
    grains = [each for each in figure.axes[0].collections if isinstance(each, PolyCollection)]
    assert [each.get_label() for each in grains] == ["quartz 50.0 %", "mica 50.0 %"]
    pale = [1 - 0.45 * (1 - np.array(matplotlib.colors.to_rgb(c))) for c in FILLS[:2]]  # cracks are seen on them
    assert np.array([each.get_facecolor()[0, :3] for each in grains]) == pytest.approx(np.array(pale))
    assert [text.get_text() for text in figure.axes[0].get_legend().get_texts()] == ["quartz 50.0 %", "mica 50.0 %"]
    dotted = gl.plot_field(made, "stress_1", phases=True).axes[0].collections[-2]
    phase = made.specimen.grains.phase[made.mesh.interface_grains]
    assert len(dotted.get_segments()) == 2 * np.count_nonzero(phase[:, 0] != phase[:, 1])
    cracks = gl.plot_cracks(made, phases=True).axes[0]
    assert "mica 50.0 %" in [text.get_text() for text in cracks.get_legend().get_texts()]


@pytest.mark.thorough
def test_colours_are_even_about_zero_where_there_are_both_signs(made):
    both = gl.plot_field(made, "displacement_y", since="after").axes[0].collections[0]
    assert both.norm.vmin == -both.norm.vmax
    assert gl.plot_field(made, "stress_1").axes[0].collections[0].get_cmap().name == ONE_SIGN


def test_a_stage_counts_from_the_last_frame_before_it(made):
    assert made.frame_before("a test", None) is made.frame_before("a test", "before") is None
    assert made.frame_before("a test", "after") is made.frames[0]


def test_a_place_has_moved_as_the_node_nearest_to_it(made):
    node = int(np.argmin(np.hypot(*(made.mesh.nodes - [0.02, 0.03]).T)))  # the upper right corner
    assert made.moved((0.02, 0.03), since="after") == pytest.approx(GRADIENT @ made.mesh.nodes[node])
    assert made.moved((0.0201, 0.0301), frame=0) == pytest.approx([1e-5, 2e-5])
    for options, words in (
        (
            {"place": (0.06, 0.01)},
            r"moved: place = \(0.06, 0.01\) is not allowed, it must be in the specimen, whose nearest node is at",
        ),
        ({"place": 5}, "moved: place = 5 is not allowed"),
        (
            {"place": (0, 0), "since": "never"},
            "moved: since = 'never' is not allowed.*a stage that frames have: before, after",
        ),
        ({"place": (0, 0), "frame": 2}, "moved: frame = 2 is not allowed"),
    ):
        with pytest.raises(gl.ParameterError, match=words):
            made.moved(**options)


def test_limits_are_those_of_the_colours(made):
    drawn = gl.plot_field(made, "stress_2", limits=(-80e6, 0)).axes[0].collections[0]
    assert (drawn.get_clim(), drawn.get_cmap().name) == ((-80, 0), ONE_SIGN)
    drawn = gl.plot_field(made, "stress_1", limits=(-10e6, 5e6)).axes[0].collections[0]
    assert (drawn.get_clim(), drawn.get_cmap().name) == ((-10, 5), BOTH_SIGNS)
    for wrong in ((0, -1e6), 5, (1,)):
        with pytest.raises(gl.ParameterError, match="plot_field: limits = "):
            gl.plot_field(made, "stress_2", limits=wrong)


def test_a_field_is_drawn_on_the_axes_given(made):
    mine = matplotlib.figure.Figure()
    axes = mine.subplots()
    assert gl.plot_field(made, "velocity", ax=axes) is mine
    last = f"after, axial strain {100 * made.curves['strain'][-1]:.4f} %"  # it is drawn over the strain
    assert (axes.get_xlabel(), axes.get_ylabel(), axes.get_title()) == ("x (mm)", "y (mm)", last)


def test_a_tunnel_of_metres_has_metres_and_millimetres():
    grains = Bricks(rows=3, columns=2).tessellate(rectangle(8.0, 12.0))
    rock = gl.Elastic(youngs_modulus=60e9, poissons_ratio=0.25, density=3100)
    whole = gl.simulate(gl.Specimen(grains, rock), Linear(kn=1e12, ks=1e12), attrs.evolve(PULL, samples=10), frames=2)
    moved = np.tile([2e-3, 0.0], (len(whole.mesh.nodes), 1))
    frame = attrs.evolve(whole.frames[-1], displacement=moved)
    figure = gl.plot_field(attrs.evolve(whole, frames=[frame]), "displacement_x")
    values, words = shown(figure)
    assert (values == pytest.approx(2.0), words) == (True, "displacement along x (mm)")
    of_contacts = gl.plot_field(attrs.evolve(whole, frames=[frame]), "opening")
    assert of_contacts.axes[1].get_ylabel().endswith("(µm)")  # which has not moved by millimetres
    wide = attrs.evolve(frame, bonds={**frame.bonds, "opening": np.full(len(frame.bonds["opening"]), 3e-3)})
    assert shown(gl.plot_field(attrs.evolve(whole, frames=[wide]), "opening"))[1].endswith("(mm)")
    axes = figure.axes[0]
    assert axes.get_ylabel() == "y (m)"
    assert axes.dataLim.height == pytest.approx(12, rel=0.01)


def test_cracks_since_a_stage_are_those_of_later_samples(made):
    """Of three at 1, 2 and 3 ms, where the stage begins after the sample of 1 ms."""
    one = np.array([1e-3, 2e-3, 3e-3])
    flat, pair = np.zeros(3), np.zeros((3, 2))
    cracks = Cracks(pair, flat, flat, flat, one, flat, flat, pair.astype(int), flat)
    curves = {"time": one, "stage": np.array([0, 1, 1])}
    found = attrs.evolve(made, cracks=cracks, curves=curves, stages=("stress", "excavate"))
    assert found.cracks_since("excavate").time.tolist() == [2e-3, 3e-3]
    assert len(found.cracks_since("stress")) == 3
    with pytest.raises(gl.ParameterError, match=r"cracks_since: stage = 'never' is not allowed.*: stress, excavate"):
        found.cracks_since("never")


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"field": "stress"}, "field = 'stress' is not allowed, it must be displacement, displacement_x, "),
        ({"field": "stress_1", "since": "later"}, "since = 'later' is not allowed, it must be .*: before, after"),
        ({"field": "velocity", "since": "after"}, "since = 'after' is not allowed, it must be None for velocity"),
        ({"field": "normal", "vectors": True}, "vectors = True is not allowed, it must be False for normal"),
        ({"field": "normal", "frame": 5}, "plot_field: frame = 5 is not allowed"),
    ],
)
def test_what_cannot_be_drawn_is_refused(made, options, says):
    with pytest.raises(gl.ParameterError, match=says):
        gl.plot_field(made, **options)


# --- what results say of themselves ----------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def broken():
    return gl.simulate(small_sample(), BRITTLE, PULL, frames=4)


def test_results_print_numbers_not_shapes(broken):
    events, pieces, rose = gl.acoustic_events(broken), gl.fragments(broken), gl.crack_rose(broken)
    path = gl.trace(BRITTLE, opening=np.linspace(0, 1e-6, 5), slip=0)
    for each in (events, pieces, rose, path, gl.failure_plane(broken)):
        assert "array of" not in repr(each)
    b, error = events.b_value()
    assert repr(events).endswith(f"b: {b:.2f} ± {error:.2f})") or np.isnan(b)
    assert repr(pieces).startswith(f"Fragments(fragments: {len(pieces)}, largest: {pieces.grains[0]} grains, ")
    assert repr(gl.failure_plane(broken)) == repr(gl.failure_plane(broken.cracks))
    assert rose.tensile.tolist() == gl.crack_rose(broken.cracks).tensile.tolist()
    assert repr(path).startswith("Trace(points: 5, opening: 0 m to 1 um, slip: 0 m, ")


def test_sizes_are_said_by_hand():
    made = Fragments(of_grain=np.array([0, 0, 1]), areas=np.array([3e-6, 1e-6]), grains=np.array([2, 1]))
    assert repr(made) == "Fragments(fragments: 2, largest: 2 grains, 75 % of the area, single grains: 1)"
    edges = np.linspace(0, np.pi, 3)
    rose = Rose(edges=edges, tensile=np.array([1e-3, 4e-3]), shear=np.array([2e-3, 1e-3]))
    assert repr(rose) == "Rose(tensile: 5 mm, shear: 3 mm, most: 90 to 180 deg, 62.5 %, bins: 2)"
    assert repr(FailurePlane(np.pi / 3, 0.5)) == "FailurePlane(angle: 60.0 deg from the x axis, alignment: 0.50)"


def test_cracks_are_parted_by_the_minerals_on_their_sides(broken):
    names = np.array([["mica", "quartz"], ["quartz", "quartz"], ["quartz", "mica"]])
    cracks = attrs.evolve(broken.cracks[np.arange(3)], phases=names)
    parts = cracks.by_pair()
    assert list(parts) == [("mica", "quartz"), ("quartz", "quartz")]
    assert [each.time.tolist() for each in parts.values()] == [cracks.time[[0, 2]].tolist(), cracks.time[[1]].tolist()]
    through = attrs.evolve(cracks, inside=np.array([False, True, False])).by_pair()
    assert list(through) == [("mica", "quartz"), ("inside", "quartz")]
    assert list(broken.cracks.by_pair()) == [("0", "0")]
    assert cracks.to_pandas()[["phase_a", "phase_b"]].to_numpy().tolist() == names.tolist()
    assert broken.cracks[np.zeros(0, int)].by_pair() == {}


def test_frames_know_where_their_nodes_are(broken, tmp_path):
    broken.save(tmp_path / "result.npz")
    for each in (broken, gl.Result.load(tmp_path / "result.npz")):
        nodes = each.frames[-1].to_pandas("nodes")
        assert nodes[["x", "y"]].to_numpy() == pytest.approx(broken.mesh.nodes)
        assert list(each.cracks.by_pair()) == [("0", "0")]
        assert each.panels == broken.panels
