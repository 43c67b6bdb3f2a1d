"""Quantities that change with time: a number that rises over a ramp, points in time, or a function of time."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from types import FunctionType
from typing import Any

import attrs
import numpy as np

from grainlaw.arguments import Checked, checked, floats, is_number
from grainlaw.fields import Bounds, ParameterError, checked_field, checked_number, parameter
from grainlaw.messages import refusal, short
from grainlaw.unit_text import written

FEW = 8  #: points that are shown one by one
GAUSS = 0.5 - 0.5 / math.sqrt(3), 0.5 + 0.5 / math.sqrt(3)  #: of a step: a function's mean is that at these times


@attrs.frozen
class TimeSeries(metaclass=Checked):
    """A quantity over time: straight between its points, and constant before the first and after the last.

    Two points of one time are a jump. A pulse of 20 us that rises and falls evenly to 1 and back::

        TimeSeries([0, 10e-6, 20e-6], [0, 1, 0])
    """

    takes_arrays = True

    times: np.ndarray = parameter("s", above=-math.inf)  #: (n,) s since the stage began, none before the last
    values: np.ndarray = parameter("its own", above=-math.inf)  #: (n,) in the unit of the quantity

    def __attrs_post_init__(self) -> None:
        times, values = self.times, self.values
        if np.ndim(times) != 1 or np.ndim(values) != 1 or len(times) != len(values) or len(times) < 2:
            raise ParameterError(
                f"TimeSeries: times has {np.size(times)} entries and values has {np.size(values)}, "
                "they must have equal numbers of at least 2"
            )
        if (np.diff(times) < 0).any() or times[0] == times[-1]:
            raise refusal("TimeSeries: times", times.tolist(), "times (s) that do not fall, the last after the first")

    def in_words(self, unit: str) -> str:
        """Its points, as "0 Pa at 0 s, -1 MPa at 5 us"; of more than eight how many and their range."""
        if len(self.times) <= FEW:
            points = zip(self.values.tolist(), self.times.tolist(), strict=True)
            return ", ".join(f"{written(value, unit)} at {written(time, 's')}" for value, time in points)
        value, time = (
            f"{written(float(f'{each.min():.4g}'), of)} to {written(float(f'{each.max():.4g}'), of)}"
            for each, of in ((self.values, unit), (self.times, "s"))
        )
        return f"{len(self.times)} points, {value}, at {time}"

    def __call__(self, time: float) -> float:
        """The value at a time (s); at a jump that after it."""
        k = int(np.searchsorted(self.times, time, side="right")) - 1
        if k < 0 or k == len(self.times) - 1:
            return float(self.values[k if k >= 0 else 0])
        share = (time - self.times[k]) / (self.times[k + 1] - self.times[k])
        return float(self.values[k] + share * (self.values[k + 1] - self.values[k]))

    def integral(self, time: np.ndarray) -> np.ndarray:
        """Its integral from the first point to times (n,) s, exactly."""
        t, v = self.times, self.values
        k = np.clip(np.searchsorted(t, time, side="right") - 1, 0, len(t) - 1)
        width = np.diff(t)
        slope = np.append(np.divide(np.diff(v), width, out=np.zeros(len(width)), where=width > 0), 0.0)
        until = np.concatenate([[0.0], np.cumsum(width * (v[1:] + v[:-1]) / 2)])
        since = time - t[k]
        return until[k] + since * (v[k] + np.maximum(since, 0.0) * slope[k] / 2)


@checked
def pulse(size: float, *, rise: float, hold: float = 0.0) -> TimeSeries:
    """A pulse that rises smoothly, as sin^2, in a time (s), holds for a time (s), and falls as it rose.

    As behind a pulse shaper, a soft disc between striker and bar. ``size`` is in the unit of the quantity.
    """
    rise = checked_number("pulse: rise", rise, "s", above=0)
    hold = checked_number("pulse: hold", hold, "s", at_least=0)
    share = np.linspace(0.0, 1.0, 17)
    up = checked_number("pulse: size", size) * np.sin(np.pi / 2 * share) ** 2
    return TimeSeries(np.append(rise * share, rise + hold + rise * share), np.append(up, up[::-1]))


Varying = float | TimeSeries | Callable[[float], float]


def varying(unit: str, default: Any = attrs.NOTHING, *, at_least: float | None = None) -> Any:
    """Declare a quantity of a component that may change with time: ``speed: Varying = varying("m/s")``.

    It is given as a number, as a :class:`TimeSeries` or a list of its points (time, value), or as a function that
    returns the value at a time (s), made by ``def`` or ``lambda``: of other callables a record of a run cannot say what
    they give. All values must be finite and ``at_least`` so much. Raises :class:`ParameterError`.
    """
    bounds = Bounds(at_least)

    def check(where: str, value: Any) -> Varying | None:
        if value is None and default is None:
            return None
        if isinstance(value, (Sequence, np.ndarray)) and not isinstance(value, (str, bytes)):
            value = _series(where, value)
        if isinstance(value, TimeSeries):
            for entry in (value.values.min(), value.values.max()):
                if not bounds.allow(float(entry)):
                    raise refusal(where, float(entry), f"{bounds} ({unit}) at all times")
            return value
        if isinstance(value, FunctionType):
            value_of(where, value, 0.0, bounds)
            return value
        if is_number(value) and bounds.allow(float(value)):
            return float(value)
        wanted = f"{bounds} ({unit}), a TimeSeries or its points (time, value), or a function of time (def or lambda)"
        raise refusal(where, value, wanted)

    number = "a number" if at_least is None else str(bounds)
    words = f"{number}, a TimeSeries or a function of time"
    return checked_field(check, default=default, metadata={"unit": unit, "varies": bounds, "bounds": words})


def _series(where: str, points: Any) -> TimeSeries:
    try:
        times, values = floats(points).reshape(len(points), 2).T
    except (TypeError, ValueError):
        raise refusal(where, points, "a list of points (time, value)") from None
    try:
        return TimeSeries(times, values)
    except ParameterError as error:
        raise ParameterError(f"{where}: {error}") from None


def value_of(where: str, function: Callable[[float], float], time: float, bounds: Bounds) -> float:
    """What a function gives at a time (s). Raises :class:`ParameterError` where it is no number within the bounds."""
    try:
        value = function(time)
    except Exception as error:
        raise ParameterError(
            f"{where}: the function fails at {time:g} s, {type(error).__name__}: {error}; it must take one time (s)"
        ) from error
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value.item()
    if not is_number(value) or not bounds.allow(float(value)):
        raise ParameterError(
            f"{where}: the function gives {short(value)} at {time:g} s, which is not allowed, it must give {bounds}"
        )
    return float(value)


def rise(time: np.ndarray, ramp: float, start: float, end: float) -> np.ndarray:
    """Rise from ``start`` to ``end`` in the time ``ramp``, smooth in value, rate and acceleration."""
    if ramp == 0:
        return np.full(time.shape, end)
    with np.errstate(over="ignore"):  # a ramp of next to nothing
        x = np.clip(time / ramp, 0, 1)
    return start + (end - start) * x**3 * (10 - 15 * x + 6 * x**2)


def rise_integral(time: np.ndarray, ramp: float, start: float, end: float) -> np.ndarray:
    """Integral of :func:`rise` from 0 to ``time``."""
    x = np.clip(time / ramp, 0, 1)
    return start * time + (end - start) * (ramp * x**4 * (2.5 - 3 * x + x**2) + np.maximum(time - ramp, 0.0))
