"""What the site is made of: pages in its contents, every public name in its reference, examples that check a number.

Sphinx itself is not asked here: `tests/release/new_user.py` and the continuous integration build the site.
"""

import ast
import re
import runpy
import shutil
import subprocess
import sys
from collections import Counter
from pathlib import Path

import pytest
from release.built_site import broken_links, from_the_network

import grainlaw as gl
from grainlaw.results.certificate import LIMITS, fails
from grainlaw.studies.table import Table

DOCS = Path(__file__).parents[1] / "docs"
GALLERY = sorted(DOCS.glob("gallery/*.py"))
PACKAGES = (gl, *(getattr(gl, name) for name in gl.MODULES))


def contents(file):
    """Pages that a table of contents lists."""
    text = file.read_text("utf-8")
    blocks = re.findall(r"```\{toctree\}\n(.*?)```", text, re.S) + re.findall(r"\.\. toctree::\n((?:\s+.*\n)+)", text)
    return [line.strip() for block in blocks for line in block.splitlines() if line.strip() and ":" not in line]


def test_every_page_is_in_the_contents_once():
    listed = contents(DOCS / "index.md")
    pages = {file.stem for file in DOCS.glob("*.md")} - {"index"}
    assert sorted(listed) == sorted([*pages, "auto_gallery/index", "reference/index"])
    reference = {file.stem for file in DOCS.glob("reference/*.rst")} - {"index"}
    assert sorted(contents(DOCS / "reference/index.rst")) == sorted(reference)


def test_validation_lists_every_page_of_tables_once():
    listed = re.findall(r"^- \[.*?\]\((tables/[\w-]+\.md)\)", (DOCS / "validation.md").read_text("utf-8"), re.M)
    assert sorted(listed) == sorted(f"tables/{file.name}" for file in DOCS.glob("tables/*.md"))


def described():
    """Names that the reference describes, by their package."""
    for file in DOCS.glob("reference/*.rst"):
        for package, names in re.findall(r"\.\. public:: (\S+)\n\n((?:   .+\n?)+)", file.read_text("utf-8")):
            yield from (f"{package}.{name}" for name in names.split())


@pytest.mark.parametrize("package", PACKAGES, ids=lambda package: package.__name__)
def test_every_public_name_is_in_the_reference_once(package):
    times = Counter(described())
    names = [f"{package.__name__}.{name}" for name in package.__all__]
    assert {name: times[name] for name in names if times[name] != 1} == {}
    mine = {name for name in times if name.rpartition(".")[0] == package.__name__}
    assert mine <= set(names)


def order():
    """The examples in the order of the gallery."""
    tree = ast.parse((DOCS / "site/gallery_figures.py").read_text("utf-8"))
    return next(ast.literal_eval(node.value) for node in tree.body if isinstance(node, ast.Assign))


def test_the_gallery_has_an_order():
    assert sorted(order()) == [file.stem for file in GALLERY]
    assert len(GALLERY) >= 10


@pytest.mark.parametrize("file", GALLERY, ids=lambda file: file.stem)
def test_an_example_has_a_title_and_checks_a_number(file):
    text = file.read_text("utf-8")
    title, rule = ast.get_docstring(ast.parse(text)).splitlines()[:2]
    assert rule == "=" * len(title)
    assert "# **Check" in text
    assert "assert" in text.split("# **Check")[1]
    assert re.search(r"^\w+$", text, re.M), "no cell ends with a value to show"


def test_pages_lead_to_examples_that_exist():
    """The site turns a link to a script into one to its page, which has the script's name."""
    targets = {
        target for file in DOCS.glob("*.md") for target in re.findall(r"\]\(gallery/(.*?)\)", file.read_text("utf-8"))
    }
    assert targets - {""} <= {file.name for file in GALLERY}
    assert "" in targets


def test_dead_links_are_found(tmp_path):
    (tmp_path / "a.html").write_text('<p id="here"><a href="b.html#there"> <a href="#here"> <img src="c.png">')
    (tmp_path / "b.html").write_text('<a href="a.html?q=1#gone">x</a> <a href="https://e.org">x</a>')
    assert broken_links(tmp_path) == [("a.html", "b.html#there"), ("a.html", "c.png"), ("b.html", "a.html?q=1#gone")]
    assert from_the_network(tmp_path) == []
    (tmp_path / "c.html").write_text('<script src="https://e.org/x.js"></script>')
    assert from_the_network(tmp_path) == [("c.html", '<script src="http')]


@pytest.mark.slow
@pytest.mark.parametrize("file", GALLERY, ids=lambda file: file.stem)
def test_an_example_runs_as_a_notebook(file, tmp_path):
    """The notebook that its page offers, in a kernel of Jupyter: no cell raises, and figures are shown."""
    pytest.importorskip("sphinx_gallery", reason="pip install grainlaw[docs]")
    nbclient = pytest.importorskip("nbclient", reason="pip install grainlaw[docs]")
    nbformat = pytest.importorskip("nbformat", reason="pip install grainlaw[docs]")
    script = shutil.copy(file, tmp_path)
    subprocess.run([sys.executable, DOCS / "site/notebooks.py", script], check=True, capture_output=True)
    book = nbformat.read(tmp_path / f"{file.stem}.ipynb", as_version=4)
    nbclient.NotebookClient(book, timeout=600, resources={"metadata": {"path": tmp_path}}).execute()
    shown = [output["data"] for cell in book.cells for output in cell.get("outputs", ()) if "data" in output]
    assert any("image/png" in each for each in shown)
    assert not [each for each in shown if "Figure" in each.get("text/plain", "") and "image/png" not in each]


@pytest.mark.slow
def test_the_site_without_its_gallery(tmp_path):
    pytest.importorskip("sphinx", reason="pip install grainlaw[docs]")
    pytest.importorskip("sphinx_gallery", reason="pip install grainlaw[docs]")
    options = ["-q", "-W", "-D", "plot_gallery=0", "-d", tmp_path / "trees"]
    subprocess.run([sys.executable, "-m", "sphinx", *options, DOCS, tmp_path / "site"], check=True, capture_output=True)


@pytest.mark.slow
@pytest.mark.parametrize("example", GALLERY, ids=lambda file: file.stem)
def test_an_example_of_the_gallery_runs_and_passes_its_certificate(example, monkeypatch, tmp_path):
    """Its own check is an assertion in it."""
    monkeypatch.chdir(tmp_path)
    made = runpy.run_path(str(example)).values()
    results = [one for one in made if isinstance(one, gl.Result)]
    for comparison in (one for one in made if isinstance(one, gl.Comparison)):
        results += comparison.values()
    failed = [name for result in results for name, value in result.summary.items() if fails(name, value)]
    for table in (one for one in made if isinstance(one, Table)):
        failed += [name for name in LIMITS if name in table.columns for value in table[name] if fails(name, value)]
    assert not failed
