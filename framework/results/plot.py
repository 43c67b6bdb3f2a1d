"""Pictures of results as functions, for those who do not want matplotlib loaded before they draw."""

from __future__ import annotations

import importlib.util
import os
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from grainlaw.arguments import checked
from grainlaw.fields import ParameterError, checked_whole_number
from grainlaw.messages import refusal
from grainlaw.results.archive import law_name
from grainlaw.results.probe import Probe
from grainlaw.results.result import Result

if TYPE_CHECKING:
    from grainlaw.drawing.figure import Figure


@checked
def plot_cracks(result: Result, frame: int = -1, *, title: str | None = None, ax: Any = None) -> Figure:
    """Draw the cracks on the deformed specimen at one frame, counted from the end if negative.

    Tensile cracks are thin and orange, shear cracks thick and blue. Draws into the axes ``ax`` of matplotlib, if they
    are given. Returns the figure. A result without frames shows its cracks on the outline of the specimen before the
    test. Raises ParameterError for a frame that is not there.
    """
    from grainlaw.results.figures.cracks import plot_cracks  # loads matplotlib, which takes longer than all the rest

    return plot_cracks(result, frame, title, ax)


@checked
def side_by_side(results: Any, frame: int = -1, *, columns: int | None = None) -> Figure:
    """Draw the cracks of several results beside each other, all at one scale and in the same colours.

    ``results`` are results by name, as a comparison or a dictionary, or a list of results, named by their laws. At most
    ``columns`` stand in one row. Returns the figure. Raises ParameterError for a frame that is not there.
    """
    from grainlaw.results.figures.cracks import side_by_side

    if columns is not None:
        checked_whole_number("side_by_side: columns", columns, at_least=1)
    return side_by_side(_named("side_by_side", results), frame, columns)


@checked
def plot_curves(results: Any, y: str | None = None, x: str | None = None, *, ax: Any = None) -> Figure:
    """Draw one column of the curves of one result or several over another, by their names in ``Result.curves``.

    Without names: what the test applies (stress or force) over how far it is (strain or displacement). ``results`` are
    as for :func:`side_by_side`, or one result. Draws into the axes ``ax`` of matplotlib, if they are given. Returns the
    figure. Raises ParameterError for a column that was not recorded.
    """
    from grainlaw.results.figures.curves import plot_columns

    return plot_columns(_named("plot_curves", results), y, x, ax)


@checked
def write_interactive(result: Result, file: str | os.PathLike[str], *, probe: Probe | None = None) -> None:
    """Write a page of HTML to click through: the curve, and beside it the cracks at the moment that is chosen.

    Pointing at a crack shows mode, opening, slip and time, and, where ``probe`` has followed its contact point, its
    path. The page is one file below 5 MB that needs no network. Raises ParameterError without Bokeh
    (``grainlaw[report]``) and for a result without frames or curves, OSError.
    """
    require_bokeh()
    from grainlaw.results.figures.interactive import write_interactive

    write_interactive(result, file, [] if probe is None else probe.paths)


def require_bokeh() -> None:
    """Raise ParameterError where Bokeh is not installed."""
    if importlib.util.find_spec("bokeh") is None:
        raise ParameterError("an interactive page needs Bokeh: pip install 'grainlaw[report]'")


def _named(where: str, results: Any) -> dict[str, Result]:
    """Results by name: by their laws, with a number where several have the same law."""
    if isinstance(results, Result):
        results = [results]
    if isinstance(results, Mapping):
        named = {str(name): result for name, result in results.items()}
    elif isinstance(results, (list, tuple)) and all(isinstance(each, Result) for each in results):
        named = {}
        for each in results:
            name = law_name(each.law)
            taken = sum(other.split(" (")[0] == name for other in named)
            named[f"{name} ({taken + 1})" if taken else name] = each
    else:
        named = {}
    if not named or not all(isinstance(each, Result) for each in named.values()):
        raise refusal(f"{where}: results", results, "results by name, or a list of at least one result")
    return named
