"""The loading protocol: a laboratory test as a sequence of stages, and what it measures."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from typing import Any

from grainlaw.arguments import Checked
from grainlaw.columns import Panel
from grainlaw.conditions import Curves
from grainlaw.engine.state import State
from grainlaw.messages import refusal, refuse_twice
from grainlaw.quantity import Quantity
from grainlaw.specimen import Specimen
from grainlaw.stage import Stage


class LoadingProtocol(metaclass=Checked):
    """A laboratory test.

    A whole test, which pulls the top of a specimen and holds its bottom::

        @attrs.frozen(kw_only=True)
        class Pull(gl.LoadingProtocol):
            speed: float = gl.parameter("m/s", default=0.01)
            quantities = (gl.Quantity("force", "kN/m"),)
            panels = (gl.Panel("displacement", ["force"]),)

            def stages(self, specimen):
                low, high = specimen.grains.region.bounds
                drives = [gl.loads.Drive(boundary="top", axis=1, speed=self.speed),
                          gl.loads.Drive(boundary="bottom", axis=1, speed=0)]
                end = gl.conditions.Reaches("displacement", 1e-4 * (high - low)[1])
                return [gl.Stage(name="pull", loads=drives, until=[end], interval=1e-5)]

            def measure(self, state):
                return {"displacement": state.moved("top")[1], "force": state.reaction("top")[1]}

            def summary(self, curves, specimen):
                return {"strength": curves["force"].max()}
    """

    @property
    def quantities(self) -> Sequence[Quantity]:
        """How columns and properties are shown that this test has by itself, or that mean something else in it."""
        return ()

    @property
    def panels(self) -> Sequence[Panel]:
        """What its figures draw, the usual picture first; without any, its columns over how far it is."""
        return ()

    @abstractmethod
    def stages(self, specimen: Specimen) -> Sequence[Stage]:
        """The stages in order. Raises :class:`ParameterError` for a specimen that the test cannot load."""

    @abstractmethod
    def measure(self, state: State) -> dict[str, float]:
        """What is recorded at every sample, by column name (SI); ``grainlaw.columns`` lists the names in use."""

    def counted(self, curves: Curves, first: int) -> Curves:
        """What the conditions of a stage see of the curves of a run: its samples, of which ``first`` is the first."""
        return {name: values[first:] for name, values in curves.items()}

    def begins(self, curves: Curves) -> int:
        """Number of the sample with which the test itself begins, after stages that only prepare the specimen."""
        return 0

    @abstractmethod
    def summary(self, curves: Curves, specimen: Specimen) -> dict[str, Any]:
        """Properties of the specimen from the recorded curves, by name (SI)."""


def stages_of(protocol: LoadingProtocol, specimen: Specimen) -> list[Stage]:
    """The stages of a test. Raises :class:`ParameterError`, also where a test of one's own has none."""
    found = protocol.stages(specimen)
    if not isinstance(found, Sequence) or not found or not all(isinstance(each, Stage) for each in found):
        raise refusal(f"{type(protocol).__name__}.stages", found, "a list of at least one gl.Stage")
    why = ": by it a result is asked for what happened since a stage"
    refuse_twice(f"{type(protocol).__name__}.stages", [stage.name for stage in found], why)
    return list(found)
