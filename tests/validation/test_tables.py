"""The documents have the tables that the studies make. Most rows are made anew by ``pytest -m slow`` alone."""

import importlib
import re
import subprocess
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).parent
STUDIES = sorted(file.stem for file in HERE.glob("*_study.py"))
DOCS = HERE.parents[1] / "docs"


@pytest.fixture
def study(monkeypatch):
    """Imports a module of this folder by its name."""
    monkeypatch.syspath_prepend(HERE)
    before = set(sys.modules)
    yield importlib.import_module
    for name in set(sys.modules) - before:
        if getattr(sys.modules[name], "__file__", None) and Path(sys.modules[name].__file__).parent == HERE:
            del sys.modules[name]


@pytest.mark.slow
@pytest.mark.parametrize("name", STUDIES)
def test_the_page_has_what_the_study_makes(name):
    done = subprocess.run([sys.executable, str(HERE / f"{name}.py"), "--check"], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_every_place_has_its_table(study):
    """Each mark in the pages belongs to one table of one study, with the columns and rows that the study makes."""
    tables = [table for name in STUDIES for table in study(name).TABLES]
    pages = [*DOCS.glob("*.md"), *DOCS.glob("tables/*.md")]
    places = [(page, name) for page in pages for name in re.findall("<!-- table (.*) -->", page.read_text())]
    assert sorted((table.page, table.name) for table in tables) == sorted(places)
    assert [found for table in tables for found in table.differences({})] == []
    for table in tables:
        assert set(table.firm) <= set(table.columns)
        assert set(table.checked or ()) <= set(table.rows)


@pytest.fixture
def table(study, tmp_path):
    """A table of two rows, in a page."""
    page = tmp_path / "page.md"
    page.write_text("before\n<!-- table one -->\n<!-- end -->\nafter <!-- end -->\n")
    rows = {"a": lambda: ("1.0 / 2.0", "3"), "b": lambda: ("4e-05", "nan")}
    made = study("study_tables").Table(page=page, name="one", columns=("", "x", "y"), rows=rows, firm=("x",))
    made.write([*made.head, *map(made.row, rows)])
    return made


def test_a_table_is_written_between_its_marks(table):
    text = re.sub("<!-- end: .* -->", "<!-- end -->", table.page.read_text())
    rows = "|  | x | y |\n|---|---|---|\n| a | 1.0 / 2.0 | 3 |\n| b | 4e-05 | nan |\n"
    assert text == f"before\n<!-- table one -->\n{rows}<!-- end -->\nafter <!-- end -->\n"


def altered(table, shown, instead):
    table.page.write_text(table.page.read_text().replace(shown, instead))
    return len(table.differences({name: table.row(name) for name in table.rows}))


@pytest.mark.parametrize(
    ("shown", "instead", "wrong"),
    [("b", "b", 0), ("2.0", "2.1", 1), ("| 3 |", "| 4 |", 1), ("| a |", "| c |", 2), ("| y |", "| z |", 1)],
)
def test_where_digits_are_the_same_the_text_is(table, shown, instead, wrong):
    assert altered(table, shown, instead) == wrong


@pytest.mark.parametrize(("instead", "wrong"), [("2.09", 0), ("2.2", 1), ("-2.0", 1), ("2.0 / 2.0", 1), ("-", 1)])
def test_elsewhere_firm_numbers_are_close(table, monkeypatch, instead, wrong):
    monkeypatch.setattr(sys.modules["study_tables"], "environment", lambda: "another machine")
    assert altered(table, "2.0", instead) == wrong
    assert altered(table, "| 3 |", "| 4 |") == wrong


def test_a_place_that_is_not_there_is_told(table):
    table.page.write_text(table.page.read_text().replace("table one", "table two"))
    with pytest.raises(AssertionError, match="has no place for the table one"):
        table.differences({})
