"""Plays a new user, before a release: python tests/release/new_user.py [--quick] [--keep FOLDER]

In a copy of the repository and an environment of its own: README's two commands, the time to import, a notebook, an
animation, the report in a browser, the files for ParaView, the site; and, without a copy, wheel and sdist of the last
commit. Each step is checked and timed; the exit code is 1 if one fails. ``--quick`` takes small samples and the fast
tests of the documents alone.
"""

import argparse
import json
import re
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
import traceback
import venv
from pathlib import Path

import browser
import built_site

ROOT = Path(__file__).parents[2]
LARGEST_PAGE = 2_000_000  #: bytes of a notebook as HTML
SLOWEST_IMPORT = 1.0  #: s, of one core
#: arrays that only some materials and tests have, or that must be asked for
ON_DEMAND = {"plastic_strain", "temperature", "fluid_pressure", "zone_stress", "zone_strain"}
#: the last cells of the notebook: figures, and values as a notebook shows them
FIGURES = ["gl.side_by_side(comparison)", "pulled.plot()", "gl.plot_law(law)", "result.plot()"]
VALUES = ["comparison", "result", "law", "rock", 'result.animate("cracks.gif")']


class Skipped(Exception):
    """A step that cannot be done here, and why."""


class NewUser:
    """The steps; each is a method that raises if something is not as promised, and says what it has seen."""

    def __init__(self, folder, quick):
        self.home, self.quick = folder / "grainlaw", quick
        self.python = self.home / ".venv/bin/python"

    def do(self, command, where=None):
        """Run a line of shell, or a list of words, in the copy or another folder; its output."""
        where = self.home if where is None else where
        done = subprocess.run(
            command, cwd=where, shell=isinstance(command, str), capture_output=True, text=True, check=False
        )
        if done.returncode:
            said = f"{done.stdout[-3000:]}\n{done.stderr[-3000:]}"
            raise AssertionError(f"{command} ended with {done.returncode}:\n{said}")
        return done.stdout

    def readme_lines(self):
        """The two commands that README shows first."""
        return re.findall(r"^```sh\n(.+)\n```", (self.home / "README.md").read_text("utf-8"), re.M)[:2]

    def copy(self):
        """a copy of the files that git knows"""
        names = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, check=True, text=True).stdout
        for name in filter(None, names.split("\0")):
            target = self.home / name
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, target)
        return f"{len(names.split(chr(0)))} files"

    def first_command(self):
        """README's first command: install, and compare three laws"""
        line = self.readme_lines()[0]
        assert line.endswith("grainlaw compare"), line
        self.do(line + " --quick" * self.quick)
        found = json.loads((self.home / "out/summary.json").read_text("utf-8"))
        assert len(found["laws"]) == 3, found["laws"].keys()
        peaks = {law: values["strength"] / 1e6 for law, values in found["laws"].items() if values.get("strength")}
        return ", ".join(f"{law} {peak:.0f} MPa" for law, peak in peaks.items())

    def second_command(self):
        """README's second command: the tests"""
        line = self.readme_lines()[1]
        assert line.endswith("pytest"), line
        said = self.do(line + " tests/test_docs.py tests/test_package.py" * self.quick)
        return said.strip().splitlines()[-1]

    def distribution(self):
        """wheel and sdist: the same bytes twice, and all of it where there is no checkout"""
        self.do([self.python, "-m", "pip", "install", "-q", "build"])
        folders = [self.home.parent / name for name in ("once", "again")]
        for folder in folders:
            self.do([self.python, ROOT / "packaging/distribution.py", folder])
        once, again = ({file.name: file.read_bytes() for file in folder.iterdir()} for folder in folders)
        assert once == again, "other bytes"
        (wheel,) = folders[0].glob("*.whl")
        empty = self.home.parent / "empty"
        venv.create(empty / "venv", with_pip=True)
        own = empty / "venv/bin"
        self.do([own / "pip", "install", "-q", f"{wheel}[all]"], empty)
        said = self.do([own / "grainlaw", "--version"], empty)
        assert wheel.name.split("-")[1] in said, said
        self.do([own / "grainlaw", "test", "uniaxial-compression", "--quick", "--rock", "forsmark-granite"], empty)
        assert (empty / "out/report.html").stat().st_size > 100_000
        for words in (["schema"], ["test", "brazilian", "--template"]):
            assert len(self.do([own / "grainlaw", *words], empty)) > 1000, words
        load = "from grainlaw.calibration.first_look import FILES, shipped"
        code = f"import grainlaw as gl; {load}; print(gl.rocks, *map(shipped, FILES))"
        self.do([own / "python", "-c", code], empty)
        return f"{wheel.name}, {wheel.stat().st_size / 1e6:.2f} MB"

    def quick_start(self):
        """import grainlaw"""
        code = "import time; a = time.process_time(); import grainlaw; print(time.process_time() - a)"
        seconds = [float(self.do([self.python, "-c", code])) for _ in range(6)][1:]
        middle = statistics.median(seconds)
        assert middle < SLOWEST_IMPORT, f"{middle:.2f} s of one core"
        return f"{middle:.2f} s of one core, median of five"

    def notebook(self):
        """README's Python as a notebook, executed"""
        self.do([self.python, "-m", "pip", "install", "-q", "nbconvert", "ipykernel"])
        text = (self.home / "README.md").read_text("utf-8").replace("grains=755", "grains=30")
        cells = [*re.findall(r"^```python\n(.*?)^```", text, re.M | re.S), *FIGURES, *VALUES]
        plain = {"cell_type": "code", "metadata": {}, "execution_count": None, "outputs": []}
        book = {
            "cells": [{**plain, "id": f"c{k}", "source": cell} for k, cell in enumerate(cells)],
            "metadata": {"kernelspec": {"name": "python3", "display_name": "Python 3", "language": "python"}},
            "nbformat": 4,
            "nbformat_minor": 5,
        }
        (self.home / "readme.ipynb").write_text(json.dumps(book), "utf-8")
        self.do([self.python, "-m", "nbconvert", "--to", "html", "--execute", "readme.ipynb"])
        page = (self.home / "readme.html").read_text("utf-8")
        pictures = page.count("data:image/png")
        assert len(page) < LARGEST_PAGE, f"{len(page)} bytes"
        assert pictures >= len(FIGURES), f"{pictures} figures"
        return f"{len(page) / 1e6:.2f} MB, {pictures} figures"

    def animation(self):
        """the animation that the notebook wrote"""
        from PIL import Image

        with Image.open(self.home / "cracks.gif") as moving:
            assert moving.n_frames > 5, moving.n_frames
            return f"{moving.n_frames} frames of {moving.width} x {moving.height}"

    def report(self):
        """the report in a browser, at three widths"""
        if not browser.chromium():
            raise Skipped("no Chromium on the path")
        file = self.home / "out/report.html"
        text, wrong = browser.opened(file)
        assert not wrong, wrong
        assert "<table" in text, text[:500]
        assert file.stat().st_size < 5_000_000, file.stat().st_size
        for width in (1280, 800, 390):
            assert not browser.is_blank(browser.seen(file, self.home / f"report_{width}.png", width)), width
        return f"{file.stat().st_size / 1e6:.2f} MB"

    def paraview(self):
        """the files for ParaView, read back, with every array that the documents list, and drawn by its script"""
        page = (self.home / "docs/results.md").read_text("utf-8")
        table, listed, last = re.search(r"^\| file \| array \|.*?\n\n", page, re.M | re.S)[0], {}, ""
        for file, arrays in re.findall(r"^\| *(`\w+`)? *\| (`.*?) \|", table, re.M):
            last = file.strip("`") or last
            listed.setdefault(last, set()).update(re.findall(r"`(\w+)`", arrays))
        code = (
            "import pyvista, sys\n"
            "reader = pyvista.get_reader(sys.argv[1])\n"
            "times = reader.time_values\n"
            "names = set()\n"
            "for time in times:\n"
            "    reader.set_active_time_value(time)\n"
            "    for mesh in reader.read():\n"
            "        names |= {*mesh.point_data, *mesh.cell_data}\n"
            "print(len(times), *names)\n"
        )
        said = []
        for run in sorted(self.home.glob("out/*_seed_1")):
            for name in ("grains", "cracks"):
                count, *found = self.do([self.python, "-c", code, run / f"{name}.pvd"]).split()
                missing = listed[name] - set(found) - ON_DEMAND
                assert not missing, f"{run.name}/{name}: {sorted(missing)}"
                said.append(int(count))
        assert len(said) == 6, said
        return f"{len(said)} series of {min(said)} to {max(said)} moments; {self._drawn()}"

    def _drawn(self):
        """ParaView itself runs the script, in a window that nobody sees."""
        if not (shutil.which("pvpython") and shutil.which("xvfb-run")):
            return "script not tried, no pvpython or no xvfb-run"
        picture = self.home / "paraview.png"
        screen = ["xvfb-run", "-a", "-s", "-screen 0 1600x1200x24"]
        self.do([*screen, "pvpython", self.home / "out/show_in_paraview.py", picture])
        assert not browser.is_blank(browser.greys(picture))
        return "its script draws all runs"

    def site(self):
        """the site: built without a warning, no dead links, nothing from the network, its search"""
        self.do([self.python, "-m", "pip", "install", "-q", ".[docs]"])
        self.do([self.python, "-m", "sphinx", "-q", "-W", "-b", "html", "docs", "build/site"])
        pages = self.home / "build/site"
        wrong = built_site.broken_links(pages) + built_site.from_the_network(pages)
        assert not wrong, wrong[:10]
        books = len(list(pages.glob("_downloads/**/*.ipynb")))
        assert books >= 10, books
        count = len(list(pages.rglob("*.html")))
        if not browser.chromium():
            return f"{count} pages, {books} notebooks; search not tried, no Chromium"
        text, complaints = browser.opened(pages / "search.html", "?q=Hillerborg")
        assert not complaints, complaints
        assert "add-a-law.html" in text, "search finds nothing"
        return f"{count} pages, {books} notebooks, search works"


STEPS = (
    "copy", "first_command", "quick_start", "notebook", "animation", "report", "paraview", "distribution", "site",
    "second_command",
)  # fmt: skip


def play(user, steps=STEPS):
    """Do the steps, print what came of each, and give those that failed."""
    failed = []
    for name in steps:
        step, begin = getattr(user, name), time.perf_counter()
        try:
            outcome = f"ok       {step()}"
        except Skipped as reason:
            outcome = f"skipped  {reason}"
        except Exception:
            failed.append(name)
            outcome = f"FAILED\n{traceback.format_exc()}"
        print(f"{time.perf_counter() - begin:7.1f} s  {step.__doc__:70} {outcome}", flush=True)
        if failed and name in ("copy", "first_command"):
            break
    return failed


def main():
    words = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    words.add_argument("--quick", action="store_true", help="small samples, and the tests of the documents alone")
    words.add_argument("--keep", type=Path, help="a new folder for the copy, which stays")
    given = words.parse_args()
    if given.keep:
        given.keep.mkdir(parents=True)
        return bool(play(NewUser(given.keep.resolve(), given.quick)))
    with tempfile.TemporaryDirectory() as folder:
        return bool(play(NewUser(Path(folder), given.quick)))


if __name__ == "__main__":
    sys.exit(main())
