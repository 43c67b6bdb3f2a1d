"""Platens of the uniaxial tests: how they hold the specimen, move it, and what is measured between them."""

from __future__ import annotations

import enum
from typing import Any

import attrs
import numpy as np

from grainlaw.columns import LATERAL_STRAIN, SHARED, STRAIN, STRESS, STRESS_BOTTOM, STRESS_TOP, VOLUMETRIC_STRAIN, Panel
from grainlaw.conditions import Condition, Fails, FailsTo, FallsTo
from grainlaw.engine.state import State
from grainlaw.fields import ParameterError
from grainlaw.gauges import Gauges, ends, has_platens
from grainlaw.integration import Integrator
from grainlaw.loading import Loading
from grainlaw.protocol import LoadingProtocol
from grainlaw.protocols.measures import axial_strain, size, window_stress
from grainlaw.quantity import Quantity
from grainlaw.specimen import Specimen
from grainlaw.strength import Until

FINE = 800  #: samples of the whole way at least, where contacts are damaged: a peak is missed by up to two
QUANTITIES = (
    attrs.evolve(SHARED[STRESS], words="axial stress"),
    attrs.evolve(SHARED[STRAIN], words="axial strain"),
    Quantity("stress_window", "MPa", form=".2f", meaning="mean over the grains in the middle of the specimen"),
    Quantity(
        "strain_points",
        "%",
        form=".4f",
        meaning="change of height over height, from points on both ends or gauges",
        counts=True,
    ),
)
PANELS = (
    Panel(STRAIN, [STRESS]), Panel(STRAIN, [VOLUMETRIC_STRAIN, LATERAL_STRAIN], "strain, extension positive"),
)  # fmt: skip
NO_TENSION = "tension does not pass the contact between two bodies; pull the specimen at its own ends, without platens"


class Platens(enum.Enum):
    """How the ends of a specimen are held across the load.

    Platens that are separate bodies (see :func:`~grainlaw.geometry.between_platens`) are always held, so that they do
    not slide away; the law between the two phases decides whether the specimen slides on them.
    """

    SMOOTH = enum.auto()  #: free to slide
    ROUGH = enum.auto()  #: held


class Moving(enum.Enum):
    """Which platens move."""

    TOP = enum.auto()
    BOTH = enum.auto()  #: each at half the speed


class UntilFailure(LoadingProtocol):
    """A test that loads a specimen until the load has fallen."""

    loading: Loading
    until: Until
    stop_fraction: float
    samples: int
    integrator: Integrator

    def failing(self, load: str, deformation: str, *, after_break: bool = False) -> list[Condition]:
        """What ends a stage in which a specimen fails by two columns, beside the limit of its deformation.

        A fall ``after_break`` counts only when a contact has broken.
        """
        if self.until is Until.FAILURE:
            return [Fails(load, deformation)]
        falls = FailsTo if after_break else FallsTo
        return [falls(load, self.stop_fraction)] if self.stop_fraction else []

    def sampling(self, travel: float, finest: int = FINE) -> dict[str, Any]:
        """How a stage is loaded and sampled whose drives part or approach by at most ``travel`` (m).

        Where contacts are damaged, samples become as short as ``finest`` of them on the whole way would be.
        """
        interval = travel / self.samples
        expected, pieces = self.samples + self.loading.delay(interval), max(1, round(finest / self.samples))
        return {
            "loading": self.loading, "interval": interval, "expected": expected, "pieces": pieces,
            "integrator": self.integrator,
        }  # fmt: skip


def require_platens(specimen: Specimen, test: str) -> None:
    """Raise ParameterError without the boundaries top and bottom, or with separate platens but no ends of the rock."""
    bodies = {"rock_top", "rock_bottom", "platen_top", "platen_bottom"} & set(specimen.mesh.boundaries)
    specimen.mesh.require_boundaries(test, "top", "bottom", *(("rock_top", "rock_bottom") if bodies else ()))


def refuse_platens(specimen: Specimen, test: str, why: str) -> None:
    """Raise ParameterError if platens are separate bodies."""
    if has_platens(specimen):
        raise ParameterError(f"{test}: the specimen has platens of its own (the boundary rock_top): {why}")


def held_across(specimen: Specimen, platens: Platens) -> Platens:
    """How the boundaries top and bottom are held: platens that are separate bodies must not slide away."""
    return Platens.ROUGH if has_platens(specimen) else platens


def require_ends(specimen: Specimen, test: str) -> None:
    """Raise ParameterError unless the specimen has flat ends and two sides; its platens must be flat on both faces.

    The boundary of a rigid platen need not be flat.
    """
    require_platens(specimen, test)
    specimen.mesh.require_boundaries(test, "left", "right")
    inner = tuple(name for name in ("platen_top", "platen_bottom") if name in specimen.mesh.boundaries)
    outer = ("top", "bottom") if inner else ()
    for name in (*ends(specimen), *inner, *outer):
        if np.ptp(specimen.mesh.nodes[specimen.mesh.boundaries[name], 1]) > 1e-9 * size(specimen)[1]:
            raise ParameterError(f"{test}: the {name} of the specimen is not flat and level")


def measure_between_platens(state: State, sign: float, gauges: Gauges) -> dict[str, float]:
    """The columns both uniaxial tests record; ``sign`` is 1 where tension counts positive, -1 where compression does.

    ``stress`` is the mean of both platens over the width at the start; ``lateral_strain`` and ``volumetric_strain``
    (two-dimensional, of the area) are those of the gauges and count extension positive.
    """
    width, _ = size(state.specimen)
    top = sign * state.reaction("top")[1] / width
    bottom = -sign * state.reaction("bottom")[1] / width
    lateral, axial = gauges.strains(state.specimen, state.mean_displacement)
    return {
        STRAIN: sign * axial_strain(state),
        STRESS: (top + bottom) / 2,
        STRESS_TOP: top,
        STRESS_BOTTOM: bottom,
        "stress_window": sign * float(window_stress(state)[1]),
        "strain_points": sign * axial,
        LATERAL_STRAIN: lateral,
        VOLUMETRIC_STRAIN: axial + lateral,
    }
