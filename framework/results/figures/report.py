"""The laboratory report of a test: one page of HTML, with its figures."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Iterator, Mapping, Sequence
from datetime import datetime
from importlib.metadata import version
from numbers import Real
from pathlib import Path
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np

from grainlaw.columns import quantity_of
from grainlaw.contact import words_of
from grainlaw.results.archive import READ, called
from grainlaw.results.certificate import COST, FAIL, LIMITS, can_fail, fails, has_failed, text_of, warnings_of
from grainlaw.results.figures import html
from grainlaw.results.figures.cracks import side_by_side
from grainlaw.results.figures.report_figures import plot_report_curves
from grainlaw.results.figures.sample_figures import plot_samples
from grainlaw.results.files import write_atomically
from grainlaw.results.laboratory import Laboratory
from grainlaw.results.means import Samples, mean_and_range
from grainlaw.time_series import TimeSeries
from grainlaw.unit_text import written

if TYPE_CHECKING:
    from grainlaw.results.measure import Measure
    from grainlaw.results.result import Result

CRACKS = "Broken contacts on the deformed specimens at one scale: tensile thin and orange, shear thick and blue"


def write_report(
    results: Mapping[str, Result],
    file: str | os.PathLike[str],
    *,
    title: str = "",
    record: Mapping[str, Any] | None = None,
    incomplete: str = "",
    measures: Sequence[Measure] | None = None,
    samples: Samples | None = None,
    files: Sequence[str] = (),
) -> None:
    """Write the results of one test under one law or several, by the laws' names, as a page of HTML.

    ``samples`` are those of the same laws on several samples: their means and ranges come first, and ``results`` are
    those of one of them.

    ``record`` is shown at the end: what else belongs to the run, such as versions. ``incomplete`` says why a test did
    not end as it should. ``measures`` are those of the table, the standard ones (``MEASURES``) if not given.
    ``files`` are linked: files beside the page, by their names, or in folders beside it.
    Raises OSError where it cannot write.
    """
    laboratories = {
        name: result.laboratory if measures is None else Laboratory(result, measures)
        for name, result in results.items()
    }
    first = next(iter(results.values()))
    name = title or f"{_words(first.protocol)}: {', '.join(results)}"
    parts = _parts(name, results, laboratories, record or {}, incomplete, samples or {}, files)
    content = html.page(name, parts)
    write_atomically(Path(file), lambda path: path.write_text(content, encoding="utf-8"))


def _parts(
    title: str,
    results: Mapping[str, Result],
    laboratories: Mapping[str, Laboratory],
    record: Mapping[str, Any],
    incomplete: str,
    samples: Samples,
    files: Sequence[str],
) -> Iterator[str]:
    first = next(iter(results.values()))
    yield html.text("h1", title)
    yield html.text("p", f"grainlaw {version('grainlaw')}, {datetime.now():%Y-%m-%d %H:%M}")
    if incomplete:
        yield html.text("p", f"Incomplete: {incomplete}. What follows was recorded before.", "warning")
    every = {f"{law}, seed {seed}": result for law, each in samples.items() for seed, result in each.items()}
    for warning in warnings_of(every or results):
        yield html.text("p", warning, "warning")
    if samples:
        yield from _all_samples(samples, first)
    yield html.text("h2", "Properties")
    yield _properties(results)
    if "apparent_modulus" in first.summary:
        yield html.text("p", "E* and nu* are slopes as measured in the plane; E and nu are those of the rock.")
    if any(can_fail(result) and not has_failed(result) for result in results.values()):
        yield html.text("p", "> stands before the largest stress of a specimen that had not failed.")
    yield html.text("h2", "Certificate")
    yield _certificate(results)
    if first.curves:
        yield html.text("h2", "Curves")
        yield html.picture(plot_report_curves(results), "What was measured, broken contact points, and energies")
    yield html.text("h2", "Cracks")
    yield html.picture(side_by_side(results, -1, None), CRACKS)
    if first.curves:
        yield html.text("h2", "Laboratory measures")
        yield from _measures(laboratories)
        for name, laboratory in laboratories.items():
            if not len(results[name].cracks):
                yield html.text("p", f"{name}: no contact has broken, so there is nothing to draw of cracks.")
                continue
            caption = f"Thresholds, orientation of cracks, fragments, acoustic events and energy lost: {name}"
            yield html.picture(laboratory.plot(), caption)
    yield html.text("h2", "Specimen, law and test")
    yield html.side_by_side(_components(results))
    if record:
        yield html.text("h2", "Record")
        yield html.side_by_side(_record(record))
    if files:
        yield html.text("h2", "Files")
        yield html.links(files)


def _all_samples(samples: Samples, first: Result) -> Iterator[str]:
    """Means and ranges, and which sample the rest of the page is about."""
    names = (name for name in first.summary if name not in (*LIMITS, *COST))
    rows = [
        [
            first.quantity(n).heading,
            *(_number(mean_and_range(first.quantity(n).brief, each.values(), n)) for each in samples.values()),
        ]
        for n in names
    ]
    yield html.text("h2", "Means and ranges of all samples")
    yield html.table(rows, ["", *samples])
    yield html.picture(plot_samples(samples), "Mean curves with the range of the samples, and broken contact points")
    seeds = dict.fromkeys(seed for each in samples.values() for seed in each)
    this = next(seed for each in samples.values() for seed, result in each.items() if result is first)
    words = f"The samples are those of the seeds {', '.join(map(str, seeds))}; what follows is of seed {this}."
    yield html.text("p", words)


def _properties(results: Mapping[str, Result]) -> str:
    names = dict.fromkeys(name for result in results.values() for name in result.summary)
    first = next(iter(results.values()))
    rows = [
        [first.quantity(name).heading, *(_number(_property(result, name)) for result in results.values())]
        for name in names
        if name not in LIMITS
    ]
    return html.table(rows, ["", *results])


def _property(result: Result, name: str) -> str:
    """Three digits."""
    return text_of(name, result.quantity(name).brief, result)


def _certificate(results: Mapping[str, Result]) -> str:
    rows = []
    for name, (limit, _) in LIMITS.items():
        cells = [_verdict(name, result.summary.get(name)) for result in results.values()]
        if any(cells):
            rows.append([quantity_of(name).heading, _number(quantity_of(name).text(limit)), *cells])
    return html.table(rows, ["", "at most", *results])


def _verdict(name: str, value: float | None) -> str:
    if value is None:
        return ""
    if math.isnan(value):
        return html.Cell(f"cannot be computed {FAIL}", "fail")
    failed = fails(name, value)
    return html.Cell(f"{quantity_of(name).text(value)} {FAIL if failed else 'pass'}", "fail" if failed else "pass")


def _measures(laboratories: Mapping[str, Laboratory]) -> Iterator[str]:
    """The measures with the sources of their definitions; without what does not exist in this test."""
    first = next(iter(laboratories.values()))
    rows = []
    for measure in first.measures:
        values = [laboratory.properties[measure.name] for laboratory in laboratories.values()]
        if not np.isnan(values).all():
            how = attrs.evolve(measure.quantity, words=measure.meaning).brief
            rows.append([how.heading, *(_number(how.text(float(value))) for value in values), measure.source])
    yield html.table(rows, ["", *laboratories, "source"])
    if first.note:
        yield html.text("p", f"Not measured: {first.note}.")


def _number(text: str) -> str:
    return html.Cell(text, "number")


def _components(results: Mapping[str, Result]) -> Iterator[str]:
    first = next(iter(results.values()))
    specimen = first.specimen
    yield html.table(_specimen_rows(first), caption="Specimen")
    materials = specimen.material if isinstance(specimen.material, Mapping) else {"": specimen.material}
    for phase, material in materials.items():
        yield html.table(_rows(material), caption=f"{called(material)} grains {phase}".strip())
    for name, result in results.items():
        laws = result.law if isinstance(result.law, Mapping) else {"": result.law}
        for pair, law in laws.items():
            kind = called(law)
            between = f" {words_of(pair)}" if pair != "" else ""
            yield html.table(_rows(law), caption=(kind if name == kind else f"{name} ({kind})") + between)
    yield html.table(_rows(first.protocol), caption=_words(first.protocol))


def _specimen_rows(result: Result) -> list[list[str]]:
    grains, mesh = result.specimen.grains, result.mesh
    low, high = grains.region.bounds
    return [
        ["width", written(_rounded(high[0] - low[0]), "m")],
        ["height", written(_rounded(high[1] - low[1]), "m")],
        ["grains", str(grains.count)],
        ["mean grain size", written(_rounded(np.sqrt(grains.areas.mean())), "m")],
        ["contact points", str(2 * len(mesh.interfaces))],
        ["kind of contact points", type(result.specimen.contact_points).__name__],
        ["zones", str(len(mesh.zones))],
        ["refinement", str(result.specimen.refinement)],
    ]


def _rounded(value: Any) -> float:
    return float(f"{value:.4g}")


def _rows(component: Any, before: str = "") -> list[list[str]]:
    """Name and value of each parameter; those of a part follow the part."""
    if isinstance(component, READ):
        return _flat(component.parameters)
    rows = []
    for field in attrs.fields(type(component)):
        value, name = getattr(component, field.name), before + field.name
        if not field.init:
            continue
        if isinstance(value, TimeSeries):
            rows.append([name, value.in_words(field.metadata["unit"])])
        elif attrs.has(type(value)):
            rows += [[name, type(value).__name__], *_rows(value, f"{name}.")]
        elif "unit" in field.metadata and isinstance(value, (Real, np.ndarray)):
            rows.append([name, _range(value, field.metadata["unit"])])
        elif value is None or value == ():
            rows.append([name, "-"])
        elif isinstance(value, tuple):
            rows.append([name, ", ".join(map(str, value))])
        else:
            rows.append(
                [name, value.name.lower() if hasattr(value, "name") else getattr(value, "__qualname__", str(value))]
            )
    return rows


def _range(value: Any, unit: str) -> str:
    if not isinstance(value, np.ndarray):
        return written(value, unit)
    return f"{written(_rounded(value.min()), unit)} to {written(_rounded(value.max()), unit)} in {len(value)} values"


def _record(record: Mapping[str, Any]) -> Iterator[str]:
    rows = [[name, str(value)] for name, value in record.items() if not isinstance(value, Mapping)]
    if rows:
        yield html.table(rows)
    for name, section in record.items():
        if isinstance(section, Mapping):
            yield html.table(_flat(section), caption=name)


def _flat(section: Mapping[str, Any], before: str = "") -> list[list[str]]:
    rows = []
    for name, value in section.items():
        rows += _flat(value, f"{before}{name}.") if isinstance(value, Mapping) else [[f"{before}{name}", str(value)]]
    return rows


def _words(component: Any) -> str:
    """``UniaxialCompression`` as words."""
    return " ".join(re.findall(r"[A-Z]+[a-z0-9]*", called(component))).capitalize()
