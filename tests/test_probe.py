"""Followed contact points: the right ones, with their own laws, and paths that their laws walk alone as well."""

import operator

import attrs
import numpy as np
import pytest
from support import ROCK, STIFF, STRONG, small_sample, state_of

import grainlaw as gl
from grainlaw.engine.model import uniform
from grainlaw.geometry import Bricks, rectangle
from grainlaw.laws import BandisClosure, CohesiveCrack, Linear, MohrCoulomb
from grainlaw.protocols import UniaxialCompression, UniaxialTension
from grainlaw.results.figures.probe import _right, plot_paths
from grainlaw.results.probe import ContactPath
from grainlaw.units import mm
from grainlaw.workbench.law_figure import Reach

COHESIVE = CohesiveCrack(**STRONG, mode_i_energy=10, mode_ii_energy=20)
PULL = UniaxialTension(loading=gl.Constant(speed=0.05), maximum_strain=6e-4)


@pytest.fixture(scope="module")
def pulled():
    probe = gl.Probe(points=[5], places=[(10 * mm, 20 * mm)], first=3)
    result = gl.simulate(small_sample(), COHESIVE, PULL, observers=[probe])
    return probe, result, result.frames[0]


@pytest.mark.thorough
def test_points_are_chosen_by_number_place_and_break(pulled):
    probe, result, frame = pulled
    numbers = [path.point for path in probe.paths]
    assert numbers[0] == 5
    count = len(frame.bonds["opening"]) // 2
    ends = result.mesh.nodes[result.interfaces[numbers[1] % count]]
    first, second = (ends[0] + ends[2]) / 2, (ends[1] + ends[3]) / 2
    assert probe.paths[1].position == pytest.approx(
        first + (second - first) * (0.75 if numbers[1] >= count else 0.25), abs=1e-6
    )
    nodes = result.mesh.nodes[result.interfaces]
    middles = nodes.mean(axis=1)
    nearest = np.hypot(*(middles - (10 * mm, 20 * mm)).T).min()
    assert np.hypot(*(probe.paths[1].position - (10 * mm, 20 * mm))) < nearest + np.hypot(*(second - first)) / 4
    assert len(numbers) == 5


def test_the_first_to_break_are_the_first_cracks(pulled):
    probe, result, _ = pulled
    assert len(result.cracks) > 3
    assert len(probe.paths) == 2 + 3
    for k, path in enumerate(probe.paths[2:]):
        assert path.broken == result.cracks.time[k]
        assert path.grains == tuple(result.cracks.grains[k])
        assert path.mode == result.cracks.mode[k]
        assert path.opening[-1] == pytest.approx(result.cracks.opening[k], rel=1e-6)
        assert path.damage[path.unbroken] == 1
        assert path.damage[path.unbroken - 1] < 1


def test_a_path_has_every_sample_of_the_run(pulled):
    probe, result, _ = pulled
    for path in probe.paths:
        assert path.time == pytest.approx(result.curves["time"], rel=1e-12)


def test_the_law_alone_walks_the_same_path(pulled):
    for path in pulled[0].paths:
        before = path.unbroken
        alone = gl.trace(COHESIVE, path.opening[:before], path.slip[:before])
        # Between two samples the contact may turn back; what is not sampled is a small part of the strength.
        assert alone.normal == pytest.approx(path.normal[:before], abs=0.01 * 13e6)
        assert alone.shear == pytest.approx(path.shear[:before], abs=0.01 * 29e6)


@pytest.mark.thorough
def test_an_elastic_path_is_exact():
    probe = gl.Probe(points=[0, 7])
    gl.simulate(
        small_sample(),
        Linear(**STIFF),
        UniaxialCompression(loading=gl.Constant(speed=0.1), maximum_strain=2e-4),
        observers=[probe],
    )
    assert len(probe.paths) == 2
    for path in probe.paths:
        assert path.opening.any()
        assert path.slip.any()
        assert path.normal == pytest.approx(1.05e14 * path.opening, rel=1e-6)
        assert path.shear == pytest.approx(9.45e13 * path.slip, rel=1e-6)
        assert not path.damage.any()
        assert path.unbroken == len(path.time)


def test_every_point_is_given_up_once_the_first_have_broken(pulled):
    probe, _, _ = pulled
    rows = probe._run.rows
    assert {row.shape for row in rows} == {(5, 5)}
    assert rows[0].dtype == np.float32


@pytest.mark.thorough
def test_what_has_not_broken_is_not_among_the_first():
    probe = gl.Probe(first=2)
    short = attrs.evolve(PULL, maximum_strain=2e-5)
    gl.simulate(small_sample(), COHESIVE, short, observers=[probe])
    assert probe.paths == []
    assert str(probe) == "nothing was followed"


@pytest.mark.thorough
def test_a_probe_begins_anew_with_another_run():
    probe, law = gl.Probe(points=[1]), Linear(**STIFF)
    short = attrs.evolve(PULL, maximum_strain=2e-5)
    first = gl.simulate(small_sample(), law, short, observers=[probe])
    gl.simulate(small_sample(), law, short, observers=[probe])
    assert len(probe.paths[0].time) == len(first.curves["time"])


def test_a_point_has_the_law_of_its_phases_and_its_own_numbers():
    bricks = Bricks(rows=4, columns=1).tessellate(rectangle(10 * mm, 40 * mm))
    phases = attrs.evolve(bricks, phase=np.array([0, 0, 1, 1]))
    rock = gl.Specimen(phases, {0: ROCK, 1: ROCK})
    strengths = np.array([11e6, 12e6])  # of the two points of the one interface between grains of phase 1
    laws = {
        (0, 0): Linear(**STIFF), (0, 1): MohrCoulomb(**STRONG),
        (1, 1): MohrCoulomb(**STRONG | {"tensile_strength": strengths}),
    }  # fmt: skip
    probe = gl.Probe(points=range(6), places=[(7 * mm, 21 * mm)])
    probe.observe(state_of(rock, laws), {}, None, 0.0)
    assert len(probe.paths) == 6  # the place is that of one of them
    nearest = gl.Probe(places=[(7 * mm, 21 * mm)])
    nearest.observe(state_of(rock, laws), {}, None, 0.0)
    assert nearest.paths[0].position == pytest.approx([7.5 * mm, 20 * mm])
    assert nearest.paths[0].grains == (1, 2)
    found = {path.point: (path.grains, type(path.law).__name__, getattr(path.law, "tensile_strength", None)) for path in
             probe.paths}  # fmt: skip
    assert sorted(found.values(), key=str) == [
        ((0, 1), "Linear", None), ((0, 1), "Linear", None), ((1, 2), "MohrCoulomb", 13e6),
        ((1, 2), "MohrCoulomb", 13e6), ((2, 3), "MohrCoulomb", 11e6), ((2, 3), "MohrCoulomb", 12e6),
    ]  # fmt: skip
    second = {point for point, (_, _, strength) in found.items() if strength == 12e6}
    assert min(second) >= 3  # the second points come after all first ones


def test_parts_have_their_own_numbers_too():
    law = attrs.evolve(COHESIVE, closure=BandisClosure(maximum_closure=[1e-6, 2e-6]))
    assert uniform(law, operator.itemgetter(1)).closure.maximum_closure == 2e-6
    assert uniform(COHESIVE, operator.itemgetter(1)) == COHESIVE


def test_a_private_parameter_may_differ_between_contacts():
    @attrs.frozen(kw_only=True)
    class Private(gl.ContactLaw):
        _kn: float = gl.parameter("Pa/m")
        stiffness = property(lambda self: (self._kn, self._kn))

        def traction(self, opening, slip):
            return self._kn * opening, self._kn * slip

    assert uniform(Private(kn=np.array([1e13, 3e13]))).stiffness == (2e13, 2e13)


@pytest.mark.thorough
def test_the_verdict_says_how_and_how_nearly(pulled):
    probe = pulled[0]
    unbroken, broken = str(probe).splitlines()[0], str(probe.paths[2])
    assert "contact 5 between grains" in unbroken
    assert "did not break, damage 0, " in unbroken
    assert "in tension (share of shear 0.0" in broken
    assert "peak tension 13 of 13 MPa" in broken
    still = attrs.evolve(probe.paths[0], law=Linear(**STIFF), normal=-np.abs(probe.paths[0].normal))
    assert "did not break, opening" in str(still)
    assert "never in tension" in str(still)


#: 10 MPa at 0.1 um of opening; 20 MPa at 0.4 um of slip, 15 and 25 MPa under 5 MPa of tension and of pressure
HAND = MohrCoulomb(
    kn=1e14, ks=5e13, tensile_strength=10e6, cohesion=20e6, friction_angle=45, residual_friction_angle=45
)


def walked(**changed):
    """A path by hand: pulled and sheared, until it broke."""
    return ContactPath(**{
        "point": 5, "grains": (1, 2), "position": np.array([1e-3, 2.5e-3]), "law": HAND, "broken": 2e-3, "mode": 0.3,
        "time": np.array([0, 1, 2, 3]) * 1e-3, "opening": np.array([0, 0.5, 2, 0]) * 1e-7,
        "slip": np.array([0, -2, -3, 0]) * 1e-7, "normal": np.array([0, 5e6, 0, 9e6]),
        "shear": np.array([0, -10e6, 0, 19e6]), "damage": np.array([0, 0, 1, 1.0]), **changed,
    })  # fmt: skip


def test_a_verdict_by_hand():
    assert str(walked()).replace("9.999", "10") == (
        "contact 5 between grains 1 and 2 at (1.0, 2.5) mm: broke at 0.002 s in tension (share of shear 0.30), opening "
        "0.2 um, slip -0.3 um; peak tension 5 of 10 MPa, peak shear 10 of 15 MPa under a tension of 5 MPa"
    )
    assert "broke at 0.002 s in shear (share of shear 0.50)" in str(walked(mode=0.5))
    pressed = walked(
        broken=np.nan, mode=np.nan, normal=np.array([0, -5e6, 0, 0]), damage=np.array([0, 0, 0, 0.25]),
        shear=np.array([0, 10e6, 0, 0]), slip=np.array([0, 0, 0, 4e-7]),
    )  # fmt: skip
    assert str(pressed) == (
        "contact 5 between grains 1 and 2 at (1.0, 2.5) mm: did not break, damage 0.25, opening 0 um, slip 0.4 um; "
        "never in tension, peak shear 10 of 25 MPa under a pressure of 5 MPa"
    )
    assert "opening 0 um, slip 0 um; never in tension, peak shear 0 of 20 MPa under a pressure" in str(
        walked(broken=0.0)
    )


def test_axes_of_a_path_show_it_and_the_law():
    """The law is drawn to 1.1 times the larger of its break and twice its peak, axes to what has happened."""
    figure = walked().plot()
    pull, shear, strength = figure.subfigs[0].axes[:3]
    (_, law, cross), (free, held, _) = pull.lines, shear.lines
    assert [text.get_text() for text in pull.get_legend().get_texts()] == ["law", "broken"]
    assert law.get_xydata()[-1] == pytest.approx([0.22, 0], abs=1e-4)
    assert law.get_ydata().max() == pytest.approx(10, rel=5e-3)
    assert cross.get_xydata().tolist() == [pytest.approx([0.2, 0])]
    assert pull.get_xlim() == pytest.approx((-0.05 * 0.3, 0.3), rel=1e-3)  # three times the peak
    assert pull.get_ylim() == pytest.approx((-0.6, 11), rel=5e-3)
    assert free.get_label() == "law, no pressure"
    assert held.get_label() == "law, 5 MPa tension"
    assert free.get_xdata()[-1] == pytest.approx(-0.88, rel=1e-3)
    assert (free.get_ydata().min(), held.get_ydata().min()) == pytest.approx((-20, -15), rel=5e-3)
    assert shear.get_xlim() == pytest.approx((-1.2, 0.18), rel=1e-3)
    assert shear.get_ylim() == pytest.approx((-20 - 0.06 * 39, 19 + 0.1 * 39), rel=5e-3)
    assert np.array(shear.collections[1].get_offsets()) == pytest.approx(
        np.array([(0, 0), (-0.2, -10), (-0.3, 0), (0, 19)])
    )
    assert np.array(strength.collections[1].get_offsets()) == pytest.approx(
        np.array([(0, 0), (-5, 10), (0, 0), (-9, 19)])
    )
    peak = strength.lines[0].get_xydata()
    assert peak[0] == pytest.approx([-10, 0], abs=0.01)
    assert peak[-1] == pytest.approx([10, 30], abs=0.01)  # half of the larger strength
    assert figure.subfigs[0].get_suptitle() == "contact 5, grains 1 and 2, at (1.0, 2.5) mm: broke at 2 ms"


def test_axes_of_a_path_that_was_pressed():
    pressed = walked(
        broken=np.nan, normal=np.array([0, -20e6, 0, 0]), shear=np.array([0, 10e6, 0, 0]),
        opening=np.array([0, -2e-7, 0, 0]),
    )  # fmt: skip
    figure = pressed.plot()
    pull, shear, strength = figure.subfigs[0].axes[:3]
    assert len(pull.lines) == 2  # no cross
    assert pull.lines[0].get_xydata()[-1] == pytest.approx([-0.2, -20])
    assert pull.get_xlim() == pytest.approx((-0.2 - 0.05 * 0.3, 0.3), rel=1e-3)
    assert shear.lines[1].get_label() == "law, 20 MPa pressure"
    assert shear.get_xlim() == pytest.approx((-0.15 * 2.4, 2.4), rel=1e-3)  # 40 MPa at 0.8 um
    assert strength.lines[0].get_xydata()[-1] == pytest.approx([22, 42], abs=0.01)
    assert "unbroken" in figure.subfigs[0].get_suptitle()


def test_an_axis_shows_a_path_but_not_all_of_a_long_slide():
    assert _right(0.1, Reach(0.01, 0.2)) == pytest.approx(1.15 * 0.1)
    assert _right(0.5, Reach(0.01, 0.2)) == pytest.approx(1.15 * 1.3 * 0.2)
    assert _right(0.01, Reach(0.1, 0.2)) == pytest.approx(3 * 0.1)


@pytest.mark.thorough
def test_paths_are_drawn_over_their_laws(pulled):
    path = pulled[0].paths[2]
    figure = path.plot()
    figure.canvas.draw()
    pull, _, strength = figure.subfigs[0].axes[:3]
    assert max(line.get_ydata().max() for line in pull.lines) == pytest.approx(13, rel=1e-3)
    followed = np.asarray(pull.collections[1].get_offsets())
    assert followed[:, 0] == pytest.approx(path.opening * 1e6, rel=1e-6)
    assert np.asarray(strength.collections[1].get_offsets())[:, 0] == pytest.approx(-path.normal / 1e6, rel=1e-6)
    (cross,) = (line for line in pull.lines if line.get_marker() == "x")
    assert cross.get_xdata()[0] == pytest.approx(path.opening[path.unbroken] * 1e6)
    titles = [axes.get_title() for axes in pulled[0].plot().axes if axes.get_title()]
    assert len(titles) == len(pulled[0].paths)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({}, "give points, places or first"),
        ({"first": -1}, "first = -1 is not allowed"),
        ({"places": [(0, np.nan)]}, "places"),
        ({"points": [100000]}, "there is no contact point 100000"),
        ({"places": [(10, 20)]}, r"\(10, 20\) m is outside of the specimen"),
    ],
)
def test_probes_of_nothing_are_refused(options, words):
    with pytest.raises(gl.ParameterError, match=words):
        gl.simulate(small_sample(10), Linear(**STIFF), PULL, observers=[gl.Probe(**options)])


@pytest.mark.thorough
def test_twenty_paths_fit_a_screen():
    """One picture of each, with the law's strength and the words of its end."""
    few, many = (plot_paths([walked()] * count) for count in (4, 20))
    assert len(few.subfigs) == 4
    assert many.get_size_inches().tolist() == [16, 9]
    panels = [axes for axes in many.axes if axes.get_title()]
    assert [axes.get_title() for axes in panels] == ["contact 5, broke at 2 ms"] * 20
    assert all(axes.get_legend() is None and len(axes.lines) > 1 for axes in panels)
    assert (many.get_supxlabel(), many.get_supylabel()) == ("pressure (MPa), tension below 0", "shear traction (MPa)")
