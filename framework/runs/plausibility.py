"""Warnings before a run: numbers that do not go with each other, as after a slip of units."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from grainlaw.contact import Laws, each_law
from grainlaw.engine.model import Model
from grainlaw.fields import ParameterError, UnitWarning
from grainlaw.loading import Constant
from grainlaw.loads import (
    BarEnd,
    BoundaryLoad,
    Conduction,
    Drive,
    Driven,
    FluidPressure,
    Heat,
    Hold,
    Pressure,
    Traction,
)
from grainlaw.material import Rigid
from grainlaw.messages import users_line
from grainlaw.specimen import Specimen
from grainlaw.stage import Stage
from grainlaw.tessellation import INSIDE

CONTACTS = (1e-2, 1e3)  #: usual stiffness of contacts times the grain size, over that of the grains
OPENING = 0.1  #: of the grain size: the most that a contact usually opens before it breaks
FELT = 10  #: times what rounding of positions makes of stresses at contacts: least load that comes to rest
LOADED = (2e-8, 0.05)  #: of the modulus: usual pressures and stresses on boundaries
THIN = 0.02  #: of the step that most zones allow: one place of the grains makes a run fifty times as long
FORCES = (Pressure, Traction, Hold)
JUMP = 0.1  #: of a load: a smaller one between two stages is none
UNBALANCED = 0.01  #: of the forces of platens: what two opposite ones may leave
SUCTION = 1e5  #: Pa: more than that no fluid pulls
SPEED = 0.005  #: of the speed of waves: the fastest usual loading


def warn_of_scales(model: Model, stages: Sequence[Stage]) -> None:
    """Warn (:class:`UnitWarning`) of loads and speeds that do not go with their grains."""
    for words in (*_levels(model, stages), *_speeds(model, stages)):
        warnings.warn(UnitWarning(words), stacklevel=users_line())


def warn_of_contacts(specimen: Specimen, laws: Laws) -> None:
    """Warn (:class:`UnitWarning`) of contacts that do not go with their grains."""
    for words in _contacts(specimen, laws):
        warnings.warn(UnitWarning(words), stacklevel=users_line())


def warn_of_thin_cell(model: Model) -> None:
    """Warn of a place of the grains that alone makes a run take many times as many steps."""
    if isinstance(model.specimen.material, Rigid):
        return
    ratio, cell = model.specimen.mesh.worst_step
    if ratio < THIN:
        x, y = model.specimen.grains.centroids[cell]
        warnings.warn(
            f"the step of a run is {ratio:.2g} of what most zones allow, for the thin cell {cell} at "
            f"({x:.4g}, {y:.4g}) m; another seed, fewer sides of a round outline, larger grains beside it or "
            "mass_scaling=2 make it longer",
            stacklevel=users_line(),
        )


def warn_of_idle_laws(model: Model) -> None:
    """Warn of a law for cells of one grain where no grain has cells."""
    keys = model.laws if isinstance(model.laws, Mapping) else ()
    inside = [key for key in keys if key == INSIDE or (isinstance(key, tuple) and key[0] == INSIDE)]
    if inside and not model.specimen.grains.is_breakable:
        warnings.warn(
            f"law: {inside[0]!r} is for cells of one grain, and no grain of this specimen has cells: nothing follows "
            "it; Breakable(grains, VoronoiCells(count=8)) gives them",
            stacklevel=users_line(),
        )


def warn_of_free(stages: Sequence[Stage]) -> None:
    """Warn of a specimen that nothing holds against what moves it, and of one let go after it was moved."""
    moved = ""
    for stage in stages:
        drives = [load for load in stage.of(Drive) if isinstance(load.speed, float) and load.moves]
        words = ""
        if not stage.loads and moved:
            words = f"has no loads: what {moved} moved before is free in it, hold it by Drive(..., speed=0)"
        elif drives and all(isinstance(load, Drive) and load.boundary == drives[0].boundary for load in stage.loads):
            words = f"moves {drives[0].boundary}, and nothing holds the specimen against it"
        if words:
            warnings.warn(f"stage '{stage.name}' {words}", stacklevel=users_line())
        moved = f"'{stage.name}'" if drives else moved if not stage.loads else ""


def warn_of_unbalanced(model: Model, stages: Sequence[Stage]) -> None:
    """Warn of platens that push the same way along an axis along which nothing else acts: the specimen flies away."""
    lengths = model.specimen.mesh.boundary_lengths
    for stage in stages:
        for axis in (0, 1):
            along = [load for load in stage.loads if not (isinstance(load, Driven) and load.axis != axis)]
            holds = [load for load in along if isinstance(load, Hold) and not load.stiffness]
            if not holds or len(holds) < len(along):
                continue
            forces = [load.level * lengths[load.boundary] for load in holds if isinstance(load.level, float)]
            if len(forces) == len(holds) and abs(sum(forces)) > UNBALANCED * sum(map(abs, forces)):
                warnings.warn(
                    f"stage '{stage.name}': the forces of Hold on {', '.join(load.boundary for load in holds)} along "
                    f"{'xy'[axis]} have a sum of {sum(forces):.4g} N/m, and nothing holds the specimen against it: a "
                    "stress is positive along the axis, on either side",
                    stacklevel=users_line(),
                )
                return


def warn_of_jumps(stages: Sequence[Stage]) -> None:
    """Warn of a load that is another when a stage begins than it was when the one before ended, as of shocks."""
    for before, stage in pairwise(stages):
        held = {drive.boundary for drive in stage.of(Drive)}
        now = {_place(load): load.at(0.0) for load in stage.of(*FORCES)}
        for load in before.of(*FORCES):
            if not isinstance(load.level, float) or load.boundary in held:
                continue
            was, then = load.level, now.get(_place(load), 0.0)
            if abs(then - was) > JUMP * max(abs(was), abs(then)):
                warnings.warn(
                    f"stage '{stage.name}': {type(load).__name__} on the boundary {load.boundary} begins with "
                    f"{then:.4g}, where stage '{before.name}' ends with {was:.4g}: such a jump is a shock; give it "
                    f"here, too, with start={was:.4g} and a ramp",
                    stacklevel=users_line(),
                )
                return


def _place(load: BoundaryLoad) -> tuple[Any, ...]:
    """Which of the loads of a boundary it is."""
    return type(load), load.boundary, getattr(load, "axis", None)


def refuse_lost_loads(model: Model, stages: Sequence[Stage]) -> None:
    """Raise ParameterError for a pressure so small that contacts do not feel it: their openings are not that exact."""
    stiffest = max(float(np.max(one.stiffness[0])) for one in model.of_bonds)
    least = FELT * stiffest * float(np.finfo(float).eps * np.hypot(*np.ptp(model.specimen.mesh.nodes, axis=0)))
    for stage in stages:
        for load in stage.of(Pressure, FluidPressure, Hold):
            if isinstance(load.level, float) and 0 < abs(load.level) < least:
                raise ParameterError(
                    f"stage '{stage.name}': {load.level:.3g} Pa on the boundary {load.boundary} is not allowed, it "
                    f"must be 0 or at least {least:.1g} Pa: less is lost in the rounding of positions"
                )


def refuse_lost_pressures(model: Model, stages: Sequence[Stage]) -> None:
    """Raise ParameterError for a pressure on a straight boundary that is moved along its normal: it does nothing."""
    mesh = model.specimen.mesh
    for stage in stages:
        moved = {(drive.boundary, drive.axis) for drive in stage.of(Drive) if not drive.roller}
        for load in stage.of(Pressure):
            straight = np.ptp(mesh.nodes[mesh.boundaries[load.boundary]], axis=0) == 0
            if any((load.boundary, axis) in moved for axis in np.flatnonzero(straight).tolist()):
                raise ParameterError(
                    f"stage '{stage.name}': a Pressure on the boundary {load.boundary} is not allowed beside a Drive "
                    "that moves it along its normal: the motion decides, and the pressure does nothing"
                )


def refuse_heat_after_conduction(stages: Sequence[Stage]) -> None:
    """Raise ParameterError for one temperature that a specimen should come to evenly, which it no longer has."""
    flows = ""
    for stage in stages:
        if flows and stage.of(Heat):
            raise ParameterError(
                f"stage '{stage.name}': Heat is not allowed after stage '{flows}', which has left other temperatures "
                "in other places; let a Conduction bring the specimen to a temperature"
            )
        flows = stage.name if stage.of(Conduction) else flows


def scales(model: Model) -> tuple[float, float, float]:
    """Modulus (Pa) of grains and contacts in series, wave speed (m/s), grain size (m)."""
    specimen = model.specimen
    size = specimen.grains.grain_size
    softness = 1 / (size * float(np.mean([np.mean(one.stiffness[0]) for one in model.of_bonds])))
    if not specimen.is_rigid:
        softness += 1 / float(np.median(specimen.zone_stiffness[:, 0, 0]))
    density = float(specimen.node_masses.sum() / specimen.grains.areas.sum())
    return 1 / softness, math.sqrt(1 / (softness * density)), size


def lowest_frequency(model: Model) -> float:
    """1/s, about: of waves along the longer side, one end held."""
    return math.pi / 2 * scales(model)[1] / float(np.max(np.ptp(model.specimen.mesh.nodes, axis=0)))


def _contacts(specimen: Specimen, laws: Laws) -> Iterator[str]:
    size = specimen.grains.grain_size
    for one in each_law(laws):
        name, kn = type(one).__name__, float(np.mean(one.stiffness[0]))
        if not specimen.is_rigid:
            modulus = float(np.median(specimen.zone_stiffness[:, 0, 0]))
            low, high = (share * modulus / size for share in CONTACTS)
            if not low <= kn <= high:
                yield (
                    f"{name}: a normal stiffness of {kn:.4g} Pa/m is unusual between grains of {size:.2g} m and "
                    f"{modulus:.2g} Pa: usual are {low:.1g} to {high:.1g} Pa/m"
                )
                continue
        strength = getattr(one, "tensile_strength", None)
        if strength is not None and float(np.max(strength)) / kn > OPENING * size:
            yield (
                f"{name}: contacts that open by {float(np.max(strength)) / kn:.2g} m before they break are unusual "
                f"between grains of {size:.2g} m: usual is at most {OPENING * size:.1g} m, tensile_strength over kn"
            )


def _levels(model: Model, stages: Sequence[Stage]) -> Iterator[str]:
    low, high = (share * scales(model)[0] for share in LOADED)
    for stage in stages:
        for load in stage.of(Pressure, FluidPressure, Hold, Traction, BarEnd):
            if isinstance(load, Pressure | FluidPressure) and isinstance(load.level, float) and load.level < -SUCTION:
                yield (
                    f"stage '{stage.name}': a pressure of {load.level:.4g} Pa on the boundary {load.boundary} pulls: "
                    "is the sign right?"
                )
                return
            size = load.largest * (max(map(abs, load.stress)) if isinstance(load, Traction) else 1.0)
            if size and not low <= size <= high:
                yield (
                    f"stage '{stage.name}': {size:.4g} Pa on the boundary {load.boundary} is unusual in this specimen: "
                    f"usual are {low:.1g} to {high:.1g} Pa: is the unit right?"
                )
                return


def _speeds(model: Model, stages: Sequence[Stage]) -> Iterator[str]:
    speeds = {
        drive.boundary: drive.largest * (1.0 if stage.loading is None else stage.loading.speed)
        for stage in stages for drive in stage.of(Drive) if isinstance(stage.loading, Constant | None)
    }  # fmt: skip
    boundary = max(speeds, key=lambda name: speeds[name], default="")
    usual = SPEED * scales(model)[1]
    if speeds and speeds[boundary] > usual:
        yield (
            f"the boundary {boundary} moves at {speeds[boundary]:.4g} m/s, which is unusual: at most "
            f"{usual:.2g} m/s, {SPEED:.1%} of the speed of waves in this specimen, or it is not loaded as a whole"
        )
