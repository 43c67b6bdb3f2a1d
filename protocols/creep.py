"""Creep: a specimen under a load that is held, until it fails."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import attrs
import numpy as np

from grainlaw.columns import AGED, AGED_LOSS, FATIGUE, JUMPS, LATERAL_STRAIN, STAGE, STRAIN, STRESS, TIME, Panel, cracks
from grainlaw.conditions import AtRest, Condition, Curves, StageError
from grainlaw.engine.state import State
from grainlaw.fields import ParameterError, parameter, part, whole_number
from grainlaw.gauges import WholeSpecimen
from grainlaw.integration import CentralDifference, Integrator
from grainlaw.loads import Drive, Hold, Pressure
from grainlaw.protocol import LoadingProtocol
from grainlaw.protocols.between_platens import QUANTITIES, Platens, held_across, measure_between_platens, require_ends
from grainlaw.protocols.measures import end_share
from grainlaw.quantity import Quantity
from grainlaw.specimen import Specimen
from grainlaw.stage import Ageing, Stage

SAMPLES = 10  #: in the ramp
SPAN = 0.25  #: of the time held, over which the rate of strain is a mean: strain comes in steps
LOST = 1e-3  #: share of the strength that bonds may lose while the load is applied, in the mean


@attrs.frozen
class Bears(Condition):
    """At rest under the load; the test ends with an error if the specimen fails before."""

    waits_for_rest: ClassVar[bool] = True
    rest: AtRest
    load: float  #: Pa
    largest: float  #: strain

    def progress(self, curves: Curves) -> float:
        if curves[STRAIN][-1] > self.largest:
            raise StageError(
                f"Creep: the specimen failed under the load of {self.load * 1e-6:g} MPa as it was applied, before any "
                "time has passed; it must be lower than the strength"
            )
        if (lost := float(curves[FATIGUE][-1])) > LOST:
            raise StageError(
                f"Creep: bonds have lost {lost:.2g} of their strength in the {float(curves[TIME][-1]):.2g} s of the "
                "run in which the load is applied: the rate of fatigue is too high for it"
            )
        return self.rest.progress(curves)


@attrs.frozen
class Collapses(Condition):
    """The strain has grown by a ``growth`` since the stage began."""

    growth: float

    def progress(self, curves: Curves) -> float:
        return float((curves[STRAIN][-1] - curves[STRAIN][0]) / self.growth)


@attrs.frozen(kw_only=True)
class Creep(LoadingProtocol):
    """Hold an axial stress, with or without confinement, and let time pass until the specimen fails.

    The load rises in the time ``ramp`` of the run and is held by the upper platen, which moves as one body. Then time
    passes in jumps from equilibrium to equilibrium (:class:`~grainlaw.Ageing`). The test ends at the equilibrium after
    ``duration``, or where the strain has grown by ``failure_strain`` while the load was held. Compression counts
    positive. Bonds need a law that ages, such as ``StaticFatigue``.
    """

    load: float = parameter("Pa")  #: axial stress, with the confinement
    duration: float = parameter("s", usual=(1e-3, 1e12))  #: for which the load is held
    confinement: float = parameter("Pa", default=0.0, at_least=0)  #: pressure on the sides
    largest_growth: float = parameter("1", default=0.02, above=0, at_most=0.5)  #: of fatigue in a jump
    failure_strain: float = parameter("1", default=5e-3, above=0, below=0.5)  #: growth under the load that is failure
    ramp: float = parameter("s", default=2e-4)  #: time of the run in which the load rises
    platens: Platens = part(Platens, Platens.SMOOTH)  #: whether the ends can move sideways
    ratio: float = parameter("1", default=1e-4)  #: at which the specimen counts as at rest
    most_samples: int = whole_number(default=100_000, at_least=100)  #: then the run stops
    integrator: Integrator = part(Integrator, CentralDifference())  #: the time integration, with its damping

    def __attrs_post_init__(self) -> None:
        if self.load <= self.confinement:
            raise ParameterError(
                f"Creep: load = {self.load:g} Pa is not allowed, it must be above confinement = {self.confinement:g} Pa"
            )

    @property
    def _ageing(self) -> Ageing:
        return Ageing(duration=self.duration, largest_growth=self.largest_growth, ratio=self.ratio)

    quantities = (
        *QUANTITIES,
        Quantity("held_stress", "MPa", form=".2f"),
        Quantity("time_to_failure", "s", is_main=True),
        Quantity("initial_strain", "%", form=".4f"),
        Quantity("creep_strain", "%", form=".4f", is_main=True),
        Quantity("lowest_rate", "1/s", words="lowest rate of strain", is_main=True),
        Quantity("time_of_lowest_rate", "s"),
    )
    panels = (Panel(AGED, [STRAIN]), Panel(AGED, [FATIGUE]), Panel(STRAIN, [STRESS]))

    def stages(self, specimen: Specimen) -> Sequence[Stage]:
        require_ends(specimen, type(self).__name__)
        largest = 2 * self.failure_strain
        bears = Bears(AtRest(self.ratio), self.load, largest)
        stages = [self._stage(specimen, "load", self.confinement, self.load, until=[bears])]
        if self.confinement:
            rest = Bears(AtRest(self.ratio), self.confinement, largest)
            stages.insert(0, self._stage(specimen, "confine", 0.0, self.confinement, until=[rest]))
        ends = [Collapses(self.failure_strain)]
        return [*stages, self._stage(specimen, "creep", self.load, self.load, until=ends, ageing=self._ageing)]

    def _stage(self, specimen: Specimen, name: str, start: float, end: float, **more: Any) -> Stage:
        share, confining = end_share(specimen), name == "confine"
        lateral = held_across(specimen, self.platens) is Platens.ROUGH
        sides = ("left", "right") if self.confinement else ()
        ramp = 0.0 if name == "creep" else self.ramp
        return Stage(
            name=name,
            loads=[
                Hold(boundary="top", axis=1, stress=-end * share, start=-start * share, ramp=ramp),
                Drive(boundary="bottom", axis=1, speed=0.0),
                *(Drive(boundary=end_, axis=0, speed=0.0) for end_ in ("top", "bottom") if lateral),
                *(
                    Pressure(boundary=side, pressure=self.confinement, ramp=self.ramp if confining else 0.0)
                    for side in sides
                ),
            ],
            interval=self.ramp / SAMPLES,
            static=confining,
            integrator=self.integrator,
            sample_limit=self.most_samples,
            **more,
        )

    def measure(self, state: State) -> dict[str, float]:
        """As uniaxial compression; mean ``fatigue`` and ``aged_loss`` (J per metre) so far."""
        return {
            **measure_between_platens(state, -1.0, WholeSpecimen()),
            AGED_LOSS: float(state.clock.books.aged_loss[0]),
            FATIGUE: float(state.memory(FATIGUE).mean()) if len(state.bonds) else 0.0,
        }

    def curve(self, curves: Curves) -> Mapping[str, np.ndarray]:
        """Time (s), strain, lateral strain and number of cracks at each equilibrium while the load is held.

        The last sample before each jump, and the last of all if the specimen rests there; of a specimen that fails not
        the samples of its failure.
        """
        held = np.flatnonzero(curves[STAGE] == curves[STAGE].max())
        before = np.diff(curves[JUMPS][held], append=curves[JUMPS][held[-1]]) > 0
        before[-1] = self._ageing.rests_after_jump({name: values[held] for name, values in curves.items()})
        rows = held[before] if before.any() else held[:1]
        return {
            "time": curves[AGED][rows],
            "strain": curves[STRAIN][rows],
            "lateral_strain": curves[LATERAL_STRAIN][rows],
            "cracks": cracks(curves)[rows],
        }

    def summary(self, curves: Curves, specimen: Specimen) -> dict[str, Any]:
        """Time to failure, strains, the lowest rate of strain (1/s) and when, cracks.

        The time (s) is that after the jump that broke it, nan if it lasts. With a large ``largest_growth`` it is too
        short, as bonds then break together.
        """
        held = np.flatnonzero(curves[STAGE] == curves[STAGE].max())
        rests = self.curve(curves)
        failed = bool(curves[STRAIN][-1] - curves[STRAIN][held[0]] >= self.failure_strain)
        rate, when = lowest_rate(rests["time"], rests["strain"])
        return {
            "held_stress": self.load,
            "confinement": self.confinement,
            "failed": failed,
            "time_to_failure": float(curves[AGED][-1]) if failed else float("nan"),
            "initial_strain": float(rests["strain"][0]),
            "creep_strain": float(rests["strain"][-1] - rests["strain"][0]),
            "lowest_rate": rate,
            "time_of_lowest_rate": when,
            "cracks_at_first": int(rests["cracks"][0]),
            "cracks": int(rests["cracks"][-1]),
            "jumps": int(curves[JUMPS][-1]),
        }


def lowest_rate(time: np.ndarray, strain: np.ndarray) -> tuple[float, float]:
    """The lowest mean rate of strain (1/s) over a quarter of the time, and the middle of that (s)."""
    lasts = SPAN * (time[-1] - time[0])
    if len(time) < 3 or strain[-1] <= strain[0] or not lasts > 0:
        return float("nan"), float("nan")
    begins = np.unique(np.clip(np.concatenate([time, time - lasts]), time[0], time[-1] - lasts))
    rates = (np.interp(begins + lasts, time, strain) - np.interp(begins, time, strain)) / lasts
    k = int(np.argmin(rates))
    return float(rates[k]), float(begins[k] + lasts / 2)
