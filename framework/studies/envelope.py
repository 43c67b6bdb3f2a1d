"""Strength of a rock over confinement: criteria fitted to the strengths of a study."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np
import scipy

from grainlaw.arguments import Checked, checked
from grainlaw.fields import ParameterError
from grainlaw.messages import refusal
from grainlaw.results.files import writable_folder, write_atomically
from grainlaw.results.means import quantile
from grainlaw.results.tables import write_json
from grainlaw.studies.design import RESERVED
from grainlaw.studies.table import Table

if TYPE_CHECKING:
    from grainlaw.drawing.figure import Figure

STRENGTH = "strength"
Interval = tuple[float, float]


@attrs.frozen(kw_only=True)
class MohrCoulombFit(metaclass=Checked):
    """Strength = ucs + slope * confinement by least squares, with the angle and the cohesion that follow from it.

    phi = asin((m - 1)/(m + 1)), c = b (1 - sin phi)/(2 cos phi) with the slope m and the intercept b. Intervals (95 %)
    are Student's for slope and intercept; those of the angle and the cohesion follow by the first-order propagation of
    both, with their covariance. They are nan with fewer than three tests.
    """

    slope: float  #: of the line
    slope_interval: Interval  #: 95 %
    ucs: float  #: Pa, the intercept
    ucs_interval: Interval  #: Pa, 95 %
    friction_angle: float  #: deg
    friction_angle_interval: Interval  #: deg, 95 %
    cohesion: float  #: Pa
    cohesion_interval: Interval  #: Pa, 95 %
    r_squared: float  #: coefficient of determination


@attrs.frozen(kw_only=True)
class HoekBrownFit(metaclass=Checked):
    """Strength = s3 + sqrt(m s_ci s3 + s_ci^2) for intact rock.

    Hoek and Brown 1980, Empirical strength criterion for rock masses, J. Geotech. Eng. 106, 1013-1035. By least
    squares of (s1 - s3)^2 on s3, whose intercept is s_ci^2 and whose slope is m s_ci.
    """

    ucs: float  #: Pa, s_ci
    ucs_interval: Interval  #: Pa, 95 %
    m: float  #: of the criterion
    m_interval: Interval  #: 95 %
    r_squared: float  #: coefficient of determination of the strengths, as that of the line


@checked
def fit_mohr_coulomb(confinement: Sequence[float], strength: Sequence[float]) -> MohrCoulombFit:
    """Fit strengths (Pa) over confinements (Pa), both axial stresses and pressures at failure.

    Raises ParameterError for fewer than two different confinements, and for a strength below its confinement.
    """
    line = _Line.through(*_pairs("fit_mohr_coulomb", confinement, strength))
    m, b = line.slope, line.intercept
    angle, c = map(float, angle_and_cohesion(np.array(m), np.array(b)))
    root = math.sqrt(m) if m > 0 else math.nan
    error = line.error(-b / (4 * root**3), 1 / (2 * root))  # c = b / (2 sqrt(m))
    angle_error = math.degrees(line.slope_error / ((m + 1) * root))
    return MohrCoulombFit(
        slope=m, slope_interval=line.interval(m, line.slope_error), ucs=b,
        ucs_interval=line.interval(b, line.intercept_error), friction_angle=angle,
        friction_angle_interval=line.interval(angle, angle_error), cohesion=c,
        cohesion_interval=line.interval(c, error), r_squared=line.r_squared,
    )  # fmt: skip


def angle_and_cohesion(slope: np.ndarray, ucs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Angles (deg) and cohesions (Pa) of lines (n,); nan for a slope that is not positive."""
    rises = np.where(slope > 0, slope, np.nan)
    return np.degrees(np.arcsin((rises - 1) / (rises + 1))), ucs / (2 * np.sqrt(rises))


@checked
def fit_hoek_brown(confinement: Sequence[float], strength: Sequence[float]) -> HoekBrownFit:
    """Fit strengths (Pa) over confinements (Pa), as :func:`fit_mohr_coulomb`.

    nan where the strengths fall so steeply that s_ci^2 is negative.
    """
    x, y = _pairs("fit_hoek_brown", confinement, strength)
    line = _Line.through(x, (y - x) ** 2)
    ucs = math.sqrt(line.intercept) if line.intercept > 0 else math.nan
    m, error = line.slope / ucs, line.error(1 / ucs, -line.slope / (2 * ucs**3))
    with np.errstate(invalid="ignore", divide="ignore"):  # squares below 0, and strengths that are all equal
        left = y - x - np.sqrt(line.slope * x + ucs**2)
        r_squared = float(1 - np.divide(left @ left, np.sum((y - y.mean()) ** 2)))
    return HoekBrownFit(
        ucs=ucs, ucs_interval=line.interval(ucs, line.intercept_error / (2 * ucs)), m=m,
        m_interval=line.interval(m, error), r_squared=r_squared,
    )  # fmt: skip


@attrs.frozen
class _Line:
    """A regression line and its scatter."""

    slope: float
    slope_error: float
    intercept: float
    intercept_error: float
    covariance: float  #: of slope and intercept
    quantile: float  #: of Student's distribution
    r_squared: float

    @classmethod
    def through(cls, x: np.ndarray, y: np.ndarray) -> _Line:
        line = scipy.stats.linregress(x, y)
        error = float(line.stderr)
        return cls(
            slope=float(line.slope), slope_error=error, intercept=float(line.intercept),
            intercept_error=float(line.intercept_stderr), covariance=-float(x.mean()) * error**2,
            quantile=quantile(len(x) - 1), r_squared=float(line.rvalue) ** 2,
        )  # fmt: skip

    def interval(self, value: float, error: float) -> Interval:
        return value - self.quantile * error, value + self.quantile * error

    def error(self, by_slope: float, by_intercept: float) -> float:
        """Of what has these slopes over slope and intercept, to first order."""
        squares = (by_slope * self.slope_error) ** 2 + (by_intercept * self.intercept_error) ** 2
        return math.sqrt(squares + 2 * by_slope * by_intercept * self.covariance)


def _pairs(name: str, confinement: Any, strength: Any) -> tuple[np.ndarray, np.ndarray]:
    """(k,) Pa each."""
    x, y = np.asarray(confinement, dtype=float), np.asarray(strength, dtype=float)
    if len(x) != len(y) or len(np.unique(x)) < 2 or not np.isfinite([x, y]).all():
        raise ParameterError(
            f"{name}: {len(x)} confinements and {len(y)} strengths are not allowed, there must be a finite one "
            "for each confinement, and two different confinements"
        )
    if (y < x).any():
        low, under = float(y[y < x][0]), float(x[y < x][0])
        raise ParameterError(
            f"{name}: strength = {low:g} Pa under {under:g} Pa is not allowed, it must be an axial stress, which is at "
            "least the confinement"
        )
    return x, y


@attrs.frozen(eq=False)
class StrengthEnvelope(metaclass=Checked):
    """Strengths over confinement, and the criteria fitted to all of them, from the table of a study.

    The confinement (Pa) is a factor of the study, and its tests have a ``strength``. All cases that came to their
    end count, whatever their other factors: choose them with :meth:`~grainlaw.studies.table.Table.where`. Raises
    ParameterError for a table without these.
    """

    table: Table  #: of the study
    confinement: str = "confinement"  #: name of the factor

    def __attrs_post_init__(self) -> None:
        for level in self.table.levels(self.confinement):
            if isinstance(level, bool) or not isinstance(level, (int, float)):
                raise refusal(f"StrengthEnvelope: {self.confinement}", level, "a number (Pa)")
        if self._finished and STRENGTH not in self.table.quantities:
            raise ParameterError(f"StrengthEnvelope: the table has no column {STRENGTH}: its tests do not measure it")

    @property
    def _finished(self) -> list[int]:
        return [k for k in range(len(self.table)) if self.table.is_finished(k)]

    @property
    def strengths(self) -> np.ndarray:
        """(k, 2) confinement and strength (Pa) of each test whose specimen has failed."""
        rows = (self.table.rows[k] for k in self._finished)
        found = np.array([(row[self.confinement], row.get(STRENGTH)) for row in rows], dtype=float).reshape(-1, 2)
        return found[np.isfinite(found[:, 1])]

    @property
    def can_be_fitted(self) -> bool:
        """Whether specimens have failed at two different confinements."""
        return len(np.unique(self.strengths[:, 0])) > 1

    @property
    def mohr_coulomb(self) -> MohrCoulombFit:
        """The straight line."""
        return fit_mohr_coulomb(*self.strengths.T)

    @property
    def hoek_brown(self) -> HoekBrownFit:
        """The parabola."""
        return fit_hoek_brown(*self.strengths.T)

    @property
    def summary(self) -> dict[str, Any]:
        """Confinements, their mean strengths, and both fits, by name (SI, angles in degrees); the rows of all tests."""
        confinement, strength = self.strengths.T
        fits: dict[str, Any] = {}
        if self.can_be_fitted:
            fits = {**attrs.asdict(self.mohr_coulomb), "hoek_brown": attrs.asdict(self.hoek_brown)}
        tests = ({n: v for n, v in self.table.rows[k].items() if n not in RESERVED} for k in self._finished)
        levels = np.unique(confinement)
        return {
            "confinement": levels.tolist(),
            STRENGTH: [float(strength[confinement == p].mean()) for p in levels],
            **fits,
            "tests": list(tests),
            "failed": self.table.failed,
        }

    def __str__(self) -> str:
        if not self.can_be_fitted:
            return f"{self.table}\n\nno strength criteria are fitted: specimens must fail at two different confinements"
        line, parabola, rows = self.mohr_coulomb, self.hoek_brown, [str(self.table), ""]
        for name, value, interval, unit in (
            ("slope", line.slope, line.slope_interval, ""),
            ("UCS", line.ucs * 1e-6, np.multiply(line.ucs_interval, 1e-6), "MPa"),
            ("cohesion", line.cohesion * 1e-6, np.multiply(line.cohesion_interval, 1e-6), "MPa"),
            ("friction angle", line.friction_angle, line.friction_angle_interval, "deg"),
            ("Hoek-Brown UCS", parabola.ucs * 1e-6, np.multiply(parabola.ucs_interval, 1e-6), "MPa"),
            ("Hoek-Brown m", parabola.m, parabola.m_interval, ""),
        ):
            known = f"{interval[0]:.3f} to {interval[1]:.3f}" if np.isfinite(interval).all() else "not known"
            rows.append(f"{name:<15} {value:9.3f} {unit:<4} (95 %: {known})")
        return "\n".join(rows)

    def plot(self) -> Figure:
        """Stress-strain curves of the stored runs, and strengths over confinement with both fits."""
        from grainlaw.studies.figures import plot_envelope

        return plot_envelope(self)

    def write(self, folder: str | os.PathLike[str], record: Mapping[str, Any] | None = None) -> None:
        """Write ``summary.json``, to which ``record`` is added, and ``envelope.png``. Raises OSError where it cannot.

        No picture where the tests that are done cannot be fitted.
        """
        path = writable_folder(folder)
        write_json(path / "summary.json", {**self.summary, **(record or {})})
        if self.can_be_fitted:
            write_atomically(path / "envelope.png", lambda file: self.plot().savefig(file, dpi=150))
