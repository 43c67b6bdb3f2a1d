"""Platens of the uniaxial tests: what they hold, and how the specimen moves when they begin."""

from __future__ import annotations

import enum
from typing import Any, Protocol

import numpy as np

from grainlaw.integration import Integrator
from grainlaw.loading import Curves, Drive, FallsTo, Reaches, Stage
from grainlaw.parameter import ParameterError
from grainlaw.protocols.measures import (
    axial_strain,
    axial_strain_of_points,
    certificate,
    elastic_moduli,
    lateral_strain,
    size,
    window_stress,
)
from grainlaw.specimen import Elastic, Specimen
from grainlaw.state import State


class Platens(enum.Enum):
    """How the ends of a specimen are held across the load."""

    SMOOTH = enum.auto()  #: free to slide
    ROUGH = enum.auto()  #: held


class Moving(enum.Enum):
    """Which platens move."""

    TOP = enum.auto()
    BOTH = enum.auto()  #: each at half the speed


class BetweenPlatens(Protocol):
    """What the uniaxial tests have in common."""

    @property
    def speed(self) -> float: ...
    @property
    def ramp(self) -> float: ...
    @property
    def platens(self) -> Platens: ...
    @property
    def moving(self) -> Moving: ...
    @property
    def maximum_strain(self) -> float: ...
    @property
    def stop_fraction(self) -> float: ...
    @property
    def samples(self) -> int: ...
    @property
    def integrator(self) -> Integrator: ...


def uniaxial_stage(test: BetweenPlatens, specimen: Specimen, name: str, sign: float, falls: str = "stress") -> Stage:
    """Platens part (``sign`` 1) or approach (-1) until the strain is reached or the column ``falls`` has fallen."""
    require_ends(specimen, type(test).__name__)
    duration = test.maximum_strain * size(specimen)[1] / test.speed
    interval = duration / test.samples
    field = None if test.ramp > 0 else homogeneous_velocity(specimen, sign * test.speed, test.platens, test.moving)
    return Stage(
        name=name,
        drives=platen_drives(sign * test.speed, test.ramp, test.platens, test.moving),
        until=[Reaches("strain", test.maximum_strain), FallsTo(falls, test.stop_fraction)],
        interval=interval,
        integrator=test.integrator,
        initial_velocity=field,
        sample_limit=2 * test.samples + int(np.ceil(test.ramp / interval)),
    )


def uniaxial_summary(curves: Curves, specimen: Specimen, sign: float) -> dict[str, Any]:
    """Peak, moduli and certificate of a uniaxial test."""
    peak = int(np.argmax(curves["stress"]))
    return {
        "peak_stress": float(curves["stress"][peak]),
        "peak_strain": float(curves["strain"][peak]),
        **elastic_moduli(curves, specimen, sign),
        **certificate(curves),
    }


def require_boundaries(specimen: Specimen, test: str, *names: str) -> None:
    """Raise ParameterError unless the specimen has boundaries of these names."""
    missing, has = set(names) - set(specimen.mesh.boundaries), ", ".join(sorted(specimen.mesh.boundaries))
    if missing:
        raise ParameterError(
            f"{test}: the specimen has no boundary named {' or '.join(sorted(missing))}, only {has}"
        )  # fmt: skip


def require_ends(specimen: Specimen, test: str) -> None:
    """Raise ParameterError unless the specimen has flat ends and two sides."""
    require_boundaries(specimen, test, "top", "bottom", "left", "right")
    for name in ("top", "bottom"):
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
    """(i, 2) m/s: linear in height, and in width by the grains' Poisson effect between smooth platens.

    With it the stress grows everywhere at once and no wave leaves the platen.
    """
    low, high = specimen.grains.region.bounds
    place = (specimen.mesh.nodes - low) / (high - low)
    field = np.zeros_like(place)
    field[:, 1] = speed * (place[:, 1] - (0.5 if moving is Moving.BOTH else 0.0))
    if platens is Platens.SMOOTH and isinstance(specimen.material, Elastic):
        along, across, _ = specimen.material.constants
        width, height = high - low
        field[:, 0] = -speed * across / along * width / height * (place[:, 0] - 0.5)
    return field


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
        "strain": sign * axial_strain(state),
        "stress": (top + bottom) / 2,
        "stress_top": top,
        "stress_bottom": bottom,
        "stress_window": sign * float(window_stress(state)[1]),
        "strain_points": sign * axial,
        "lateral_strain": lateral,
        "volumetric_strain": axial + lateral,
    }
