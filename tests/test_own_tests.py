"""Tests of one's own: what they may say, what they are told, and how they end."""

import json
import math
import warnings
from types import SimpleNamespace

import attrs
import numpy as np
import pytest
from support import BRITTLE, small_sample

import grainlaw as gl
from grainlaw.conditions import Condition
from grainlaw.loading import Loading
from grainlaw.protocols import failure_summary
from grainlaw.results.certificate import doubts, has_failed
from grainlaw.results.means import mean_and_range

BOTTOM = gl.loads.Drive(boundary="bottom", axis=1, speed=0)


@attrs.frozen(kw_only=True)
class Pulled(gl.LoadingProtocol):
    """Pulls the top for a moment."""

    def stages(self, specimen):
        drives = [gl.loads.Drive(boundary="top", axis=1, speed=0.1), BOTTOM]
        return [gl.Stage(name="pull", loads=drives, until=[gl.conditions.Lasts(1e-5)], interval=1e-6)]

    def measure(self, state):
        return {"force": state.reaction("top")[1]}

    def summary(self, curves, specimen):
        return {}


# --- what may not be right -------------------------------------------------------------------------------------------


@attrs.frozen(kw_only=True)
class Careful(Pulled):
    """Pulls by a loading, until a condition."""

    loading: Loading = gl.Constant(speed=0.1)
    until: Condition = gl.conditions.Lasts(1e-5)

    def stages(self, specimen):
        drives = [gl.loads.Drive(boundary="top", axis=1, speed=1.0), BOTTOM]
        return [
            gl.Stage(name="pull", loads=drives, until=[self.until], interval=1e-7, loading=self.loading, expected=9)
        ]


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        ((math.nan, False), r"Given.next gave \(nan, False\), it must be a finite speed above 0 and whether"),
        ((0.0, False), r"gave \(0\.0, False\)"), (1.0, "Given.next gave 1.0"), (None, "Given.next gave None"),
        ((0.1, True), "Given.next has asked for the sample again 200 times: what it does must come to an end"),
    ],
)  # fmt: skip
def test_a_loading_that_gives_no_speed_is_told(answer, words):
    @attrs.frozen(kw_only=True)
    class Given(Loading):
        def first(self, pace):
            return 0.1

        def next(self, pace):
            return answer

        def slower(self):
            return self

    with pytest.raises(gl.StageError, match=words):
        gl.simulate(small_sample(12), BRITTLE, Careful(loading=Given()))


@pytest.mark.parametrize(
    ("progress", "words"),
    [
        (lambda curves: None, "Given.progress gave None, it must be a number: 1 and more where the stage ends"),
        (lambda curves: math.nan, "Given.progress gave nan"),
        (lambda curves: curves["strian"][-1], "Given.progress takes the column 'strian', there are: time, step"),
        (lambda curves: 1 / 0, "Given.progress: ZeroDivisionError"),
    ],
)
def test_a_condition_that_gives_no_number_is_told(progress, words):
    given = type("Given", (Condition,), {"progress": lambda self, curves: progress(curves)})()
    with pytest.raises(gl.StageError, match=words):
        gl.simulate(small_sample(12), BRITTLE, Careful(until=given))


def test_an_integrator_that_goes_back_in_time_is_refused():
    back = type("Back", (gl.integration.CentralDifference,), {"stable_step": lambda self, frequency: -1.0})()
    with pytest.raises(gl.ParameterError, match=r"Back.stable_step = -1.0 is not allowed, it must be a time above 0"):
        gl.simulate(small_sample(12), BRITTLE, Pulled(), integrator=back)


def test_an_observer_cannot_change_what_is_recorded():
    class Meddles(gl.Observer):
        def observe(self, state, curves, stage, progress):
            curves["time"][:] = -5

    with pytest.raises(ValueError, match="read-only"):
        gl.simulate(small_sample(12), BRITTLE, Pulled(), observers=[Meddles()])


# --- names ------------------------------------------------------------------------------------------------------------


@attrs.frozen(kw_only=True)
class Misspelt(Pulled):
    quantities = (gl.Quantity("forse", "kN/m"), gl.Quantity("lenght", "mm"), gl.Quantity("other", "mm"))
    panels = (gl.Panel("time", ["force", "froce"]), gl.Panel("time", ["dilation"]))

    def measure(self, state):
        return {"force": 1.0, "length": 2.0}


def test_a_misspelt_name_of_a_test_of_ones_own_is_told():
    """What is like no name may be of other settings; a force has words and a unit already."""
    with pytest.warns(UserWarning, match="Misspelt has") as told:
        gl.simulate(small_sample(12), BRITTLE, Misspelt())
    words = sorted(str(each.message) for each in told if "Misspelt has" in str(each.message))
    assert words == [
        "Misspelt has a panel of 'froce', which is not recorded; did you mean 'force'?",
        "Misspelt has a quantity 'lenght', which is neither a column nor a property; did you mean 'length'?",
    ]


def test_a_measure_that_fails_is_told_as_the_tests_and_keeps_what_was_recorded():
    def measure(self, state):
        return {"force": 1.0, "late": 1 / 0 if state.time > 5e-6 else 0.0}

    late = type("Late", (Pulled,), {"measure": measure})()
    with pytest.raises(gl.StageError, match=r"^Late.measure: ZeroDivisionError: division by zero") as told:
        gl.simulate(small_sample(12), BRITTLE, late)
    assert len(told.value.result.curves["late"]) >= 4


def test_a_column_that_is_left_out_within_a_stage_is_told():
    def measure(self, state):
        return {"force": 1.0} | ({} if state.time > 5e-6 else {"early": 0.0})

    early = type("Early", (Pulled,), {"measure": measure})()
    with pytest.warns(UserWarning, match="Early.measure leaves out early in the stage in which it gave it before"):
        assert np.isnan(gl.simulate(small_sample(12), BRITTLE, early).curves["early"][-1])


@attrs.frozen(kw_only=True)
class Careless(Pulled):
    """A test with one mistake."""

    column: str = "force"
    panel: tuple = ("force",)
    read: str = ""
    quantities = (gl.Quantity("wide", "mm"),)

    @property
    def panels(self):
        return (gl.Panel("time", self.panel, "what is drawn"),)

    def measure(self, state):
        found = {self.column: 1.0, "wide": 0.0}
        if self.read:
            getattr(state, self.read.split()[0])(self.read.split()[1])
        return found


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"column": "stage"}, r"Careless.measure: stage is recorded in every test, give what is measured another name"),
        ({"column": "energy_kinetic"}, "energy_kinetic is recorded in every test"),
        (
            {"panel": ("force", "wide")},
            r"Careless: a panel of .* several units .*force \(kN/m\), wide \(mm\)",
        ),
        (
            {"read": "moved topp"},
            r"moved: the specimen has no boundary named topp; did you mean 'top'\? \(it has: bottom,",
        ),
        (
            {"read": "reaction lid"},
            r"reaction: the specimen has no boundary named lid \(it has: bottom, left, right, top\)",
        ),
        ({"read": "memory damge"}, r"state.memory: no law has 'damge' in its memory; did you mean 'damage'\?"),
    ],
)
def test_mistakes_of_a_test_of_ones_own_are_refused(given, words):
    with pytest.raises(gl.ParameterError, match=words):
        gl.simulate(small_sample(12), BRITTLE, Careless(**given))
    gl.simulate(small_sample(12), BRITTLE, Careless(read="memory fatigue"))  # other laws have it


@attrs.frozen(kw_only=True)
class Listed(Pulled):
    """A test with one value per cycle, as a list and as an array."""

    quantities = (gl.Quantity("moduli", "GPa", is_main=True), gl.Quantity("works", "kJ/m"))

    def summary(self, curves, specimen):
        return {"moduli": np.array([50e9, 49.5e9]), "works": [1e3, 2e3]}


def test_one_value_per_cycle_is_shown_in_its_unit_and_written(tmp_path):
    result = gl.simulate(small_sample(12), BRITTLE, Listed())
    assert result.summary["moduli"] == [50e9, 49.5e9]
    assert "moduli (GPa): 50, 49.5" in str(result)
    found = gl.compare(small_sample(12), {"brittle": BRITTLE, "same": BRITTLE}, Listed(), progress=False)
    assert [line.split()[2:] for line in str(found).splitlines() if line.startswith("moduli")] == [
        ["50,", "49.5", "50,", "49.5"]
    ]
    found.write(tmp_path)
    assert json.loads((tmp_path / "summary.json").read_text())["laws"]["same"]["moduli"] == [50e9, 49.5e9]
    for other, shown in (([3e3, 4e3], "2, 3"), ([3e3], "-")):
        both = [result, SimpleNamespace(summary={"works": other})]
        assert mean_and_range(result.quantity("works"), both, "works") == shown


@pytest.mark.parametrize("stages", [None, [], "load", [3]])
def test_a_test_without_stages_is_refused(stages):
    protocol = type("Empty", (Pulled,), {"stages": lambda self, specimen: stages})()
    with pytest.raises(gl.ParameterError, match=r"Empty.stages = .* at least one gl.Stage"):
        gl.simulate(small_sample(12), BRITTLE, protocol)


def test_two_stages_of_one_name_are_refused():
    load = gl.Stage(name="load", loads=[BOTTOM], until=[gl.conditions.Lasts(1e-5)], interval=1e-5)
    protocol = type("Loads", (Pulled,), {"stages": lambda self, specimen: [load, load]})()
    with pytest.raises(gl.ParameterError, match=r"Loads.stages: two are named 'load'"):
        gl.simulate(small_sample(12), BRITTLE, protocol)


# --- how a test ends --------------------------------------------------------------------------------------------------


@attrs.frozen(kw_only=True)
class Twice(gl.LoadingProtocol):
    """Pulls until it fails, and pulls what is left, or ends there; the last stage may wait for what never comes."""

    ends: bool = False
    expected: int | None = None
    again: float = 1e-5

    def stages(self, specimen):
        def pull(name, speed, **more):
            loads = [gl.loads.Drive(boundary="top", axis=1, speed=speed, ramp=2e-5), BOTTOM]
            return gl.Stage(name=name, loads=loads, interval=1e-6, **more)

        failure, until = [gl.conditions.Fails("stress", "strain")], [gl.conditions.Reaches("strain", 0.01)]
        first = {"until": until, "ends_test": failure} if self.ends else {"until": [*failure, *until]}
        waits = [gl.conditions.Lasts(self.again) if self.expected is None else gl.conditions.Reaches("stress", 1e12)]
        return [pull("pull", 0.05, **first), pull("again", 0.05, until=waits, expected=self.expected)]

    def measure(self, state):
        (low, high), lengths = state.specimen.grains.region.bounds, state.mesh.boundary_lengths
        return {
            "stress": state.reaction("top")[1] / lengths["top"], "strain": state.moved("top")[1] / (high - low)[1],
        }  # fmt: skip

    def summary(self, curves, specimen):
        return failure_summary(curves, "stress", "strain", {"failure_strain": "strain"})


def test_a_test_can_end_before_its_last_stage():
    whole, ended = (gl.simulate(small_sample(12), BRITTLE, Twice(ends=ends)) for ends in (False, True))
    assert set(whole.curves["stage"]) == {0, 1}
    assert set(ended.curves["stage"]) == {0}
    first = whole.curves["stage"] == 0
    assert np.array_equal(ended.curves["stress"], whole.curves["stress"][first])
    assert ended.summary["strength"] == whole.summary["strength"] > 0


def test_a_test_that_ends_before_its_stage_that_is_judged_says_so():
    """Neither "had not failed", nor a mark of a strength that the table has not."""

    def judged(self, curves, specimen):
        return failure_summary(curves, "stress", "strain", {}, stage=1)

    judging = type("Judging", (Twice,), {"summary": judged})
    ended = gl.simulate(small_sample(12), BRITTLE, judging(ends=True))
    assert np.isnan(ended.summary["strength"])
    none = attrs.evolve(ended, summary=ended.summary | {"strength": None})  # as a test of one's own may say
    assert has_failed(none)
    assert list(doubts(none)) == list(doubts(ended))
    assert list(doubts(ended)) == ["the test ended in its stage 'pull', before its stage 'again'"]
    assert len(ended.plot().axes[0].lines) == 1  # the curve, without a mark
    assert not any("ended in" in words for words in doubts(gl.simulate(small_sample(12), BRITTLE, Twice(ends=True))))
    assert not any("ended in" in words for words in doubts(gl.simulate(small_sample(12), BRITTLE, judging())))


def test_a_misspelt_column_of_any_stage_is_refused_at_the_first_sample():
    def stages(self, specimen):
        first, last = Twice.stages(self, specimen)
        return [first, attrs.evolve(last, until=[gl.conditions.Reaches("strian", 1e-3)])]

    words = r"^stage 'again': Reaches needs the column strian, which the test does not record; did you mean 'strain'\? "
    with pytest.raises(gl.ParameterError, match=words + r"\(it records stress, strain\)$"):
        gl.simulate(small_sample(12), BRITTLE, type("Typo", (Twice,), {"stages": stages})())


def test_what_is_missing_in_a_declaration_is_told_with_a_cure():
    with pytest.raises(gl.ParameterError, match=r"^Stage 'wait': until = \(\) .*Reaches\('strain', 0.01\)\]$"):
        gl.Stage(name="wait", interval=1e-6)
    with pytest.raises(gl.ParameterError, match=r"^parameter: default = 0 .* above 0, or another bound .* at_least=0$"):
        gl.parameter("Pa", default=0)
    with pytest.raises(gl.ParameterError, match=r"Pulled has no loading .*; give it a field, loading: gl.Loading ="):
        gl.certify(small_sample(12), BRITTLE, Pulled())


def listed(seed):
    """A case of a study whose test has a list."""
    return gl.Run(small_sample(12 + seed), BRITTLE, Listed())


@pytest.mark.thorough
def test_a_list_is_no_single_number_of_a_study():
    table = gl.Study(listed, seed=[0]).run(workers=1, progress=False)
    assert table.rows[0]["works"] == [1e3, 2e3]
    with pytest.raises(gl.ParameterError, match="plot: 'works' is no single number of each case"):
        table.plot("works")
    with pytest.raises(gl.ParameterError, match="there is no column of single numbers 'works'"):
        table.means("seed")["works"]


def test_a_stage_that_takes_twenty_times_its_samples_ends_the_run():
    words = r"stage 'again' did not end within 60 samples \(3 were expected\); it waits for .*Reaches"
    with pytest.raises(gl.StageError, match=words) as told:
        gl.simulate(small_sample(12), BRITTLE, Twice(expected=3))
    assert (told.value.result.curves["stage"] == 1).sum() == 60
    stages = [gl.Stage(name="a", until=[gl.conditions.Lasts(1)], interval=1.0, **more)
              for more in ({}, {"expected": 5, "pieces": 4}, {"expected": 5, "sample_limit": 7})]  # fmt: skip
    assert [stage.most_samples for stage in stages] == [100_000, 400, 7]


def test_a_column_that_is_no_number_ends_the_stage_that_waits_for_it():
    nothing = type("Nothing", (Twice,), {"measure": lambda self, state: {"stress": np.nan, "strain": 0.0}})()
    words = r"stage 'pull' waits for Fails\(.*, and Nothing.measure gave nan for stress"
    with pytest.raises(gl.StageError, match=words) as told:
        gl.simulate(small_sample(12), BRITTLE, nothing)
    assert len(told.value.result.curves["stress"]) == 1


def test_where_a_column_stands_is_told_of_a_stage_that_does_not_end():
    with pytest.raises(
        gl.StageError,
        match=r"; stress is \S+, between \S+ and \S+ in this stage; \d+ of its 44 contact points have broken$",
    ):
        gl.simulate(small_sample(12), BRITTLE, Twice(expected=3))


def test_a_stage_that_ends_at_once_where_many_samples_are_expected_is_told():
    def pull(self, specimen):
        return [attrs.evolve(Pulled.stages(self, specimen)[0], interval=1e-5, expected=expected)]

    hasty = type("Hasty", (Pulled,), {"stages": pull})()
    expected = 10
    with pytest.warns(UserWarning, match="stage 'pull' ended at its first sample, and 10 were expected"):
        gl.simulate(small_sample(12), BRITTLE, hasty)
    expected = 9
    with warnings.catch_warnings():
        warnings.filterwarnings("error", message=".*first sample")
        gl.simulate(small_sample(12), BRITTLE, hasty)


# --- strength ---------------------------------------------------------------------------------------------------------


def curves(result):
    """Two stages: one that fails at 60 MPa, and one, from there on, at 119 MPa."""
    way = np.arange(1, 41) * 1e-4
    load = np.concatenate([np.linspace(3e6, 60e6, 16), np.full(4, 30e6), np.linspace(30e6, 119e6, 16), np.full(4, 5e6)])
    columns = {name: np.zeros(40) for name in result.curves}
    return {**columns, "damaged": way * 1e5, "stress": load, "strain": way, "stage": np.repeat([0.0, 1.0], 20)}


def test_a_picture_marks_the_strength_of_the_stage_that_the_test_judges():
    result = gl.simulate(small_sample(12), BRITTLE, Twice())
    made = curves(result)
    for stage, strength in ((None, 60e6), (1, 119e6)):
        judged = failure_summary(made, "stress", "strain", {"failure_strain": "strain"}, stage=stage)
        assert judged["strength"] == strength
        drawn = attrs.evolve(result, curves=made, summary=judged)
        for axes in (drawn.plot().axes[0], gl.plot_curves(drawn).axes[0]):
            marks = [line for line in axes.lines if line.get_linestyle() == "None"]
            full = [line.get_ydata() for line in marks if line.get_fillstyle() == "full"]
            assert np.concatenate(full) == pytest.approx([strength / 1e6])
        whole = attrs.evolve(drawn, curves=made | {"damaged": np.zeros(40)})  # it was only unloaded
        assert [len(each.axes[0].lines) for each in (whole.plot(), gl.plot_curves(whole))] == [1, 1]
    both = gl.plot_curves({"one": attrs.evolve(result, curves=made), "other": attrs.evolve(result, curves=made)}).axes[
        0
    ]
    said = [text.get_text() for text in both.get_legend().get_texts()]
    assert said == ["one", "other", "strength", "largest load"]  # each mark is explained once
