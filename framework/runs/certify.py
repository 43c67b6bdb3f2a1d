"""The quasi-static limit of a strength: the same test at two speeds, and what their difference says."""

from __future__ import annotations

from typing import Any

import attrs

from grainlaw.arguments import Checked, checked
from grainlaw.columns import quantity_of
from grainlaw.contact import Laws
from grainlaw.fields import ParameterError
from grainlaw.loading import Loading
from grainlaw.protocol import LoadingProtocol
from grainlaw.results.certificate import STRENGTHS
from grainlaw.results.result import Result
from grainlaw.runs.parallel import Run, simulate_all
from grainlaw.specimen import Specimen


@attrs.frozen(kw_only=True)
class QuasiStaticLimit(metaclass=Checked):
    """A strength at two speeds, and what slower runs tend to if the excess is proportional to the speed."""

    name: str  #: of the summary's entry
    strength: float  #: at the speed of the test (Pa, or N/m); nan if the specimen did not fail
    slower: float  #: at half of it

    @property
    def limit(self) -> float:
        """Richardson's extrapolation to no speed."""
        return 2 * self.slower - self.strength

    @property
    def error(self) -> float:
        """Of the limit: the difference of the two strengths. What breaks first differs by chance, too."""
        return abs(self.strength - self.slower)

    def __str__(self) -> str:
        words = [*map(quantity_of(self.name).with_unit, (self.strength, self.slower, self.limit, self.error))]
        if self.limit <= 0:
            return "{}, at half the speed {}: too far apart to tell a quasi-static limit".format(*words)
        share = abs(self.strength / self.limit - 1)
        return "{}, at half the speed {}: quasi-static limit {}, give or take {}".format(*words) + f" ({share:.1%} off)"


def slower(protocol: Any) -> LoadingProtocol:
    """The same test at half the speed. Raises :class:`ParameterError` for one without a loading."""
    for name in ("loading", "test"):
        part: Any = getattr(protocol, name, None)
        if isinstance(part, Loading):
            return attrs.evolve(protocol, **{name: part.slower()})
        if isinstance(part, LoadingProtocol):
            return attrs.evolve(protocol, **{name: slower(part)})
    raise ParameterError(
        f"certify: {type(protocol).__name__} has no loading whose speed could be halved; give it a "
        "field, loading: gl.Loading = gl.Adaptive(), and its stages loading=self.loading"
    )


@checked
def certify(specimen: Specimen, law: Laws, protocol: LoadingProtocol, **options: Any) -> QuasiStaticLimit:
    """Do a test twice, the second time at half the speed, and say what its strength tends to.

    ``options`` are those of :func:`~grainlaw.compare`. Raises what :func:`simulate` raises,
    :class:`ParameterError` for a test without a loading or a strength.
    """
    runs = {"test": Run(specimen, law, protocol), "slower": Run(specimen, law, slower(protocol))}
    outcome = simulate_all(runs, **options)
    for error in outcome.failed.values():
        raise error
    return limit_of(outcome.results["test"], outcome.results["slower"])


def limit_of(result: Result, other: Result) -> QuasiStaticLimit:
    """From a result and that at half the speed."""
    for name in STRENGTHS:
        if name in result.summary:
            return QuasiStaticLimit(name=name, strength=result.summary[name], slower=other.summary[name])
    raise ParameterError(f"certify: {type(result.protocol).__name__} measures no {' or '.join(STRENGTHS)}")
