"""Several laws under the same test on several samples of the same rock: one sample says little."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import attrs

from grainlaw.arguments import Checked, checked
from grainlaw.contact import Laws
from grainlaw.naming import aligned, shown
from grainlaw.parameter import ParameterError
from grainlaw.protocol import LoadingProtocol
from grainlaw.results.certificate import marked, warnings_of
from grainlaw.results.measure import Measure
from grainlaw.results.result import Result
from grainlaw.results.samples import mean_and_range, means
from grainlaw.runs.comparison import TABLE, reasons, write_comparison
from grainlaw.runs.parallel import Run, simulate_all
from grainlaw.runs.stopping import Stopped
from grainlaw.specimen import Specimen

if TYPE_CHECKING:
    from grainlaw.drawing.figure import Figure

Test = tuple[str, int]  #: law, and seed of the sample


@attrs.frozen(eq=False)
class SampleComparison(metaclass=Checked):
    """Results by the name of the law and the seed of the sample; prints as a table of means and ranges.

    The runs that failed are in ``failed``, with their errors.
    """

    results: dict[Test, Result]
    failed: dict[Test, Exception] = attrs.field(factory=dict)

    @property
    def by_law(self) -> dict[str, dict[int, Result]]:
        """The results by law, and by seed."""
        found: dict[str, dict[int, Result]] = {}
        for (law, seed), result in self.results.items():
            found.setdefault(law, {})[seed] = result
        return found

    @property
    def named(self) -> dict[str, Result]:
        """The results by law and seed in words."""
        return {in_words(test): result for test, result in self.results.items()}

    @property
    def summary(self) -> dict[str, Any]:
        """Means (SI) by the name of the law, and the summaries of each sample by its seed."""
        samples: dict[str, dict[str, Any]] = {}
        for (law, seed), result in self.results.items():
            samples.setdefault(str(seed), {})[law] = result.summary
        laws = {law: means([r.summary for r in each.values()]) for law, each in self.by_law.items()}
        return {"laws": laws, "samples": samples}

    def __str__(self) -> str:
        by_law = self.by_law
        absent = [law for law in dict.fromkeys(law for law, _ in self.failed) if law not in by_law]
        rows = [["", *by_law, *absent]]
        for name in TABLE:
            look = shown(name)
            cells = (marked(name, each.values(), mean_and_range(look, each.values(), name)) for each in by_law.values())
            rows.append([look.heading, *cells, *("failed" for _ in absent)])
        reasons = [f"{in_words(test)} failed: {error}" for test, error in self.failed.items()]
        seeds = ", ".join(map(str, dict.fromkeys(seed for _, seed in (*self.results, *self.failed))))
        last = f"mean (range) of the samples with the seeds {seeds}"
        return "\n".join([aligned(rows, rule=True), last, *reasons, *warnings_of(self.named)])

    def plot(self) -> Figure:
        """Mean stress-strain curves of all laws, with their ranges. Raises ParameterError as :class:`Comparison`."""
        from grainlaw.results.figures.samples import plot_samples

        return plot_samples(self.by_law)

    def write(self, folder: str | os.PathLike[str], record: Mapping[str, Any] | None = None) -> None:
        """Write ``comparison.png``, ``cracks_<law>.png``, ``summary.json`` and ``curves.csv``.

        ``record``, the input of the runs, is added to the summary. Raises OSError where it cannot write, and
        ParameterError for a test without the columns ``strain`` and ``stress``.
        """
        from grainlaw.results.figures.samples import plot_cracks_of_samples

        cracks = ((law, plot_cracks_of_samples(law, results)) for law, results in self.by_law.items())
        curves = {test: result.curves for test, result in self.results.items()}
        failed = reasons({in_words(test): error for test, error in self.failed.items()})
        content = {**self.summary, **failed, **(record or {})}
        write_comparison(folder, self.plot(), cracks, content, curves, ("law", "seed"))

    def write_report(
        self,
        file: str | os.PathLike[str],
        *,
        title: str = "",
        record: Mapping[str, Any] | None = None,
        measures: Sequence[Measure] | None = None,
        files: Sequence[str] = (),
    ) -> None:
        """Write means and ranges of all samples, and the laboratory report of the first, as a page of HTML."""
        from grainlaw.results.figures.report import write_report

        first = next(iter(self.results))[1]
        results = {law: each[first] for law, each in self.by_law.items() if first in each}
        incomplete = "; ".join(f"{in_words(test)}: {error}" for test, error in self.failed.items())
        write_report(
            results,
            file,
            title=title,
            record=record,
            incomplete=incomplete,
            measures=measures,
            samples=self.by_law,
            files=files,
        )


@checked
def compare_samples(
    specimens: Mapping[int, Specimen],
    laws: Mapping[str, Laws],
    protocol: LoadingProtocol,
    **options: Any,
) -> SampleComparison:
    """Put each of several samples (by seed) through one test under several laws, as many runs at a time as ``threads``.

    ``options`` are those of :func:`~grainlaw.runs.comparison.compare`; ``observers`` maps the name of a law and a seed
    to the observers of that run. A run that fails does not touch the others. :class:`Stopped` has the finished runs as
    its ``result``.
    """
    if not laws or not specimens:
        raise ParameterError("compare_samples: there must be at least one law and one specimen")
    runs = {(law, seed): Run(specimens[seed], laws[law], protocol) for seed in specimens for law in laws}
    try:
        outcome = simulate_all(runs, folder=folder_name, **options)
    except Stopped as stopped:
        stopped.result = SampleComparison(stopped.result.results, stopped.result.failed)
        raise
    return SampleComparison(outcome.results, outcome.failed)


def in_words(test: Test) -> str:
    """``linear, seed 1``."""
    return f"{test[0]}, seed {test[1]}"


def folder_name(test: Test) -> str:
    """The folder of one run inside that of the comparison."""
    return f"{test[0]}_seed_{test[1]}"
