"""Bodies that fall, slide, roll and collide, under gravity and with initial velocities; no platens."""

from __future__ import annotations

import operator
from collections.abc import Mapping, Sequence
from typing import Any

import attrs
import numpy as np

from grainlaw.columns import TIME, Panel
from grainlaw.conditions import Curves, Lasts
from grainlaw.engine.state import State
from grainlaw.fields import ParameterError, grain_numbers, parameter, part, vector, whole_number
from grainlaw.integration import CentralDifference, Integrator, LocalDamping, Undamped
from grainlaw.loads import Fixed, Gravity, InitialVelocity
from grainlaw.messages import short
from grainlaw.protocol import LoadingProtocol
from grainlaw.quantity import Quantity
from grainlaw.specimen import Specimen
from grainlaw.stage import Stage


def _velocities(value: Any) -> dict[int, tuple[float, float]]:
    try:
        made = {operator.index(grain): (float(vx), float(vy)) for grain, (vx, vy) in dict(value).items()}
    except (TypeError, ValueError):
        made = {0: (np.nan, np.nan)}
    if not np.isfinite(list(made.values())).all():
        wanted = "it must give grain numbers two finite numbers (x, y)"
        raise ParameterError(f"FreeMotion: velocity = {short(value)} m/s is not allowed, {wanted}")
    return made


@attrs.frozen(kw_only=True)
class FreeMotion(LoadingProtocol):
    """Bodies move for a time under gravity, some of them with an initial velocity.

    Before that, for the time ``settle``, they come to rest under gravity with ``LocalDamping``, while grains with a
    ``velocity`` are held. Refuses grain numbers that the specimen does not have.
    """

    duration: float = parameter("s")  #: of the motion
    settle: float = parameter("s", default=0.0, at_least=0)  #: time before it, in which bodies come to rest
    gravity: tuple[float, float] = vector("m/s2", default=(0.0, -9.81))  #: m/s2
    fixed: Sequence[int] = grain_numbers()  #: grains that neither move nor turn
    velocity: Mapping[int, tuple[float, float]] = attrs.field(factory=dict, converter=_velocities)  #: m/s, by grain
    tracked: Sequence[int] = grain_numbers()  #: grains whose motion is recorded
    samples: int = whole_number(default=200, at_least=2)  #: in the time duration
    #: At a third of the stable step an impact takes some thirty steps, and bodies part as fast as they met, to 0.3 %.
    integrator: Integrator = part(Integrator, CentralDifference(damping=Undamped()))

    quantities = (
        *(Quantity(name, "m/s") for name in ("mean_speed", "largest_speed", "last_mean_speed")),
        *(Quantity(name, "m") for name in ("centre_x", "centre_y", "centre_moved_x", "centre_moved_y", "x", "y")),
    )

    @property
    def panels(self) -> Sequence[Panel]:
        """Speeds and the way of the centre of mass; places and rotations of the tracked grains."""
        each = {name: [f"{name}_{k}" for k in self.tracked] for name in ("x", "y", "rotation")}
        words = {"x": "place along x", "y": "place along y", "rotation": "rotation, counter-clockwise"}
        return (
            Panel(TIME, ["mean_speed", "largest_speed"], "speed"),
            Panel(TIME, ["centre_x", "centre_y"], "place of the centre of mass"),
            *(Panel(TIME, columns, words[name]) for name, columns in each.items() if columns),
        )

    def stages(self, specimen: Specimen) -> Sequence[Stage]:
        for name in ("fixed", "velocity", "tracked"):
            specimen.check_grain_numbers(f"FreeMotion: {name}", getattr(self, name))
        thrown = np.zeros((specimen.grains.count, 2))
        for grain, velocity in self.velocity.items():
            thrown[grain] = velocity
        move = Stage(
            name="move", until=[Lasts(self.duration)], interval=self.duration / self.samples,
            expected=self.samples,
            integrator=self.integrator,
            loads=[
                Gravity(acceleration=self.gravity), Fixed(grains=self.fixed),
                InitialVelocity(velocity=thrown[specimen.mesh.node_grain]),
            ],
        )  # fmt: skip
        if not self.settle:
            return [move]
        damped = CentralDifference(damping=LocalDamping())
        settle = attrs.evolve(
            move, name="settle", until=[Lasts(self.settle)], interval=self.settle / self.samples,
            integrator=damped,
            loads=[Gravity(acceleration=self.gravity), Fixed(grains=[*self.fixed, *self.velocity])],
        )  # fmt: skip
        return [settle, move]

    def measure(self, state: State) -> dict[str, float]:
        """Of all grains that are not fixed: mean and largest speed of their centres, and their centre of mass.

        ``energy_kinetic`` is recorded in every test. Of each tracked grain k the place of its centre of mass, ``x_k``
        and ``y_k`` (m), and its rotation ``rotation_k`` (rad, counter-clockwise). The rotation of a grain that deforms
        is that of the polar decomposition, from -pi to pi.
        """
        place, speed = state.grain_motion()
        free = self._free(state.specimen)
        speeds, centre = np.hypot(*speed[free].T), self._centre(state.specimen, place)
        row = {
            "mean_speed": float(speeds.mean()) if len(free) else 0.0,
            "largest_speed": float(speeds.max(initial=0.0)),
            "centre_x": float(centre[0]),
            "centre_y": float(centre[1]),
        }
        for k in self.tracked:
            row |= {f"x_{k}": place[k, 0], f"y_{k}": place[k, 1], f"rotation_{k}": state.rotation(k)}
        return row

    def summary(self, curves: Curves, specimen: Specimen) -> dict[str, Any]:
        """Largest speed of all, mean speed at the end (m/s), and how far the centre of mass has moved (m)."""
        start = self._centre(specimen, specimen.grains.centroids)
        return {
            "largest_speed": float(curves["largest_speed"].max()),
            "last_mean_speed": float(curves["mean_speed"][-1]),
            "centre_moved_x": float(curves["centre_x"][-1] - start[0]),
            "centre_moved_y": float(curves["centre_y"][-1] - start[1]),
        }

    def _free(self, specimen: Specimen) -> np.ndarray:
        """Grains that are not fixed."""
        return np.setdiff1d(np.arange(specimen.grains.count), self.fixed)

    def _centre(self, specimen: Specimen, places: np.ndarray) -> np.ndarray:
        """(2,) m, centre of mass of the free grains, whose places (g, 2) m are given; nan without one."""
        free = self._free(specimen)
        mass = specimen.grain_masses[free]
        return mass @ places[free] / mass.sum() if len(free) else np.full(2, np.nan)
