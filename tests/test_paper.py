"""The page of the paper: its equations by hand, lines through peaks, and the command."""

import json
import math

import attrs
import numpy as np
import pytest
from click.testing import CliRunner
from joint import Joint
from paper import paper as command
from paper_calibration import parameters, stored, targets_met
from paper_numbers import PAPER, Paper, contact_rows, cycle_work, macroscopic, statement
from paper_runs import BRITTLE, CONFINEMENTS, CONSISTENT, LEAST, LOCAL, PRINTED, RULES, SEEDS, study
from study_rows import row, table_of

from grainlaw.messages import spelled
from grainlaw.runs.elastic_properties import ElasticProperties
from grainlaw.units import GPa, MPa

#: of Table 1 with L = 3, opening and slip alike and no friction under tension: computed elsewhere from Eqs. (1) to (11)
TOGETHER = [12.30458, 27.44867, 9.06673, 20.22579, 4.97549, 11.09918, 1.26915, 2.83119]


def test_both_modes_and_closure_are_those_of_the_equations():
    rows = contact_rows()
    assert [program for *_, program in rows[:8]] == pytest.approx(TOGETHER, abs=1e-5)
    assert [theory for _, _, theory, _ in rows[:8]] == pytest.approx(TOGETHER, abs=1e-5)
    assert [program for *_, program in rows[8:]] == pytest.approx([127.0] * 3)
    assert [words.split()[2] for words, *_ in rows[8:]] == ["0.5474", "0.9739", "1.0790"]  # um


def test_the_printed_contact_gives_work_and_the_consistent_one_takes_it():
    assert cycle_work(RULES[PRINTED]) == pytest.approx(11, abs=0.5)  # J/m2
    assert cycle_work(RULES[CONSISTENT]) < 0


@pytest.fixture
def paper(tmp_path):
    """Peaks on known lines; one of the seeds has failed under one confinement."""
    ucs = {PRINTED: 100 * MPa, CONSISTENT: 110 * MPa, BRITTLE: 120 * MPa}
    slope = {PRINTED: 9.0, CONSISTENT: 4.0, BRITTLE: 9.0}
    rows = []
    for law in ucs:
        for p in CONFINEMENTS:
            for seed in SEEDS:
                factors = {"law": law, "damping": LOCAL, "confinement": p, "seed": seed}
                peak = ucs[law] + (seed - 2) * MPa + slope[law] * p
                found = {"strength": peak, "apparent_modulus": 53 * GPa, "apparent_poisson": 0.28}
                failed = law == BRITTLE and seed == 3 and p > 3 * MPa
                rows.append(row(factors, {}, "unstable", "too fast") if failed else row(factors, found))
    factors = {"law": PRINTED, "damping": LEAST, "confinement": 0.0, "seed": 1}
    rows.append(row(factors, {"strength": 50 * MPa}))
    joint = Joint([("", math.nan, 2.0, 2.01)], [], None, None, {})
    elastic = ElasticProperties(
        apparent_modulus=53.1 * GPa, apparent_poisson=0.281, modulus=51 * GPa, poisson=0.22, stiffness=np.eye(3),
        boundary="kinematic",
    )  # fmt: skip
    return Paper(joint, table_of(rows, tmp_path / "s"), elastic, {}, {})


def test_lines_are_those_of_each_seed(paper):
    assert [line.slope for line in paper.lines(PRINTED)] == pytest.approx([9.0] * 3)
    assert [line.ucs / MPa for line in paper.lines(PRINTED)] == pytest.approx([99, 100, 101])
    assert len(paper.lines(BRITTLE)) == 2  # of the third one test is missing
    table = {words: cells for words, *cells in macroscopic(paper)}
    assert table["UCS by the line (MPa)"][0] == "126.65"
    assert table["UCS by the line (MPa)"][2] == "100.0 (99.0 to 101.0)"
    assert table["friction angle (deg)"][2] == "53.1 (53.1 to 53.1)"  # asin(8/10)
    assert table["cohesion (MPa)"][3] == "27.5 (27.2 to 27.8)"  # ucs / (2 sqrt(4))
    assert table["E* (GPa)"][1] == "53.10"


def test_the_statement_has_the_numbers_of_the_runs(paper):
    words = " ".join(statement(paper))
    assert "0.50 %" in words
    assert "100 (99 to 101) MPa and a slope of 9.0" in words
    assert f"99 MPa with local damping and 50 MPa with {LEAST}" in words


def test_what_is_stored_is_told(paper):
    """Whatever the calibrations have found: all six targets of each law, and what is not determined, by name."""
    known = attrs.evolve(paper, calibrated=stored())
    rows = {words: cells for words, *cells in targets_met(stored())}
    assert rows["UCS (MPa)"][0] == "126.65"
    for k, (law, answer) in enumerate(stored().items()):
        said = next(words for words in statement(known) if words.startswith(f"{law}, calibrated"))
        verdicts = [cells[k + 1] for cells in rows.values() if cells[0] != "-"]
        met = sum(verdict.endswith(", met") for verdict in verdicts)
        assert f"{met} of 6 targets" in said
        for each in answer["identifiability"]["parameters"]:
            undetermined = each["verdict"] == "not determined"
            assert (spelled(each["name"]) in said.partition(";")[2]) == undetermined
    table = {words: cells for words, *cells in parameters(stored())}
    assert "mode I energy" in table
    assert table["tensile strength"][0] == "13 MPa"


def test_the_paper_means_one_line():
    """m = (1 + sin phi)/(1 - sin phi) and b = 2 c cos phi/(1 - sin phi), Eqs. (13, 14)."""
    phi = math.radians(PAPER["friction_angle"])
    assert PAPER["slope"] == pytest.approx((1 + math.sin(phi)) / (1 - math.sin(phi)), rel=1e-3)
    assert PAPER["ucs"] == pytest.approx(2 * PAPER["cohesion"] * math.cos(phi) / (1 - math.sin(phi)), rel=1e-3)


def test_cases_are_all_different_and_full_has_more():
    few, all_of_them = study(quick=True, full=False), study(quick=True, full=True)
    assert len(few) == len({tuple(case.items()) for case in few.design})
    assert {tuple(case.items()) for case in few.design} < {tuple(case.items()) for case in all_of_them.design}


@pytest.mark.slow
def test_the_command_writes_the_page_and_goes_on_where_it_was(tmp_path):
    result = CliRunner().invoke(command, ["--quick", "--out", str(tmp_path / "paper")])
    assert result.exit_code == 0, result.output
    page = (tmp_path / "paper" / "paper.html").read_text()
    for words in ("Fig. 5", "Fig. 6", "Fig. 8", "Fig. 9", "Flutter", "Table 1", "What this says"):
        assert words in page
    assert page.count("<img") == 5
    written = json.loads((tmp_path / "paper" / "paper.json").read_text())
    assert len(written["runs"]) == 32
    assert "slope of the line" in result.output
    before = {file: file.stat().st_mtime_ns for file in (tmp_path / "paper" / "runs").rglob("*.json")}
    assert CliRunner().invoke(command, ["--quick", "--out", str(tmp_path / "paper")]).exit_code == 0
    assert before == {file: file.stat().st_mtime_ns for file in (tmp_path / "paper" / "runs").rglob("*.json")}
