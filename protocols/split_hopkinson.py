"""The split Hopkinson bar: a test between two long bars, along one of which a wave comes."""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from typing import Any

import attrs
import numpy as np

from grainlaw.columns import DAMAGED, LOAD, STRAIN, TIME, Panel
from grainlaw.conditions import Curves, Fails, Reaches
from grainlaw.engine.state import State
from grainlaw.fields import ParameterError, UnitWarning, optional, parameter, part, unusual, whole_number
from grainlaw.integration import CentralDifference, Integrator, Undamped
from grainlaw.loads import BarEnd, Drive
from grainlaw.messages import refusal, short
from grainlaw.moduli import slope
from grainlaw.protocol import LoadingProtocol
from grainlaw.protocols.measures import size
from grainlaw.protocols.uniaxial import UniaxialCompression
from grainlaw.quantity import Quantity
from grainlaw.specimen import Specimen
from grainlaw.stage import Stage
from grainlaw.strength import borne_in
from grainlaw.time_series import Varying, pulse, varying

TRIED = 401  #: times at which the wave is looked at
WIDER = 20  #: times the width of the specimen, or less by as much, that bars usually have at most
LOW, HIGH = 0.2, 0.8  #: of the largest load: between them its rate is found; from ``LOW`` on the balance counts
#: of a slow test: what it says about how slow it was, and what does not exist where nothing was damaged
SLOW = ("kinetic_ratio", "imbalance", "unstable_rise")
AT_FAILURE = ("strength", "failure_strain", "failure_force", "failure_deflection", "flexural_strength", "toughness")
WAVES = (
    Quantity("incident", "MPa", form=".2f", meaning="of the wave that comes along the bar, tension positive"),
    Quantity("reflected", "MPa", form=".2f", meaning="of the wave that goes back in the incident bar"),
    Quantity("transmitted", "MPa", form=".2f", meaning="of the wave in the transmission bar"),
    Quantity(
        "mean_end_difference",
        "%",
        words="mean difference of end forces",
        form=".2f",
        meaning="while the load rises from a fifth of that at failure",
    ),
    Quantity(
        "strain_rate",
        "1/s",
        form=".3g",
        is_main=True,
        meaning="from all three waves; of a test the mean while the load rises from a fifth of that at failure",
    ),
    Quantity("strain_rate_one_wave", "1/s", form=".3g", meaning="from the reflected wave, as if in balance"),
    Quantity("failure_strain_rate", "1/s", words="strain rate at failure", form=".3g"),
    Quantity("failure_time", "µs", words="time of failure"),
    Quantity(TIME, "µs", meaning="since the start"),
    Quantity("stress_rate", "GPa/s", meaning="of the load, between 20 and 80 % of that at failure"),
    Quantity("force_rate", "GN/m/s", meaning="of the load, between 20 and 80 % of that at failure"),
    Quantity("toughness_rate", "GPa √m/s", factor=1e-9, meaning="of the stress intensity that the load gives"),
)


@attrs.frozen(kw_only=True)
class SplitHopkinson(LoadingProtocol):
    """Another test by a wave that comes along a bar from above, with a second bar below: dynamic strength, toughness.

    In place of the drives between which the test loads the specimen there are the ends of two long elastic bars
    (:class:`~grainlaw.loads.BarEnd`); the bar of two supports stands half on each. The test measures as it does, its
    strength and toughness are those of its own formulae, and beside them there are the three waves, the balance of the
    forces on both ends, and rates. It lasts for the ``duration``, or ends at the failure of a test with
    ``until=Until.FAILURE``. For any test of one stage, such as ``UniaxialCompression``, ``Brazilian`` and
    ``SemiCircularBend``.
    """

    test: LoadingProtocol = part(LoadingProtocol, UniaxialCompression())  #: what the specimen is put through
    #: stress of the wave that comes, tension is positive: below 0 for a test that presses
    wave: Varying = varying("Pa", pulse(-300e6, rise=60e-6, hold=20e-6))
    youngs_modulus: float = parameter("Pa", default=200e9, usual=(1e8, 1e12))  #: of the bars
    density: float = parameter("kg/m3", default=7850.0, usual=(500, 20_000))  #: of the bars
    #: of the bars, section over thickness; that of the specimen, if not given
    width: float | None = optional("m", above=0)
    duration: float = parameter("s", default=200e-6)  #: of the test
    samples: int = whole_number(default=800, at_least=10)  #: in the duration
    integrator: Integrator = part(Integrator, CentralDifference(damping=Undamped()))  #: the time integration

    def __attrs_post_init__(self) -> None:
        if isinstance(self.test, SplitHopkinson):
            raise refusal("SplitHopkinson: test", self.test, "another test such as UniaxialCompression()")

    @property
    def quantities(self) -> Sequence[Quantity]:
        """Those of the waves and of the test."""
        return (*WAVES, *self.test.quantities)

    @property
    def panels(self) -> Sequence[Panel]:
        """Those of the test, and the waves in the bars."""
        waves = Panel(TIME, ["incident", "reflected", "transmitted"], "stress of the waves in the bars")
        return (*self.test.panels, waves)

    @property
    def impedance(self) -> float:
        """Pa s/m, of the bars: density times the speed of their waves."""
        return math.sqrt(self.youngs_modulus * self.density)

    def stages(self, specimen: Specimen) -> Sequence[Stage]:
        drives = self._between(specimen)
        bars = [
            BarEnd(
                boundary=drive.boundary, axis=drive.axis, roller=drive.roller, impedance=self.impedance,
                stress=0.0 if k else self.wave, width=self._width(specimen) / (len(drives) - 1 if k else 1),
            )
            for k, drive in enumerate(drives)
        ]  # fmt: skip
        self._check(specimen, bars[0], drives)
        (stage,) = self.test.stages(specimen)
        others = [load for load in stage.loads if load not in drives]
        until = [Reaches(TIME, self.duration), *(end for end in stage.until if isinstance(end, Fails))]
        return [
            Stage(
                name="wave", loads=[*others, *bars], until=until,
                interval=self.duration / self.samples, expected=self.samples, integrator=self.integrator,
            )
        ]  # fmt: skip

    def _check(self, specimen: Specimen, bar: BarEnd, drives: Sequence[Drive]) -> None:
        """Refuse a wave that pulls where the test presses, or the other way round; warn of a width in other units."""
        peak = max(map(bar.at, np.linspace(0.0, self.duration, TRIED)), key=abs)
        if peak * (drives[0].at(0.0) - drives[1].at(0.0)) < 0:
            does, other = ("pulls", "presses, and its wave is below 0") if peak > 0 else ("presses", "pulls: above 0")
            raise ParameterError(
                f"SplitHopkinson: wave of {peak / 1e6:.4g} MPa is not allowed, it {does} and the test "
                f"{type(self.test).__name__} {other}"
            )
        width, own = self._width(specimen), size(specimen)[0]
        if words := unusual("SplitHopkinson: width", width, "m", (own / WIDER, own * WIDER)):
            warnings.warn(UnitWarning(words), stacklevel=2)

    def _between(self, specimen: Specimen) -> list[Drive]:
        """The drives of the test between which it loads the specimen, the uppermost first."""
        stages = self.test.stages(specimen)
        drives = [drive for stage in stages for drive in stage.of(Drive)]
        axis = next((drive.axis for drive in drives if drive.moves), None)
        between = [drive for drive in drives if drive.axis == axis]
        if len(stages) != 1 or len(between) < 2:
            raise ParameterError(
                f"SplitHopkinson: test = {short(self.test)} is not allowed, it must have one stage, in which one "
                "boundary moves towards another, or from it"
            )
        mesh = specimen.mesh
        return sorted(between, key=lambda drive: -mesh.nodes[mesh.boundaries[drive.boundary], drive.axis].mean())

    def _width(self, specimen: Specimen) -> float:
        return self.width or size(specimen)[0]

    def measure(self, state: State) -> dict[str, float]:
        """As the test; ``incident``, ``reflected`` and ``transmitted`` (Pa), tension positive, means over a sample.

        They are those of a bar at the specimen, from the forces on its ends. ``end_difference`` is that of both forces
        over their mean; ``strain_rate`` (1/s), positive in the direction of loading, (v1 - v2)/L from all three waves
        and from the reflected one alone, which is right in balance; only in tests that have a strain (Kolsky 1949,
        doi:10.1088/0370-1301/62/11/302).
        """
        first, *others = self._between(state.specimen)
        width, height = self._width(state.specimen), size(state.specimen)[1]
        upper = state.reaction(first.boundary)[first.axis] / width
        lower = -sum(state.reaction(drive.boundary)[drive.axis] for drive in others) / width
        bars = (load for load in state.imposed.of(BarEnd) if load.boundary == first.boundary)
        end, bar = state.time - state.began, next(bars, None)  # there is none before the test, as while it is heated
        begin = end - state.since_sample
        incident = bar.at(end) if bar else 0.0
        if bar and begin < end:
            incident = float(bar.course(np.array([begin]), np.array([end]))[0])
        reflected, transmitted, total = upper - incident, lower, abs(upper + lower)
        row = {
            **self.test.measure(state), "incident": incident, "reflected": reflected, "transmitted": transmitted,
            "end_difference": 2 * abs(upper - lower) / total if total > 0 else 0.0,
        }  # fmt: skip
        if STRAIN in row:
            sign = math.copysign(1.0, first.at(0.0) - others[0].at(0.0)) / (self.impedance * height)
            row["strain_rate"] = sign * (incident - reflected - transmitted)
            row["strain_rate_one_wave"] = -2 * sign * reflected
        return row

    def summary(self, curves: Curves, specimen: Specimen) -> dict[str, Any]:
        """Of the test, but for how slow it was; balance of the end forces, strain rate, rate of the load, and times.

        They are those at its failure, or at its largest load where nothing was damaged: then it has no strength.
        """
        found = {name: value for name, value in self.test.summary(curves, specimen).items() if name not in SLOW}
        intact, failure = not curves[DAMAGED].any(), borne_in(curves)
        if intact:
            found |= {name: math.nan for name in AT_FAILURE if name in found}
        if failure is None:
            return found
        at = failure.largest if intact else failure.at
        name = next(name for name in LOAD if name in curves)
        time, load = curves[TIME][: at + 1], curves[name][: at + 1]
        first, last = (int(np.argmax(load >= share * load[at])) for share in (LOW, HIGH))
        rate = slope(time[first : last + 1], load[first : last + 1])
        found |= {
            "failure_time": float(time[at]), "end_difference": float(curves["end_difference"][at]),
            "mean_end_difference": float(curves["end_difference"][first : at + 1].mean()), f"{name}_rate": rate,
        }  # fmt: skip
        if STRAIN in curves:
            rates = curves["strain_rate"]
            found |= {"strain_rate": float(rates[first : at + 1].mean()), "failure_strain_rate": float(rates[at])}
        if "toughness" in found:
            found["toughness_rate"] = rate * found["largest_toughness"] / found["largest_force"]
        return found
