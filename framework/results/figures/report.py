"""The laboratory report of a test: one page of HTML, with its figures."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator, Mapping, Sequence
from numbers import Real
from typing import Any

import attrs
import numpy as np

from grainlaw.columns import quantity_of
from grainlaw.edge_keys import words_of
from grainlaw.messages import short
from grainlaw.quantity import Quantity
from grainlaw.results.archive import READ, called, in_words, law_name
from grainlaw.results.certificate import COST, FAIL, LIMITS, can_fail, fails, has_failed, text_of, warnings_of
from grainlaw.results.figures.cracks import pressures_side_by_side, side_by_side, temperatures_side_by_side
from grainlaw.results.figures.curves import plot_report_curves, plot_samples
from grainlaw.results.figures.pages import Cell, write_page
from grainlaw.results.laboratory import Laboratory
from grainlaw.results.means import ENOUGH, Samples, mean_and_interval, mean_and_range
from grainlaw.results.measure import Measure
from grainlaw.results.result import Result
from grainlaw.results.standard_measures import thresholds
from grainlaw.short_form import rounded
from grainlaw.time_series import TimeSeries
from grainlaw.unit_text import written


def write_report(
    results: Mapping[str, Result], file: str | os.PathLike[str], *, title: str = "",
    record: Mapping[str, Any] | None = None, incomplete: str = "", measures: Sequence[Measure] | None = None,
    samples: Samples | None = None, files: Sequence[str] = (),
) -> None:  # fmt: skip
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
    every = {f"{law}, seed {seed}": result for law, each in (samples or {}).items() for seed, result in each.items()}
    write_page(
        file, "results/figures/report.html", title=title or f"{in_words(first.protocol)}: {', '.join(results)}",
        incomplete=incomplete, doubts=list(warnings_of(every or results)), laws=list(results),
        samples=_all_samples(samples, first) if samples else None, properties=_properties(results),
        has_apparent="apparent_modulus" in first.summary,
        has_open=any(can_fail(result) and not has_failed(result) for result in results.values()),
        certificate=_certificate(results), curves=plot_report_curves(results) if first.curves else None,
        cracks=side_by_side(results) if all(result.frames for result in results.values()) else None,
        heat=temperatures_side_by_side(results), fluids=pressures_side_by_side(results),
        measures=_measures(laboratories) if first.curves else [],
        not_measured=_not_measured(laboratories) if first.curves else [],
        patterns={law: laboratories[law].plot() if len(each.cracks) else None for law, each in results.items()}
        if first.curves else {},
        components=list(_components(results)), record=list(_record(record or {})), files=files,
    )  # fmt: skip


def _all_samples(samples: Samples, first: Result) -> dict[str, Any]:
    """Means and ranges, and which sample the rest of the page is about."""
    looks = [first.quantity(name) for name in first.summary if name not in (*LIMITS, *COST)]
    return {
        "rows": [
            [look.heading, *(mean_and_range(look.brief, each.values(), look.name) for each in samples.values())]
            for look in looks
        ],
        "thresholds": list(_thresholds(samples)),
        "too_few": min(map(len, samples.values())) < ENOUGH,
        "laws": list(samples),
        "figure": plot_samples(samples),
        "seeds": list(dict.fromkeys(seed for each in samples.values() for seed in each)),
        "this": next(seed for each in samples.values() for seed, result in each.items() if result is first),
    }


def _thresholds(samples: Samples) -> Iterator[list[str]]:
    """CI and CD over the specimens, without those that none has."""
    for measure in thresholds():
        values = [np.array([r.laboratory.value(measure.name) for r in each.values()]) for each in samples.values()]
        if not np.isnan(np.concatenate(values)).all():
            look = _look(measure)
            yield [look.heading, *(mean_and_interval(look, of_law) for of_law in values), measure.source]


def _properties(results: Mapping[str, Result]) -> list[list[str]]:
    names = dict.fromkeys(name for result in results.values() for name in result.summary)
    first, could_fail = next(iter(results.values())), any(map(can_fail, results.values()))
    rows = [
        [first.quantity(name).heading, *(text_of(name, r.quantity(name).brief, r) for r in results.values())]
        for name in names
        if name not in LIMITS
    ]
    return [row for row in rows if could_fail or set(row[1:]) != {"-"}]  # where nothing can fail there is no strength


def _certificate(results: Mapping[str, Result]) -> list[list[str]]:
    rows = []
    for name, (limit, _) in LIMITS.items():
        cells = [_verdict(name, result.summary.get(name)) for result in results.values()]
        if any(cells):
            rows.append([quantity_of(name).heading, Cell(quantity_of(name).text(limit)), *cells])
    return rows


def _verdict(name: str, value: float | None) -> str:
    if value is None:
        return ""
    if math.isnan(value):
        return Cell(f"cannot be computed {FAIL}", "fail")
    failed = fails(name, value)
    return Cell(f"{quantity_of(name).text(value)} {FAIL if failed else 'pass'}", "fail" if failed else "pass")


def _look(measure: Measure) -> Quantity:
    """How a measure is shown: by its meaning."""
    return attrs.evolve(measure.quantity, words=measure.meaning).brief


def _not_measured(laboratories: Mapping[str, Laboratory]) -> list[str]:
    """What does not exist and why, by law where laws differ."""
    notes = {name: laboratory.note for name, laboratory in laboratories.items() if laboratory.note}
    same = len(set(notes.values())) == 1 and len(notes) == len(laboratories)
    return list(notes.values())[:1] if same else [f"{name}: {note}" for name, note in notes.items()]


def _measures(laboratories: Mapping[str, Laboratory]) -> list[list[str]]:
    """The measures with the sources of their definitions; without what does not exist in this test."""
    rows = []
    for measure in next(iter(laboratories.values())).measures:
        values = [laboratory.properties[measure.name] for laboratory in laboratories.values()]
        if not np.isnan(values).all():
            how = _look(measure)
            rows.append([how.heading, *(Cell(how.text(float(value))) for value in values), measure.source])
    return rows


def _components(results: Mapping[str, Result]) -> Iterator[tuple[str, list[list[str]]]]:
    first = next(iter(results.values()))
    specimen = first.specimen
    yield "Specimen", _specimen_rows(first)
    materials = specimen.material if isinstance(specimen.material, Mapping) else {"": specimen.material}
    for phase, material in materials.items():
        yield f"{called(material)} grains {'of other minerals' if phase is ... else phase}".strip(), _rows(material)
    for name, result in results.items():
        laws = result.law if isinstance(result.law, Mapping) else {"": result.law}
        for pair, law in laws.items():
            kind = law_name(law)
            between = f" {words_of(pair)}" if pair != "" else ""
            yield (kind if name == kind or len(results) == 1 else f"{name} ({kind})") + between, _rows(law)
    yield in_words(first.protocol), _rows(first.protocol)


def _specimen_rows(result: Result) -> list[list[str]]:
    grains, mesh = result.specimen.grains, result.mesh
    low, high = grains.region.bounds
    return [
        ["width", rounded(high[0] - low[0], "m")],
        ["height", rounded(high[1] - low[1], "m")],
        ["grains", str(grains.count)],
        ["mean grain size", rounded(grains.mean_size, "m")],
        ["contact points", str(2 * len(mesh.interfaces))],
        ["kind of contact points", type(result.specimen.contact_points).__name__],
        ["zones", str(len(mesh.zones))],
        ["refinement", str(result.specimen.refinement)],
        *(["to cite", work] for work in result.specimen.cite),
    ]


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
        elif isinstance(value, np.ndarray):
            rows.append([name, short(value)])
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
    return f"{rounded(value.min(), unit)} to {rounded(value.max(), unit)} in {len(value)} values"


def _record(record: Mapping[str, Any]) -> Iterator[tuple[str, list[list[str]]]]:
    rows = [[name, str(value)] for name, value in record.items() if not isinstance(value, Mapping)]
    if rows:
        yield "", rows
    for name, section in record.items():
        if isinstance(section, Mapping):
            yield name, _flat(section)


def _flat(section: Mapping[str, Any], before: str = "") -> list[list[str]]:
    rows = []
    for name, value in section.items():
        rows += _flat(value, f"{before}{name}.") if isinstance(value, Mapping) else [[f"{before}{name}", str(value)]]
    return rows
