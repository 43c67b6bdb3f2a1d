"""A page on one run to click through: the curve, and the cracks at the moment that is chosen (Bokeh)."""

from __future__ import annotations

import importlib.util
import math
import os
from collections.abc import Sequence
from typing import Any

import numpy as np

from grainlaw.arguments import checked
from grainlaw.columns import TIME, quantity_of
from grainlaw.fields import ParameterError
from grainlaw.results.archive import in_words, law_name
from grainlaw.results.figures.cracks import RIM, SHEAR, TENSILE, outlines, unit_of
from grainlaw.results.figures.pages import write_page
from grainlaw.results.probe import ContactPath, Probe
from grainlaw.results.result import Result, contact_segments

MOST_BYTES = 2.3e6  #: of rims and cracks in all moments: with Bokeh and in text, the page stays below 5 MB
HEIGHT = 460  #: of each panel, pixels
MOST_SAMPLES = 300  #: of each path


def require_bokeh() -> None:
    """Raise ParameterError where Bokeh is not installed."""
    if importlib.util.find_spec("bokeh") is None:
        raise ParameterError("an interactive page needs Bokeh: pip install 'grainlaw[report]'")


@checked
def write_interactive(result: Result, file: str | os.PathLike[str], *, probe: Probe | None = None) -> None:
    """Write a page of HTML to click through: the curve, and beside it the cracks at the moment that is chosen.

    Pointing at a crack shows mode, opening, slip and time, and, where ``probe`` has followed its contact point, its
    path. The page is one file below 5 MB that needs no network. Raises ParameterError without Bokeh
    (``grainlaw[report]``) and for a result without frames or curves, OSError.
    """
    require_bokeh()
    from bokeh.embed import components
    from bokeh.resources import Resources

    result.frame("write_interactive", -1)
    if not result.curves:
        raise ParameterError("write_interactive: the result has no curves")
    script, divisions = components(_panels(result, [] if probe is None else probe.paths))
    resources = Resources(mode="inline", components=["bokeh", "bokeh-widgets"]).render()
    write_page(
        file, "results/figures/interactive.html", title=f"{in_words(result.protocol)}: {law_name(result.law)}",
        resources=resources, divisions=divisions, script=script,
    )  # fmt: skip


def _panels(result: Result, paths: Sequence[ContactPath]) -> list[Any]:
    from bokeh.models import ColumnDataSource, CustomJS, CustomJSTickFormatter, HoverTool, Slider
    from bokeh.transform import linear_cmap

    frames = _chosen(result)
    table = {key: ColumnDataSource(values) for key, values in _tables(result, frames, paths).items()}
    count = len(frames)
    shown = CustomJSTickFormatter(args={"moments": table["moments"]}, code=SHOWN)
    slider = Slider(
        start=0, end=max(count - 1, 1), value=count - 1, step=1, format=shown, sizing_mode="stretch_width",
        title=result.quantity(_axes_of(result)[0]).heading,
    )  # fmt: skip
    curve, marks = _curve(result, table["moments"])
    specimen = _figure(*(f"{axis} ({unit_of(result).name})" for axis in "xy"), match_aspect=True)
    rims, cracks, path = (ColumnDataSource({}) for _ in range(3))
    rims.data = {name: values[len(values) - len(values) // count :] for name, values in table["outlines"].data.items()}
    first = table["moments"].data["first"]
    cracks.data = {name: values[first[-1] :] for name, values in table["cracks"].data.items()}
    shown_first = table["paths"].data["point"] == (paths[0].point if paths else -1)
    path.data = {name: values[shown_first] for name, values in table["paths"].data.items()}
    specimen.line("x", "y", source=rims, line_color=RIM, line_width=0.8)
    colors = linear_cmap("mode", [TENSILE, SHEAR], 0, 1)
    lines = specimen.segment("x0", "y0", "x1", "y1", source=cracks, line_color=colors, line_width=2.4)
    pull = _figure(*(quantity_of(name).heading for name in ("opening", "normal")))
    pull.title.text = f"contact point {paths[0].point}" if paths else ""
    shear = _figure(*(quantity_of(name).heading for name in ("slip", "shear")))
    pull.line("opening", "normal", source=path, line_color=TENSILE, line_width=1.5)
    shear.line("slip", "shear", source=path, line_color=SHEAR, line_width=1.5)
    shares = {"slider": slider, "moments": table["moments"], "marks": marks, "count": count}
    held = {"rims": rims, "cracks": cracks, "outlines": table["outlines"], "every": table["cracks"]}
    change = CustomJS(args=shares | held, code=CHANGE)
    slider.js_on_change("value", change)
    curve.js_on_event("tap", CustomJS(args=shares, code=NEAREST))
    follow = CustomJS(args={"cracks": cracks, "path": path, "paths": table["paths"], "pull": pull}, code=FOLLOW)
    broke = quantity_of("broken_time")
    tips = [
        ("mode (share of shear)", "@mode{0.00}"),
        *((look.words, f"@{look.name}{{0.00}} {look.unit}") for look in map(quantity_of, ("opening", "slip"))),
        (broke.words, f"@time{{0.0000}} {broke.unit}"), ("contact point", "@point"),
        ("followed by a probe", "@followed{0}"),
    ]  # fmt: skip
    specimen.add_tools(HoverTool(renderers=[lines], tooltips=tips, callback=follow))
    return [slider, curve, specimen, *([pull, shear] if paths else [])]


#: the slider's number of a moment as the value there
SHOWN = "return String(Number(moments.data.x[Math.min(Math.round(tick), moments.data.x.length - 1)].toPrecision(4)))"
#: the slider has been moved
CHANGE = """
const k = slider.value, n = outlines.data.x.length / count, first = moments.data.first;
const end = k + 1 < first.length ? first[k + 1] : every.data.x0.length;
rims.data = {x: outlines.data.x.slice(k * n, (k + 1) * n), y: outlines.data.y.slice(k * n, (k + 1) * n)};
const chosen = {};
for (const name of Object.keys(every.data)) chosen[name] = every.data[name].slice(first[k], end);
cracks.data = chosen;
marks.data = {x: [moments.data.x[k]], y: [moments.data.y[k]]};
"""
#: the curve has been clicked
NEAREST = """
const x = moments.data.x;
let best = 0;
for (let k = 0; k < x.length; k++) if (Math.abs(x[k] - cb_obj.x) < Math.abs(x[best] - cb_obj.x)) best = k;
slider.value = best;
"""
#: a crack is pointed at
FOLLOW = """
const k = cb_data.index.indices[0];
if (k === undefined) return;
const rows = [], points = paths.data.point;
for (let i = 0; i < points.length; i++) if (points[i] == cracks.data.point[k]) rows.push(i);
if (!rows.length) return;
const found = {};
for (const name of Object.keys(paths.data)) found[name] = rows.map(i => paths.data[name][i]);
path.data = found;
pull.title.text = "contact point " + cracks.data.point[k];
"""


def _figure(x: str, y: str, **options: Any) -> Any:
    """Each as large as the others."""
    from bokeh.plotting import figure

    look = {"tools": "pan,wheel_zoom,box_zoom,reset,save", "sizing_mode": "stretch_width", "height": HEIGHT}
    made = figure(title="", **look, **options)
    made.xaxis.ticker.desired_num_ticks = 4  # labels as long as 2.500e+5 stand beside each other on a narrow page
    made.xaxis.axis_label, made.yaxis.axis_label = x, y
    made.toolbar.logo = None
    return made


def _axes_of(result: Result) -> Sequence[str]:
    """The two columns of its usual picture."""
    return result.panels[0].names[:2]


def _curve(result: Result, moments: Any) -> tuple[Any, Any]:
    """The curve with its moments, and the source of the mark on the chosen one."""
    from bokeh.models import ColumnDataSource, HoverTool

    names = [result.quantity(name).heading for name in _axes_of(result)]
    made = _figure(*names)
    x, y = map(result.shown, _axes_of(result))
    made.line(x.astype(np.float32), y.astype(np.float32), line_color="#333333", line_width=1.5)
    dots = made.scatter("x", "y", source=moments, size=7, color="#888888")
    marks = ColumnDataSource({name: moments.data[name][-1:] for name in ("x", "y")})
    made.scatter("x", "y", source=marks, size=13, color=TENSILE)
    tips = [*zip(names, ("@x{0.0000}", "@y{0.00}"), strict=True), ("cracks", "@cracks")]
    made.add_tools(HoverTool(renderers=[dots], tooltips=tips))
    return made, marks


def _chosen(result: Result) -> list[int]:
    """Numbers of the frames that are shown: all, or every other and so on where that is much, with the last."""
    broken = sum(np.count_nonzero(~np.isnan(frame.bonds["broken_time"])) for frame in result.frames)
    size = 8 * len(_ring(result)) * len(result.frames) + 37 * int(broken)
    every = max(1, math.ceil(size / MOST_BYTES))
    return list(range(len(result.frames) - 1, -1, -every))[::-1]


def _ring(result: Result) -> np.ndarray:
    """Nodes round each grain, its first node again, and -1 where the pen is lifted."""
    rim = outlines(result)
    after = dict(zip(rim[:, 0].tolist(), rim[:, 1].tolist(), strict=True))
    ring: list[int] = []
    while after:
        node = begin = next(iter(after))
        while node in after:
            ring.append(node)
            node = after.pop(node)
        ring += [begin, -1]
    return np.array(ring)


def _tables(result: Result, frames: Sequence[int], paths: Sequence[ContactPath]) -> dict[str, dict[str, np.ndarray]]:
    """Columns of what the page holds: moments, rims of grains and cracks one moment after the other, and paths."""
    times = [result.frames[k].time for k in frames]
    x, y = (np.interp(times, result.curves[TIME], result.shown(name)) for name in _axes_of(result))
    ring, followed = _ring(result), {path.point for path in paths}
    rims, rows, numbers = [], [], []
    for k in frames:
        frame = result.frames[k]
        place = (result.mesh.nodes + frame.displacement) * unit_of(result).factor
        rims.append(np.where(ring[:, None] < 0, np.nan, place[ring]))
        broken = np.flatnonzero(~np.isnan(frame.bonds["broken_time"]))
        numbers.append(len(broken))
        ends = contact_segments(place, result.interfaces)[broken].reshape(-1, 4)
        bonds = [frame.bonds[name][broken] * quantity_of(name).factor for name in BONDS]
        rows.append(np.column_stack([ends, *bonds, broken]))
    flat = np.concatenate(rows)
    names = ("x0", "y0", "x1", "y1", "mode", "opening", "slip", "time")
    columns = dict(zip(names, flat.T.astype(np.float32), strict=False))
    point = flat[:, -1].astype(np.int32)
    outlines = np.concatenate(rims).astype(np.float32)
    first = np.concatenate([[0], np.cumsum(numbers)[:-1]]).astype(np.int32)
    return {
        "moments": {"x": x, "y": y, "first": first, "cracks": np.array(numbers, dtype=np.int32)},
        "outlines": {"x": outlines[:, 0], "y": outlines[:, 1]},
        "cracks": {**columns, "point": point, "followed": np.isin(point, list(followed)).astype(np.uint8)},
        "paths": _paths(paths),
    }


TRACTIONS = ("opening", "normal", "slip", "shear")
BONDS = ("mode", "opening", "slip", "broken_time")


def _paths(paths: Sequence[ContactPath]) -> dict[str, np.ndarray]:
    """The paths one after the other, thinned, with the number of their contact point."""
    found: dict[str, list[np.ndarray]] = {name: [np.zeros(0)] for name in ("point", *TRACTIONS)}
    for path in paths:
        rows = np.unique(np.linspace(0, len(path.time) - 1, MOST_SAMPLES).astype(int))
        found["point"].append(np.full(len(rows), path.point))
        for name in TRACTIONS:
            found[name].append(getattr(path, name)[rows] * quantity_of(name).factor)
    return {name: np.concatenate(each).astype(np.float32) for name, each in found.items()}
