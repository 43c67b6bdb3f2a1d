"""Properties that every material must have, each a function from a material on its bench to what breaks it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from grainlaw.compiler.batch import CompilationError
from grainlaw.fields import ParameterError
from grainlaw.material import Material, knows_temperature
from grainlaw.memory import ROOM
from grainlaw.workbench.bench import Finding
from grainlaw.workbench.material_bench import SMALL, MaterialBench, at
from grainlaw.workbench.properties import units
from grainlaw.workbench.zone import Zone, kept

ROUNDING = 1e-12
COLD, HOT, TEMPERATURES = -100.0, 800.0, 9  # °C, between which a material is asked, as far as it knows them
#: times the declared stiffness along a step, at most: the safety of the stable step, 0.9, allows for 1 / 0.9^2. Flow
#: that is not normal to the yield surface is up to (1 / cos a - 1) / 2 stiffer, a being the angle between the two.
STIFFER = 1.2
EXACT = 1e-6  #: of the stress that the declared stiffness gives: the first response, and the derivative of the energy


def stiffness(bench: MaterialBench) -> Finding | None:
    """The first response is that of the declared stiffness, and no step of any path is stiffer."""
    small = SMALL * bench.scale
    for direction in np.eye(3):
        for sign in (1, -1):
            strain = sign * small * direction
            expected = bench.declared @ strain
            found = np.array(bench.zone.step(strain.tolist(), bench.zone.start)[:3])
            error = np.abs(found - expected).max() / np.abs(expected).max()
            if not error <= max(EXACT, 10 * small):  # a nonlinear first response differs by its curvature
                text = f"{_shown(found)} at {at(strain)}, {_shown(expected)} by the declared stiffness"
                return Finding(text, float(error))
    return _too_stiff(bench)


def _too_stiff(bench: MaterialBench) -> Finding | None:
    """A step of a path that is stiffer than declared."""
    worst = Finding("")
    for name, trace in bench.traces.items():
        moved, change = np.diff(trace.strain, axis=0), np.diff(trace.stress, axis=0)
        work = (change * moved) @ [1.0, 1.0, 2.0]
        allowed = np.einsum("ij,kj,ik->i", moved, bench.declared, moved * [1.0, 1.0, 2.0])
        rounding = ROUNDING * np.abs(trace.stress).max() * np.abs(moved).max(axis=1)
        i = int(np.argmax((work - rounding) / allowed))
        ratio = float((work[i] - rounding[i]) / allowed[i])
        if ratio > max(STIFFER, worst.size):
            text = f"{name}: {ratio:.4g} times as stiff as declared at {at(trace.strain[i + 1])}"
            worst = Finding(text, ratio)
    return worst if worst.text else None


def symmetry(bench: MaterialBench) -> Finding | None:
    """The stress is the derivative of the energy by the strain, with the memory held: so tangents are symmetric."""
    zone, little = bench.zone, 1e-4 * bench.scale
    for name, trace in bench.traces.items():
        memory = np.array(list(trace.memory.values())).T.reshape(len(trace.strain), -1)
        for i in range(0, len(trace.strain), 7):
            state = memory[i].tolist()
            here = trace.strain[i]
            ends = [[zone.energy((here + d).tolist(), state) for d in sign * little * np.eye(3)] for sign in (1, -1)]
            slope = (np.array(ends[0]) - ends[1]) / (2 * little)
            expected = trace.stress[i] * [1.0, 1.0, 2.0]
            allowed = EXACT * max(np.abs(trace.stress).max(), bench.scale * np.abs(bench.declared).max())
            wrong = np.abs(slope - expected)
            if np.any(wrong > 10 * allowed):
                k = int(np.argmax(wrong))
                text = f"{name}: {expected[k]:.6g} Pa, derivative of the energy {slope[k]:.6g} Pa"
                return Finding(f"{text} ({('xx', 'yy', 'xy')[k]}) at {at(trace.strain[i])}", float(wrong[k]))
    return None


def energy(bench: MaterialBench) -> Finding | None:
    """What a zone has dissipated, work less stored energy, never falls: so no closed path gives energy."""
    worst = Finding("")
    for name, trace in bench.traces.items():
        lost = trace.work - trace.stored
        size = max(float(np.abs(trace.work).max()), bench.scale**2 * float(np.abs(bench.declared).max()))
        falls = np.maximum.accumulate(lost) - lost
        i = int(np.argmax(falls))
        if falls[i] > max(2e-3 * size, worst.size):
            text = f"{name}: gives {falls[i]:.4g} J/m3 beyond the work done, up to {at(trace.strain[i])}"
            worst = Finding(text, float(falls[i]))
    return worst if worst.text else None


def memory(bench: MaterialBench) -> Finding | None:
    """``plastic_strain`` never falls and is never negative."""
    for name, trace in bench.traces.items():
        if "plastic_strain" in trace.memory:
            values = trace.memory["plastic_strain"]
            falls = np.diff(values, prepend=0.0)
            if np.any(falls < 0):
                i = int(np.argmax(falls < 0))
                return Finding(f"{name}: plastic_strain falls to {values[i]:.6g} at {at(trace.strain[i])}", -falls[i])
    return None


def compiled_equals_interpreted(bench: MaterialBench) -> Finding | None:
    """The machine code of a simulation gives the same answers."""
    try:
        zone = Zone(bench.material, compiled=True)
    except CompilationError as error:
        return Finding(f"does not compile: {' '.join(str(error).split())}")
    for name, trace in bench.traces.items():
        points = trace.strain[: len(trace.strain) // 3]
        here, there = bench.zone.run(points.tolist()), zone.run(points.tolist())
        # Plastic strain is a small difference: it is held to the strain of the path, like the strain itself.
        scale = np.maximum(np.abs(here).max(axis=0), 1e-30)
        scale[:3] = max(scale[:3].max(), bench.scale * np.abs(bench.declared).max())
        scale[4:] = np.maximum(scale[4:], np.abs(points).max())
        wrong = (np.abs(there - here) > 1e3 * ROUNDING * scale) | (np.isnan(there) != np.isnan(here))
        if wrong.any():
            i, j = np.argwhere(wrong)[0]
            text = f"{name}: {_label(bench, j)} {there[i, j]:.15g} compiled, {here[i, j]:.15g} interpreted"
            return Finding(f"{text} at {at(points[i])}", float(np.abs(there[i, j] - here[i, j])))
    return None


def finite(bench: MaterialBench) -> Finding | None:
    """Strains up to a tenth give numbers, in any order."""
    random = np.random.default_rng(5)
    sizes = 10.0 ** random.uniform(-9, -1, (40, 6, 3)) * random.choice((-1.0, 0.0, 1.0), (40, 6, 3))
    for points in [*sizes, np.zeros((2, 3)), *(trace.strain for trace in bench.traces.values())]:
        bench.zone.error = ""
        answers = bench.zone.run(points.tolist())
        bad = np.argwhere(~np.isfinite(answers))
        if len(bad):
            i, j = bad[0]
            why = f" ({bench.zone.error})" if bench.zone.error else ""
            return Finding(f"{_label(bench, j)} is {answers[i, j]} at {at(points[i])}{why}")
    return None


def no_hidden_state(bench: MaterialBench) -> Finding | None:
    """All paths once more, one zone after the other, give bit for bit what they gave at first."""
    for name, trace in reversed(bench.traces.items()):
        again = bench.zone.trace(trace.strain)
        if not np.array_equal(again.stress, trace.stress, equal_nan=True):
            i = int(np.argmax(np.any(again.stress != trace.stress, axis=1)))
            text = f"{name}: {_shown(again.stress[i])} the second time, {_shown(trace.stress[i])} the first"
            return Finding(f"{text} at {at(trace.strain[i])}")
    return None


def temperature(bench: MaterialBench) -> Finding | None:
    """At other temperatures, too, closed paths give no energy; and a zone that is free of stress returns with them.

    So the free strain is a function of the temperature alone: heating and cooling close a loop.
    """
    material = bench.material
    if not knows_temperature(material):
        return None
    low, high = (max(material.temperatures[0], COLD), min(material.temperatures[1], HOT))
    if not low <= ROOM <= high - 1:
        return Finding(f"is known from {low:g} to {high:g} °C; runs begin at {ROOM:g} °C")
    for end in (high, low):
        if abs(end - ROOM) >= 1 and (found := _at_temperature(bench, float(end))):
            return found
    return None


def _at_temperature(bench: MaterialBench, end: float) -> Finding | None:
    """What is wrong on the way to a temperature and back, or there."""
    material, path = bench.material, _free_strains(bench.material, bench.zone, end)
    left = float(np.abs(path[-1][1] - path[0][1]).max())
    there, free = max(path, key=lambda point: abs(point[0] - ROOM))
    if not left <= 1e-6 * max(bench.scale, float(np.abs(free - path[0][1]).max())):
        way = ("heated", "cooled") if there > ROOM else ("cooled", "heated")
        words = f"{way[0]} to {there:.4g} °C and {way[1]} it keeps a free strain of {left:.4g}: closes no loop"
        return Finding(words, left)
    zone = Zone(material, temperature=there)
    zone.origin = (float(free[0]), float(free[1]), float(free[2]))
    asked = MaterialBench(material, zone)
    asked.scale = bench.scale  # its own first response is another one than declared
    for name, ask in (("stiffness", _too_stiff), ("symmetry", symmetry), ("energy", energy)):
        if name not in material.exceptions and (found := ask(asked)):
            return Finding(f"at {there:.4g} °C, {name}: {found.text}", found.size)
    return None


def _free_strains(material: Material, zone: Zone, end: float) -> list[tuple[float, np.ndarray]]:
    """Temperatures from 20 °C to ``end`` and back, with the strain that is free of stress (nan where there is none).

    As far as the memory of the zone stays, since a plastic material may yield across the plane; but by one kelvin.
    """
    path, state = [(ROOM, _free(zone, zone.start, np.zeros(3)))], zone.start
    for temperature in (ROOM + np.sign(end - ROOM), *np.linspace(ROOM, end, TEMPERATURES)[1:].tolist()):
        there = Zone(material, temperature=temperature)
        strain = _free(there, state, path[-1][1])
        after = there.step(strain.tolist(), state)[3:]
        if (after != zone.start or np.isnan(strain).any()) and len(path) > 1:
            break
        path.append((temperature, strain))
        state = after
    for temperature, _ in path[-2::-1]:
        there = Zone(material, temperature=temperature)
        path.append((temperature, _free(there, state, path[-1][1])))
        state = there.step(path[-1][1].tolist(), state)[3:]
    return path


def _free(zone: Zone, state: tuple[float, ...], near: np.ndarray) -> np.ndarray:
    try:
        return kept(zone, state, near, np.zeros(3), None)
    except ParameterError:
        return np.full(3, np.nan)


def _label(bench: MaterialBench, column: int) -> str:
    """Name of a column of answers."""
    return ("stress xx", "stress yy", "stress xy", "energy", *bench.zone.names)[column]


def _shown(stress: np.ndarray) -> str:
    return f"stress ({', '.join(f'{value * 1e-6:.6g}' for value in stress)}) MPa"


PROPERTIES: dict[str, Callable[[MaterialBench], Finding | None]] = {
    "units": lambda bench: units(bench.material),
    "finite": finite,
    "stiffness": stiffness,
    "symmetry": symmetry,
    "energy": energy,
    "memory": memory,
    "temperature": temperature,
    "compiled": compiled_equals_interpreted,
    "no hidden state": no_hidden_state,
}
