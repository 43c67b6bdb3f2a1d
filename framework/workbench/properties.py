"""Properties that every contact law must have, each a function from a law on its bench to what breaks it."""

from __future__ import annotations

import enum
import itertools
import math
from collections.abc import Callable, Iterator
from typing import Any

import attrs
import numpy as np

from grainlaw.compiler.batch import CompilationError, compile_law
from grainlaw.workbench.bench import FIRST, LAPS, Bench, label
from grainlaw.workbench.characteristics import shear_mode, tensile_mode
from grainlaw.workbench.driver import run_together
from grainlaw.workbench.finding import Finding, place, words
from grainlaw.workbench.first_response import first_response
from grainlaw.workbench.friction_property import friction
from grainlaw.workbench.rate_property import rate
from grainlaw.workbench.refined import Response

ROUNDING = 1e-12


def units(bench: Bench) -> Finding | None:
    """Every number is declared with its unit, also in the law's parts."""
    names = without_unit(bench.law)
    return Finding(f'not declared with a unit, as gl.parameter("Pa") does: {", ".join(names)}') if names else None


def without_unit(component: Any) -> list[str]:
    """Names of the numbers of a component and its parts that are not declared with a unit."""

    def missing(component: Any, prefix: str) -> Iterator[str]:
        for field in attrs.fields(type(component)):
            value = getattr(component, field.name)
            if attrs.has(type(value)):
                yield from missing(value, f"{prefix}{field.name}.")
            elif isinstance(value, (int, np.ndarray, enum.Enum)) or field.metadata.get("unit"):
                continue
            else:
                yield prefix + field.name

    return list(missing(component, ""))


def compiled_equals_interpreted(bench: Bench) -> Finding | None:
    """The machine code of a simulation gives the same answers, for many contacts at a time."""
    try:
        compiled = compile_law(bench.law)
    except CompilationError as error:
        return Finding(f"does not compile: {' '.join(str(error).split())}")
    names, paths = list(bench.paths), list(bench.paths.values())
    longest = max(map(len, paths))
    points = np.array([[*path, *[path[-1]] * (longest - len(path))] for path in paths])  # (path, i, 2)
    found = run_together(compiled, points)
    for k, name in enumerate(names):
        here = bench.answers[name]
        difference = np.abs(found[k, : len(here)] - here)
        wrong = difference > ROUNDING * (np.abs(here) + np.max(np.abs(here), axis=0, initial=1e-30))
        wrong |= np.isnan(found[k, : len(here)]) != np.isnan(here)
        if wrong.any():
            i, j = np.argwhere(wrong)[0]
            text = f"{name}: {label(bench, j)} {found[k, i, j]:.15g} compiled, {here[i, j]:.15g} interpreted"
            return Finding(f"{text} at {place(points[k, i])}", float(difference[i, j]))
    return None


def odd_in_slip(bench: Bench) -> Finding | None:
    """Slip in the other direction gives the opposite shear traction, and changes nothing else."""
    for name, path in bench.paths.items():
        there = bench.answers[name]
        mirrored = bench.contact.run([(o, -s) for o, s in path])
        for column, sign in ((0, 1), (1, -1)):
            difference = np.abs(there[:, column] - sign * mirrored[:, column])
            i = int(np.nanargmax([0.0, *difference])) - 1
            if i >= 0 and difference[i] > ROUNDING * np.nanmax(np.abs(there[:, column])):
                a, b = words(there[i, column], "Pa"), words(mirrored[i, column], "Pa")
                text = f"{name}: {label(bench, column)} {a} at {place(path[i])}, and {b} with the slip reversed"
                return Finding(text, float(difference[i]))
    return None


def damage_never_heals(bench: Bench) -> Finding | None:
    """``damage`` and ``mode`` stay in [0, 1], and damage never falls."""
    for name in [name for name in ("damage", "mode") if name in bench.contact.names]:
        for run in bench.drives:
            values = bench.memory(run.answers, name)
            outside = np.flatnonzero((values < 0) | (values > 1))
            if len(outside):
                i = outside[0]
                return Finding(f"{run.name}: {name} {values[i]:.6g} at {place(run.points[i])}", float(values[i]))
            falls = np.flatnonzero(np.diff(values) < 0)
            if name == "damage" and len(falls):
                i = falls[0]
                text = f"{run.name}: damage falls from {values[i]:.6g} to {values[i + 1]:.6g}"
                return Finding(f"{text} at {place(run.points[i + 1])}", float(values[i] - values[i + 1]))
    return None


def closed_paths_create_no_energy(bench: Bench) -> Finding | None:
    """The work on a virgin contact is stored or lost, so never negative, nor is that of a settled cycle."""
    worst, shear = Finding(""), bench.scale.shear
    rounding = ROUNDING * shear.strength * shear.displacement  # a path on which nothing happens
    for run in bench.drives:
        allowed = 2e-3 * float(np.max(np.abs(run.work))) + rounding
        for when, gain in gains(run):
            if gain > max(allowed, worst.size):
                worst = Finding(f"{run.name}: gives {words(gain, 'J/m2')} {when}", gain)
    return worst if worst.text else None


def gains(run: Response) -> Iterator[tuple[str, float]]:
    """Energy that three laps of a path give (J/m2 per lap), and where."""
    work, legs = run.work, (run.legs // LAPS)
    ends = run.corners[::legs]
    for lap, (start, end) in enumerate(itertools.pairwise([*ends, len(work) - 1])):
        if start < end:
            i = start + int(np.argmin(work[start : end + 1]))
            yield f"up to {place(run.points[i])} in lap {lap + 1}", -float(work[i]) / (lap + 1)
    if len(ends) == LAPS + 1:
        yield "in a settled lap", float(work[ends[-2]] - work[ends[-1]])


def fracture_energies(bench: Bench) -> Finding | None:
    """Pulled, or sheared under no pressure, the work from the peak to the break is what the law declares."""
    declared = bench.law.fracture_energies
    unknown = set(declared) - {"mode_i", "mode_ii"}
    if unknown:
        return Finding(f"fracture_energies has {', '.join(sorted(unknown))}, it may have mode_i and mode_ii")
    worst = Finding("")
    for name, energy in declared.items():
        mode = tensile_mode(bench.contact) if name == "mode_i" else shear_mode(bench.contact, pressure=0.0)
        work = mode.work_after_peak
        error = abs(work - energy) / abs(energy)
        if math.isnan(error):
            return Finding(f"{name}: no peak and break, declared {words(energy, 'J/m2')}")
        if error > max(1e-3, worst.size):
            text = f"{name}: {words(work, 'J/m2')} from the peak to the break, declared {words(energy, 'J/m2')}"
            worst = Finding(f"{text} ({100 * (work / energy - 1):+.2f} %)", error)
    return worst if worst.text else None


def no_jump(bench: Bench) -> Finding | None:
    """No traction jumps, that is changes by 3 % of a strength however small the step."""
    jumps = [(run.name, jump) for run in bench.drives for jump in run.jumps]
    if not jumps:
        return None
    largest = max(jump.size for _, jump in jumps)
    name, jump = next(entry for entry in jumps if entry[1].size > 0.9 * largest)  # designed paths come first
    text = f"{name}: {jump.kind} traction jumps by {words(jump.size, 'Pa')} at {place((jump.opening, jump.slip))}"
    return Finding(text, jump.size)


def finite(bench: Bench) -> Finding | None:
    """Displacements up to a metre give numbers, in any order."""
    random = np.random.default_rng(5)
    sizes = 10.0 ** random.uniform(-12, 0, (60, 6, 2)) * random.choice((-1.0, 0.0, 1.0), (60, 6, 2), p=(0.4, 0.2, 0.4))
    wild = {f"random displacements {k}": [tuple(p) for p in row] for k, row in enumerate(sizes.tolist())}
    for name, path in (bench.paths | wild).items():
        bench.contact.error = ""
        answers = bench.answers[name] if name in bench.paths else bench.contact.run(path)
        bad = np.argwhere(~np.isfinite(answers))
        if len(bad):
            i, j = bad[0]
            why = f" ({bench.contact.error})" if bench.contact.error else ""
            return Finding(f"{name}: {label(bench, j)} is {answers[i, j]} at {place(path[i])}{why}")
        if "damage" in bench.contact.names:
            values = bench.memory(answers, "damage")
            if np.any((values < 0) | (values > 1)):
                return Finding(f"{name}: damage leaves [0, 1]: {values.min():.6g} to {values.max():.6g}")
    return None


def no_hidden_state(bench: Bench) -> Finding | None:
    """All paths once more, their contacts taking turns, give bit for bit what each gave alone."""
    again = bench.contact.run(FIRST)
    if not np.array_equal(again, bench.first, equal_nan=True):
        i, j = np.argwhere(again != bench.first)[0]
        text = f"{label(bench, j)} {again[i, j]:.6g} after other paths, {bench.first[i, j]:.6g} at first"
        return Finding(f"{text}, at {place(FIRST[i])}", float(abs(again[i, j] - bench.first[i, j])))
    states = {name: bench.contact.start for name in bench.paths}
    for i in range(max(map(len, bench.paths.values()))):
        for name, path in bench.paths.items():
            if i < len(path):
                answer = bench.contact.step(*path[i], states[name])
                states[name] = answer[2:]
                alone = bench.answers[name][i]
                if not np.array_equal(answer, alone, equal_nan=True):
                    j = int(np.argmax(np.array(answer) != alone))
                    text = f"{name}: {label(bench, j)} {answer[j]:.6g} among other contacts, {alone[j]:.6g} before"
                    return Finding(f"{text}, at {place(path[i])}", float(abs(answer[j] - alone[j])))
    return None


PROPERTIES: dict[str, Callable[[Bench], Finding | None]] = {
    "units": units,
    "stiffness": first_response,
    "compiled": compiled_equals_interpreted,
    "odd in slip": odd_in_slip,
    "damage": damage_never_heals,
    "energy": closed_paths_create_no_energy,
    "fracture energies": fracture_energies,
    "continuity": no_jump,
    "finite": finite,
    "friction": friction,
    "rate": rate,
    "no hidden state": no_hidden_state,
}
