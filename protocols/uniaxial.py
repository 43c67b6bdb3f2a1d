"""Compression and tension between two platens, also under a constant lateral pressure."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, ClassVar

import attrs
import numpy as np

from grainlaw.columns import DEVIATOR, STAGE, STRAIN, STRESS
from grainlaw.conditions import AtRest, Condition, Curves, Reaches, StageError
from grainlaw.engine.state import State
from grainlaw.fields import parameter, part, whole_number
from grainlaw.gauges import Gauges, WholeSpecimen, has_platens
from grainlaw.integration import CentralDifference, Integrator
from grainlaw.loading import Adaptive, HeatingRate, Loading
from grainlaw.loads import Drive, Hold, Pressure
from grainlaw.moduli import elastic_moduli
from grainlaw.protocols.between_platens import (
    NO_TENSION,
    PANELS,
    QUANTITIES,
    Moving,
    Platens,
    UntilFailure,
    held_across,
    measure_between_platens,
    refuse_platens,
    require_ends,
)
from grainlaw.protocols.measures import end_share, failure_summary, size
from grainlaw.protocols.preliminary import after_stages, counted_after
from grainlaw.quantity import Quantity
from grainlaw.specimen import Specimen
from grainlaw.stage import Stage
from grainlaw.strength import Until


@attrs.frozen(kw_only=True)
class UniaxialCompression(UntilFailure):
    """Press a specimen until it has lost part of its strength; stress and strain count compression positive.

    It ends at ``stop_fraction`` of the peak stress or at ``maximum_strain``.
    """

    loading: Loading = part(Loading, Adaptive(), without=HeatingRate)  #: how fast the platens approach each other
    platens: Platens = part(Platens, Platens.SMOOTH)  #: whether the ends may slide along the platens
    moving: Moving = part(Moving, Moving.TOP)  #: which platen moves, or both
    #: axial strain at which the test ends, if it has not failed
    maximum_strain: float = parameter("1", default=0.01, above=0, below=0.5)
    until: Until = part(Until, Until.FALL)  #: whether the test ends at the first failure
    #: share of the peak stress at which the test ends
    stop_fraction: float = parameter("1", default=0.5, at_least=0, below=1)
    samples: int = whole_number(default=1000, at_least=10)  #: wanted until the test ends at its limit
    gauges: Gauges = part(Gauges, WholeSpecimen())  #: where lateral and axial strain are measured
    integrator: Integrator = part(Integrator, CentralDifference())  #: the time integration, with its damping

    quantities, panels = QUANTITIES, PANELS

    def stages(self, specimen: Specimen) -> Sequence[Stage]:
        return [_stage(self, specimen, "compression", -1.0)]

    def measure(self, state: State) -> dict[str, float]:
        return measure_between_platens(state, -1.0, self.gauges)

    def summary(self, curves: Curves, specimen: Specimen) -> dict[str, Any]:
        return _summary(curves, specimen, -1.0, self.gauges)


@attrs.frozen(kw_only=True)
class UniaxialTension(UntilFailure):
    """Pull a specimen by its glued ends until it parts; stress and strain count tension positive.

    It ends at ``stop_fraction`` of the peak stress or at ``maximum_strain``.
    """

    loading: Loading = part(Loading, Adaptive(), without=HeatingRate)  #: how fast the platens part
    platens: Platens = part(Platens, Platens.SMOOTH)  #: whether the ends may slide along the platens
    moving: Moving = part(Moving, Moving.BOTH)  #: which platen moves, or both
    #: axial strain at which the test ends, if it has not failed
    maximum_strain: float = parameter("1", default=0.001, above=0, below=0.5)
    until: Until = part(Until, Until.FALL)  #: whether the test ends at the first failure
    #: share of the peak stress at which the test ends
    stop_fraction: float = parameter("1", default=0.1, at_least=0, below=1)
    samples: int = whole_number(default=1000, at_least=10)  #: wanted until the test ends at its limit
    gauges: Gauges = part(Gauges, WholeSpecimen())  #: where lateral and axial strain are measured
    integrator: Integrator = part(Integrator, CentralDifference())  #: the time integration, with its damping

    quantities, panels = QUANTITIES, PANELS

    def stages(self, specimen: Specimen) -> Sequence[Stage]:
        return [_stage(self, specimen, "tension", 1.0)]

    def measure(self, state: State) -> dict[str, float]:
        return measure_between_platens(state, 1.0, self.gauges)

    def summary(self, curves: Curves, specimen: Specimen) -> dict[str, Any]:
        return _summary(curves, specimen, 1.0, self.gauges)


SAMPLES = 20  #: in each ramp
MOST_CONFINING = 10_000  #: samples: a specimen that is not at rest by then has failed


@attrs.frozen
class IntactAtRest(Condition):
    """At rest; the test ends with an error if more than a hundredth of the bonds has broken before.

    Contact points without cohesion, such as joints, do not count as bonds: they may slip into place.
    """

    waits_for_rest: ClassVar[bool] = True
    rest: AtRest
    confinement: float  #: Pa

    def progress(self, curves: Curves) -> float:
        broken = float(curves["broken_bonds"][-1])
        if broken > 0.01:
            raise StageError(
                f"BiaxialCompression: {broken:.1%} of the bonded contact points broke under the confinement of "
                f"{self.confinement * 1e-6:g} MPa alone; it must be lower than what the specimen withstands"
            )
        return self.rest.progress(curves)


@attrs.frozen(kw_only=True)
class BiaxialCompression(UntilFailure):
    """Press a specimen axially while a constant pressure follows its deforming sides; compression counts positive.

    First the confinement rises on all sides, also on the upper platen, which is free to move, until the specimen is at
    rest. Then the platens approach as in uniaxial compression. The test ends when the deviator has fallen to
    ``stop_fraction`` of its peak, or at ``maximum_strain``.
    """

    confinement: float = parameter("Pa", at_least=0)  #: pressure on both sides
    confining_ramp: float = parameter("s", default=2e-4)  #: time in which the confinement rises
    loading: Loading = part(Loading, Adaptive(), without=HeatingRate)  #: how fast the platens approach each other
    platens: Platens = part(Platens, Platens.SMOOTH)  #: whether the ends may slide along the platens
    moving: Moving = part(Moving, Moving.TOP)  #: which platen moves, or both
    #: axial strain from the confined state on at which the test ends, if it has not failed
    maximum_strain: float = parameter("1", default=0.01, above=0, below=0.5)
    until: Until = part(Until, Until.FALL)  #: whether the test ends at the first failure
    #: share of the peak stress at which the test ends
    stop_fraction: float = parameter("1", default=0.5, at_least=0, below=1)
    samples: int = whole_number(default=1000, at_least=10)  #: wanted until the test ends at its limit
    gauges: Gauges = part(Gauges, WholeSpecimen())  #: where lateral and axial strain are measured
    integrator: Integrator = part(Integrator, CentralDifference())  #: the time integration, with its damping

    quantities = (
        *QUANTITIES, Quantity("broken_bonds", "%", meaning="share of the bonded contact points", counts=True)
    )  # fmt: skip
    panels = PANELS

    def stages(self, specimen: Specimen) -> Sequence[Stage]:
        axial = _stage(self, specimen, "axial", -1.0, falls=DEVIATOR)
        if self.confinement == 0:
            return [axial]
        axial = attrs.evolve(axial, loads=[*axial.loads, *self._sides(0.0)])
        return [self._confine(specimen), axial]

    def _sides(self, ramp: float) -> list[Pressure]:
        return [Pressure(boundary=side, pressure=self.confinement, ramp=ramp) for side in ("left", "right")]

    def _confine(self, specimen: Specimen) -> Stage:
        require_ends(specimen, type(self).__name__)
        stress = -self.confinement * end_share(specimen)
        bodies = ("top", "bottom") if has_platens(specimen) else ()
        return Stage(
            name="confine",
            loads=[
                Hold(boundary="top", axis=1, stress=stress, ramp=self.confining_ramp),
                Drive(boundary="bottom", axis=1, speed=0.0),
                *(Drive(boundary=platen, axis=0, speed=0.0) for platen in bodies),
                *self._sides(self.confining_ramp),
            ],
            until=[IntactAtRest(AtRest(1e-4), self.confinement)],
            interval=self.confining_ramp / SAMPLES,
            static=True,
            integrator=self.integrator,
            sample_limit=MOST_CONFINING,
        )

    def measure(self, state: State) -> dict[str, float]:
        """As uniaxial compression; also ``deviator`` (axial stress less confinement), share of ``broken_bonds``."""
        columns = measure_between_platens(state, -1.0, self.gauges)
        bonds = np.concatenate([group.cohesive for group in state.bonds.groups], axis=1).ravel()
        broken = ~np.isnan(state.broken_time[bonds])
        return {
            **columns,
            DEVIATOR: columns[STRESS] - self.confinement,
            "broken_bonds": float(broken.mean()) if len(broken) else 0.0,
        }

    def counted(self, curves: Curves, first: int) -> Curves:
        """As of any test; strains, cracks and damage count from the confined state, as in the summary."""
        return counted_after(super().counted, curves, first, int(self.confinement > 0), self.quantities)

    def summary(self, curves: Curves, specimen: Specimen) -> dict[str, Any]:
        """Strength, strain from the confined state on, moduli from the deviator, certificate."""
        confining = int(self.confinement > 0 and curves[STAGE].max() > 0)
        summary = _summary(after_stages(curves, confining, self.quantities), specimen, -1.0, self.gauges, DEVIATOR)
        stresses = {name: summary[name] + self.confinement for name in ("strength", "largest_stress")}
        return {"confinement": self.confinement, **summary, **stresses}


def _stage(
    test: UniaxialCompression | UniaxialTension | BiaxialCompression, specimen: Specimen, name: str, sign: float,
    falls: str = STRESS,
) -> Stage:  # fmt: skip
    """Platens part (``sign`` 1) or approach (-1) until the strain is reached or the column ``falls`` has fallen."""
    require_ends(specimen, type(test).__name__)
    if sign > 0:
        refuse_platens(specimen, type(test).__name__, NO_TENSION)
    return Stage(
        name=name,
        loads=_drives(sign, held_across(specimen, test.platens), test.moving),
        until=[Reaches(STRAIN, test.maximum_strain), *test.failing(falls, STRAIN)],
        **test.sampling(test.maximum_strain * size(specimen)[1]),
    )


def _drives(sign: float, platens: Platens, moving: Moving) -> list[Drive]:
    """Drives that part the platens at 1 m/s (``sign`` 1), or press (-1)."""
    share = 0.5 if moving is Moving.BOTH else 0.0
    drives = [
        Drive(boundary="top", axis=1, speed=(1 - share) * sign),
        Drive(boundary="bottom", axis=1, speed=-share * sign),
    ]
    if platens is Platens.ROUGH:
        drives += [Drive(boundary=name, axis=0, speed=0.0) for name in ("top", "bottom")]
    return drives


def _summary(
    curves: Curves, specimen: Specimen, sign: float, gauges: Gauges, load: str = STRESS
) -> dict[str, Any]:  # fmt: skip
    """Strength by the column ``load`` (Pa), the largest stress, moduli and certificate of a uniaxial test."""
    moduli: dict[str, Any] = {**elastic_moduli(curves, specimen, sign, load, gauges.axial)}
    return failure_summary(curves, load, STRAIN, {"failure_strain": STRAIN}, **moduli)
