"""Acoustic events: breaks that are near in space and time, and their energy."""

from __future__ import annotations

import math

import attrs
import numpy as np
import scipy

from grainlaw.arguments import Checked, checked
from grainlaw.fields import checked_number
from grainlaw.results.result import Cracks, Result
from grainlaw.specimen import Specimen

LEAST_EVENTS = 10  #: for a b-value


@attrs.frozen(eq=False)
class AcousticEvents(metaclass=Checked):
    """Events in the order of their first break."""

    time: np.ndarray  #: (e,) s, of the first break
    position: np.ndarray  #: (e, 2) m, mean of the breaks weighted by energy
    energy: np.ndarray  #: (e,) J, spent by the breaks, for the thickness of the specimen
    breaks: np.ndarray  #: (e,) number of contact points
    tensile: np.ndarray  #: (e,) share of the energy in tensile cracks

    def __len__(self) -> int:
        return len(self.time)

    @property
    def magnitude(self) -> np.ndarray:
        """(e,) (2/3) (log10 E - 4.8), E in J (Gutenberg and Richter 1956, Bull. Seism. Soc. Am. 46, 105-145).

        nan for an event without energy.
        """
        return (np.log10(np.where(self.energy > 0, self.energy, np.nan)) - 4.8) * 2 / 3

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


def shear_wave_speed(specimen: Specimen) -> float:
    """m/s in the grains, the slowest of several minerals; 0 for rigid grains, in which there are no waves."""
    if specimen.is_rigid:
        return 0.0
    return float(np.sqrt(np.min(specimen.zone_stiffness[:, 2, 2] * specimen.mesh.zone_areas / specimen.zone_masses)))


@checked
def acoustic_events(
    result: Result, *, thickness: float = 1.0, distance: float | None = None, duration: float | None = None
) -> AcousticEvents:
    """Group breaks at most ``distance`` (m) and ``duration`` (s) apart into events, also along chains of breaks.

    ``distance`` is twice the grain size (the root of the mean area) if not given, ``duration`` the time in which a
    shear wave passes that distance. A break has the time of its sample, so that all breaks of one sample are
    simultaneous: where samples are farther apart than ``duration``, their interval decides. ``thickness`` (m) is that
    of the specimen.
    """
    for name, value in (("thickness", thickness), ("distance", distance), ("duration", duration)):
        if value is not None:
            checked_number(f"acoustic_events: {name}", value, at_least=0)
    if distance is None:
        distance = 2 * math.sqrt(float(result.specimen.grains.areas.mean()))
    if duration is None:
        speed = shear_wave_speed(result.specimen)
        duration = distance / speed if speed > 0 else 0.0
    return clustered(result.cracks, distance, duration, thickness)


def clustered(cracks: Cracks, distance: float, duration: float, thickness: float = 1.0) -> AcousticEvents:
    """Events made of breaks; see :func:`acoustic_events`."""
    if not len(cracks):
        none = np.zeros(0)
        return AcousticEvents(none, np.zeros((0, 2)), none, np.zeros(0, int), none)
    pairs = scipy.spatial.KDTree(cracks.position).query_pairs(distance, output_type="ndarray")
    rounding = 1e-12 * float(np.max(cracks.time, initial=0.0))
    one, other = pairs[np.abs(np.diff(cracks.time[pairs], axis=1)[:, 0]) <= duration + rounding].T
    links = scipy.sparse.coo_matrix((np.ones(len(one)), (one, other)), shape=(len(cracks),) * 2)
    count, label = scipy.sparse.csgraph.connected_components(links, directed=False)
    energy = cracks.spent * cracks.length * thickness
    total = np.bincount(label, energy, count)
    size = np.bincount(label, minlength=count)
    weight = np.where(total[label] > 0, energy / np.maximum(total[label], 1e-300), 1 / size[label])
    return AcousticEvents(
        time=cracks.time[np.unique(label, return_index=True)[1]],
        position=np.stack([np.bincount(label, weight * x, count) for x in cracks.position.T], axis=1),
        energy=total,
        breaks=size,
        tensile=np.bincount(label, weight * cracks.tensile, count),
    )
