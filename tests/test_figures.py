"""Pictures as parts: they show in a notebook, take axes, keep one scale, and move."""

import io
import subprocess
import sys
from types import SimpleNamespace

import attrs
import matplotlib.figure
import numpy as np
import pytest
from matplotlib.collections import LineCollection
from matplotlib.image import imread
from PIL import Image
from support import BRITTLE, PULL, small_sample

import grainlaw as gl
from grainlaw.drawing.figure import Figure, draw_legend
from grainlaw.drawing.grains import _told_apart, phase_legend
from grainlaw.drawing.palette import BLUE, COLORS, VERMILLION
from grainlaw.geometry import Bricks, rectangle
from grainlaw.results.acoustic import KINDS
from grainlaw.results.figures.cracks import box, fit, how_far, outlines, unit_of
from grainlaw.results.figures.curves import _begins_at_zero
from grainlaw.results.figures.laboratory import PANELS, _from_zero

BRICK = gl.Rigid(density=2700)


@pytest.fixture(scope="module")
def broken():
    """A sample that has been pulled in two."""
    return gl.simulate(small_sample(), BRITTLE, PULL, frames=4)


@pytest.fixture(scope="module")
def path():
    return gl.trace(BRITTLE, opening=np.linspace(0, 1e-6, 5), slip=np.linspace(0, 2e-6, 5))


# --- in a notebook ---------------------------------------------------------------------------------------------------


def test_a_figure_shows_itself_as_a_picture_of_its_size(broken):
    figure = gl.plot_cracks(broken)
    width, height = figure.get_size_inches() * figure.dpi
    shown = imread(io.BytesIO(figure._repr_png_()))
    assert shown.shape[:2] == pytest.approx((height, width), abs=1)
    assert shown[..., :3].std() > 0.01


@pytest.mark.thorough
def test_no_picture_needs_pyplot(tmp_path):
    """It keeps every figure that it makes, and chooses a window system."""
    code = (
        "import sys, grainlaw as gl\nfrom grainlaw.geometry import Hexagonal, rectangle\n"
        "figure = Hexagonal(grains=12).tessellate(rectangle(1, 1)).plot()\nassert figure._repr_png_()\n"
        "import grainlaw.results.figures.cracks, matplotlib.animation, grainlaw.studies.figures\n"
        "assert 'matplotlib.pyplot' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True, timeout=120)


# --- axes ------------------------------------------------------------------------------------------------------------

PICTURES = {
    "cracks": lambda result, path, **ax: gl.plot_cracks(result, -1, **ax),
    "curves": lambda result, path, **ax: gl.plot_curves(result, **ax),
    "specimen": lambda result, path, **ax: result.specimen.plot(**ax),
    "grains": lambda result, path, **ax: result.specimen.grains.plot("area", **ax),
    "path": lambda result, path, **ax: path.plot(**ax),
}


@pytest.mark.parametrize("draw", PICTURES.values(), ids=PICTURES)
def test_a_picture_is_drawn_on_the_axes_given_or_on_a_figure_of_its_own(broken, path, draw):
    mine = matplotlib.figure.Figure()
    left, right = mine.subplots(1, 2)
    assert draw(broken, path, ax=right) is mine
    assert right.has_data()
    assert not left.has_data()
    own = draw(broken, path)
    assert isinstance(own, Figure)
    assert own.axes[0].has_data()
    with pytest.raises(gl.ParameterError, match="ax = 3 is not allowed, it must be axes of matplotlib"):
        draw(broken, path, ax=3)


@pytest.mark.parametrize("panel", list(PANELS))
def test_a_panel_of_the_laboratory_is_drawn_alone(broken, panel):
    whole = matplotlib.figure.Figure()
    axes = whole.add_subplot(projection="polar" if panel == "rose" else None)
    assert broken.laboratory.plot(panel, ax=axes) is whole
    assert axes.has_data() or axes.texts
    assert len(broken.laboratory.plot(panel).axes) == 1


def drawn(laboratory, panel):
    return laboratory.plot(panel).axes[0]


def test_panels_show_the_numbers_of_the_laboratory(broken):
    """Lengths in mm, both ways round the rose; circles as large as the energy of their events; losses of all."""
    laboratory, cracks = broken.laboratory, broken.cracks
    lengths = [1e3 * cracks.length[chosen].sum() for chosen in (cracks.tensile, ~cracks.tensile)]
    growth = drawn(laboratory, "growth")
    assert [line.get_ydata()[-1] for line in growth.lines] == pytest.approx(lengths)
    assert growth.lines[0].get_xdata()[-1] == pytest.approx(100 * broken.curves["strain"][-1])
    assert growth.get_ylim()[0] == 0
    assert growth.get_ylim()[1] > lengths[0]
    tensile, shear, *opposite = drawn(laboratory, "rose").containers
    assert [sum(bar.get_height() for bar in bars) for bars in (tensile, shear)] == pytest.approx(lengths)
    assert [bar.get_y() for bar in shear] == pytest.approx([bar.get_height() for bar in tensile])
    assert [bar.get_x() for bar in opposite[0]] == pytest.approx([bar.get_x() + np.pi for bar in tensile])
    assert [bar.get_x() for bar in tensile][:2] == pytest.approx([0, np.radians(10)], abs=1e-12)
    events, shown = laboratory.events, drawn(laboratory, "events").collections[2:]
    circles, planes = shown[::2], shown[1::2]
    counts = [np.sum(events.kind == kind) for kind in KINDS]
    assert [len(each.get_offsets()) for each in circles] == counts
    assert [len(each.get_segments()) for each in planes] == [2 * count for count in counts]
    mechanisms = drawn(laboratory, "mechanisms")
    points = np.concatenate([np.array(each.get_offsets()) for each in mechanisms.collections[::2]])
    assert np.sort(points[:, 1]) == pytest.approx(np.sort(events.isotropic))
    assert [text.get_text() for text in mechanisms.get_legend().get_texts()] == [
        f"{kind}: {count}" for kind, count in zip(KINDS, counts, strict=True)
    ]
    sums = [line.get_ydata()[-1] for line in drawn(laboratory, "moments").lines]
    assert sums == pytest.approx([1e-3 * events.scalar_moment[events.kind == kind].sum() for kind in KINDS])
    sizes = np.concatenate([each.get_sizes() for each in circles])
    assert np.sort(sizes) == pytest.approx(np.sort(400 * events.energy / events.energy.max()))
    assert np.concatenate([np.array(each.get_offsets()) for each in circles]).sum(axis=0) == pytest.approx(
        1e3 * events.position.sum(axis=0)
    )
    lost = drawn(laboratory, "lost")
    assert [line.get_ydata()[-1] for line in lost.lines] == pytest.approx(laboratory.energy_lost.sum(axis=1))
    assert len(lost.lines[0].get_xdata()) == len(broken.frames)
    fragments = laboratory.fragments
    several, alone = (fragments.grains > 1).sum(), (fragments.grains == 1).sum()
    shown = drawn(laboratory, "fragments")
    assert shown.get_title() == f"{several + alone} fragments, {several} of several grains\n(single grains white)"
    place = 1e3 * (broken.mesh.nodes + broken.frames[-1].displacement)
    zones = np.array([path.vertices[:3] for path in shown.collections[0].get_paths()])
    assert zones == pytest.approx(place[broken.mesh.zones])
    white = np.all(shown.collections[0].get_facecolor()[:, :3] == 1, axis=1)
    assert (
        white.sum() == np.isin(fragments.of_grain[broken.mesh.zone_grain], np.flatnonzero(fragments.grains == 1)).sum()
    )


def test_an_axis_of_zeros_is_shown_to_one():
    axes = matplotlib.figure.Figure().subplots(3)
    for each, top in zip(axes, (0.0, 5.0, -1.0), strict=True):
        each.plot([0, 1], [0, top], label="energy")
        _from_zero(each, "x", "y")
    assert [each.get_ylim()[0] for each in axes] == [0, 0, 0]
    assert (axes[0].get_ylim()[1], axes[2].get_ylim()[1]) == (1, 1)
    assert 5 <= axes[1].get_ylim()[1] < 6


def test_a_panel_of_no_cracks_says_so_and_invents_no_range():
    sound = gl.simulate(small_sample(12), BRITTLE, attrs.evolve(PULL, maximum_strain=2e-5), frames=1).laboratory
    assert sound.plot("rose").axes[0].get_xlabel() == "no cracks"
    assert not len(sound.plot("rose").axes[0].get_yticks())
    assert sound.plot("events").axes[0].get_title() == "no acoustic events"
    strain = sound.result.curves["strain"] * 100
    assert sound.plot("mechanisms").axes[0].get_xlim() == pytest.approx((strain[0], strain[-1]))
    assert sound.plot("fragments").axes[0].get_title().startswith("1 fragment, ")


def test_an_axis_begins_at_zero_unless_that_cuts_off_what_is_seen_on_the_other_axis():
    """A first wave below zero is cut off; a joint that is closed by a tenth of its opening under pressure is not."""
    up = np.linspace(0, 5, 50)
    assert _begins_at_zero(np.append(-0.05, up), np.append(0.01, up))
    assert not _begins_at_zero(np.append(up, -0.05), np.append(up, -10.0))
    assert not _begins_at_zero(np.append(up, -0.5), np.append(up, 1.0))


def test_a_flat_specimen_has_a_flat_picture_and_one_number_along_its_short_side():
    thin = Bricks(rows=1, columns=30).tessellate(rectangle(0.2, 0.004)).plot()
    assert thin.get_figheight() < 2 < thin.get_figwidth()
    assert [text.get_text() for text in thin.axes[0].get_yticklabels()] == ["4"]
    square = Bricks(rows=3, columns=3).tessellate(rectangle(0.2, 0.2)).plot()
    assert (square.get_figheight(), len(square.axes[0].get_yticklabels()) > 3) == (7, True)


def test_a_legend_of_many_names_lies_below_the_picture():
    for count, inside in ((6, True), (12, False)):
        figure = Figure(layout="constrained")
        axes = figure.subplots()
        for k in range(count):
            axes.plot([0, 1], [0, k], label=f"a law with a long name of many words, number {k}")
        draw_legend(axes)
        assert (axes.get_legend() is not None, len(figure.legends)) == (inside, not inside)


def test_a_panel_that_does_not_exist_is_refused(broken):
    with pytest.raises(gl.ParameterError, match=r"panel = 'cracks' is not allowed, it must be thresholds, growth, "):
        broken.laboratory.plot("cracks")
    with pytest.raises(gl.ParameterError, match=r"panel = None is not allowed"):
        broken.laboratory.plot(ax=matplotlib.figure.Figure().subplots())
    with pytest.raises(gl.ParameterError, match=r"it must be polar axes"):
        broken.laboratory.plot("rose", ax=matplotlib.figure.Figure().subplots())


def test_axes_of_a_part_of_a_figure_return_the_whole_figure(broken):
    whole = matplotlib.figure.Figure()
    part = whole.subfigures(1, 2)[0]
    assert gl.plot_cracks(broken, ax=part.subplots()) is whole


# --- curves ----------------------------------------------------------------------------------------------------------


def test_curves_have_the_units_that_their_axes_name(broken):
    axes = gl.plot_curves(broken).axes[0]
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("axial strain (%)", "axial stress (MPa)")
    x, y = axes.lines[0].get_data()
    assert np.allclose(x, broken.curves["strain"] * 100)
    assert np.allclose(y, broken.curves["stress"] / 1e6)
    other = gl.plot_curves(broken, "energy_kinetic", "time").axes[0]
    assert (other.get_xlabel(), other.get_ylabel()) == ("time (s)", "energy kinetic (J/m)")
    assert np.array_equal(other.lines[0].get_ydata(), broken.curves["energy_kinetic"])


def test_curves_of_several_laws_differ_in_colour_and_in_line(broken):
    axes = gl.plot_curves({"a": broken, "b": broken, "c": broken}).axes[0]
    whole = [line for line in axes.lines if line.get_marker() != "o"]  # no mark of a strength
    looks = [(line.get_color(), line.get_linestyle()) for line in whole]
    assert [color for color, _ in looks] == list(COLORS[:3])
    assert len({style for _, style in looks}) == 3
    assert [text.get_text() for text in axes.get_legend().get_texts()] == ["a", "b", "c", "strength"]


def test_results_in_a_list_are_named_by_their_laws(broken):
    axes = gl.plot_curves([broken, broken]).axes[0]
    assert [text.get_text() for text in axes.get_legend().get_texts()] == ["MohrCoulomb", "MohrCoulomb (2)", "strength"]


# --- cracks ----------------------------------------------------------------------------------------------------------


def segments(axes, color):
    """(k, 2, 2) mm, the lines of one colour."""
    wanted = tuple(int(color[k : k + 2], 16) / 255 for k in (1, 3, 5))
    lines = [each for each in axes.collections if isinstance(each, LineCollection)]
    chosen = [each for each in lines if np.allclose(each.get_color()[0][:3], wanted)]
    return np.array([line for each in chosen for line in each.get_segments()]).reshape(-1, 2, 2)


def test_crack_segments_lie_where_the_cracks_are_between_their_grains(broken):
    """Each in the order of the cracks, through the place of its contact point, as long as its half of the interface."""
    found, cracks = broken.crack_segments(), broken.cracks
    assert len(found) == len(cracks) > 5
    along = found[:, 1] - found[:, 0]
    length = np.hypot(*along.T)
    to = cracks.position - found[:, 0]
    share = np.sum(to * along, axis=1) / length**2
    assert np.all((share > 0) & (share < 1))
    assert np.abs(to[:, 0] * along[:, 1] - to[:, 1] * along[:, 0]).max() < 1e-9 * length.max()
    assert np.allclose(length, cracks.length, rtol=0.05)
    grain = broken.mesh.node_grain[broken.interfaces]
    assert np.array_equal(grain[:, 0], grain[:, 1])
    assert np.array_equal(grain[:, 2], grain[:, 3])
    assert np.all(grain[:, 0] != grain[:, 2])


def test_the_start_of_an_interface_is_one_place_of_both_grains(broken):
    """Drawn from a node of one grain to the wrong one of the other, a crack would cross the grain."""
    nodes = broken.mesh.nodes[broken.interfaces]
    assert np.allclose(nodes[:, 0], nodes[:, 2])
    assert np.allclose(nodes[:, 1], nodes[:, 3])


def test_a_frame_shows_the_cracks_that_it_has(broken):
    counts = [len(broken.crack_segments(k)) for k in range(len(broken.frames))]
    assert counts[0] < counts[-1]
    assert counts == [np.sum(broken.cracks.time <= frame.time) for frame in broken.frames]
    for k in (0, -1):
        axes = gl.plot_cracks(broken, k).axes[0]
        assert len(segments(axes, VERMILLION)) + len(segments(axes, BLUE)) == counts[k]
    with pytest.raises(gl.ParameterError, match=r"plot_cracks: frame = 99 is not allowed"):
        gl.plot_cracks(broken, 99)


def test_tensile_and_shear_cracks_differ_where_a_page_is_printed_grey(broken):
    tensile, shear = gl.plot_cracks(broken).axes[0].get_legend_handles_labels()[0][::-1]
    assert shear.get_linewidth() > 1.5 * tensile.get_linewidth()


def test_the_outline_of_grains_is_drawn_and_no_side_of_a_zone_inside():
    """Of eight bricks, the sides of each; node pairs belong to one grain."""
    mesh = gl.Specimen(Bricks(rows=4, columns=2).tessellate(rectangle(0.02, 0.04)), BRICK, refinement=2).mesh
    pairs = outlines(SimpleNamespace(mesh=mesh))
    grain = mesh.node_grain[pairs]
    assert np.array_equal(grain[:, 0], grain[:, 1])
    length = np.hypot(*(mesh.nodes[pairs[:, 1]] - mesh.nodes[pairs[:, 0]]).T)
    assert np.bincount(grain[:, 0], length) == pytest.approx(np.full(8, 4 * 0.01))
    assert len(np.unique(np.sort(pairs, axis=1), axis=0)) == len(pairs)


def test_the_number_of_cracks_stands_below_the_picture(broken):
    figure = gl.plot_cracks(broken)
    figure.draw_without_rendering()
    [axes] = figure.axes
    box, counts = axes.get_window_extent(), axes.get_legend().get_window_extent()
    assert counts.y1 < box.y0
    assert (counts.x0 + counts.x1) / 2 == pytest.approx((box.x0 + box.x1) / 2, abs=1)


def test_side_by_side_is_at_one_scale(broken):
    small = gl.simulate(small_sample(20), BRITTLE, PULL, frames=2)
    figure = gl.side_by_side({"one": broken, "other": small, "third": broken}, columns=2)
    limits = [(axes.get_xlim(), axes.get_ylim()) for axes in figure.axes]
    assert len(limits) == 3
    assert figure.axes[0].get_gridspec().get_geometry() == (2, 2)
    assert gl.side_by_side({"one": broken, "other": small}).axes[0].get_gridspec().get_geometry() == (1, 2)
    assert limits[0] == limits[1] == limits[2]
    assert [axes.get_title().split("\n")[0] for axes in figure.axes] == ["one", "other", "third"]
    figure.draw_without_rendering()
    boxes = [axes.get_window_extent() for axes in figure.axes]
    assert np.ptp([box.width for box in boxes]) < 1
    (left, right), (low, high) = limits[0]
    assert figure.get_size_inches()[0] > 2 * 6.0 * (right - left) / (high - low)  # two panels of 6 inches height
    for result, axes in zip((broken, small), figure.axes, strict=False):
        place = (result.mesh.nodes + result.frames[-1].displacement) * 1e3
        (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
        inside = (place > (left, low)) & (place < (right, high))
        assert inside.all()


@pytest.mark.parametrize("results", [{}, [], 3, {"a": 3}, [3]])
def test_what_is_no_result_is_refused(results):
    with pytest.raises(gl.ParameterError, match="side_by_side: results = "):
        gl.side_by_side(results)


# --- moving ----------------------------------------------------------------------------------------------------------


def test_phases_are_told_with_their_shares():
    """Of four equal bricks one is of the second mineral."""
    bricks = Bricks(rows=4, columns=1).tessellate(rectangle(0.02, 0.04))

    def told(**changes):
        return [patch.get_label() for patch in phase_legend(attrs.evolve(bricks, **changes))]

    assert told() == []
    assert told(phase=np.array([0, 0, 1, 0])) == ["0 75.0 %", "1 25.0 %"]
    assert told(phase_names=("quartz", "mica")) == ["quartz 100.0 %"]
    assert told(phase=np.array([2, 2, 0, 2])) == ["0 25.0 %", "2 75.0 %"]


def test_grains_that_share_an_edge_have_different_colours():
    grains = small_sample(60).grains
    number = np.array(_told_apart(grains))
    inner = grains.edges.right >= 0
    assert not np.any(number[grains.edges.left[inner]] == number[grains.edges.right[inner]])
    assert number.max() < 7


def test_a_moment_is_told_by_the_strain_or_else_by_the_time(broken):
    strain, time = (
        np.interp(broken.frames[1].time, broken.curves["time"], broken.curves[x]) for x in ("strain", "time")
    )
    assert how_far(broken, 1) == f"axial strain {100 * strain:.4f} %"
    assert how_far(attrs.evolve(broken, curves={}), 1) == f"time {1e3 * time:.4g} ms"


def test_a_little_room_is_left_around_what_is_shown():
    axes = matplotlib.figure.Figure().subplots()
    fit(axes, np.array([1.0, 2.0]), np.array([21.0, 42.0]))
    room = 0.03 * 40
    assert (*axes.get_xlim(), *axes.get_ylim()) == pytest.approx((1 - room, 21 + room, 2 - room, 42 + room))


@pytest.mark.thorough
def test_an_animation_has_a_picture_for_each_frame(broken, tmp_path):
    broken.animate(tmp_path / "cracks.gif", per_second=5)
    with Image.open(tmp_path / "cracks.gif") as film:
        assert film.n_frames == len(broken.frames)
        assert film.info["duration"] == 200
        sizes = set()
        for k in range(film.n_frames):
            film.seek(k)
            sizes.add(film.size)
    assert len(sizes) == 1
    assert list(tmp_path.iterdir()) == [tmp_path / "cracks.gif"]


@pytest.mark.parametrize(("size", "pixels"), [((2, 1), (1232, 682)), ((100, 1), (1232, 242)), ((1, 2), (489, 847))])
def test_an_animation_of_any_specimen_fits_a_screen(size, pixels, tmp_path):
    """The longer of 10 by 6.5 inches, and room for the axes."""
    specimen = gl.Specimen(Bricks(rows=2).tessellate(rectangle(*(1e-3 * each for each in size))), BRICK)
    result = gl.simulate(specimen, BRITTLE, PULL, frames=2, progress=False)
    attrs.evolve(result, frames=result.frames[:1]).animate(tmp_path / "cracks.gif")
    with Image.open(tmp_path / "cracks.gif") as film:
        assert film.size == pytest.approx(pixels, abs=1)


def test_an_animation_without_ffmpeg_says_so(broken, tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(gl.ParameterError, match=r"cracks\.mp4.* it must be a \.gif, because the program ffmpeg"):
        broken.animate(tmp_path / "cracks.mp4")
    with pytest.raises(gl.ParameterError, match=r"ends in \.gif or \.mp4"):
        broken.animate(tmp_path / "cracks.avi")
    assert not list(tmp_path.iterdir())


def test_what_flew_far_is_left_out_of_the_box():
    """A specimen of 20 x 40 mm, of which one grain is a metre away: 0.3 of its larger side is shown beside it."""
    made = gl.simulate(small_sample(12), BRITTLE, PULL, frames=1, progress=False)
    made.frames[-1].displacement[0] = (-1.0, 1.0)
    low, high = box(made, [-1], unit_of(made))
    assert low[0] == pytest.approx(-0.3 * 40)
    assert high[1] == pytest.approx(1.3 * 40)
    assert -1 < low[1] < 1
    assert 19 < high[0] < 21
    nodes = np.array([(0.1, 0.2), (0.12, 0.24)])  # wherever the specimen lies
    far = SimpleNamespace(displacement=np.array([(-1.0, 0.0), (0.0, 1.0)]))
    elsewhere = SimpleNamespace(specimen=SimpleNamespace(grains=SimpleNamespace(vertices=nodes)), frames=[far],
                                mesh=SimpleNamespace(nodes=nodes), frame=lambda who, number: far)  # fmt: skip
    assert box(elsewhere, [-1], unit_of(elsewhere)) == pytest.approx(
        np.array([(100 - 0.3 * 40, 200), (120, 200 + 1.3 * 40)])
    )
