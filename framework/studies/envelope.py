"""Strength of a rock over confinement: compression tests, and strength criteria fitted to their peaks."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np
from scipy.stats import linregress, t

from grainlaw.arguments import Checked, checked
from grainlaw.contact import Laws
from grainlaw.parameter import ParameterError
from grainlaw.protocol import LoadingProtocol
from grainlaw.results.files import writable_folder, write_atomically
from grainlaw.results.result import Result
from grainlaw.results.tables import write_json
from grainlaw.runs.parallel import Run, simulate_all
from grainlaw.runs.stopping import Stopped
from grainlaw.specimen import Specimen

if TYPE_CHECKING:
    from matplotlib.figure import Figure

CONFIDENCE = 0.95
Interval = tuple[float, float]
Test = tuple[int, float]  #: seed, or any number of the specimen, and confinement (Pa)


@attrs.frozen(kw_only=True)
class MohrCoulombFit(metaclass=Checked):
    """Peak stress = ucs + slope * confinement by least squares, with the angle and the cohesion that follow from it.

    phi = asin((m - 1)/(m + 1)), c = b (1 - sin phi)/(2 cos phi) with the slope m and the intercept b. Intervals (95 %)
    are Student's for slope and intercept; those of the angle and the cohesion follow by the first-order propagation of
    both, with their covariance. They are nan with fewer than three tests.
    """

    slope: float
    slope_interval: Interval
    ucs: float  #: Pa, the intercept
    ucs_interval: Interval
    friction_angle: float  #: deg
    friction_angle_interval: Interval
    cohesion: float  #: Pa
    cohesion_interval: Interval
    r_squared: float


@attrs.frozen(kw_only=True)
class HoekBrownFit(metaclass=Checked):
    """Peak stress = s3 + sqrt(m s_ci s3 + s_ci^2) for intact rock.

    Hoek and Brown 1980, Empirical strength criterion for rock masses, J. Geotech. Eng. 106, 1013-1035. By least
    squares of (s1 - s3)^2 on s3, whose intercept is s_ci^2 and whose slope is m s_ci.
    """

    ucs: float  #: Pa, s_ci
    ucs_interval: Interval
    m: float
    m_interval: Interval
    r_squared: float


@checked
def fit_mohr_coulomb(confinement: Sequence[float], peak_stress: Sequence[float]) -> MohrCoulombFit:
    """Fit peaks (Pa) over confinements (Pa). Raises ParameterError for fewer than two different confinements."""
    m, b, spread = _line(*_pairs("fit_mohr_coulomb", confinement, peak_stress))
    angle, c = _angle_and_cohesion(m.value, b.value)
    root = math.sqrt(m.value) if m.value > 0 else math.nan
    by_slope, by_ucs = -b.value / (4 * root**3), 1 / (2 * root)  # c = b / (2 sqrt(m))
    error = math.sqrt(
        (by_slope * m.error) ** 2 + (by_ucs * b.error) ** 2 + 2 * by_slope * by_ucs * spread.covariance
    )  # fmt: skip
    angle_error = math.degrees(m.error / ((m.value + 1) * root))
    return MohrCoulombFit(
        slope=m.value, slope_interval=m.interval, ucs=b.value, ucs_interval=b.interval, friction_angle=angle,
        friction_angle_interval=spread.interval(angle, angle_error), cohesion=c,
        cohesion_interval=spread.interval(c, error), r_squared=spread.r_squared,
    )  # fmt: skip


def _angle_and_cohesion(slope: float, ucs: float) -> tuple[float, float]:
    """Angle (deg) and cohesion (Pa) of a line; nan for a slope that is not positive."""
    if not slope > 0:
        return math.nan, math.nan
    phi = math.asin((slope - 1) / (slope + 1))
    return math.degrees(phi), ucs * (1 - math.sin(phi)) / (2 * math.cos(phi))


@checked
def fit_hoek_brown(confinement: Sequence[float], peak_stress: Sequence[float]) -> HoekBrownFit:
    """Fit peaks (Pa) over confinements (Pa). Raises ParameterError for fewer than two different confinements.

    nan where the peaks fall so steeply that s_ci^2 is negative.
    """
    x, y = _pairs("fit_hoek_brown", confinement, peak_stress)
    slope, square, spread = _line(x, (y - x) ** 2)
    ucs = math.sqrt(square.value) if square.value > 0 else math.nan
    m = slope.value / ucs
    by_slope, by_square = 1 / ucs, -slope.value / (2 * ucs**3)
    error = math.sqrt(
        (by_slope * slope.error) ** 2 + (by_square * square.error) ** 2 + 2 * by_slope * by_square * spread.covariance
    )
    return HoekBrownFit(
        ucs=ucs, ucs_interval=spread.interval(ucs, square.error / (2 * ucs)), m=m,
        m_interval=spread.interval(m, error), r_squared=spread.r_squared,
    )  # fmt: skip


@attrs.frozen
class _Coefficient:
    value: float
    error: float
    interval: Interval


@attrs.frozen
class _Spread:
    quantile: float  #: of Student's distribution
    covariance: float  #: of slope and intercept
    r_squared: float

    def interval(self, value: float, error: float) -> Interval:
        return value - self.quantile * error, value + self.quantile * error


_Line = tuple[_Coefficient, _Coefficient, _Spread]


def _pairs(name: str, confinement: Any, peak_stress: Any) -> tuple[np.ndarray, np.ndarray]:
    """(k,) Pa each."""
    x, y = np.asarray(confinement, dtype=float), np.asarray(peak_stress, dtype=float)
    if len(x) != len(y) or len(np.unique(x)) < 2 or not np.isfinite([x, y]).all():
        raise ParameterError(
            f"{name}: {len(x)} confinements and {len(y)} peak stresses are not allowed, there must be a finite peak "
            "for each confinement, and two different confinements"
        )
    return x, y


def _line(x: np.ndarray, y: np.ndarray) -> _Line:
    """Slope and intercept of a regression line, and their scatter."""
    line = linregress(x, y)
    freedom = len(x) - 2
    quantile = float(t.ppf(0.5 + CONFIDENCE / 2, freedom)) if freedom > 0 else math.nan
    spread = _Spread(quantile, -float(x.mean()) * float(line.stderr) ** 2, float(line.rvalue) ** 2)
    slope, ucs = (
        _Coefficient(float(value), float(error), spread.interval(float(value), float(error)))
        for value, error in ((line.slope, line.stderr), (line.intercept, line.intercept_stderr))
    )
    return slope, ucs, spread


@attrs.frozen(eq=False)
class StrengthEnvelope(metaclass=Checked):
    """Compression tests over confinement, and the criteria fitted to all their peaks; errors of those that failed."""

    results: dict[Test, Result]
    failed: dict[Test, Exception] = attrs.field(factory=dict)

    @property
    def peaks(self) -> np.ndarray:
        """(k, 3) seed, confinement (Pa) and peak stress (Pa) of each test."""
        return np.array([(*test, result.summary["peak_stress"]) for test, result in self.results.items()]).reshape(
            -1, 3
        )

    @property
    def can_be_fitted(self) -> bool:
        """Whether tests at two different confinements have come to their end."""
        return len({confinement for _, confinement in self.results}) > 1

    @property
    def mohr_coulomb(self) -> MohrCoulombFit:
        """The straight line."""
        return fit_mohr_coulomb(*self.peaks[:, 1:].T)

    @property
    def hoek_brown(self) -> HoekBrownFit:
        """The parabola."""
        return fit_hoek_brown(*self.peaks[:, 1:].T)

    @property
    def summary(self) -> dict[str, Any]:
        """Confinements, their mean peaks, and both fits, by name (SI, angles in degrees)."""
        peaks = self.peaks
        confinement, fits = np.unique(peaks[:, 1]), {}
        if self.can_be_fitted:
            fits = {**attrs.asdict(self.mohr_coulomb), "hoek_brown": attrs.asdict(self.hoek_brown)}
        return {
            "confinement": confinement.tolist(),
            "peak_stress": [float(peaks[peaks[:, 1] == p, 2].mean()) for p in confinement],
            **fits,
            "tests": [{"seed": seed, "confinement": p, **result.summary} for (seed, p), result in self.results.items()],
            "failed": [{"seed": seed, "confinement": p, "reason": str(e)} for (seed, p), e in self.failed.items()],
        }

    def __str__(self) -> str:
        rows = [f"{'seed':>4}  {'confinement (MPa)':>17}  {'peak stress (MPa)':>17}  {'strain at peak (%)':>18}"]
        for (seed, confinement), result in self.results.items():
            peak, strain = result.summary["peak_stress"] * 1e-6, result.summary["peak_strain"] * 100
            rows.append(f"{seed:>4}  {confinement * 1e-6:>17g}  {peak:>17.2f}  {strain:>18.4f}")
        for (seed, confinement), error in self.failed.items():
            rows.append(f"{seed:>4}  {confinement * 1e-6:>17g}  failed: {error}")
        if not self.can_be_fitted:
            return "\n".join([*rows, "", "there are not two different confinements to fit strength criteria to"])
        line, parabola = self.mohr_coulomb, self.hoek_brown
        rows.append("")
        for name, value, interval, unit in (
            ("slope", line.slope, line.slope_interval, ""),
            ("UCS", line.ucs * 1e-6, np.multiply(line.ucs_interval, 1e-6), "MPa"),
            ("cohesion", line.cohesion * 1e-6, np.multiply(line.cohesion_interval, 1e-6), "MPa"),
            ("friction angle", line.friction_angle, line.friction_angle_interval, "deg"),
            ("Hoek-Brown UCS", parabola.ucs * 1e-6, np.multiply(parabola.ucs_interval, 1e-6), "MPa"),
            ("Hoek-Brown m", parabola.m, parabola.m_interval, ""),
        ):
            rows.append(f"{name:<15} {value:9.3f} {unit:<4} (95 %: {interval[0]:.3f} to {interval[1]:.3f})")
        return "\n".join(rows)

    def plot(self) -> Figure:
        """Stress-strain curves, and peaks over confinement with both fits."""
        from grainlaw.studies.envelope_figure import plot_envelope

        return plot_envelope(self)

    def write(self, folder: str | os.PathLike[str], record: Mapping[str, Any] | None = None) -> None:
        """Write ``summary.json``, to which ``record`` is added, and ``envelope.png``. Raises OSError where it cannot.

        No picture where the tests that are done cannot be fitted.
        """
        path = writable_folder(folder)
        write_json(path / "summary.json", {**self.summary, **(record or {})})
        if not self.can_be_fitted:
            return
        write_atomically(path / "envelope.png", lambda file: self.plot().savefig(file, dpi=150))


@checked
def strength_envelope(
    specimens: Mapping[int, Specimen],
    law: Laws,
    confinements: Sequence[float],
    test: Callable[[float], LoadingProtocol],
    **options: Any,
) -> StrengthEnvelope:
    """Compress specimens (by seed) under each of the ``confinements`` (Pa), as many at a time as there are ``threads``.

    ``test`` makes the protocol of a confinement, such as ``lambda p: BiaxialCompression(confinement=p)``; its summary
    must have a ``peak_stress``. ``options`` are those of :func:`compare`; ``observers`` maps a seed and a confinement
    to the observers of that test. A test that fails does not touch the others. :class:`Stopped` has the finished tests
    as its ``result``.
    """
    if len(set(confinements)) < 2:
        raise ParameterError(
            f"strength_envelope: confinements = {list(confinements)} is not allowed, there must be two different ones"
        )
    if not specimens:
        raise ParameterError("strength_envelope: specimens is empty, it must hold at least one")
    runs = {
        (seed, float(p)): Run(specimen, law, test(float(p)))
        for seed, specimen in specimens.items()
        for p in confinements
    }
    try:
        outcome = simulate_all(runs, folder=folder_name, **options)
    except Stopped as stopped:
        stopped.result = StrengthEnvelope(stopped.result.results, stopped.result.failed)
        raise
    return StrengthEnvelope(outcome.results, outcome.failed)


def folder_name(test: Test) -> str:
    """The folder of one test inside that of the envelope."""
    return f"seed {test[0]}, {test[1] / 1e6:g} MPa"
