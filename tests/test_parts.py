"""Parts of a running specimen: what steps change is declared, saved and restored; shares cover everything once."""

from types import SimpleNamespace
from typing import Annotated, get_args, get_origin, get_type_hints

import attrs
import numpy as np
import pytest
from bodies import GRAVITY, RIGID, box, turned
from support import ROCK, STIFF, STRONG, small_sample, state_of
from toy_materials import YIELDING

import grainlaw as gl
from grainlaw.compiler.batch import compile_integrator
from grainlaw.conditions import Reaches
from grainlaw.engine.parts.clock import Clock
from grainlaw.engine.parts.flow import Network
from grainlaw.engine.parts.heat import EvenTemperature
from grainlaw.engine.parts.laws import LawTable
from grainlaw.engine.parts.part import Split
from grainlaw.engine.stepping import advance
from grainlaw.geometry import together
from grainlaw.integration import CentralDifference
from grainlaw.laws import CohesiveCrack, Friction, MohrCoulomb
from grainlaw.loads import (
    BarEnd,
    Conduction,
    Drive,
    Fixed,
    FixedTemperature,
    FluidPressure,
    Gravity,
    Hold,
    InitialVelocity,
    Injection,
    Pressure,
    Quiet,
    Traction,
)
from grainlaw.materials import Thermal

WEAK = CohesiveCrack(**STRONG, mode_i_energy=1.5, mode_ii_energy=3)
ENDS = [Drive(boundary="bottom", axis=1, speed=0.0), Drive(boundary="top", axis=1, speed=-2.0)]
NEVER = [Reaches("time", 1.0)]


def stage(*loads):
    return gl.Stage(name="load", until=NEVER, interval=1e-6, loads=loads)


def pile():
    """Blocks that fall on a floor: contacts, gravity, grains that are held."""
    blocks = [turned(0.5, 0.5, 20 * k, (0.3 * k, 0.28 + 0.6 * k), f"block {k}") for k in range(3)]
    return gl.Specimen(together(box(4, 1, -2, -1, "floor"), *blocks), RIGID)


PILE = pile()
CASES = {
    "driven": (small_sample(), WEAK, stage(*ENDS), 4e-8),
    "rigid": (small_sample(material=gl.Rigid(density=3100)), WEAK, stage(*ENDS), 4e-8),
    "refined": (small_sample(12, refinement=1), MohrCoulomb(**STRONG), stage(*ENDS), 2e-8),
    "yielding": (small_sample(material=YIELDING), WEAK, stage(*ENDS), 4e-8),
    "pressed": (
        small_sample(), WEAK,
        stage(*ENDS, *(Pressure(boundary=side, pressure=5e6) for side in ("left", "right"))), 4e-8,
    ),
    "waves": (
        small_sample(), WEAK,
        stage(
            ENDS[0], *(Quiet(boundary=side) for side in ("left", "right", "top")),
            Traction(boundary="top", stress=(0, -5e6, 1e6), factor=[(0, 0), (1e-6, 1)]),
        ), 4e-8,
    ),
    "held": (
        small_sample(), WEAK,
        stage(ENDS[0], Hold(boundary="top", axis=1, stress=-5e6, stiffness=1e12)), 4e-8,
    ),
    "bars": (
        small_sample(), WEAK,
        stage(
            BarEnd(boundary="bottom", axis=1, impedance=4e7),
            BarEnd(boundary="top", axis=1, impedance=4e7, stress=[(0, 0), (1e-6, -50e6)]),
        ), 4e-8,
    ),
    "wet": (
        small_sample(), WEAK,
        stage(*ENDS, *(FluidPressure(boundary=side, pressure=5e6) for side in ("left", "right"))), 4e-8,
    ),
    "flowing": (
        small_sample(), Friction(**STIFF, friction_angle=30),
        stage(
            ENDS[0], FluidPressure(boundary="right", pressure=1e5),
            Injection(boundary="left", rate=1e-3, volume=1e-6, viscosity=1e-3, residual_aperture=5e-6),
        ), 4e-8,
    ),
    "conducting": (
        small_sample(
            material=Thermal(material=ROCK, expansion=8e-6, conductivity=3.0, heat_capacity=800.0)
        ), WEAK,
        stage(
            ENDS[0], Conduction(duration=1.0, speedup=1e5), FixedTemperature(boundary="left", temperature=60.0),
        ), 4e-8,
    ),
    "falling": (
        PILE, Friction(kn=1e9, ks=1e9, friction_angle=30),
        stage(
            Gravity(acceleration=(0, -GRAVITY)), Fixed(grains=[0]),
            InitialVelocity(velocity=np.tile((0.0, -0.5), (len(PILE.mesh.nodes), 1))),
        ), 1e-4,
    ),
}  # fmt: skip


def run(case, steps, threads=1):
    specimen, law, load, time_step = CASES[case]
    state = state_of(specimen, law, gl.Detection())
    state.begin(load)
    state.time_step = time_step
    go(state, steps, threads)
    return state


def go(state, steps, threads=1):
    state.let_heat_flow()
    advance(state, compile_integrator(CentralDifference()), steps, threads=threads)


def declared(rows):
    """Name, kind and value of every field of a named tuple; plain numbers, tables of laws and networks are constant."""
    for name, hint in get_type_hints(type(rows), include_extras=True).items():
        if get_origin(hint) is Annotated:
            yield name, get_args(hint)[1], getattr(rows, name)
        else:
            assert hint in (float, LawTable, Network), f"{type(rows).__name__}.{name} says not whether a run changes it"


def fields(state):
    for part, each in state.parts.items():
        for rows in (each.arrays, each.books):
            for name, kind, value in declared(rows):
                yield f"{part}.{name}", kind, value


def bits(state):
    return {name: value.copy() for name, kind, value in fields(state) if kind == "changing"}


@pytest.mark.parametrize("case", CASES)
def test_steps_change_only_what_is_declared(case):
    state = run(case, 10)
    before = {name: (kind, value.copy()) for name, kind, value in fields(state)}
    go(state, 300)
    assert state.contacts.searches >= 1
    changed = set()
    for name, _, value in fields(state):
        kind, old = before[name]
        if old.shape != value.shape or not np.array_equal(old, value, equal_nan=True):
            assert kind in ("changing", "scratch"), f"steps change {name}"
            changed.add(name)
    assert {"nodes.displacement", "freedoms.velocity", "clock.time"} <= changed


@pytest.mark.thorough
@pytest.mark.parametrize("threads", [1, 2])
@pytest.mark.parametrize("case", CASES)
def test_a_restored_state_goes_on_with_the_same_bits(case, threads):
    state = run(case, 50, threads)
    saved = state.save()
    go(state, 250, threads)
    once = bits(state)
    state.restore(saved)
    go(state, 250, threads)
    again = bits(state)
    assert once.keys() == again.keys()
    for name, value in once.items():
        assert np.array_equal(value, again[name], equal_nan=True), name


def test_a_copy_of_what_is_saved_is_restored_too():
    """As from a file: nothing of the state is shared with what was saved."""
    state = run("falling", 600)
    assert len(state.contacts) > 0
    saved = state.save()
    copies = {part: {name: row.copy() for name, row in rows.items()} for part, rows in saved.items()}
    go(state, 900)
    assert state.contacts.work.any()
    once = bits(state)
    for rows in saved.values():
        for row in rows.values():
            row.fill(0)
    state.restore(copies)
    go(state, 900)
    assert all(np.array_equal(value, bits(state)[name], equal_nan=True) for name, value in once.items())


@pytest.mark.parametrize("threads", [1, 2, 3, 5])
@pytest.mark.parametrize("case", CASES)
def test_shares_cover_everything_once(case, threads):
    state = run(case, 200)
    parts = state.shared(threads).parts
    sizes = {
        "nodes": len(state.mesh.nodes), "zones": parts.zones.corner.shape[1], "bonds": len(state.bonds),
        "contacts": len(state.contacts), "pressures": len(parts.pressures.column),
        "fluids": len(parts.fluids.column), "drives": len(parts.drives.column),
        "freedoms": parts.freedoms.force.shape[1], "tractions": len(parts.tractions.node),
        "quiet": len(parts.quiet.node),
    }  # fmt: skip
    for name, size in sizes.items():
        share = getattr(parts, name).share
        assert (len(share), share[0], share[-1]) == (threads + 1, 0, size), name
        assert np.all(np.diff(share) >= 0), name
    for row, group in zip(parts.materials.share, state.materials.groups, strict=True):
        assert (len(row), row[0], row[-1]) == (threads + 1, group.first, group.last)


def test_a_part_that_a_model_has_none_of_has_no_share():
    state = state_of(small_sample(), WEAK)
    split = Split(2, np.array([0, 20, 40]), state.mesh.first_node[[0, 20, 40]])
    assert not state.gravity.share(split).any()
    assert not state.grains.share(split).any()
    assert not state.contacts.share(split).any()
    rigid = state_of(small_sample(material=gl.Rigid(density=3100)), WEAK)
    assert rigid.zones.arrays.corner.shape == (3, 0)
    assert not rigid.zones.share(split).any()


def test_two_minerals_of_different_laws_keep_their_memory():
    """Groups of laws with memories of different depth lie in one array; each point has its own law's."""
    specimen = small_sample(30)
    phase = np.arange(specimen.grains.count) % 2
    mixed = gl.Specimen(attrs.evolve(specimen.grains, phase=phase), {0: ROCK, 1: ROCK})
    laws = {(0, 0): MohrCoulomb(**STRONG), (0, 1): WEAK, (1, 1): Friction(**STIFF, friction_angle=20)}
    state = state_of(mixed, laws)
    place = mixed.mesh.nodes
    state.nodes.arrays.displacement[:] = (place * [1e-3, 2e-3]).T
    state.time_step = 1e-30
    go(state, 1)
    for group in state.bonds.groups:
        points = group.points(len(state.bonds))
        memory = np.zeros((group.depth, 2 * group.size))
        normal, shear = group.compiled.batch(state.opening[points], state.slip[points], memory)
        assert np.array_equal(state.normal[points], normal)
        assert np.array_equal(state.shear[points], shear)
        assert np.array_equal(state.bonds.memory_of(group), memory)


def test_the_time_of_a_step_is_counted_from_where_its_length_last_changed():
    clock = Clock()
    assert clock.next_times(3, 0.5).tolist() == [0.5, 1.0, 1.5]
    clock.count(2, 1.0)
    assert clock.next_times(2, 0.5).tolist() == [1.5, 2.0]
    assert clock.next_times(2, 0.125).tolist() == [1.125, 1.25]
    clock.count(1, 1.125)
    assert clock.next_times(1, 0.125).tolist() == [1.25]
    clock.books.aged[0], clock.books.jumps[0], clock.books.waited[0] = 70.0, 3, 2
    assert clock.begin_stage() == 1.125
    assert (clock.aged, clock.books.aged_before[0], clock.books.jumps_before[0], clock.books.waited[0]) == (
        70,
        70,
        3,
        0,
    )


def test_a_temperature_goes_straight_to_its_target_and_stays_where_there_is_no_pace():
    """By hand, at 20 °C from 3 s on: 4 K/s up to 30 °C, none at a pace of 0, and 8 K/s down to -10 °C."""
    told = []
    heat = EvenTemperature(SimpleNamespace(take_temperature=told.append))
    assert (heat.sign, heat.temperature) == (0, 20.0)
    heat.target = 30.0
    assert heat.course(np.array([4.0, 5.0, 6.0]), 3.0, 4.0).tolist() == [[20, 24], [24, 28], [28, 30]]
    assert heat.course(np.array([4.0, 5.0]), 3.0, 0.0).tolist() == [[20, 20], [20, 20]]
    heat.reach(25.0)
    assert heat.course(np.array([7.0]), 6.5, 4.0).tolist() == [[25, 27]]
    heat.target = -10.0
    assert heat.sign == -1
    assert heat.course(np.array([7.0, 12.0]), 6.0, 8.0).tolist() == [[25, 17], [17, -10]]
    heat.target = None
    assert heat.course(np.array([7.0]), 6.0, 8.0).tolist() == [[25, 25]]
    assert told == [25.0]
