"""The Brazilian test: a disc split by pressing it between two jaws."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import attrs
import numpy as np

from grainlaw.columns import STRAIN, STRESS, STRESS_BOTTOM, STRESS_TOP, Panel
from grainlaw.conditions import Curves, Reaches
from grainlaw.engine.state import State
from grainlaw.fields import parameter, part, whole_number
from grainlaw.integration import CentralDifference, Integrator
from grainlaw.loading import Adaptive, HeatingRate, Loading
from grainlaw.loads import Drive
from grainlaw.messages import ParameterError
from grainlaw.protocols.between_platens import Platens, UntilFailure, held_across, require_platens
from grainlaw.protocols.measures import axial_strain, failure_summary, size
from grainlaw.quantity import Quantity
from grainlaw.specimen import Specimen
from grainlaw.stage import Stage
from grainlaw.strength import Until
from grainlaw.window import window_mean, within_circle

NEAREST, FARTHEST = 0.8, 1.05  #: of half of the width: the rim of a disc from its middle, also where jaws are wide


def _require_disc(specimen: Specimen, test: str) -> None:
    """Raise ParameterError unless the specimen is round: 2 P/(pi D) is the stress in no other."""
    region = specimen.grains.region
    low, high = region.bounds
    distance = np.hypot(*(region.outline - (low + high) / 2).T) / (size(specimen)[0] / 2)
    if distance.min() < NEAREST or distance.max() > FARTHEST:
        raise ParameterError(
            f"{test}: the specimen is no disc: its rim is {distance.min():.2f} to {distance.max():.2f} times half of "
            "its width from its middle; make it with grainlaw.geometry.disc"
        )


@attrs.frozen(kw_only=True)
class Brazilian(UntilFailure):
    """Press a disc at its boundaries top and bottom (see :func:`~grainlaw.geometry.disc`) until it has split.

    ``stress`` is the tensile stress in the middle of an elastic disc, ``shape_factor`` times 2 P/(pi D). The factor is
    1 for a load over a narrow arc; for flat ends of 20 and 30 degrees it is 0.9644 and 0.9205 (Wang, Jia, Kou, Zhang
    and Lindqvist 2004). The upper jaw moves, the lower one is held. The test ends when the load has fallen by a tenth,
    because the halves of a split disc can bear more load than the disc, as two columns. Where platens are separate
    bodies (see :func:`~grainlaw.geometry.between_platens`), these are moved and held instead.
    """

    loading: Loading = part(Loading, Adaptive(), without=HeatingRate)  #: how fast the jaws approach each other
    jaws: Platens = part(Platens, Platens.ROUGH)  #: whether the disc may slide along the jaws
    shape_factor: float = parameter("1", default=1.0)  #: of the stress in the middle: 1 for a narrow load
    maximum_strain: float = parameter(
        "1", default=0.005, above=0, below=0.5
    )  #: approach of the loaded ends over their distance
    until: Until = part(Until, Until.FALL)  #: whether the test ends at the first failure
    stop_fraction: float = parameter("1", default=0.9, at_least=0, below=1)  #: of the load at which it splits
    samples: int = whole_number(default=1000, at_least=10)  #: wanted until the test ends at its limit
    integrator: Integrator = part(Integrator, CentralDifference())  #: the time integration, with its damping

    quantities = (
        Quantity(STRESS, "MPa", words="tensile stress", form=".2f", meaning="in the middle of an elastic disc"),
        Quantity(STRAIN, "%", words="approach over diameter", form=".4f"),
        Quantity("middle_across", "MPa", form=".2f", meaning="stress in the middle, across the load"),
        Quantity("middle_along", "MPa", form=".2f", meaning="stress in the middle, along the load"),
        Quantity("failure_force", "kN/m"),
    )
    panels = (
        Panel(STRAIN, [STRESS]),
        Panel("force", ["middle_across", "middle_along"], "stress in the middle, tension positive"),
    )

    def stages(self, specimen: Specimen) -> Sequence[Stage]:
        require_platens(specimen, type(self).__name__)
        _require_disc(specimen, type(self).__name__)
        held = held_across(specimen, self.jaws) is Platens.ROUGH
        across = [Drive(boundary=jaw, axis=0, speed=0.0) for jaw in ("top", "bottom") if held]
        return [
            Stage(
                name="split",
                loads=[Drive(boundary="top", axis=1, speed=-1.0), Drive(boundary="bottom", axis=1, speed=0.0), *across],
                until=[Reaches(STRAIN, self.maximum_strain), *self.failing(STRESS, STRAIN, after_break=True)],
                **self.sampling(self.maximum_strain * size(specimen)[1]),
            )
        ]

    def measure(self, state: State) -> dict[str, float]:
        """Approach of the loaded ends over their distance, load (N/m), ``stress``, and stresses (Pa) in the middle.

        The latter, across and along the load, tension positive, are means over the grains whose centroid is nearer to
        the centre than a tenth of the diameter.
        """
        width, _ = size(state.specimen)
        top, bottom = -state.reaction("top")[1], state.reaction("bottom")[1]
        factor = self.shape_factor * 2 / (math.pi * width)
        low, high = state.specimen.grains.region.bounds
        middle = window_mean(state.specimen.grains, state.grain_stress(), within_circle((low + high) / 2, 0.1 * width))
        return {
            STRAIN: -axial_strain(state),
            "force": (top + bottom) / 2,
            STRESS: factor * (top + bottom) / 2,
            STRESS_TOP: factor * top,
            STRESS_BOTTOM: factor * bottom,
            "middle_across": float(middle[0]),
            "middle_along": float(middle[1]),
        }

    def summary(self, curves: Curves, specimen: Specimen) -> dict[str, Any]:
        """Brazilian tensile strength, load and approach at it, the largest stress, and the certificate."""
        return failure_summary(curves, STRESS, STRAIN, {"failure_force": "force", "failure_strain": STRAIN})
