"""Platens of the uniaxial tests: how they hold the specimen, move it, and what is measured between them."""

from __future__ import annotations

import enum
import math
from collections.abc import Mapping
from typing import Any, Protocol

import numpy as np

from grainlaw.columns import LATERAL_STRAIN, STRAIN, STRESS, STRESS_BOTTOM, STRESS_TOP, VOLUMETRIC_STRAIN
from grainlaw.engine.state import State
from grainlaw.integration import Integrator
from grainlaw.parameter import ParameterError
from grainlaw.protocols.measures import (
    axial_strain,
    axial_strain_of_points,
    certificate,
    elastic_moduli,
    ends,
    has_platens,
    is_rock,
    lateral_strain,
    size,
    window_stress,
)
from grainlaw.specimen import Elastic, Rigid, Specimen
from grainlaw.stage import Curves, Drive, FallsTo, Reaches, Stage

NO_TENSION = "tension does not pass the contact between two bodies; pull the specimen at its own ends, without platens"


class Platens(enum.Enum):
    """How the ends of a specimen are held across the load.

    Platens that are separate bodies (see :func:`~grainlaw.geometry.between_platens`) are always held, so that they do
    not slide away; the law between the two phases decides whether the specimen slides on them. ``SMOOTH`` then only
    means that a test without a ramp begins with a velocity field in which the specimen becomes wider.
    """

    SMOOTH = enum.auto()  #: free to slide
    ROUGH = enum.auto()  #: held


class Moving(enum.Enum):
    """Which platens move."""

    TOP = enum.auto()
    BOTH = enum.auto()  #: each at half the speed


class AtSpeed(Protocol):
    """What tests that load at a speed until the load has fallen have in common."""

    @property
    def speed(self) -> float: ...
    @property
    def ramp(self) -> float: ...
    @property
    def stop_fraction(self) -> float: ...
    @property
    def samples(self) -> int: ...
    @property
    def integrator(self) -> Integrator: ...


class BetweenPlatens(AtSpeed, Protocol):
    """What the uniaxial tests have in common."""

    @property
    def platens(self) -> Platens: ...
    @property
    def moving(self) -> Moving: ...
    @property
    def maximum_strain(self) -> float: ...


def sample_limit(test: AtSpeed, interval: float) -> int:
    """Most samples of a test: twice those that it asks for, and those of its ramp."""
    return 2 * test.samples + math.ceil(test.ramp / interval)


def expected_samples(test: AtSpeed, interval: float) -> int:
    """Samples of a test whose specimen does not fail: half of its ramp is lost."""
    return test.samples + math.ceil(test.ramp / 2 / interval)


def uniaxial_stage(test: BetweenPlatens, specimen: Specimen, name: str, sign: float, falls: str = STRESS) -> Stage:
    """Platens part (``sign`` 1) or approach (-1) until the strain is reached or the column ``falls`` has fallen."""
    require_ends(specimen, type(test).__name__)
    if sign > 0:
        refuse_platens(specimen, type(test).__name__, NO_TENSION)
    duration = test.maximum_strain * size(specimen)[1] / test.speed
    interval = duration / test.samples
    field = None if test.ramp > 0 else homogeneous_velocity(specimen, sign * test.speed, test.platens, test.moving)
    return Stage(
        name=name,
        drives=platen_drives(sign * test.speed, test.ramp, held_across(specimen, test.platens), test.moving),
        until=[
            Reaches(STRAIN, test.maximum_strain),
            *([FallsTo(falls, test.stop_fraction)] if test.stop_fraction else []),
        ],
        interval=interval,
        integrator=test.integrator,
        initial_velocity=field,
        sample_limit=sample_limit(test, interval),
        expected=expected_samples(test, interval),
    )


def uniaxial_summary(curves: Curves, specimen: Specimen, sign: float, load: str = STRESS) -> dict[str, Any]:
    """Peak of the column ``load`` (Pa), moduli and certificate of a uniaxial test."""
    peak = int(np.argmax(curves[load]))
    return {
        "peak_stress": float(curves[load][peak]),
        "peak_strain": float(curves[STRAIN][peak]),
        **elastic_moduli(curves, specimen, sign, load),
        **certificate(curves, load),
    }


def require_boundaries(specimen: Specimen, test: str, *names: str) -> None:
    """Raise ParameterError unless the specimen has boundaries of these names."""
    missing, has = set(names) - set(specimen.mesh.boundaries), ", ".join(sorted(specimen.mesh.boundaries))
    if missing:
        raise ParameterError(
            f"{test}: the specimen has no boundary named {' or '.join(sorted(missing))}, only {has}"
        )  # fmt: skip


def require_platens(specimen: Specimen, test: str) -> None:
    """Raise ParameterError without the boundaries top and bottom, or with separate platens but no ends of the rock."""
    bodies = {"rock_top", "rock_bottom", "platen_top", "platen_bottom"} & set(specimen.mesh.boundaries)
    require_boundaries(specimen, test, "top", "bottom", *(("rock_top", "rock_bottom") if bodies else ()))


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
    require_boundaries(specimen, test, "left", "right")
    inner = tuple(name for name in ("platen_top", "platen_bottom") if name in specimen.mesh.boundaries)
    outer = ("top", "bottom") if inner or not has_platens(specimen) else ()
    for name in dict.fromkeys((*ends(specimen), *inner, *outer)):
        if np.ptp(specimen.mesh.nodes[specimen.mesh.boundaries[name], 1]) > 1e-9 * size(specimen)[1]:
            raise ParameterError(f"{test}: the {name} of the specimen is not flat and level")


def platen_drives(speed: float, ramp: float, platens: Platens, moving: Moving) -> list[Drive]:
    """Drives that part the platens at ``speed`` (m/s; negative presses)."""
    share = 0.5 if moving is Moving.BOTH else 0.0
    drives = [
        Drive(boundary="top", axis=1, speed=(1 - share) * speed, ramp=ramp),
        Drive(boundary="bottom", axis=1, speed=-share * speed, ramp=ramp),
    ]
    if platens is Platens.ROUGH:
        drives += [Drive(boundary=name, axis=0, speed=0.0) for name in ("top", "bottom")]
    return drives


def homogeneous_velocity(specimen: Specimen, speed: float, platens: Platens, moving: Moving) -> np.ndarray:
    """(i, 2) m/s: linear in height, and between smooth platens in width, by the Poisson effect of the grains.

    With it the stress grows everywhere at once and no wave leaves the platen. Platens that are separate bodies move
    with their drives; the small wave that their own deformation makes is accepted.
    """
    low, high = specimen.grains.region.bounds
    place = (specimen.mesh.nodes - low) / (high - low)
    steel = ~is_rock(specimen)[specimen.mesh.node_grain]
    place[steel, 1] = np.clip(place[steel, 1], 0, 1)
    field = np.zeros_like(place)
    field[:, 1] = speed * (place[:, 1] - (0.5 if moving is Moving.BOTH else 0.0))
    rock = _rock(specimen)
    if platens is Platens.SMOOTH and isinstance(rock, Elastic):
        along, across, _ = rock.constants
        width, height = high - low
        field[:, 0] = -speed * across / along * width / height * (place[:, 0] - 0.5)
        field[steel, 0] = 0.0
    return field


def _rock(specimen: Specimen) -> Elastic | Rigid | None:
    """What the specimen is made of; None where it is of several phases."""
    if not isinstance(specimen.material, Mapping):
        return specimen.material
    phases = np.unique(specimen.grains.phase[is_rock(specimen)])
    return specimen.material[int(phases[0])] if len(phases) == 1 and has_platens(specimen) else None


def measure_between_platens(state: State, sign: float) -> dict[str, float]:
    """The columns both uniaxial tests record; ``sign`` is 1 where tension counts positive, -1 where compression does.

    ``stress`` is the mean of both platens over the width at the start; ``lateral_strain`` and ``volumetric_strain``
    (two-dimensional, of the area) count extension positive.
    """
    width, _ = size(state.specimen)
    top = sign * state.reaction("top")[1] / width
    bottom = -sign * state.reaction("bottom")[1] / width
    lateral, axial = lateral_strain(state), axial_strain_of_points(state)
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
