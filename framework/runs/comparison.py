"""Several laws on the same grains under the same test."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np

from grainlaw.arguments import Checked, checked
from grainlaw.contact import Laws
from grainlaw.naming import aligned, shown
from grainlaw.parameter import ParameterError
from grainlaw.protocol import LoadingProtocol
from grainlaw.results.certificate import marked, text_of, warnings_of
from grainlaw.results.files import file_name, writable_folder, write_atomically
from grainlaw.results.measure import Measure
from grainlaw.results.result import Result
from grainlaw.results.tables import write_curves, write_json
from grainlaw.runs.parallel import Run, simulate_all
from grainlaw.runs.stopping import Stopped
from grainlaw.short_form import html_table
from grainlaw.specimen import Specimen

if TYPE_CHECKING:
    from grainlaw.drawing.figure import Figure

#: rows of the table that a comparison prints
TABLE = (
    "strength", "failure_strain", "largest_stress", "apparent_modulus", "apparent_poisson", "modulus", "poisson",
    "tensile_cracks", "shear_cracks", "kinetic_ratio", "imbalance", "unstable_rise", "energy_error", "energy_made",
    "energy_returned", "steps", "seconds",
)  # fmt: skip


FIRST = "strength"  #: what is shown of each law in one line


@attrs.frozen(eq=False)
class Comparison(Mapping[str, Result], metaclass=Checked):
    """Results by the name of the law; prints as a table.

    The laws whose run failed are in ``failed``, with their errors; to ask for their result raises this error.
    """

    results: dict[str, Result]  #: by name of the law
    failed: dict[str, Exception] = attrs.field(factory=dict)  #: errors by name of the law

    def __getitem__(self, name: str) -> Result:
        if name in self.failed:
            raise self.failed[name]
        return self.results[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.results)

    def __len__(self) -> int:
        return len(self.results)

    @property
    def summary(self) -> dict[str, dict[str, Any]]:
        """The summaries (SI) by the name of the law."""
        return {name: result.summary for name, result in self.results.items()}

    @property
    def _facts(self) -> dict[str, str]:
        peak, name = shown(FIRST), FIRST
        texts = {
            law: f"{text_of(name, peak, result)} {peak.unit}"
            for law, result in self.results.items()
            if name in result.summary
        }
        rest = [law for law in self.results if law not in texts]
        failed = {"failed": ", ".join(self.failed)} if self.failed else {}
        return {"laws": str(len(self) + len(self.failed)), **failed, **texts, **dict.fromkeys(rest, "finished")}

    def _html(self) -> str:
        heads, *rows = self._rows()
        failed = [(name, "failed", str(error)) for name, error in self.failed.items()]
        doubted = [("doubt", words) for words in warnings_of(self.results)]
        return html_table(rows, heads) + "".join(html_table(each) for each in (failed, doubted) if each)

    def __str__(self) -> str:
        reasons = [f"{name} failed: {error}" for name, error in self.failed.items()]
        return "\n".join([aligned(self._rows(), rule=True), *reasons, *warnings_of(self.results)])

    def _rows(self) -> list[list[str]]:
        rows = [["", *self.results, *self.failed]]
        rows += [
            [
                shown(n).heading,
                *(marked(n, [r], text_of(n, shown(n), r)) for r in self.results.values()),
                *("failed" for _ in self.failed),
            ]
            for n in TABLE
        ]
        return rows

    def plot(self) -> Figure:
        """Stress-strain curves of all laws. Raises ParameterError for a test that does not record them."""
        from grainlaw.results.figures.curves import plot_curves

        return plot_curves(self.results)

    def write(self, folder: str | os.PathLike[str], record: Mapping[str, Any] | None = None) -> None:
        """Write ``comparison.png``, ``cracks_<law>.png``, ``summary.json`` and ``curves.csv``.

        ``record``, the input of the run, is added to the summary. Raises OSError where it cannot write, and
        ParameterError for a test without the columns ``strain`` and ``stress``.
        """
        from grainlaw.results.figures.cracks import plot_cracks

        cracks = ((name, plot_cracks(result, -1, name, None)) for name, result in self.results.items())
        curves = {(name,): result.curves for name, result in self.results.items()}
        content = {"laws": self.summary, **reasons(self.failed), **(record or {})}
        write_comparison(folder, self.plot(), cracks, content, curves, ("law",))

    def write_report(
        self,
        file: str | os.PathLike[str],
        *,
        title: str = "",
        record: Mapping[str, Any] | None = None,
        measures: Sequence[Measure] | None = None,
        files: Sequence[str] = (),
    ) -> None:
        """Write the laboratory report of all laws as a page of HTML; the rest is as in :meth:`Result.write_report`."""
        from grainlaw.results.figures.report import write_report

        incomplete = "; ".join(f"{name}: {error}" for name, error in self.failed.items())
        write_report(
            self.results, file, title=title, record=record, incomplete=incomplete, measures=measures, files=files
        )


def reasons(failed: Mapping[str, Exception]) -> dict[str, dict[str, str]]:
    """Why runs failed, as an entry of the summary; none where all are there."""
    return {"failed": {name: str(error) for name, error in failed.items()}} if failed else {}


def write_comparison(
    folder: str | os.PathLike[str],
    figure: Figure,
    cracks: Iterable[tuple[str, Figure]],
    summary: Mapping[str, Any],
    curves: Mapping[tuple[Any, ...], Mapping[str, np.ndarray]],
    keys: tuple[str, ...],
) -> None:
    """Write the files of a comparison: ``cracks`` are pictures by law, ``keys`` what tells the curves apart.

    Raises OSError.
    """
    path = writable_folder(folder)
    write_json(path / "summary.json", summary)
    write_curves(path / "curves.csv", curves, keys)
    write_atomically(path / "comparison.png", lambda file: figure.savefig(file, dpi=150))
    for name, each in cracks:
        write_atomically(path / f"cracks_{file_name(name)}.png", lambda file, each=each: each.savefig(file, dpi=150))  # type: ignore[misc]


@checked
def compare(
    specimen: Specimen,
    laws: Mapping[str, Laws],
    protocol: LoadingProtocol,
    **options: Any,
) -> Comparison:
    """Put one specimen through one test under several laws, as many at a time as there are ``threads`` (all cores).

    ``options`` are ``threads``; ``observers``, which maps the name of a law to the observers of its run;
    ``checkpoint``, a folder with one for each law, ``restart``, ``overwrite``; and those of :func:`simulate`. The
    results do not depend on ``threads``. A law whose run fails does not touch the others, see :class:`Comparison`; if
    all fail, the first error is raised. :class:`Stopped` has the finished laws as its ``result``.
    Bars show how far the runs are, unless ``progress`` is False.
    """
    if not laws:
        raise ParameterError("compare: laws is empty, it must name at least one law")
    runs = {name: Run(specimen, law, protocol) for name, law in laws.items()}
    try:
        outcome = simulate_all(runs, **options)
    except Stopped as stopped:
        stopped.result = Comparison(stopped.result.results, stopped.result.failed)
        raise
    return Comparison(outcome.results, outcome.failed)
