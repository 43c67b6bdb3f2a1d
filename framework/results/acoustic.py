"""Acoustic events: breaks that are near in space and time, their energy, and the mechanism of their sources."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import attrs
import meshio
import numpy as np
import scipy

from grainlaw.arguments import Checked, checked
from grainlaw.columns import ABSORBED, KINETIC, LOST, TIME, energy
from grainlaw.fields import checked_number
from grainlaw.messages import refusal
from grainlaw.polygon import linked
from grainlaw.results.files import write_atomically
from grainlaw.results.result import Cracks, Result
from grainlaw.results.tables import data_frame
from grainlaw.results.vtk import in_tensor, write_vtu
from grainlaw.short_form import between

if TYPE_CHECKING:
    import pandas

LEAST_EVENTS = 10  #: for a b-value
UNITS = {
    "time": "s", "energy": "J", "radiated": "J", "size": "m", "potency": "m3", "moment": "N m",
    "scalar_moment": "N m", "tensile_angle": "deg",
}  # fmt: skip
OPENS = 0.3  #: isotropic share of the moment from which on a source opens, and below minus which it closes
KINDS = ("opening", "shear", "closing")  #: of sources


@attrs.frozen(eq=False)
class AcousticEvents(metaclass=Checked):
    """Events in the order of their first break.

    The source of an event is what opening and slip its contact points have gained by breaking, beyond elastic ones:
    from the last sample before the break until a shear wave has left its vicinity. Tensors are those of the plane: xx,
    yy and xy.
    """

    time: np.ndarray  #: (e,) s, of the first break
    position: np.ndarray  #: (e, 2) m, mean of the breaks weighted by energy
    energy: np.ndarray  #: (e,) J, spent by the breaks, for the thickness of the specimen
    breaks: np.ndarray  #: (e,) number of contact points
    size: np.ndarray  #: (e,) m, length of a straight crack whose points are as far from each other
    tensile: np.ndarray  #: (e,) share of the energy in tensile cracks
    potency: np.ndarray  #: (e, 3) m3, inelastic strain of the source times its volume
    moment: np.ndarray  #: (e, 3) N m, stiffness of the grains times potency; zeros where they are rigid
    radiated: np.ndarray  #: (e,) J, what has gone into motion of the specimen meanwhile, also what damping took of it

    def __len__(self) -> int:
        return len(self.time)

    @property
    def _facts(self) -> dict[str, str]:
        counts = {kind: str(int(np.count_nonzero(self.kind == kind))) for kind in KINDS if len(self)}
        found = {"events": str(len(self)), "breaks": str(int(self.breaks.sum())), **counts}
        if len(self):
            found["size"] = between(self.size, "m")
        if np.any(self.energy > 0):
            found["magnitude"] = f"{np.nanmin(self.magnitude):.2f} to {np.nanmax(self.magnitude):.2f}"
        b, error = self.b_value()
        return found | ({} if math.isnan(b) else {"b": f"{b:.2f} ± {error:.2f}"})

    @property
    def magnitude(self) -> np.ndarray:
        """(e,) (2/3) (log10 E - 4.8), E in J (Gutenberg and Richter 1956, Bull. Seism. Soc. Am. 46, 105-145).

        nan for an event without energy.
        """
        return (np.log10(np.where(self.energy > 0, self.energy, np.nan)) - 4.8) * 2 / 3

    # --- mechanism ----------------------------------------------------------------------------------------------------

    @property
    def scalar_moment(self) -> np.ndarray:
        """(e,) N m, root of half the sum of squares of the moment's entries (Silver and Jordan 1982), in the plane.

        That of slip is shear modulus times slip times area.
        """
        xx, yy, xy = self.moment.T
        return np.sqrt((xx**2 + yy**2) / 2 + xy**2)

    @property
    def moment_magnitude(self) -> np.ndarray:
        """(e,) (2/3) (log10 M0 - 9.1), M0 in N m (Hanks and Kanamori 1979); nan for an event without a moment."""
        moment = self.scalar_moment
        return (np.log10(np.where(moment > 0, moment, np.nan)) - 9.1) * 2 / 3

    @property
    def isotropic(self) -> np.ndarray:
        """(e,) isotropic share of the moment, from -1 to 1; 0 is pure shear.

        Mean of the principal moments over the sum of it and of half their difference, which is the ratio R of Feignier
        and Young (1992, Geophys. Res. Lett. 19, 1503-1506) and the k of Hudson and others (1989) in the plane, where a
        deviatoric moment has one form alone. A crack that opens has (K + G/3) / (K + 4G/3) under plane strain.
        """
        mean, half = _mean_and_half(self.moment if self.moment.any() else self.potency)
        return mean / np.maximum(np.abs(mean) + half, 1e-300)

    @property
    def tensile_angle(self) -> np.ndarray:
        """(e,) deg between the motion of both faces and their plane: 90 opens, 0 slips, -90 closes (Vavrycuk 2001).

        Exact for sources in one plane; others are given what one plane would come nearest with.
        """
        mean, half = _mean_and_half(self.potency)
        share = np.divide(mean, half, out=np.sign(mean), where=half > 0)  # where all directions open alike, 90
        return np.degrees(np.arcsin(np.clip(share, -1, 1)))

    @property
    def kind(self) -> np.ndarray:
        """(e,) "opening" where the isotropic share is above 0.3, "closing" below -0.3, else "shear"; or "unknown"."""
        share = self.isotropic
        cases = [share > OPENS, np.abs(share) <= OPENS, share < -OPENS]
        return np.select(cases, KINDS, "unknown")

    @property
    def planes(self) -> np.ndarray:
        """(e, 2) rad from the x axis, in [0, pi): the two directions that a crack with this source can have.

        They lie alike on both sides of the axis of the largest extension, and are one where it only opens or closes.
        """
        xx, yy, xy = self.potency.T
        axis = np.arctan2(2 * xy, xx - yy) / 2  # of the largest extension
        off = np.pi / 4 - np.radians(self.tensile_angle) / 2  # between it and the normals of both planes
        return (np.stack([axis - off, axis + off], axis=1) + np.pi / 2) % np.pi

    def _columns(self) -> dict[str, np.ndarray]:
        names = ("magnitude", "scalar_moment", "moment_magnitude", "isotropic", "tensile_angle", "kind")
        return attrs.asdict(self, recurse=False) | {name: getattr(self, name) for name in names}

    def to_pandas(self) -> pandas.DataFrame:
        """A row for each event, its place as x, y (m), with what follows from its source. Raises ParameterError."""
        first, second = self.planes.T
        return data_frame("AcousticEvents.to_pandas", self._columns() | {"plane": first, "other_plane": second})

    @property
    def plane_lines(self) -> np.ndarray:
        """(e, 2, 2, 2) m: both planes of each event as lines through its place, of its size."""
        half = np.stack([np.cos(self.planes), np.sin(self.planes)], axis=2) * self.size[:, None, None] / 2
        middle = self.position[:, None]
        return np.stack([middle - half, middle + half], axis=2)

    def write_vtk(self, file: str | os.PathLike[str]) -> None:
        """Write both planes of each event as lines with its numbers, a ``.vtu`` for ParaView.

        Raises ParameterError for another ending and without events, OSError.
        """
        if Path(file).suffix != ".vtu" or not len(self):
            raise refusal("write_vtk: file", str(file), "a name that ends in .vtu, of at least one event")
        kind = np.select([self.kind == kind for kind in KINDS], range(len(KINDS)), -1)
        tensor = {name: in_tensor(getattr(self, name)) for name in ("moment", "potency")}
        columns = self._columns() | tensor | {"kind": kind, "event": np.arange(len(self))}
        del columns["position"]
        data = {name: [np.repeat(values, 2, axis=0)] for name, values in columns.items()}
        points = np.pad(self.plane_lines.reshape(-1, 2), [(0, 0), (0, 1)])
        mesh = meshio.Mesh(points, [("line", np.arange(len(points)).reshape(-1, 2))], cell_data=data)
        units = [f"{name}: {UNITS[name]}" for name in columns if name in UNITS]
        write_atomically(Path(file), lambda path: write_vtu(path, mesh, {"units": units, "kinds": ", ".join(KINDS)}))

    # --- sizes --------------------------------------------------------------------------------------------------------

    def completeness(self, width: float = 0.2) -> float:
        """The magnitude below which events are missing: the lower end of the bin, of a width, that has the most.

        Largest curvature (Wiemer and Wyss 2000, Bull. Seism. Soc. Am. 90, 859-869). nan where no event has energy.
        """
        checked_number("completeness: width", width, above=0)
        bins = np.floor(self.magnitude[np.isfinite(self.magnitude)] / width)
        values, counts = np.unique(bins, return_counts=True)
        return float(values[np.argmax(counts)] * width) if len(values) else math.nan

    def b_value(self, completeness: float | None = None) -> tuple[float, float]:
        """b and its standard error b/sqrt(n), from the n events of the magnitude ``completeness`` or more.

        Maximum likelihood, log10(e) / (mean magnitude - completeness) (Aki 1965, Bull. Earthq. Res. Inst. 43, 237-239).
        Without ``completeness`` it is the smallest magnitude, so that all events count. nan for fewer than ten events.
        """
        magnitude = self.magnitude[np.isfinite(self.magnitude)]
        least = magnitude.min(initial=math.inf) if completeness is None else completeness
        excess = magnitude[magnitude >= least] - least
        if len(excess) < LEAST_EVENTS or not excess.mean() > 0:
            return float("nan"), float("nan")
        b = math.log10(math.e) / float(excess.mean())
        return b, b / math.sqrt(len(excess))

    def b_interval(self, completeness: float | None = None) -> tuple[float, float]:
        """The interval that holds b with 95 %: the sum of exponential magnitudes is as chi-squared.

        That of :meth:`b_value`; where the smallest event is the end of the magnitudes, it tells nothing itself.
        """
        b, error = self.b_value(completeness)
        if math.isnan(b):
            return b, b
        count = round((b / error) ** 2)
        free = 2 * (count - (completeness is None))
        low, high = scipy.stats.chi2.ppf([0.025, 0.975], free) / (2 * count)
        return b * float(low), b * float(high)


def _mean_and_half(tensor: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mean of the principal values of tensors (e, 3), and half their difference."""
    xx, yy, xy = tensor.T
    return (xx + yy) / 2, np.hypot((xx - yy) / 2, xy)


def sources(cracks: Cracks) -> np.ndarray:
    """(k, 3) m: jump times normal, made symmetric, of the motion that each crack gained; xx, yy, xy."""
    tx, ty = np.cos(cracks.orientation), np.sin(cracks.orientation)  # the normal is (ty, -tx)
    opening, slip = cracks.source_opening, cracks.source_slip
    shear = slip * tx * ty
    return np.stack(
        [opening * ty**2 + shear, opening * tx**2 - shear, -opening * tx * ty + slip * (ty**2 - tx**2) / 2], axis=1
    )


@checked
def acoustic_events(
    result: Result, *, thickness: float = 1.0, distance: float | None = None, duration: float | None = None
) -> AcousticEvents:
    """Group breaks at most ``distance`` (m) and ``duration`` (s) apart into events, also along chains of breaks.

    ``distance`` is twice the grain size (the root of the mean area) if not given, ``duration`` the time in which a
    shear wave passes that distance. A break has the time of its sample, so that all breaks of one sample are
    simultaneous: where samples are farther apart than ``duration``, their interval decides. ``thickness`` (m) is that
    of the specimen.

    The moment is the stiffness of the grains on both sides times the inelastic strain of the contact points (Minakov
    and Yarushina 2021). What goes into motion while an event lasts is radiated by it, shared among those that last at
    the same time by their energy.
    """
    checked_number("acoustic_events: thickness", thickness, above=0)
    for name, value in (("distance", distance), ("duration", duration)):
        if value is not None:
            checked_number(f"acoustic_events: {name}", value, at_least=0)
    near, passage = result.specimen.vicinity
    distance = near if distance is None else distance
    duration = passage * distance / near if duration is None else duration
    stiffness = result.specimen.grain_stiffness[result.cracks.grains].mean(axis=1)
    return clustered(result.cracks, distance, duration, thickness, stiffness, result.curves, passage)


def clustered(
    cracks: Cracks, distance: float, duration: float, thickness: float = 1.0, stiffness: np.ndarray | None = None,
    curves: Mapping[str, np.ndarray] | None = None, passage: float = 0.0,
) -> AcousticEvents:  # fmt: skip
    """Events made of breaks, with the stiffness (k, 3, 3) Pa beside them and curves; see :func:`acoustic_events`."""
    count, label = 0, np.zeros(0, dtype=int)
    if len(cracks):
        pairs = scipy.spatial.KDTree(cracks.position).query_pairs(distance, output_type="ndarray")
        rounding = 1e-12 * float(np.max(cracks.time, initial=0.0))
        one, other = pairs[np.abs(np.diff(cracks.time[pairs], axis=1)[:, 0]) <= duration + rounding].T
        label = linked(len(cracks), one, other)
        count = int(label.max()) + 1

    def sums(values: np.ndarray) -> np.ndarray:
        rows = np.atleast_2d(values.T)
        return np.stack([np.bincount(label, row, count) for row in rows], axis=1)

    area = cracks.length * thickness
    energy_of = cracks.spent * area
    total, size = sums(energy_of)[:, 0], np.bincount(label, minlength=count)
    weight = np.where(total[label] > 0, energy_of / np.maximum(total[label], 1e-300), 1 / size[label])
    potency = sources(cracks) * area[:, None]
    strain = potency * [1, 1, 2]
    moment = np.zeros_like(strain) if stiffness is None else np.einsum("kij,kj->ki", stiffness, strain)
    length = sums(cracks.length)[:, 0]
    middle = sums(cracks.length[:, None] * cracks.position) / length[:, None]
    spread = sums(cracks.length * ((cracks.position - middle[label]) ** 2).sum(axis=1))[:, 0]
    first = np.full(count, np.inf)
    last = np.full(count, -np.inf)
    np.minimum.at(first, label, cracks.time)
    np.maximum.at(last, label, cracks.time)
    shares = np.where(total > 0, total, float(np.min(total[total > 0], initial=1.0)))
    return AcousticEvents(
        time=first,
        position=sums(weight[:, None] * cracks.position),
        energy=total,
        breaks=size,
        size=np.sqrt((sums(cracks.length**3)[:, 0] + 12 * spread) / length),
        tensile=sums(weight * cracks.tensile)[:, 0],
        potency=sums(potency),
        moment=sums(moment),
        radiated=thickness * _radiated(curves or {}, first, last + passage, shares),
    )


def _radiated(curves: Mapping[str, np.ndarray], first: np.ndarray, last: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """(e,) J/m that has gone into motion, or to damping, from the sample before an event to the first at its end."""
    if not curves:
        return np.full(len(first), np.nan)
    time, motion = curves[TIME], energy(curves, KINETIC, LOST, ABSORBED)
    begin = np.searchsorted(time, first)  # breaks have the times of samples
    end = np.minimum(np.maximum(np.searchsorted(time, last), begin + 1), len(time) - 1)
    gains = np.diff(motion, prepend=0.0)
    active = np.zeros(len(time) + 1)
    np.add.at(active, begin, weight)
    np.add.at(active, end + 1, -weight)
    active = np.cumsum(active)[:-1]
    rates = np.divide(gains, active, out=np.zeros(len(time)), where=active > 1e-12 * weight.max(initial=0.0))
    sums = np.concatenate([[0.0], np.cumsum(rates)])
    return weight * (sums[end + 1] - sums[begin])
