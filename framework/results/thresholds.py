"""Stresses at which cracking begins and becomes unstable, and moduli, from the curves of a compression test."""

from __future__ import annotations

from collections.abc import Mapping

import attrs
import numpy as np

from grainlaw.columns import DEVIATOR, LATERAL_STRAIN, STAGE, STRAIN, STRESS, TIME, VOLUMETRIC_STRAIN
from grainlaw.fields import ParameterError
from grainlaw.moduli import on_path, slope
from grainlaw.strength import borne_in

NAN = float("nan")
NOT_COMPRESSED = "the specimen has not become shorter"
NO_LATERAL = "no lateral strain was measured"
TWOFOLD = 2  #: axial strains of two columns that differ by more than this are not those of one specimen


@attrs.frozen(eq=False)
class Path:
    """The path to the peak: samples with a higher load than all before them, from the stage that leads to the peak on.

    Not those of a stage that unloads: loads are means since the last sample, and so it may begin with the highest one.

    Strains count extension positive, from the start of that stage; nan where a test does not record them. The axial
    one is the volumetric less the lateral one or, where a test records no volumetric strain, ``strain`` with the sign
    against the lateral one.
    """

    load: np.ndarray  #: (t,) Pa, beyond the confinement
    axial: np.ndarray  #: (t,)
    lateral: np.ndarray  #: (t,)
    strain: np.ndarray  #: (t,) as the test records it, of either sign
    confinement: float  #: Pa; the axial stress is the load plus this
    laterals: int = 1  #: lateral strains in the volume: 1 in a plane, 2 of a cylinder

    @property
    def volumetric(self) -> np.ndarray:
        """(t,) of the area, in plane strain that of the volume; of a cylinder that of the volume."""
        return self.axial + self.laterals * self.lateral

    @property
    def is_compression(self) -> bool:
        """Whether the specimen has become shorter."""
        return len(self.load) > 2 and bool(self.axial[-1] < 0)

    def spacing(self, stress: float) -> float:
        """Pa, from the sample below an axial stress to the one above it: what is read from samples is no finer."""
        if len(self.load) < 2 or not np.isfinite(stress):
            return 0.0
        k = int(np.clip(np.searchsorted(self.load, stress - self.confinement), 1, len(self.load) - 1))
        return float(self.load[k] - self.load[k - 1])

    def between(self, low: float, high: float) -> np.ndarray:
        """Numbers of the samples between two shares of the peak load."""
        if not 0 <= low < high <= 1:
            raise ParameterError(f"shares of the peak = {low:g}, {high:g} are not allowed, they must rise from 0 to 1")
        if not len(self.load):
            return np.array([], dtype=int)
        return np.flatnonzero((self.load >= low * self.load[-1]) & (self.load <= high * self.load[-1]))


def path_to_peak(curves: Mapping[str, np.ndarray], *, laterals: int = 1, tension: bool | None = None) -> Path:
    """Find the path in the curves of a test; empty where there is no ``stress`` or no load above zero.

    The path begins with the stage in which the load first reaches half of its peak, so that a stage of confinement
    does not count. The load is the ``deviator`` where there is one. Whether it is ``tension`` is told by the lateral
    strain, unless given.
    """
    stress = curves.get(STRESS, np.array([]))
    load = curves.get(DEVIATOR, stress)
    found = borne_in(curves) if len(stress) else None
    if found is None:
        none = np.zeros(0)
        return Path(none, none, none, none, NAN, laterals)
    peak, none = found.at, np.full(len(load), NAN)
    first, chosen = on_path(load, curves.get(STRAIN, none), curves[STAGE], peak)
    lateral, area, strain = (
        curves.get(name, none)[chosen] - curves.get(name, none)[first]
        for name in (LATERAL_STRAIN, VOLUMETRIC_STRAIN, STRAIN)
    )
    way = lateral[-1] if tension is None else -1.0 if tension else 1.0
    axial = area - laterals * lateral if VOLUMETRIC_STRAIN in curves else -np.copysign(strain, way)
    return Path(
        load=load[chosen], axial=axial, lateral=lateral, strain=strain, confinement=float(stress[peak] - load[peak]),
        laterals=laterals,
    )  # fmt: skip


def strains_disagree(curves: Mapping[str, np.ndarray]) -> bool:
    """Whether the axial strain of :func:`path_to_peak` is not that of the column ``strain``, at half of the peak."""
    path = path_to_peak(curves)
    half = path.between(0.5, 1.0)[:1]
    axial, strain = np.abs(path.axial[half]), np.abs(path.strain[half])
    return bool(np.any(axial > TWOFOLD * strain) or np.any(strain > TWOFOLD * axial))


def tangent_constants(path: Path, centre: float = 0.5, width: float = 0.2) -> tuple[float, float]:
    """E* (Pa) and nu*: regression over ``width`` of the peak load round a share of it (ISRM 1979, 1999)."""
    chosen = path.between(centre - width / 2, centre + width / 2)
    young = slope(path.axial[chosen], path.load[chosen])
    return abs(young), -slope(path.axial[chosen], path.lateral[chosen])


def secant_constants(path: Path, share: float = 0.5) -> tuple[float, float]:
    """E* (Pa) and nu* from the start to a share of the peak load (ISRM 1979, 1999)."""
    if not len(path.load):
        return NAN, NAN
    wanted = share * path.load[-1]
    axial, lateral = (float(np.interp(wanted, path.load, values)) for values in (path.axial, path.lateral))
    return (abs((wanted - path.load[0]) / axial), -lateral / axial) if axial else (NAN, NAN)


@attrs.frozen
class Sought:
    """A threshold, or in words why there is none."""

    value: float = NAN  #: Pa, nan where there is none
    why: str = ""


def crack_damage(path: Path, laterals: int | None = None) -> Sought:
    """CD (Pa): axial stress at the largest contraction, where the volumetric strain reverses before the peak.

    The ``laterals`` are those of the path, unless given. With one it is that of the area, which in plane strain is the
    volume: it reverses where the tangent lateral ratio passes 1. With two it is what a laboratory finds on a cylinder,
    whose two lateral strains are equal: it reverses at a ratio of 1/2, and so sooner.
    Without a value where the specimen contracts until the peak. (Bieniawski 1967; Martin and Chandler 1994.)
    """
    turn, why = _reversal(path, laterals)
    return Sought(why=why) if why else Sought(float(path.load[turn]) + path.confinement)


def _reversal(path: Path, laterals: int | None = None) -> tuple[int, str]:
    """Number of the sample at which the volumetric strain reverses, or why it does not."""
    if why := _unfit(path):
        return 0, why
    laterals = path.laterals if laterals is None else laterals
    turn = int(np.argmin(path.axial + laterals * path.lateral))
    if 0 < turn < len(path.load) - 1:
        return turn, ""
    words = "axial and lateral strain" if laterals == 1 else "axial and twice the lateral strain"
    return 0, f"the sum of {words} {'falls' if turn else 'rises'} all the way to the peak"


def _unfit(path: Path) -> str:
    """Why the path has no volume to look at; empty if it has."""
    if not path.is_compression:
        return NOT_COMPRESSED
    return NO_LATERAL if np.isnan(path.lateral).all() else ""


def crack_closure(path: Path, share: float = 0.5, least: float = 0.01) -> Sought:
    """CC (Pa): axial stress at which cracks that were open have closed and the axial strain goes on straight.

    The axial strain over load is compared with a straight line from the start to a ``share`` of the peak: CC is where
    the specimen is shortened most beyond the line. Without a value where that is less than ``least`` times the strain
    at the end of the line. After the axial strain response (Peng and others 2015, Chinese Journal of Rock Mechanics
    and Engineering 34(6), 1091); that the line ends at half of the peak is ours.
    """
    if not path.is_compression:
        return Sought(why=NOT_COMPRESSED)
    chosen = path.between(0.0, share)
    if len(chosen) < 3:
        return Sought(why=f"fewer than three samples lie below {share:g} of the peak")
    load, shortened = path.load[chosen] - path.load[0], -path.axial[chosen]
    beyond = shortened - shortened[-1] * load / load[-1]
    most = int(np.argmax(beyond))
    if beyond[most] > least * shortened[-1]:
        return Sought(float(path.load[most]) + path.confinement)
    return Sought(why=f"the axial strain has no foot of {least:.2g} of that at {share:g} of the peak")


def initiation_by_lateral_strain(path: Path, least: float = 0.01) -> Sought:
    """CI (Pa) by the lateral strain response (Nicksiar and Martin 2012, doi:10.1007/s00603-012-0221-6).

    The lateral strain over load is compared with a straight line from the start to crack damage: CI is where it lies
    farthest below the line. Without a value where there is no crack damage, or where that distance is less than
    ``least`` times the lateral strain at crack damage.
    """
    turn, why = _reversal(path)
    if why:
        return Sought(why=f"there is no CD to end the line at: {why}")
    load, lateral = path.load[: turn + 1], path.lateral[: turn + 1]
    line = lateral[-1] * (load - load[0]) / (load[-1] - load[0])  # strains count from the start
    short = line - lateral
    most = int(np.argmax(short))
    if short[most] > least * abs(lateral[-1]):
        return Sought(float(load[most]) + path.confinement)
    return Sought(why=f"the lateral strain is nowhere {least:.2g} of that at CD below its line")


def crack_volumetric_strain(path: Path, low: float = 0.1, high: float = 0.3) -> np.ndarray:
    """(t,) volumetric less elastic volumetric strain (Martin and Chandler 1994, doi:10.1016/0148-9062(94)90014-0).

    The elastic part is the regression on the load between two shares of the peak; its slope is -(1 - nu*)/E*, in plane
    strain -(1 - 2 nu)(1 + nu)/E. nan where fewer than two samples lie there.
    """
    chosen = path.between(low, high)
    if len(chosen) < 2:
        return np.full(len(path.load), NAN)
    return path.volumetric - np.polyval(np.polyfit(path.load[chosen], path.volumetric[chosen], 1), path.load)


def initiation_by_crack_volume(path: Path, tolerance: float = 0.01, low: float = 0.1, high: float = 0.3) -> Sought:
    """CI (Pa) by the crack-volumetric strain (Martin and Chandler 1994, doi:10.1016/0148-9062(94)90014-0).

    Where it rises above ``tolerance`` times the elastic volumetric strain at the peak, and stays above it until the
    peak. Without a value where it never does.
    """
    if why := _unfit(path):
        return Sought(why=why)
    opened = crack_volumetric_strain(path, low, high)
    limit = tolerance * abs(path.volumetric[-1] - opened[-1])
    if np.isnan(limit):
        return Sought(why=f"fewer than two samples lie between {low:g} and {high:g} of the peak")
    if not opened[-1] > limit:
        return Sought(why=f"the crack volume at the peak is less than {tolerance:.2g} of the elastic one")
    last = int(np.flatnonzero(~(opened > limit))[-1])  # there is one: some residual of a regression is at most zero
    share = (limit - opened[last]) / (opened[last + 1] - opened[last])
    return Sought(float(path.load[last] + share * (path.load[last + 1] - path.load[last])) + path.confinement)


def stress_at_share(curves: Mapping[str, np.ndarray], time: np.ndarray, count: np.ndarray, share: float) -> float:
    """Axial stress (Pa) when a growing count (n,) at times (n,) s first reached a share of its value at the peak.

    nan where it was zero at the peak, or where no stress is recorded.
    """
    stress = curves.get(STRESS)
    if stress is None or not len(stress) or not len(time):
        return NAN
    found = borne_in(curves)
    if found is None:
        return NAN
    peak = curves[TIME][found.at]
    at_peak = np.interp(peak, time, count)
    if not at_peak > 0:
        return NAN
    reached = int(np.argmax(count >= share * at_peak))
    when = np.interp(share * at_peak, count[: reached + 1], time[: reached + 1])
    return float(np.interp(when, curves[TIME], stress))
