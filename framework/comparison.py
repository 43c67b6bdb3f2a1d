"""Several laws on the same grains under the same test."""

from __future__ import annotations

import csv
import io
import json
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np

from grainlaw.assembly import Laws
from grainlaw.files import file_name, without_nan, writable_folder, write_atomically
from grainlaw.loading import LoadingProtocol
from grainlaw.observation import Observer
from grainlaw.parallel import Run, simulate_all
from grainlaw.parameter import ParameterError
from grainlaw.result import Result
from grainlaw.specimen import Specimen

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: rows of the table: heading, name in the summary, factor, format
TABLE = (
    ("peak stress (MPa)", "peak_stress", 1e-6, ".2f"), ("strain at peak (%)", "peak_strain", 1e2, ".4f"),
    ("E* (GPa)", "apparent_modulus", 1e-9, ".2f"), ("nu*", "apparent_poisson", 1, ".3f"),
    ("E (GPa)", "modulus", 1e-9, ".2f"), ("nu", "poisson", 1, ".3f"),
    ("tensile cracks", "tensile_cracks", 1, ".0f"), ("shear cracks", "shear_cracks", 1, ".0f"),
    ("kinetic ratio", "kinetic_ratio", 1, ".1e"), ("platen imbalance (%)", "platen_imbalance", 1e2, ".2f"),
    ("energy error", "energy_error", 1, ".1e"), ("steps", "steps", 1, ".0f"), ("seconds", "seconds", 1, ".1f"),
)  # fmt: skip


@attrs.frozen(eq=False)
class Comparison(Mapping[str, Result]):
    """Results by the name of the law; prints as a table."""

    results: dict[str, Result]

    def __getitem__(self, name: str) -> Result:
        return self.results[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.results)

    def __len__(self) -> int:
        return len(self.results)

    @property
    def summary(self) -> dict[str, dict[str, Any]]:
        """The summaries (SI) by the name of the law."""
        return {name: result.summary for name, result in self.results.items()}

    def __str__(self) -> str:
        rows = [["", *self.results]]
        for heading, key, factor, form in TABLE:
            values = [summary.get(key) for summary in self.summary.values()]
            rows.append([heading, *("-" if v is None else f"{v * factor:{form}}" for v in values)])
        widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
        lines = [
            "  ".join([row[0].ljust(widths[0]), *(c.rjust(w) for c, w in zip(row[1:], widths[1:], strict=True))])
            for row in rows
        ]
        lines.insert(1, "  ".join("-" * width for width in widths))
        return "\n".join(lines)

    def plot(self) -> Figure:
        """Stress-strain curves of all laws."""
        from grainlaw.view import plot_curves

        return plot_curves(self.results)

    def write(self, folder: str | os.PathLike[str], record: Mapping[str, Any] | None = None) -> None:
        """Write ``comparison.png``, ``cracks_<law>.png``, ``summary.json`` and ``curves.csv``.

        ``record`` is added to the summary: what the run was made with. Raises OSError where it cannot.
        """
        from grainlaw.view import plot_cracks

        path = writable_folder(folder)
        content = {"laws": self.summary, **(record or {})}
        text = json.dumps(without_nan(content), indent=2, allow_nan=False) + "\n"
        write_atomically(path / "summary.json", lambda file: file.write_text(text, encoding="utf-8"))
        write_atomically(path / "curves.csv", self._write_curves)
        write_atomically(path / "comparison.png", lambda file: self.plot().savefig(file, dpi=150))
        for name, result in self.results.items():
            figure = plot_cracks(result, name)
            write_atomically(path / f"cracks_{file_name(name)}.png", lambda file, f=figure: f.savefig(file, dpi=150))  # type: ignore[misc]

    def _write_curves(self, file: Path) -> None:
        columns = list(dict.fromkeys(name for result in self.results.values() for name in result.curves))
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(["law", *columns])
        for name, result in self.results.items():
            count = len(result.curves["time"])
            table = [result.curves.get(column, np.full(count, np.nan)) for column in columns]
            writer.writerows([name, *(f"{value:.9g}" for value in row)] for row in zip(*table, strict=True))
        file.write_text(text.getvalue(), encoding="utf-8")


def compare(
    specimen: Specimen,
    laws: Mapping[str, Laws],
    protocol: LoadingProtocol,
    *,
    threads: int | None = None,
    observers: Callable[[str], Sequence[Observer]] = lambda name: (),
    **options: Any,
) -> Comparison:
    """Put one specimen through one test under several laws, as many at a time as there are ``threads`` (all cores).

    ``observers`` gives those of each run by the law's name; ``options`` go to :func:`simulate`. The results do not
    depend on ``threads``.
    """
    if not isinstance(laws, Mapping):
        raise ParameterError(f"compare: laws = {laws!r} is not allowed, it must be a mapping from names to laws")
    if not laws:
        raise ParameterError("compare: laws is empty, it must name at least one law")
    runs = {name: Run(specimen, law, protocol) for name, law in laws.items()}
    return Comparison(simulate_all(runs, threads=threads, observers=observers, **options))
