"""A script for ParaView that shows runs beside each other in one step: stress of the grains, cracks by mode."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from grainlaw.results.files import PARAVIEW, write_text
from grainlaw.results.result import Result
from grainlaw.results.vtk import principal

ROOM = 1.3  #: widths of a specimen from one to the next

SCRIPT = '''"""Runs beside each other in ParaView: Tools > Python Shell > Run Script, or paraview --script={script}.

pvpython {script} FILE.png draws the last moment into a file, without a window. The grains have the smaller principal
stress in the plane (stress_2, Pa), dark where they bear most; broken contacts are orange if tensile, blue if shear.
"""

import os
import sys

from paraview.simple import *

FOLDER = os.path.dirname(os.path.abspath(__file__)) if "__file__" in globals() else {folder!r}
#: rows from below of runs from the left: name and folder
RUNS = {runs}
WIDTH, HEIGHT = {width!r}, {height!r}  # m, from one run to the next
LOWEST = {lowest!r}  # Pa, where the colours of the stress begin

LoadPalette("WhiteBackground")
view = GetActiveViewOrCreate("RenderView")


def placed(source, name, column, row):
    moved = Transform(Input=source)
    moved.Transform.Translate = [column * WIDTH, row * HEIGHT, 0.0]
    RenameSource(name, moved)
    display = Show(moved, view)
    Hide(source, view)
    return display


def named(name, source, column, row):
    """The name below a run, as wide as that or smaller."""
    left, right, below = source.GetDataInformation().GetBounds()[:3]
    text = a3DText(Text=name)
    text.UpdatePipeline()
    width = text.GetDataInformation().GetBounds()[1]
    size = min((right - left) / width, 0.04 * HEIGHT)
    label = Transform(Input=text)
    label.Transform.Scale = [size, size, size]
    label.Transform.Translate = [column * WIDTH + left, row * HEIGHT + below - 1.5 * size, 0.0]
    RenameSource(name, label)
    display = Show(label, view)
    display.AmbientColor = display.DiffuseColor = [0.0, 0.0, 0.0]


for row, runs in enumerate(RUNS):
    for column, (name, place) in enumerate(runs):
        grains = PVDReader(FileName=os.path.join(FOLDER, place, "grains.pvd"))
        display = placed(grains, name + ": grains", column, row)
        ColorBy(display, ("CELLS", "stress_2"))
        named(name, grains, column, row)
        file = os.path.join(FOLDER, place, "cracks.pvd")
        if not os.path.exists(file):
            continue
        broken = Threshold(Input=PVDReader(FileName=file))
        broken.Scalars = ["CELLS", "damage"]
        if hasattr(broken, "LowerThreshold"):
            broken.LowerThreshold, broken.UpperThreshold = 0.999, 1.0
        else:  # before ParaView 5.10
            broken.ThresholdRange = [0.999, 1.0]
        display = placed(broken, name + ": cracks", column, row)
        display.LineWidth = 3.0
        ColorBy(display, ("CELLS", "mode"))

stress = GetColorTransferFunction("stress_2")
stress.RGBPoints = [LOWEST, 0.25, 0.25, 0.25, 0.0, 0.94, 0.92, 0.89]
bar = GetScalarBar(stress, view)
bar.Title, bar.ComponentTitle, bar.Visibility = "stress_2 (Pa)", "", 1
mode = GetColorTransferFunction("mode")
mode.RGBPoints = [0.0, 0.84, 0.37, 0.0, 0.499, 0.84, 0.37, 0.0, 0.501, 0.0, 0.45, 0.7, 1.0, 0.0, 0.45, 0.7]

scene = GetAnimationScene()
scene.UpdateAnimationUsingDataTimeSteps()
scene.GoToLast()
view.InteractionMode = "2D"
ResetCamera(view)
Render(view)
if len(sys.argv) > 1 and sys.argv[-1].endswith(".png"):
    view.ViewSize = [1600, 1200]
    SaveScreenshot(sys.argv[-1], view)
'''


def write_script(folder: str | os.PathLike[str], rows: Sequence[Sequence[tuple[str, str, Result]]]) -> None:
    """Write ``show_in_paraview.py`` into a folder, for runs by row, from below, and column.

    Each run has its name, the folder inside of this one where its ``grains.pvd`` and ``cracks.pvd`` are, and its
    result, which needs frames. Raises OSError.
    """
    results = [result for row in rows for *_, result in row]
    sizes = [np.ptp(result.specimen.grains.vertices, axis=0) for result in results]
    width, height = (ROOM * float(length) for length in np.max(sizes, axis=0))
    of_each = [min(np.quantile(principal(f.stress)[1], 0.05) for f in result.frames) for result in results]
    lowest = float(np.median(of_each))  # a law that does not break would leave no colours to the others
    places = ",".join(f"\n    {[(name, place) for name, place, _ in row]!r}" for row in rows)
    whole = Path(folder).resolve()
    text = SCRIPT.format(
        script=PARAVIEW, folder=str(whole), runs=f"[{places},\n]", width=width, height=height, lowest=min(lowest, -1.0)
    )
    write_text(whole / PARAVIEW, text)
