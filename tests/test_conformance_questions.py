"""Single questions of the kit for laws, and what its pictures show, of answers that are given or known by hand."""

from types import SimpleNamespace

import attrs
import numpy as np
import pytest
from faulty_laws import Hillerborg
from support import STIFF, STRONG
from toy_materials import CUBIC, Cubic

import grainlaw as gl
from grainlaw.drawing.figure import Figure
from grainlaw.drawing.palette import BLUE
from grainlaw.laws import MohrCoulomb
from grainlaw.workbench import law_figure, material_figure, properties
from grainlaw.workbench.bench import FIRST
from grainlaw.workbench.characteristics import fitting_pressures
from grainlaw.workbench.driver import Contact, alone
from grainlaw.workbench.law_figure import Reach, along, mixed, pull_and_release, ratios, reach, shear_and_reverse
from grainlaw.workbench.paths import designed_paths
from grainlaw.workbench.refined import Jump, Response, drive
from grainlaw.workbench.scale import Peak, Scale, find_closure, measure
from grainlaw.workbench.shear_box import opening_at, sheared

BRITTLE = MohrCoulomb(**STRONG)
TAN = np.tan(np.radians(54))
#: displacements in um, strengths in MPa: peaks at 1 and 2, broken at 11 and 22
SCALE = Scale(
    Peak(10e6, 1e-6, 11e-6, True), Peak(20e6, 2e-6, 22e-6, True), (0.0, 10e6, 20e6, 40e6), (0.0, 1e-6, 2e-6, 4e-6),
    (Peak(20e6, 2e-6, 22e-6, True), Peak(30e6, 3e-6, 33e-6, True), Peak(40e6, 4e-6, 30e-6, True),
     Peak(60e6, 5e-6, 25e-6, True)),
)  # fmt: skip


def response(name="path", shear=(), work=None, corners=(), legs=4):
    """Answers along a path: the shear traction in MPa at each point, or the work."""
    answers = np.column_stack([np.zeros(len(shear)), 1e6 * np.array(shear)])
    points = np.column_stack([np.zeros(len(shear)), 1e-6 * np.arange(len(shear))])
    found = Response(name, points, answers, list(corners), legs, [])
    return found if work is None else SimpleNamespace(work=np.array(work), points=np.zeros((len(work), 2)),
                                                       corners=list(corners), legs=legs, name=name)  # fmt: skip


def spring(normal, shear=lambda slip: 0.0):
    """A contact of given tractions (Pa) over opening and slip, without memory."""
    return SimpleNamespace(start=(), step=lambda opening, slip, state: (normal(opening), shear(slip)))


@pytest.mark.parametrize(("k", "steps"), [(1e12, 12), (4e12, 48), (1e9, 12)])
def test_steps_are_halved_until_tractions_change_little(k, steps):
    """A leg of 2 um in twelfths; an increment of 0.3 MPa is the largest in opening, 0.6 in shear."""
    run = drive(spring(lambda u: k * u), "pull", [(0.0, 0.0), (2e-6, 0.0)], SCALE)
    assert run.points[:, 0] == pytest.approx(np.linspace(0, 2e-6, steps + 1))
    assert run.answers[-1].tolist() == [k * 2e-6, 0]
    run = drive(spring(lambda u: 0.0, lambda s: k * s), "shear", [(0.0, 0.0), (0.0, 4e-6), (0.0, 0.0)], SCALE)
    assert run.corners == [0, steps, 2 * steps]
    assert (run.complete, run.jumps) == (True, [])
    pressed = drive(spring(lambda u: 2 * k * u), "press", [(0.0, 0.0), (-4e-6, 0.0)], SCALE)  # 1.2 MPa
    assert len(pressed.points) == steps + 1


def test_a_drop_is_a_jump_and_what_is_no_number_ends_a_path():
    drop = spring(lambda u: 1e12 * u if u < 1e-6 else 0.0)
    run = drive(drop, "pull", [(0.0, 0.0), (2e-6, 0.0)], SCALE)
    [jump] = run.jumps
    assert (jump.opening, jump.slip, jump.size) == pytest.approx((1e-6, 0, 1e6), rel=1e-5)
    assert jump.kind == "normal"
    sheared_ = drive(spring(lambda u: 0.0, lambda s: 1e6 * (s > 1e-6)), "shear", [(0.0, 0.0), (0.0, 2e-6)], SCALE)
    assert [(jump.kind, jump.size) for jump in sheared_.jumps] == [("shear", 1e6)]
    falls = drive(spring(lambda u: 0.0, lambda s: 1e6 if s > 1e-6 else 3e6), "", [(0.0, 0.0), (0.0, 2e-6)], SCALE)
    assert [(jump.kind, jump.size) for jump in falls.jumps] == [("shear", 2e6)]
    falls = drive(spring(lambda u: 1e6 if u > 1e-6 else 3e6), "", [(0.0, 0.0), (2e-6, 0.0)], SCALE)
    assert [(jump.kind, jump.size) for jump in falls.jumps] == [("normal", 2e6)]
    wild = spring(lambda u: 1e9 * np.sin(1e15 * u))
    run = drive(wild, "pull", [(0.0, 0.0), (2e-6, 0.0)], SCALE)
    assert len(run.jumps) == 12  # then it goes on in coarse steps
    ends = drive(
        spring(lambda u: 1e11 * u if u < 1.5e-6 else np.nan), "pull", [(0.0, 0.0), (1e-6, 0.0), (2e-6, 0.0)], SCALE
    )
    assert (ends.complete, ends.corners) == (False, [0, 12])


def test_a_scale_tells_increments_and_how_far_a_contact_slides():
    assert (SCALE.pulled, SCALE.pressed, SCALE.sheared) == pytest.approx((0.3e6, 1.2e6, 0.6e6))
    assert SCALE.far == pytest.approx(39e-6)  # broken, and twice as far again as the peak
    found = measure(alone(BRITTLE))  # roughly of the larger strength none, half, all and twice
    assert 0.94 * 29e6 < found.pressures[2] <= 29e6
    assert found.pressures == pytest.approx(found.pressures[2] * np.array([0, 0.5, 1, 2]))
    assert found.closures == pytest.approx(np.array(found.pressures) / 1.05e14, rel=1e-6)


def test_paths_of_a_law_go_where_their_names_say():
    """In um; a tenth beyond the break, and at three tenths of the way there."""
    paths = {name: np.array(corners) * 1e6 for name, corners in designed_paths(SCALE).items()}
    to, so, th, sh, c, d, far = 12.1, 24.2, 4.0, 8.0, 1.0, 4.0, 39.0
    expected = {
        "pull, release, pull on": [(0, 0), (0.8, 0), (0, 0), (th, 0), (0, 0), (to, 0), (0, 0)],
        "shear, reverse": [(0, 0), (0, 1.6), (0, -1.6), (0, sh), (0, -sh), (0, so), (0, -so), (0, 0)],
        "shear under high pressure": [(0, 0), (-d, 0), (-d, far), (-d, -far), (-d, 0), (0, 0)],
        "open, slide, close": [(0, 0), (to, 0), (to, so), (-c, so), (-c, far + so), (0, far + so), (0, 0)],
        "press, slip, open": [(0, 0), (-c, 0), (-c, sh), (to, sh), (0, sh), (0, 0)],
        "all directions": [(0, 0), (th, 2), (0.3, -2), (-c, 2), (2, so), (-c, -far), (0, 0)],
        "mixed, 0.25 opening to 0.75 slip": [(0, 0), (0.25, 1.5), (0, 0), (1, 6), (0, 0), (to, 3 * so), (0, 0)],
        "mixed, 0.5 opening to 0.5 slip": [(0, 0), (0.5, 1), (0, 0), (2, 4), (0, 0), (to, so), (0, 0)],
    }
    for name, corners in expected.items():
        assert paths[name] == pytest.approx(np.array(corners, dtype=float)), name


def test_a_strength_that_falls_with_pressure_is_told_by_how_much():
    """In MPa under 0, 10, 20 and 40: less by more than a thousandth of 20 is a fall."""

    def runs(peaks, lasts):
        return [
            response(shear=[0, peak, last, 0, 0], corners=[0, 2, 3, 4]) for peak, last in zip(peaks, lasts, strict=True)
        ]

    given = runs([20, 19.981, 30, 27], [5, 5, 4, 3.981])
    found = list(properties.weakening(given, SCALE, "shear"))
    assert [each.size for each in found] == pytest.approx([3e6, 1e6])
    assert found[0].text == "shear: shear strength falls from 30 MPa under 20 MPa pressure to 27 MPa under 40 MPa"
    assert found[1].text.startswith("shear: shear traction after long slip falls from 5 MPa under 10 MPa pressure to 4")
    assert list(properties.weakening(runs([1, 2, 3, 4], [1, 1, 1, 1]), SCALE, "shear")) == []


def test_friction_that_drives_is_told():
    """Out it must not be negative, back beyond the start not positive, each by a thousandth of the strength."""
    corners = [0, 2, 4, 6]
    assert properties.driven_by_shear(SCALE, response(shear=[-0.019, 5, 5, 9, -9, -5, 0.019], corners=corners)) is None
    out = properties.driven_by_shear(SCALE, response(shear=[0, -3, 5, 5, 5, -5, -5], corners=corners))
    assert out.size == 3e6
    assert out.text == ("path: shear traction -3 MPa drives the contact while slip grows, at opening 0 um, slip 1 um")
    back = properties.driven_by_shear(SCALE, response(shear=[0, 3, 5, 5, 0, 2, -5], corners=corners))
    assert back.size == 2e6
    assert "2 MPa drives the contact while slip goes back beyond its start, at opening 0 um, slip 5 um" in back.text


@pytest.mark.parametrize(("change", "size"), [(0.199, None), (0.201, 0.201e6)])
def test_a_traction_that_changes_at_rest_creeps(change, size):
    """By more than a hundredth of the strength between two answers at one place."""
    scale = attrs.evolve(SCALE, closures=(0.0,), sheared_under=SCALE.sheared_under[:1])

    def run(points):
        assert points[-1] == pytest.approx((0.0, 3e-6))
        shear = np.repeat(np.arange(len(points) // 2), 2) * 1e6
        shear[11] += change * 1e6
        return np.column_stack([0 * shear, shear])

    found = properties.creep(SimpleNamespace(scale=scale, contact=SimpleNamespace(run=run)))
    assert (found and found.size) == (size and pytest.approx(size))
    assert found is None or "goes on from 5 MPa to 5.201 MPa at rest" in found.text


@pytest.mark.parametrize(("after", "size"), [(9.981, None), (9.979, 0.021e6)])
def test_a_contact_that_slides_is_pressed_harder(monkeypatch, after, size):
    """In um: closed by 1, slid to 39, closed by 4 over twice the slip at the peak, and slid as far again."""

    def drive(contact, name, corners, scale):
        assert np.array(corners) * 1e6 == pytest.approx(np.array([(0, 0), (-1, 0), (-1, 39), (-4, 43), (-4, 86)]))
        return response(name, shear=[0, 3, 10, 12, after], corners=range(5))

    monkeypatch.setattr(properties, "drive", drive)
    found = properties.pressed_while_sliding(SimpleNamespace(scale=SCALE, contact=None))
    assert (found and found.size) == (size and pytest.approx(size))


def test_a_first_response_is_asked_for_in_every_direction_that_a_contact_bears(monkeypatch):
    """In um: 1 in opening, unless there is no bond, and 2 in slip, closed by 1 without a bond; the worst is told."""
    asked = []

    def ask(bench, mode, size, opening):
        asked.append((mode, size * 1e6, opening * 1e6))
        return properties.Finding(f"{mode}, {size:g}", mode - size)

    bench = SimpleNamespace(scale=SCALE, contact=spring(lambda u: 0.0))
    for bonded, pulled, closed in ((True, [(0, 1, 0)], 0), (False, [], -1)):
        monkeypatch.setattr(properties, "is_bonded", lambda *_, bonded=bonded: bonded)
        for name, other in (("_limit", "_stiffest"), ("_stiffest", "_limit")):
            asked.clear()
            monkeypatch.setattr(properties, name, ask)
            monkeypatch.setattr(properties, other, lambda *_: None)
            assert properties.first_response(bench).text == "1, -2e-06"
            expected = [*pulled, (0, -1, 0), (1, 2, closed), (1, -2, closed)]
            assert np.array(asked) == pytest.approx(np.array(expected, dtype=float))


def test_the_first_of_the_jumps_that_are_nearly_the_largest_is_told():
    def run(name, *sizes):
        return SimpleNamespace(name=name, jumps=[Jump(1e-6, 0.0, size * 1e6, "normal") for size in sizes])

    found = properties.no_jump(SimpleNamespace(drives=[run("a", 1), run("b", 4.4, 4.6), run("c", 5)]))
    assert (found.size, found.text) == (4.6e6, "b: normal traction jumps by 4.6 MPa at opening 1 um, slip 0 um")
    assert properties.no_jump(SimpleNamespace(drives=[run("a")])) is None


@pytest.mark.parametrize(
    ("name", "values", "size", "said"),
    [
        ("damage", [0, 0.5, 0.5, 1], None, ""),
        ("damage", [0, 0.5, 0.3, 0.9], 0.2, "pull: damage falls from 0.5 to 0.3 at opening 2 um, slip 0 um"),
        ("damage", [0, 0.5, 1.25, 0.9], 1.25, "pull: damage 1.25 at opening 2 um, slip 0 um"),
        ("damage", [0, -0.5, 0.3, 0.9], -0.5, "pull: damage -0.5 at opening 1 um, slip 0 um"),
        ("mode", [0, 0.5, 0.3, 1], None, ""),
        ("mode", [0, 0.5, 1.5, 1], 1.5, "pull: mode 1.5 at opening 2 um, slip 0 um"),
        ("other", [0, 0.5, 1.5, 1], None, ""),
    ],
)
def test_damage_that_heals_or_leaves_its_range_is_told(name, values, size, said):
    run = Response("pull", np.array([(k * 1e-6, 0.0) for k in range(4)]), np.array(values), [0, 3], 1, [])
    bench = SimpleNamespace(contact=SimpleNamespace(names=(name,)), drives=[run], memory=lambda answers, _: answers)
    found = properties.damage_never_heals(bench)
    assert (found and found.size) == (size and pytest.approx(size))
    assert (found.text if found else "") == said


def test_displacements_of_either_sign_up_to_a_metre_are_tried():
    tried = []

    def run(path):
        tried.extend(path)
        return np.zeros((len(path), 2))

    contact = SimpleNamespace(run=run, names=(), error="")
    assert properties.finite(SimpleNamespace(contact=contact, paths={}, answers={})) is None
    for column in np.array(tried).T:
        for sign in (1, -1):
            sizes = sign * column[sign * column > 0]
            assert len(sizes) > 0.3 * len(column)
            assert 1e-12 < sizes.min() < 1e-10
            assert 0.1 < sizes.max() < 1
        assert 0.1 < np.mean(column == 0) < 0.3


def test_what_a_contact_remembers_outside_its_memory_is_told_to_the_end_of_the_longest_path():
    """Its normal traction counts the steps of all contacts from the fifth on."""
    taken = []

    def step(opening, slip, state):
        taken.append(opening)
        return float(len(taken)) if opening >= 4 else 1.0, 0.0

    paths = {"short": [(0.0, 0.0)] * 2, "long": [(float(i), 0.0) for i in range(6)]}
    answers = {name: np.tile([1.0, 0.0], (len(path), 1)) for name, path in paths.items()}
    contact = SimpleNamespace(run=lambda path: np.zeros((len(path), 2)), step=step, start=(), names=())
    bench = SimpleNamespace(contact=contact, first=np.zeros((len(FIRST), 2)), paths=paths, answers=answers)
    found = properties.no_hidden_state(bench)
    assert found.size == 6.0  # the seventh step of all
    assert found.text.startswith("long: normal traction 7 among other contacts, 1 before, at opening 4e+06 um")


def test_energy_of_laps_by_hand():
    """Three laps of two legs: given up to the least of each, by lap, and in the last one, settled."""
    work = [0, 1, -3, -1, 2, -4, 5, 3, 1]
    run = response(work=work, corners=[0, 1, 2, 4, 5, 6, 8], legs=6)
    found = dict(properties.gains(run))
    text = "up to opening 0 um, slip 0 um in lap"
    assert found == {f"{text} 1": 3.0, f"{text} 2": 2.0, f"{text} 3": 4 / 3, "in a settled lap": -5.0}
    broken = response(work=work[:5], corners=[0, 1, 2, 4], legs=6)
    assert dict(properties.gains(broken)) == {f"{text} 1": 3.0, f"{text} 2": 1.5}


@pytest.mark.parametrize(("off", "told"), [(0.9, False), (1.1, True)])
def test_a_law_around_another_answers_as_that_one_where_no_time_passes(off, told):
    """To a millionth of the largest traction."""
    inner, path = Hillerborg(), [(0.0, 0.0), (1e-7, 0.0), (2e-6, 1e-6)]
    answers = alone(inner).run(path)
    answers[1, 1] += off * 1e-6 * 5e7
    bench = SimpleNamespace(
        law=SimpleNamespace(law=inner), contact=alone(inner), paths={"a": path}, answers={"a": answers}
    )
    found = properties._as_alone(bench)
    assert (found is not None) is told
    assert not told or found.size == pytest.approx(55.0)


def test_the_nearer_of_two_limits_of_the_rate_is_told():
    """A tenth stiffer slowly, a fifth at once; right at one of them is enough."""

    @attrs.frozen(kw_only=True)
    class Rated(Hillerborg):
        slow: float = gl.parameter("1", default=1.1)

        def traction(self, opening, slip, time_step, damage, widest):
            normal, shear, damage, widest = self.softened(opening, slip, damage, max(widest, opening), self.energy)
            factor = 1.0 if time_step == 0 else self.slow if time_step > 1 else 1.2
            return factor * normal, shear, damage, widest

    path = {"press": [(0.0, 0.0), (-1e-6, 0.0)]}

    def found(law):
        return properties._slow_limit(SimpleNamespace(law=law, paths=path, contact=Contact(law),
                                                      answers={"press": Contact(law).run(path["press"])}))  # fmt: skip

    assert found(Rated()).size == pytest.approx(0.1 * 1e8)
    assert "infinitely slow" in found(Rated()).text
    assert found(Rated(slow=1.0)) is None


def test_no_answer_at_a_rate_counts_as_energy():
    @attrs.frozen(kw_only=True)
    class Fails(Hillerborg):
        def traction(self, opening, slip, time_step, damage, widest):
            normal, shear, damage, widest = self.softened(opening, slip, damage, max(widest, opening), self.energy)
            return normal if time_step < 1 or opening > -1e-6 else float("nan"), shear, damage, widest

    sound, fails = (SimpleNamespace(law=law, scale=SCALE) for law in (Hillerborg(), Fails()))
    assert properties._energy(sound) is None
    assert properties._energy(fails).size == np.inf


# --- one contact in a shear box, and pictures ------------------------------------------------------------------------


def test_an_opening_has_the_traction_that_is_held():
    contact = alone(BRITTLE)
    assert opening_at(contact, 6.5e6) == pytest.approx(6.5e6 / 1.05e14, rel=1e-6)
    assert opening_at(contact, -5e6) == pytest.approx(-5e6 / 1.05e14, rel=1e-6)
    assert opening_at(contact, 0.0) == 0
    assert find_closure(contact, 5e6) == pytest.approx(5e6 / 1.05e14, rel=1e-6)
    soft = spring(lambda u: 1e12 * u / 3)
    soft.law = SimpleNamespace(stiffness=(1e12, 1e12))  # at first
    assert find_closure(soft, 4e6) == pytest.approx(12e-6, rel=1e-9)
    assert fitting_pressures(contact) == (0, 14.5e6, 29e6, 58e6)


def test_a_contact_has_failed_after_two_steps_that_hold_nothing():
    """Under a tension of half its strength: it breaks where the shear strength is reached, and the trace ends there."""
    slips = np.linspace(0, 1e-6, 51)
    for cut in (True, False):
        run = sheared(Contact(BRITTLE), 6.5e6, slips, cut=cut)
        breaks = (29e6 - 6.5e6 * TAN) / 9.45e13
        assert run.slip.tolist() == slips[slips <= breaks].tolist()


def test_pictures_of_a_law_reach_beyond_its_breaks():
    assert reach(1.0, 5.0) == Reach(1.0, 5.0)
    assert reach(1.0, 1.5) == Reach(1.0, 2.0)
    assert reach(1.0, np.nan) == Reach(1.0, 4.0)
    assert reach(np.nan, np.nan) == Reach(1e-6, 1e-6)
    path = along([0.0, 2.0, 1.0], steps=4)
    assert path == pytest.approx([0, 2e-4, 2 / 3, 1, 4 / 3, 1.9998, 2, 1.9999, 5 / 3, 1.5, 4 / 3, 1.0001, 1])
    assert ratios(Reach(1, 2.0), Reach(1, 40.0)) == pytest.approx([0, 5, 20, 80, np.inf])


def test_pictures_of_a_law_drive_it_along_their_paths():
    """In shares of the way from the peak to the end."""
    spring = alone(gl.laws.Linear(**STIFF))
    pull = pull_and_release(spring, Reach(1e-6, 3e-6)).opening * 1e6
    turns = pull[1:-1][(np.diff(pull)[1:] * np.diff(pull)[:-1]) < 0]
    assert turns == pytest.approx([0.8, 0, 1.2, 0, 1.7, 0])
    assert pull[-1] == pytest.approx(3.45)
    slip = shear_and_reverse(spring, -1e6, Reach(1e-6, 3e-6)).slip * 1e6
    turns = slip[1:-1][(np.diff(slip)[1:] * np.diff(slip)[:-1]) < 0]
    assert turns == pytest.approx([1.5, 0, 3.6])
    assert slip[-1] == pytest.approx(1.8)
    opening, slip = Reach(1e-6, 3e-6), Reach(1e-6, 8e-6)
    for ratio, end in ((0.0, (6, 0)), (2.0, (6, 12)), (4.0, (4, 16)), (np.inf, (0, 16))):
        run = mixed(spring, ratio, opening, slip)
        assert (run.opening[-1] * 1e6, run.slip[-1] * 1e6) == pytest.approx(end)


def test_a_curve_is_shown_a_little_beyond_its_end_and_a_corner_is_free_where_no_curve_is():
    u, traction = np.linspace(0, 4, 41), np.linspace(10, 0, 41)
    shown, tractions, *_ = law_figure._upto(Reach(1, 2.01), u, traction, "", "")
    assert (shown[-1], len(shown), tractions[0]) == (pytest.approx(2.3), 24, 10)
    low, high = ((u, np.where(u > 1.8, part * 10.0, 10.0), "", "") for part in (0.47, 0.49))
    assert law_figure._is_free([low])
    assert not law_figure._is_free([low, high])
    short = u / 2, np.full(41, 20.0), "", ""
    assert law_figure._is_free([(u, np.where(u > 1.8, 0.0, 10.0), "", ""), (u[:18], np.full(18, 20.0), "", "")])
    assert not law_figure._is_free([(u, np.where(u > 1.8, 4.0, 10.0), "", ""), short])


def test_curves_are_drawn_in_um_and_mpa_and_magnified_about_a_peak_that_is_near():
    figure = Figure()
    u = np.array([0, 1e-6, 2e-6, 20e-6])
    for k, (end, traction, zoomed) in enumerate(
        [(9e-6, [0, 5e6, 1e6, 0], True), (7e-6, [0, 5e6, 1e6, 0], False), (9e-6, [0, 5e6, 5e6, 5e6], False)]
    ):
        axes = figure.add_subplot(1, 3, k + 1)
        law_figure._draw(axes, [(u, np.array(traction), BLUE, "")], "x", "y", "title", Reach(1e-6, end))
        assert axes.lines[-1].get_xdata() == pytest.approx([0, 1, 2, 20])
        assert axes.lines[-1].get_ydata() == pytest.approx(np.array(traction) * 1e-6)
        assert [inset.get_xlim() for inset in axes.child_axes] == [(0, 3)] * zoomed
        assert not axes.texts
    law_figure._draw(axes, [(u, 0 * u, BLUE, "")], "x", "y", "title", None)
    assert [text.get_text() for text in axes.texts] == ["nothing is held"]


def test_a_material_is_pressed_until_it_shows_more_than_its_first_response():
    """One that is crushed bears less than 0.8 of it, a crystal all of it."""
    assert not material_figure._is_bent(CUBIC, 1e-3)
    strain, stress = material_figure._as_far(CUBIC, 1e-3, 2e6)
    first = (CUBIC.c11 - CUBIC.c12**2 / CUBIC.c11) * 1e-3  # free across
    assert np.ptp(strain) == pytest.approx(1e-3)
    assert np.ptp(stress) == pytest.approx(first)

    class Crushed(Cubic):
        def stress(self, exx, eyy, exy):
            return self.c11 * exx, self.c11 * max(eyy, -2e-4), 2 * self.c44 * exy

    crushed = Crushed(c11=9e10, c12=1.0, c44=4.5e10, density=3000)
    assert not material_figure._is_bent(crushed, 2.3e-4)  # 0.87 of it
    assert material_figure._is_bent(crushed, 2.7e-4)  # 0.74


def test_a_zone_is_pressed_as_far_as_it_keeps_its_confinement(monkeypatch):
    """In four attempts, of which the last is a tenth of the way."""
    asked, bears = [], []

    def compress(material, path, confinement):
        asked.append(path[-1])
        if not bears or path[-1] > bears[0]:
            raise gl.ParameterError("it softens")
        return SimpleNamespace(strain=np.column_stack([0 * path, -path, 0 * path]), stress=np.full((len(path), 3), 7.0))

    monkeypatch.setattr(material_figure, "compress", compress)
    assert material_figure._as_far(CUBIC, 2.0, 5.0) is None
    assert asked == pytest.approx([2, 1, 0.5, 0.2])
    bears.append(1.2)
    strain, stress = material_figure._as_far(CUBIC, 2.0, 5.0)
    assert (strain[-1], stress[-1]) == (-1, 7)
