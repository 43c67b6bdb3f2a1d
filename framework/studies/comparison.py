"""Several laws under the same test on the same grains, and on several samples of them: one sample says little."""

from __future__ import annotations

import functools
import os
from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np

from grainlaw.arguments import Checked, checked
from grainlaw.contact import Laws
from grainlaw.fields import ParameterError
from grainlaw.protocol import LoadingProtocol
from grainlaw.quantity import Quantity, aligned
from grainlaw.results.archive import called
from grainlaw.results.certificate import marked, warnings_of
from grainlaw.results.files import file_name, writable_folder, write_atomically
from grainlaw.results.means import mean_and_range, means
from grainlaw.results.measure import Measure
from grainlaw.results.result import Result
from grainlaw.results.standard_measures import MEASURES
from grainlaw.results.tables import latex_lines, write_curves, write_json
from grainlaw.runs.parallel import Run, simulate_all
from grainlaw.runs.stopping import Stopped
from grainlaw.short_form import html_table
from grainlaw.specimen import Specimen
from grainlaw.studies.case import FINISHED, found_by
from grainlaw.studies.store import InMemory
from grainlaw.studies.table import Table

if TYPE_CHECKING:
    from grainlaw.drawing.figure import Figure

Key = str | tuple[str, int]  #: the name of a law; where there are several samples, and the seed of one


@attrs.frozen(eq=False)
class Comparison(Mapping[Key, Result], metaclass=Checked):
    """Results by the name of the law, or by law and seed of several samples; prints as a table, with means and ranges.

    The runs that failed are in ``failed``, with their errors; to ask for their result raises this error.
    """

    results: dict[Key, Result]  #: by law, or by law and seed
    failed: dict[Key, Exception] = attrs.field(factory=dict)  #: errors in the same way

    def __getitem__(self, key: Key) -> Result:
        if key in self.failed:
            raise self.failed[key]
        if key not in self.results:
            raise KeyError(f"there is no run {key!r} (there are: {', '.join(map(repr, self.results))})")
        return self.results[key]

    def __iter__(self) -> Iterator[Key]:
        return iter(self.results)

    def __len__(self) -> int:
        return len(self.results)

    @property
    def by_law(self) -> dict[str, dict[Any, Result]]:
        """The results by law, and by seed; None for the seed of the only sample."""
        found: dict[str, dict[Any, Result]] = {}
        for key, result in self.results.items():
            law, seed = _parted(key)
            found.setdefault(law, {})[seed] = result
        return found

    @property
    def seeds(self) -> list[int]:
        """Of several samples, also of those whose runs failed; none of one."""
        every = dict.fromkeys(_parted(key)[1] for key in (*self.results, *self.failed))
        return [seed for seed in every if seed is not None]

    @cached_property
    def table(self) -> Table:
        """A row for each run, as of a study: means with intervals, pairs, pictures, other forms.

        Its factors are the law and, of several samples, the seed.
        """
        kept, several = InMemory(), bool(self.seeds)
        for key in (*self.results, *self.failed):
            law, seed = _parted(key)
            row: dict[str, Any] = {"case": in_words(key), "run": "", "factors": {"law": law}}
            if several:
                row["factors"]["seed"] = seed
            if key in self.results:
                found = found_by(self.results[key], tuple(MEASURES.values()))
                kept.write({**row, "run": in_words(key), "status": FINISHED, **found}, self.results[key])
            else:
                kept.write({**row, "status": "failed", "reason": str(self.failed[key])}, None)
        return Table(map(kept.row, kept.cases()), ("law", "seed") if several else ("law",), kept)

    @property
    def named(self) -> dict[str, Result]:
        """The results by law, and seed, in words."""
        return {in_words(key): result for key, result in self.results.items()}

    @property
    def summary(self) -> dict[str, dict[str, Any]]:
        """The summaries (SI) by the name of the law, of several samples the means."""
        several = bool(self.seeds)
        return {
            law: means([result.summary for result in each.values()]) if several else each[None].summary
            for law, each in self.by_law.items()
        }

    @property
    def content(self) -> dict[str, Any]:
        """The summaries (SI) by law, those of each sample by seed and law, and the reasons of runs that failed."""
        found: dict[str, Any] = {"laws": self.summary}
        if seeds := self.seeds:
            of_seed = {seed: {law: each[seed] for law, each in self.by_law.items() if seed in each} for seed in seeds}
            found["samples"] = {
                str(seed): {law: result.summary for law, result in each.items()} for seed, each in of_seed.items()
            }
        if self.failed:
            found["failed"] = {in_words(key): str(error) for key, error in self.failed.items()}
        return found

    @property
    def _facts(self) -> dict[str, str]:
        main = next((look for look in self._quantities if look.is_main), None)
        texts = {
            law: "finished" if main is None else f"{mean_and_range(main, each.values(), main.name)} {main.unit_shown}"
            for law, each in self.by_law.items()
        }
        failed = {"failed": ", ".join(map(in_words, self.failed))} if self.failed else {}
        laws = dict.fromkeys(_parted(key)[0] for key in (*self.results, *self.failed))
        return {"laws": str(len(laws)), **failed, **texts}

    @property
    def _quantities(self) -> list[Quantity]:
        """Of the summaries."""
        found = {name: result for result in self.results.values() for name in result.summary}
        return [result.quantity(name) for name, result in found.items()]

    @property
    def _doubts(self) -> list[str]:
        """Of the runs, and where they differ in more than the law."""
        found = list(warnings_of(self.named))
        tests = dict.fromkeys(called(result.protocol) for result in self.results.values())
        if len(tests) > 1:
            found.append(
                f"the runs are of different tests, {', '.join(tests)}: what they differ by is not the law alone"
            )
        for seed in dict.fromkeys(_parted(key)[1] for key in self.results):
            grains = [
                result.specimen.grains.vertices for key, result in self.results.items() if _parted(key)[1] == seed
            ]
            if not all(np.array_equal(each, grains[0]) for each in grains):
                found.append("the runs are of different grains: what they differ by is not the law alone")
                break
        return found

    def _html(self) -> str:
        heads, *rows = self._rows()
        failed = [(in_words(key), "failed", str(error)) for key, error in self.failed.items()]
        doubted = [("doubt", words) for words in self._doubts]
        return html_table(rows, heads) + "".join(html_table(each) for each in (failed, doubted) if each)

    def __str__(self) -> str:
        reasons = [f"{in_words(key)} failed: {error}" for key, error in self.failed.items()]
        seeds = ", ".join(map(str, self.seeds))
        last = [f"mean (range) of the samples with the seeds {seeds}"] if seeds else []
        return "\n".join([aligned(self._rows(), rule=True), *last, *reasons, *self._doubts])

    def to_latex(self) -> str:
        """The printed table for a paper (LaTeX, package booktabs)."""
        return latex_lines(self._rows())

    def _rows(self) -> list[list[str]]:
        by_law = self.by_law
        absent = [law for law in dict.fromkeys(_parted(key)[0] for key in self.failed) if law not in by_law]
        rows = [["", *by_law, *absent]]
        for look in self._quantities:
            cells = (
                marked(look.name, each.values(), mean_and_range(look, each.values(), look.name))
                for each in by_law.values()
            )
            rows.append([look.heading, *cells, *("failed" for _ in absent)])
        return rows

    def plot(self) -> Figure:
        """The usual picture of the test under all laws, of several samples with means and ranges of the strengths.

        Raises ParameterError for results without curves.
        """
        from grainlaw.results.figures.curves import plot_laws, plot_samples

        return plot_samples(self.by_law) if self.seeds else plot_laws(self.named)

    def write(self, folder: str | os.PathLike[str], record: Mapping[str, Any] | None = None) -> None:
        """Write ``comparison.png``, ``cracks_<law>.png``, ``summary.json`` and ``curves.csv``.

        ``record``, the input of the runs, is added to the summary. Raises OSError where it cannot write, and
        ParameterError for results without curves.
        """
        from grainlaw.results.figures.cracks import plot_cracks, side_by_side

        figure, seeds, path = self.plot(), self.seeds, writable_folder(folder)
        write_json(path / "summary.json", self.content | dict(record or {}))
        keys = ("law", "seed") if seeds else ("law",)
        curves = {_parted(key)[: len(keys)]: result.curves for key, result in self.results.items()}
        write_curves(path / "curves.csv", curves, keys)
        write_atomically(path / "comparison.png", lambda file: figure.savefig(file, dpi=150))
        for law, each in self.by_law.items():
            of_samples = {f"{law}, seed {seed}": result for seed, result in each.items()}
            cracks = side_by_side(of_samples) if seeds else plot_cracks(each[None], title=law)
            write_atomically(path / f"cracks_{file_name(law)}.png", functools.partial(cracks.savefig, dpi=150))

    def write_report(
        self, file: str | os.PathLike[str], *, title: str = "", record: Mapping[str, Any] | None = None,
        measures: Sequence[Measure] | None = None, files: Sequence[str] = (),
    ) -> None:  # fmt: skip
        """Write the laboratory report of all laws as a page of HTML; the rest is as in :meth:`Result.write_report`.

        Of several samples it is that of the first, below means and ranges of all.
        """
        from grainlaw.results.figures.report import write_report

        by_law = self.by_law
        first = next(iter(next(iter(by_law.values()))))
        results = {law: each[first] for law, each in by_law.items() if first in each}
        incomplete = "; ".join(f"{in_words(key)}: {error}" for key, error in self.failed.items())
        write_report(
            results, file, title=title, record=record, incomplete=incomplete, measures=measures,
            samples=by_law if self.seeds else None, files=files,
        )  # fmt: skip


def _parted(key: Key) -> tuple[str, int | None]:
    return (key, None) if isinstance(key, str) else key


def in_words(key: Key) -> str:
    """``linear``, or of several samples ``linear, seed 1``."""
    return key if isinstance(key, str) else f"{key[0]}, seed {key[1]}"


def folder_name(key: Key) -> str:
    """The folder of one run inside that of the comparison."""
    return key if isinstance(key, str) else f"{key[0]}_seed_{key[1]}"


@checked
def compare(
    specimen: Specimen | Mapping[int, Specimen], laws: Mapping[str, Laws], protocol: LoadingProtocol, **options: Any
) -> Comparison:
    """Put one specimen, or several samples by their seeds, through one test under several laws.

    As many runs at a time as there are ``threads`` (all cores), on which the results do not depend. ``options`` are
    ``threads``; ``observers``, which maps the name of a law, or a law and a seed, to the observers of its run;
    ``checkpoint``, a folder with one for each run, ``restart``, ``overwrite``; and those of :func:`simulate`. A run
    that fails does not touch the others, see :class:`Comparison`; if all fail, the first error is raised.
    :class:`Stopped` has the finished runs as its ``result``. Bars show how far the runs are, unless ``progress`` is
    False.
    """
    if not laws:
        raise ParameterError("compare: laws is empty, it must name at least one law")
    runs: dict[Key, Run]
    if isinstance(specimen, Mapping):
        if not specimen:
            raise ParameterError("compare: specimen = {} is not allowed, it must have at least one sample")
        runs = {(law, seed): Run(specimen[seed], laws[law], protocol) for seed in specimen for law in laws}
    else:
        runs = {name: Run(specimen, law, protocol) for name, law in laws.items()}
    try:
        outcome = simulate_all(runs, folder=folder_name, **options)
    except Stopped as stopped:
        stopped.result = Comparison(stopped.result.results, stopped.result.failed)
        raise
    return Comparison(outcome.results, outcome.failed)
