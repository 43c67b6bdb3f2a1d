"""Loading and unloading in loops under any other test."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import attrs
import numpy as np

from grainlaw.arguments import is_number
from grainlaw.columns import STAGE, STRAIN, STRESS, Panel, cracks
from grainlaw.conditions import Curves, FallsTo, Reaches
from grainlaw.engine.state import State
from grainlaw.fields import ParameterError, parameter, part
from grainlaw.loads import Drive
from grainlaw.messages import refusal
from grainlaw.moduli import work
from grainlaw.protocol import LoadingProtocol
from grainlaw.protocols.uniaxial import UniaxialCompression
from grainlaw.quantity import Quantity
from grainlaw.specimen import Specimen
from grainlaw.stage import Stage
from grainlaw.strength import FALL


def _as_tuple(value: Any) -> Any:
    listed = value.tolist() if isinstance(value, np.ndarray) else value
    return tuple(listed) if isinstance(listed, list) else listed


def _is_growing(test: Cyclic, attribute: attrs.Attribute, value: Sequence[float]) -> None:
    numbers = isinstance(value, tuple) and all(is_number(level) and math.isfinite(level) for level in value)
    if not numbers or not value or list(value) != sorted(set(value)) or value[0] <= 0:
        raise refusal("Cyclic: levels", value, "a list of positive numbers in SI, each above the last")


@attrs.frozen(kw_only=True)
class Cyclic(LoadingProtocol):
    """Another test, unloaded at each level of its last stage, and loaded again.

    A level is a value of the column ``displacement``, such as a strain. There the drives reverse, until the column
    ``load`` has fallen to ``unload_to`` times its value at the level.
    """

    test: LoadingProtocol = part(LoadingProtocol, UniaxialCompression())  #: the test that is interrupted
    #: values of the column displacement at which it is unloaded
    levels: tuple[float, ...] = attrs.field(
        converter=_as_tuple, validator=_is_growing, metadata={"unit": "1", "bounds": ""}
    )
    displacement: str = STRAIN  #: column that names the levels
    load: str = STRESS  #: column that falls on unloading
    unload_to: float = parameter("1", default=0.1, at_least=0, below=1)  #: unloading ends at this share of the load

    def __attrs_post_init__(self) -> None:
        if isinstance(self.test, Cyclic):
            raise refusal("Cyclic: test", self.test, "a test without loops; give all levels together")

    @property
    def quantities(self) -> Sequence[Quantity]:
        """Those of each loop, and of the other test."""
        loops = (
            Quantity("unloading_moduli", "GPa", form=".2f"), Quantity("lost_work", "kJ/m3"),
            Quantity("residual_strains", "%", form=".4f"),
        )  # fmt: skip
        return (*loops, *self.test.quantities)

    @property
    def panels(self) -> Sequence[Panel]:
        """Its loops, and those of the other test."""
        loops = Panel(self.displacement, [self.load])
        return (loops, *(panel for panel in self.test.panels if panel != loops))

    def stages(self, specimen: Specimen) -> Sequence[Stage]:
        *before, main = self.test.stages(specimen)
        if not any(load.moves for load in main.of(Drive)):
            wanted = f"one whose last stage, here '{main.name}', has a Drive to reverse"
            raise refusal("Cyclic: test", self.test, wanted)
        if any(isinstance(end, FallsTo) and end.column == self.displacement for end in main.until):
            wanted = f"one whose last stage, here '{main.name}', raises the {self.displacement}, by which levels count"
            raise refusal("Cyclic: test", self.test, wanted)
        ends = (end for end in main.until if isinstance(end, Reaches) and end.column == self.displacement)
        if (limit := min((end.limit for end in ends), default=math.inf)) < self.levels[-1]:
            raise ParameterError(
                f"Cyclic: levels = {self.levels[-1]:g} is not allowed, the test {type(self.test).__name__} ends at a "
                f"{self.displacement} of {limit:g}"
            )
        back = [load.reversed() if isinstance(load, Drive) else load for load in main.loads]
        stages = list(before)
        for number, level in enumerate(self.levels, 1):
            load = attrs.evolve(
                main, name=f"load {number}", until=[Reaches(self.displacement, level)],
                ends_test=[*main.ends_test, *main.until],  # a level that is not reached has no loop
            )  # fmt: skip
            unload = attrs.evolve(main, name=f"unload {number}", loads=back, until=[FallsTo(self.load, self.unload_to)])
            stages += [load, unload]
        return [*stages, main]

    def measure(self, state: State) -> dict[str, float]:
        return self.test.measure(state)

    def begins(self, curves: Curves) -> int:
        """As the other test."""
        return self.test.begins(curves)

    def counted(self, curves: Curves, first: int) -> Curves:
        """As the other test."""
        return self.test.counted(curves, first)

    def summary(self, curves: Curves, specimen: Specimen) -> dict[str, Any]:
        """That of the other test, and of each loop: modulus (Pa), lost work (J/m3), residual strain, Felicity ratio.

        The lost work is the area between the unloading and the reloading curve, up to the level; nan for a loop in
        which the specimen fails, so that it bears less at the level than before. The residual strain is where the line
        through both ends of the unloading bears nothing. The Felicity ratio is the load at which contact points break
        again on reloading, over the largest load before: 1 where the rock remembers it (Kaiser effect), nan where none
        breaks before the next level.
        """
        found = dict(self.test.summary(curves, specimen))
        begin = int(np.searchsorted(curves[STAGE], len(self.test.stages(specimen)) - 1))
        seen = self.test.counted(curves, begin)  # as the levels count
        x, y, stage = (seen[name] for name in (self.displacement, self.load, STAGE))
        first = int(stage[0]) if len(stage) else 0
        moduli, lost, residual, felicity = [], [], [], []
        broken = cracks(seen)
        for number in range(len(self.levels)):
            unload = np.flatnonzero(stage == first + 2 * number + 1)
            reload = np.flatnonzero(stage == first + 2 * number + 2)
            if len(unload) < 2 or len(reload) < 2:
                break
            moduli.append(float((y[unload[-1]] - y[unload[0]]) / (x[unload[-1]] - x[unload[0]])))
            residual.append(float(x[unload[-1]] - y[unload[-1]] / moduli[-1]))
            at = np.linspace(x[unload].min(), self.levels[number], 400)
            down = np.interp(at, x[unload][::-1], y[unload][::-1])
            up = np.interp(at, x[reload], y[reload])
            closed = up[-1] >= (1 - FALL) * y[unload[0]]  # else it has failed in the loop, and released what it stored
            lost.append(work(up - down, at) if closed else math.nan)
            again = reload[broken[reload] > broken[unload[-1]]]
            felicity.append(float(y[again[0]] / y[: reload[0]].max()) if len(again) else float("nan"))
        loops = {"unloading_moduli": moduli, "lost_work": lost, "residual_strains": residual}
        return {**found, **loops, "felicity_ratios": felicity}
