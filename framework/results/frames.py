"""Frames: moments of a run that are kept for pictures, and when one is taken."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np

from grainlaw.arguments import Checked
from grainlaw.engine.dissipation import balance
from grainlaw.engine.state import State
from grainlaw.fields import whole_number
from grainlaw.messages import refusal
from grainlaw.results.files import grouped
from grainlaw.results.tables import data_frame
from grainlaw.stage import Stage

if TYPE_CHECKING:
    import pandas


@attrs.frozen(eq=False)
class Frame(metaclass=Checked):
    """One moment, copied out of the state."""

    time: float  #: s
    nodes: np.ndarray  #: (i, 2) m, their places before the test
    displacement: np.ndarray  #: (i, 2) m
    velocity: np.ndarray  #: (i, 2) m/s
    stress: np.ndarray  #: (g, 3) Pa, xx, yy, xy
    #: (p,) damage, mode, opening, slip, normal, shear, broken_time, lost_*, made, fluid_pressure where there is a fluid
    bonds: dict[str, np.ndarray]
    contacts: dict[str, np.ndarray]  #: (k,) those that are closed, see :meth:`Contacts.closed`; empty without detection
    #: (z,) plastic_strain, temperature (°C), where a material has it; stress (z, 3) Pa xx, yy, xy, if it was asked for
    zones: dict[str, np.ndarray] = attrs.field(factory=dict)
    stage: str = ""  #: of the test

    def to_pandas(self, kind: str = "bonds") -> pandas.DataFrame:
        """One of its tables, SI: "bonds" (a row for each contact point), "contacts", "zones", "grains" or "nodes".

        The places x, y (m) of nodes are those before the test.
        The contact points are in the order that :class:`Result` describes. Raises ParameterError for another kind, and
        without pandas.
        """
        tables: dict[str, Mapping[str, np.ndarray]] = {
            "bonds": self.bonds,
            "contacts": self.contacts,
            "zones": self.zones,
            "grains": {"stress": self.stress},
            "nodes": {"position": self.nodes, "displacement": self.displacement, "velocity": self.velocity},
        }
        if kind not in tables:
            raise refusal("Frame.to_pandas: kind", kind, ", ".join(tables))
        return data_frame("Frame.to_pandas", tables[kind])


def take_frame(state: State, *, zones: bool = False) -> Frame:
    """Copy the present moment, with ``zones`` also their stresses, where grains are not rigid.

    Energies lost and made (J/m2) are those of :mod:`~grainlaw.engine.dissipation`.
    """
    names = ("opening", "slip", "normal", "shear", "broken_time")
    bonds = {name: np.array(getattr(state, name)) for name in names}
    bonds["mode"] = np.where(np.isnan(state.broken_time), state.mode, state.broken_mode)
    bonds["damage"] = state.memory("damage")
    if state.fluids.imposed:
        bonds["fluid_pressure"] = state.fluid_pressure
    (bonds["lost_opening"], bonds["lost_slip"]), bonds["made"] = balance(state)
    closed = {} if state.contacts.detection is None else state.contacts.closed()
    plastic = any("plastic_strain" in group.memory for group in state.materials.groups)
    of_zones = {"plastic_strain": state.materials.memory("plastic_strain")} if plastic else {}
    if zones and not state.specimen.is_rigid:
        of_zones["stress"] = state.zone_state()[0].copy()
    if any(group.knows_temperature for group in state.materials.groups):
        of_zones["temperature"] = state.zone_temperature
    moved, stress = (state.displacement.copy(), state.velocity.copy()), state.grain_stress()
    return Frame(state.time, state.mesh.nodes, *moved, stress, bonds, closed, of_zones, state.stage)


def packed(frame: Frame) -> dict[str, np.ndarray]:
    """A frame as arrays by name, for a file; see :func:`unpacked`."""
    arrays = {name: np.asarray(getattr(frame, name)) for name in (*_WHOLE, "stage")}
    for kind in ("bonds", "contacts", "zones"):
        arrays |= {f"{kind}/{name}": row for name, row in getattr(frame, kind).items()}
    return arrays


def unpacked(arrays: Mapping[str, np.ndarray], nodes: np.ndarray) -> Frame:
    """The frame that :func:`packed` was given, of a specimen with these nodes."""
    displacement, velocity, stress = (arrays[name] for name in _WHOLE[1:])
    bonds, contacts, zones = (grouped(arrays).get(kind, {}) for kind in ("bonds", "contacts", "zones"))
    whole = float(arrays["time"]), nodes, displacement, velocity, stress
    return Frame(*whole, bonds, contacts, zones, str(arrays.get("stage", "")))


_WHOLE = ("time", "displacement", "velocity", "stress")
CRACKED = 0.02  #: share of the contact points that breaks between two frames at most, while there are few


@attrs.define
class FrameClock:
    """Decides when a frame is taken: at equal steps of the progress of each stage, at its end, and as cracks grow.

    The stages of a test share ``count`` equally. Failure may happen within a small part of the progress, such as a
    strain; so a frame is also taken each time that another 2 % of the contact points has broken. Both steps double
    whenever a stage has used up its share, so that about ``count`` are taken in all.
    """

    count: int = whole_number(default=30, at_least=1)
    _stage: str = ""
    _next: float = 0.0
    _broken: int = 0
    _taken: int = 0  #: in the present stage

    def due(self, state: State, stage: Stage, progress: float) -> bool:
        """Whether a frame is taken at this sample."""
        if stage.name != self._stage:
            self._stage, self._next, self._taken = stage.name, 0.0, 0
        share = max(1, round(self.count / state.stages))
        longer = 2 ** (self._taken // share)
        broken = int(np.count_nonzero(~np.isnan(state.broken_time)))
        many = max(CRACKED * longer * len(state.broken_time), 1)  # of no points one never breaks
        if progress < min(self._next, 1.0) and broken - self._broken < many:
            return False
        step = longer / share
        self._next, self._broken = float((np.floor(progress / step) + 1) * step), broken
        self._taken += 1
        return True

    def save(self) -> dict[str, np.ndarray]:
        """Where it stands, as arrays by name."""
        return {"clock": np.array([self._next, self._broken, self._taken]), "stage": np.array(self._stage)}

    def restore(self, saved: Mapping[str, Any]) -> None:
        """Go on from what :meth:`save` returned."""
        self._next, self._stage = float(saved["clock"][0]), str(saved["stage"])
        self._broken, self._taken = int(saved["clock"][1]), int(saved["clock"][2])
