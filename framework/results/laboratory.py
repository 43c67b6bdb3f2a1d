"""What a laboratory reports of a test, from its finished result."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import attrs
import numpy as np

from grainlaw.columns import TIME
from grainlaw.moduli import converted
from grainlaw.results.acoustic import AcousticEvents, acoustic_events
from grainlaw.results.crack_pattern import FailurePlane, Rose, crack_lengths, crack_rose, failure_plane
from grainlaw.results.fragments import Fragments, fragments
from grainlaw.results.result import Result
from grainlaw.results.thresholds import (
    Path,
    crack_damage,
    initiation_by_crack_volume,
    initiation_by_lateral_strain,
    path_to_peak,
    secant_constants,
    stress_at_share,
    tangent_constants,
)
from grainlaw.window import Window, window_mean

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@attrs.frozen
class Measure:
    """What a number of a laboratory report means; ``docs/measures.md`` has the definitions."""

    meaning: str
    unit: str = "1"  #: for display
    factor: float = 1.0  #: value in SI times this is the value in ``unit``
    source: str = ""


ISRM = "ISRM (1979, 1999)"
NICKSIAR = "Nicksiar and Martin (2012)"
MARTIN = "Martin and Chandler (1994)"

#: by the names of :attr:`Laboratory.properties`
MEASURES = {
    "apparent_tangent_modulus": Measure("E* at 50 % of the peak, tangent", "GPa", 1e-9, ISRM),
    "apparent_tangent_poisson": Measure("nu* at 50 % of the peak, tangent", source=ISRM),
    "tangent_modulus": Measure("E at 50 % of the peak, tangent", "GPa", 1e-9, ISRM),
    "tangent_poisson": Measure("nu at 50 % of the peak, tangent", source=ISRM),
    "apparent_secant_modulus": Measure("E* up to 50 % of the peak, secant", "GPa", 1e-9, ISRM),
    "apparent_secant_poisson": Measure("nu* up to 50 % of the peak, secant", source=ISRM),
    "secant_modulus": Measure("E up to 50 % of the peak, secant", "GPa", 1e-9, ISRM),
    "secant_poisson": Measure("nu up to 50 % of the peak, secant", source=ISRM),
    "damage_onset": Measure("onset of damage, 1 % of the damaged points at the peak", "MPa", 1e-6),
    "crack_initiation_count": Measure("CI, 1 % of the cracks at the peak", "MPa", 1e-6, "Potyondy and Cundall (2004)"),
    "crack_initiation_lateral": Measure("CI, lateral strain response", "MPa", 1e-6, NICKSIAR),
    "crack_initiation_volumetric": Measure("CI, crack-volumetric strain", "MPa", 1e-6, MARTIN),
    "crack_damage": Measure("CD, reversal of the volumetric strain", "MPa", 1e-6, MARTIN),
    "tensile_length": Measure("length of tensile cracks", "mm", 1e3),
    "shear_length": Measure("length of shear cracks", "mm", 1e3),
    "lost_opening": Measure("energy lost by contacts in opening", "J/m"),
    "lost_slip": Measure("energy lost by contacts in slip", "J/m"),
    "lost_tensile_cracks": Measure("energy lost by tensile cracks", "J/m"),
    "lost_shear_cracks": Measure("energy lost by shear cracks", "J/m"),
    "lost_unbroken": Measure("energy lost by contacts that have not broken", "J/m"),
    "fragments": Measure("fragments"),
    "largest_fragment": Measure("largest fragment, share of the area", "%", 1e2),
    "acoustic_events": Measure("acoustic events"),
    "largest_magnitude": Measure("largest magnitude, 1 m thick", source="Gutenberg and Richter (1956)"),
    "b_value": Measure("b-value", source="Aki (1965)"),
    "b_error": Measure("standard error of the b-value", source="Aki (1965)"),
    "failure_plane_angle": Measure("failure plane, from the x axis", "deg", 180 / np.pi, "Mardia and Jupp (2000)"),
    "failure_plane_strength": Measure("alignment of the failure plane", source="Mardia and Jupp (2000)"),
}


def mean_stress(result: Result, window: Window, frame: int = -1) -> np.ndarray:
    """(3,) Pa, xx, yy, xy: area mean over the grains whose centroid lies in a window, at one of the frames."""
    return window_mean(result.specimen.grains, result.frames[frame].stress, window)


@attrs.frozen(eq=False)
class Laboratory:
    """The measures of one test; prints as a table. nan where a measure does not exist (``docs/measures.md``)."""

    result: Result

    @cached_property
    def path(self) -> Path:
        """The way to the peak."""
        return path_to_peak(self.result.curves)

    @cached_property
    def half_lengths(self) -> np.ndarray:
        """(p,) m, what each contact point stands for."""
        ends = self.result.mesh.nodes[self.result.interfaces]
        return np.tile(np.hypot(*(ends[:, 1] - ends[:, 0]).T) / 2, 2)

    @cached_property
    def growth(self) -> dict[str, np.ndarray]:
        """``tensile_length`` and ``shear_length`` (t,) m at each sample of the curves."""
        lengths = crack_lengths(self.result.cracks, self.result.curves.get(TIME, np.array([])))
        return dict(zip(("tensile_length", "shear_length"), lengths, strict=True))

    @cached_property
    def rose(self) -> Rose:
        """Length of cracks by orientation."""
        return crack_rose(self.result.cracks)

    @cached_property
    def plane(self) -> FailurePlane:
        """Mean direction of the shear cracks in compression, of the tensile cracks otherwise."""
        cracks = self.result.cracks
        return failure_plane(cracks[~cracks.tensile if self.path.is_compression else cracks.tensile])

    @cached_property
    def fragments(self) -> Fragments:
        """At the end."""
        return fragments(self.result)

    @cached_property
    def events(self) -> AcousticEvents:
        """Acoustic events of a specimen 1 m thick."""
        return acoustic_events(self.result)

    @cached_property
    def properties(self) -> dict[str, float]:
        """Every measure that is one number, SI, under the names of ``MEASURES``."""
        found = self._constants() | self._thresholds() | self._cracks() | self._energies()
        return {name: found[name] for name in MEASURES}

    def _constants(self) -> dict[str, float]:
        found: dict[str, float] = {}
        for name, constants in (("tangent", tangent_constants), ("secant", secant_constants)):
            apparent = constants(self.path)
            true = converted(*apparent, self.result.specimen)
            for label, (young, poisson) in ((f"apparent_{name}", apparent), (name, true)):
                found |= {f"{label}_modulus": young, f"{label}_poisson": poisson}
        return found

    def _thresholds(self) -> dict[str, float]:
        curves, frames = self.result.curves, self.result.frames
        time = curves.get(TIME, np.array([]))
        cracks = np.searchsorted(self.result.cracks.time, time, side="right")
        damaged = np.array([np.count_nonzero(frame.contacts["damage"] > 0) for frame in frames])
        return {
            "damage_onset": stress_at_share(curves, np.array([frame.time for frame in frames]), damaged, 0.01),
            "crack_initiation_count": stress_at_share(curves, time, cracks, 0.01),
            "crack_initiation_lateral": initiation_by_lateral_strain(self.path),
            "crack_initiation_volumetric": initiation_by_crack_volume(self.path),
            "crack_damage": crack_damage(self.path),
        }

    def _cracks(self) -> dict[str, float]:
        cracks, areas, events = self.result.cracks, self.fragments.areas, self.events
        b, error = events.b_value()
        return {
            "tensile_length": float(cracks.length[cracks.tensile].sum()),
            "shear_length": float(cracks.length[~cracks.tensile].sum()),
            "fragments": len(areas),
            "largest_fragment": float(areas[0] / areas.sum()),
            "acoustic_events": len(events),
            "largest_magnitude": float(np.nanmax(events.magnitude)) if (events.energy > 0).any() else float("nan"),
            "b_value": b,
            "b_error": error,
            "failure_plane_angle": self.plane.angle,
            "failure_plane_strength": self.plane.strength,
        }

    def _energies(self) -> dict[str, float]:
        """Of the last frame."""
        contacts = self.result.frames[-1].contacts
        opening, slip = (self.half_lengths * contacts[name] for name in ("lost_opening", "lost_slip"))
        broken, tensile = ~np.isnan(contacts["broken_time"]), contacts["mode"] < 0.5
        groups = {"tensile_cracks": broken & tensile, "shear_cracks": broken & ~tensile, "unbroken": ~broken}
        by_group = {f"lost_{name}": float((opening + slip)[chosen].sum()) for name, chosen in groups.items()}
        return {"lost_opening": float(opening.sum()), "lost_slip": float(slip.sum()), **by_group}

    def __str__(self) -> str:
        rows = []
        for name, measure in MEASURES.items():
            value = self.properties[name] * measure.factor
            rows.append((measure.meaning, f"{value:.4g}" if np.isfinite(value) else "-", measure.unit))
        widths = [max(len(row[k]) for row in rows) for k in range(2)]
        return "\n".join(
            f"{a.ljust(widths[0])}  {b.rjust(widths[1])}  {c.replace('1', '')}".rstrip() for a, b, c in rows
        )

    def plot(self) -> Figure:
        """Curves with thresholds, orientations, fragments, events, and what cracks grow to and spend."""
        from grainlaw.results.figures.laboratory import plot_laboratory

        return plot_laboratory(self)
