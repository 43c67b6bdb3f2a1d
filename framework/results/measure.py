"""The measure: one number that a laboratory reports of a test."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from numbers import Real
from typing import TYPE_CHECKING

from grainlaw.arguments import Checked
from grainlaw.columns import missing
from grainlaw.fields import ParameterError
from grainlaw.messages import refuse_twice, short
from grainlaw.quantity import Quantity
from grainlaw.unit_text import factor_into

if TYPE_CHECKING:
    from grainlaw.results.laboratory import Laboratory


class Measure(metaclass=Checked):
    """One number found from a finished result.

    A whole measure, the energy that damping took over the energy that was supplied::

        class DampedShare(gl.Measure):
            name = "damped_share"
            meaning = "energy taken by damping, share of the energy supplied"
            unit = "%"

            def find(self, laboratory):
                curves = laboratory.result.curves
                return curves["energy_damping"][-1] / curves["energy_external"][-1]
    """

    @property
    @abstractmethod
    def name(self) -> str:
        """Its key in :attr:`Laboratory.properties`."""

    @property
    @abstractmethod
    def meaning(self) -> str:
        """What it is, in words for a report."""

    @property
    def unit(self) -> str:
        """Unit in which it is shown, such as "MPa"; "1" for a number without a unit."""
        return "1"

    @property
    def factor(self) -> float:
        """The value in SI times this is the value in ``unit``; by default found from the unit."""
        return factor_into(self.unit, f"{type(self).__name__}: unit")

    @property
    def of_curves(self) -> bool:
        """Whether it is found from the curves alone, so that a measured curve has it too."""
        return False

    @property
    def of_frames(self) -> bool:
        """Whether it is found from the frames: it is nan of a result that was saved without them."""
        return False

    @property
    def is_main(self) -> bool:
        """Whether the tables of studies show it unasked."""
        return True

    @property
    def quantity(self) -> Quantity:
        """How it is shown."""
        return Quantity(self.name, self.unit, meaning=self.meaning, is_main=self.is_main, factor=self.factor)

    @property
    def source(self) -> str:
        """Publication that defines it."""
        return ""

    @property
    def needs(self) -> Sequence[str]:
        """Columns of the curves that it needs: without one of them it is nan, and ``find`` is not called."""
        return ()

    def resolution(self, laboratory: Laboratory) -> float:
        """By how much it may be wrong as it is found, in SI; no digit below it is shown. 0 where that is not known."""
        return 0.0

    @abstractmethod
    def find(self, laboratory: Laboratory) -> float:
        """The number in SI; nan where it does not exist.

        ``laboratory.result`` is the finished result; the laboratory has the path to the peak, cracks, fragments and
        acoustic events, and the other measures by :meth:`Laboratory.value`.
        """

    def why(self, laboratory: Laboratory) -> str:
        """Why it does not exist, in words that reports show; empty if there is nothing to say."""
        return ""


def check_measures(where: str, measures: Sequence[Measure]) -> None:
    """Raise :class:`ParameterError` for an object that is not a measure, and for two measures of one name."""
    for measure in measures:
        if not isinstance(measure, Measure):
            raise ParameterError(f"{where}: measures: {short(measure)} is not allowed, it must be a Measure")
    refuse_twice(f"{where}: measures", [measure.name for measure in measures])


def lacks_frames(measure: Measure, laboratory: Laboratory) -> bool:
    """Whether a measure needs frames, and the result was saved without them."""
    return measure.of_frames and not laboratory.is_measured and not laboratory.result.frames


def found(measure: Measure, laboratory: Laboratory) -> float:
    """Value of a measure, nan without the columns it needs.

    Raises :class:`ParameterError` if it is not a number, and where one of the user's own fails.
    """
    if missing(laboratory.result.curves, measure.needs) or (laboratory.is_measured and not measure.of_curves):
        return float("nan")
    if lacks_frames(measure, laboratory):
        return float("nan")
    try:
        value = measure.find(laboratory)
    except ParameterError:
        raise
    except Exception as error:
        raise ParameterError(
            f"{type(measure).__name__}: find fails for {measure.name!r}: {type(error).__name__}: {error}"
        ) from error
    if not isinstance(value, Real) or isinstance(value, bool):
        raise ParameterError(
            f"{type(measure).__name__}: find returned {short(value)} for {measure.name!r}, it must return one number"
        )
    return value
