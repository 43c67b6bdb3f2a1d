"""What a calibration prints and writes, of rocks whose answers are formulas."""

import json
import re

import attrs
import numpy as np
import pytest
from formula_rocks import FOUR, RANGES, FormulaRock, exact, searched, space, targets_at
from support import STIFF

import grainlaw as gl
from grainlaw.calibration import figures
from grainlaw.calibration.check import check
from grainlaw.calibration.identifiability import identifiability
from grainlaw.calibration.result import Calibration
from grainlaw.calibration.simulator import Failure
from grainlaw.laws import MohrCoulomb
from grainlaw.short_form import MOST
from grainlaw.units import MPa

HIDDEN = {"tensile_strength": 11 * MPa, "cohesion": 33 * MPa, "friction_angle": 41.0}
LAW = MohrCoulomb(**STIFF, tensile_strength=10 * MPa, cohesion=40 * MPa, friction_angle=40)
ROCKS = {
    "law": LAW, "tied": {"residual_cohesion": ("cohesion", 0.1)},
    "free": {name: RANGES[name] for name in ("tensile_strength", "cohesion", "friction_angle")},
}  # fmt: skip
TESTS = ("compression", "confined", "tension", "brazilian")


@pytest.fixture(scope="module")
def answered():
    """A rock that is found, and its check."""
    targets, rock = targets_at(HIDDEN, FOUR), FormulaRock()
    found = searched(targets, ["crack_damage", "crack_initiation", "brazilian_strength"], rock, **ROCKS)
    best = found.posterior.best
    rows = check(found.match, targets, ElasticToo(), best, TESTS, range(11, 21))
    return Calibration(
        targets=targets, space=found.match.space, stiffness=None, found=found, seeds=3, store="", cpu=7200.0,
        failures=[Failure(3, 2, "tension", "no peak"), Failure(4, 1, "tension", "another")],
        identifiability=identifiability(found.match, found.posterior, 0), best=found.match.space.mapping(best),
        checks=rows,
    )  # fmt: skip


class ElasticToo(FormulaRock):
    """A check asks for elastic constants too."""

    def values(self, points, quantities, seeds, scales):
        rest = [name for name in quantities if name not in ("youngs_modulus", "poissons_ratio")]
        shape = len(points), len(seeds)
        elastic = {"youngs_modulus": np.full(shape, 5e10), "poissons_ratio": np.full(shape, 0.2)}
        return {**super().values(points, rest, seeds, scales), **elastic}


@pytest.fixture(scope="module")
def conflicting():
    targets = targets_at(HIDDEN, FOUR, tensile_strength=exact(HIDDEN)["ucs"] / 60)
    return Calibration(
        targets=targets,
        space=space(**ROCKS),
        stiffness=None,
        found=searched(targets, budget=34, **ROCKS),
        seeds=3,
        store="",
    )


@pytest.mark.thorough
def test_the_tables_tell_parameters_and_the_check(answered):
    text = str(answered)
    assert re.search(r"cohesion +\S+ MPa +\S+ MPa to \S+ MPa +\d+ % +determined", text)
    assert "Tests without a value: 2 of tension (first: no peak)" in text
    ucs = next(row for row in answered.checks if row.name == "ucs")
    assert ucs.measured == pytest.approx(exact(answered.best)["ucs"], rel=0.08)
    low, high = ucs.predicted_interval
    assert low < exact(answered.best)["ucs"] < high
    assert [row.name for row in answered.checks[:4]] == [*FOUR]  # targets first
    assert next(row for row in answered.checks if row.name == "brazilian_strength").is_met is None
    assert answered.law.residual_cohesion == 0.1 * answered.law.cohesion == 0.1 * answered.best["cohesion"]
    assert answered.law.kn == STIFF["kn"]


@pytest.mark.thorough
def test_a_target_is_met_within_five_percent_or_in_the_interval(answered):
    row = next(row for row in answered.checks if row.name == "ucs")
    near = attrs.evolve(row, measured=1.04 * row.target.value, interval=(0, 1))
    assert near.is_met
    assert near.off == pytest.approx(0.04)
    far = attrs.evolve(row, measured=1.2 * row.target.value, interval=(1.1 * row.target.value, 1.3 * row.target.value))
    assert far.is_met is False
    assert attrs.evolve(far, interval=(0.9 * row.target.value, 1.5 * row.target.value)).is_met


@pytest.mark.thorough
def test_the_page_has_all_pictures_and_the_numbers_are_whole(answered, tmp_path):
    answered.write(tmp_path / "out")
    page = (tmp_path / "out" / "report.html").read_text()
    assert page.count("<img") == 4  # envelope, corner, bands, points left out
    content = json.loads((tmp_path / "out" / "calibration.json").read_text())
    assert content["parameters"]["residual_cohesion"] == 0.1 * content["parameters"]["cohesion"]
    assert np.array(content["values"]["ucs"]).shape == (len(content["points"]), 3)
    assert content["plausible"]
    assert {"first", "total"} <= set(content["identifiability"]["sobol"])


@pytest.mark.thorough
def test_bands_pass_through_the_best_parameters(answered):
    figure = figures.bands(answered)
    axes = figure.axes[0]
    middle = axes.lines[-2]  # emulator, target
    assert len(middle.get_xdata()) > 10
    assert [tick.get_text() for tick in figure.axes[9].get_xticklabels()] == ["5", "12.2", "30"]  # MPa


@pytest.mark.thorough
def test_without_an_answer_there_is_no_law_and_the_conflict_is_told(conflicting, tmp_path):
    assert not conflicting.is_plausible
    assert "In conflict: tensile_strength (at best" in str(conflicting)
    with pytest.raises(gl.ParameterError, match="no calibrated law, the targets are in conflict: tensile_strength"):
        conflicting.law  # noqa: B018
    assert conflicting.parameters == {}
    conflicting.write(tmp_path / "out")
    page = (tmp_path / "out" / "report.html").read_text()
    assert "Nothing in the ranges is plausible" in page
    assert json.loads((tmp_path / "out" / "calibration.json").read_text())["conflicts"][0]["targets"] == [
        "tensile_strength"
    ]


@pytest.mark.thorough
def test_it_prints_its_parameters_in_one_line(answered, conflicting):
    met = sum(each.is_met for each in answered.checks if each.target)
    assert repr(answered).startswith("Calibration(law: MohrCoulomb, points: ")
    assert f"met on fresh seeds: {met} of 4 targets" in repr(answered)
    assert "tensile_strength" in repr(conflicting)
    assert len(repr(answered)) <= MOST
    assert len(repr(conflicting)) <= MOST
    assert "<table>" in answered._repr_html_()


@pytest.mark.thorough
def test_one_target_and_one_parameter_have_a_report(tmp_path):
    """For which Sobol indices of scipy do not exist."""
    targets, rock = targets_at(HIDDEN, ["tensile_strength"]), FormulaRock()
    one = {"law": LAW, "tied": {}, "free": {"tensile_strength": RANGES["tensile_strength"]}}
    found = searched(targets, [], rock, **one)
    best = found.posterior.best
    answered = Calibration(
        targets=targets, space=found.match.space, stiffness=None, found=found, seeds=3, store="",
        identifiability=identifiability(found.match, found.posterior, 0), best=found.match.space.mapping(best),
        checks=check(found.match, targets, ElasticToo(), best, ("tension",), range(11, 21)),
    )  # fmt: skip
    assert answered.identifiability.first_order.tolist() == answered.identifiability.total_order.tolist() == [[1.0]]
    answered.write(tmp_path)
    assert "1.00, 1.00" in (tmp_path / "report.html").read_text()
    assert answered.best["tensile_strength"] == pytest.approx(HIDDEN["tensile_strength"], rel=0.1)
