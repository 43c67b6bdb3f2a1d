"""Small cases of a study, for tests that run them in other processes; none is compiled anew for its numbers."""

import csv
import io

from support import BRITTLE, ROCK, STIFF

import grainlaw as gl
from grainlaw.geometry import Bricks, Voronoi, rectangle
from grainlaw.laws import Linear
from grainlaw.protocols import UniaxialCompression
from grainlaw.runs.parallel import Run
from grainlaw.units import mm

LAWS = {"brittle": BRITTLE, "linear": Linear(**STIFF)}
SHORT = UniaxialCompression(samples=20, maximum_strain=1e-3)


def tiny(law, seed):
    """Twelve grains, some hundred steps."""
    grains = Voronoi(grains=12, seed=seed).tessellate(rectangle(20 * mm, 40 * mm))
    return gl.Run(gl.Specimen(grains, ROCK), LAWS[law], SHORT)


def column(rows, height=40.0, speed=1.0):
    """Rows of bricks under waves; as long as the speed (m/s) says."""
    grains = Bricks(rows=rows).tessellate(rectangle(20 * mm, height * mm))
    test = UniaxialCompression(samples=100, maximum_strain=1e-3, loading=gl.Constant(speed=speed))
    return gl.Run(gl.Specimen(grains, ROCK), BRITTLE, test)


def tiny_study(seeds=2):
    return gl.Study(tiny, law=["brittle", "linear"], seed=range(seeds))


def content(table):
    """A table, as text with all digits."""
    text = io.StringIO()
    writer = csv.writer(text)
    writer.writerow(table.columns)
    writer.writerows([repr(row.get(name)) for name in table.columns] for row in table.rows)
    return text.getvalue()


def refuse_to_run(monkeypatch):
    def run(*_, **__):
        raise AssertionError("it is run")

    monkeypatch.setattr(Run, "simulate", run)
