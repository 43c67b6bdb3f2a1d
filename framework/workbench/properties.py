"""Properties that every contact law must have, each a function from a law on its bench to what breaks it."""

from __future__ import annotations

import enum
import itertools
import math
import types
from collections.abc import Callable, Iterator
from typing import Any

import attrs
import numpy as np

from grainlaw.compiler.batch import CompilationError, compile_law
from grainlaw.compiler.fingerprint import code_names
from grainlaw.contact import ContactLaw, law_arguments, memory_names
from grainlaw.workbench.bench import FIRST, LAPS, Bench, Finding, label, place, words
from grainlaw.workbench.characteristics import shear_mode, tensile_mode
from grainlaw.workbench.driver import Contact, run_together
from grainlaw.workbench.paths import designed_paths, even_steps
from grainlaw.workbench.refined import Response, drive
from grainlaw.workbench.scale import Scale, find_peak, is_bonded

ROUNDING = 1e-12
EXACT = 1e-5
SMALL = (1e-6, 1e-8, 1e-10)  #: shares of the displacement at the peak; smaller ones would show the rounding of 1 - exp
NEAR = np.geomspace(SMALL[-1], 1e-2, 25)
BACK = np.append(np.geomspace(0.1, 1e-6, 26), 0.0)  #: shares of the way back, the last of them
KINDS = ("normal", "shear")
SLOW, FAST = 1e60, 1e-60  #: s between two answers: nothing has a rate, nothing ages
EVEN = 1e-6  #: of the largest traction or memory
AT_ONCE = 1e-12  #: s, in which a dashpot bears far more than the springs
TIME_STEPS = (1e-9, 1e-4, 10.0, 1e6)  #: s
FINE = 40  #: steps of a leg
MOST = 2000  #: steps of one that is fine
LEFT = 1e-3  #: share of its pressure that a broken contact bears at least
STRONGER = 1.1  #: ratio of two strengths that are sampled to 6 %


def rate(bench: Bench) -> Finding | None:
    """Infinitely slow, or at once, the law is as if no time passed; a modified law is then the law alone.

    At no rate between does a virgin contact give energy, unless the law declares that it does without time too.
    """
    if "time_step" not in law_arguments(bench.law):
        return None
    return _as_alone(bench) or _slow_limit(bench) or _dashpot(bench) or _energy(bench)


def _as_alone(bench: Bench) -> Finding | None:
    """Where no time passes, a law around another answers as that one."""
    inner = getattr(bench.law, "law", None)
    if not isinstance(inner, ContactLaw):
        return None
    alone, names = Contact(inner), memory_names(inner)
    columns = [0, 1, *(2 + bench.contact.names.index(name) for name in names)]
    for name, path in bench.paths.items():
        here, there = bench.answers[name][:, columns], alone.run(path)
        wrong = np.abs(here - there) > EVEN * np.max(np.abs(there), axis=0, initial=1e-30)
        if wrong.any():
            i, j = np.argwhere(wrong)[0]
            text = f"{name}: {label(bench, columns[j])} {here[i, j]:.6g}, {there[i, j]:.6g} without the modifier"
            return Finding(f"{text}, at {place(path[i])} where no time passes", float(abs(here[i, j] - there[i, j])))
    return None


def _slow_limit(bench: Bench) -> Finding | None:
    """Tractions at one end of all rates are those without time; not of a law around another that knows time."""
    if isinstance(inner := getattr(bench.law, "law", None), ContactLaw) and "time_step" in law_arguments(inner):
        return None
    worst: list[Finding] = []
    for time_step, words_of in ((SLOW, "infinitely slow"), (FAST, "at once")):
        found, contact = Finding(""), Contact(bench.law, time_step=time_step)
        for name, path in bench.paths.items():
            here, there = bench.answers[name][:, :2], contact.run(path)[:, :2]
            apart = np.nan_to_num(np.abs(here - there), nan=np.inf)
            if apart.max() > max(EVEN * np.abs(here).max(), found.size):
                i, j = np.unravel_index(int(np.argmax(apart)), apart.shape)
                text = f"{name}: {label(bench, j)} {there[i, j]:.6g} {words_of}, {here[i, j]:.6g} where no time passes"
                found = Finding(f"{text}, at {place(path[int(i)])}", float(apart[i, j]))
        worst.append(found)
    return min(worst, key=lambda finding: finding.size) if all(finding.text for finding in worst) else None


def _dashpot(bench: Bench) -> Finding | None:
    """A dashpot beside the springs is one of the law's ``retardation_time``, by which the stable step is shorter."""
    contact, declared, worst = Contact(bench.law, time_step=AT_ONCE), bench.law.retardation_time, Finding("")
    for mode, peak in enumerate((bench.scale.tension, bench.scale.shear)):
        for way in (SMALL[0] * peak.displacement, -SMALL[0] * peak.displacement):
            move = (way, 0.0) if mode == 0 else (0.0, way)
            more = contact.step(*move, contact.start)[mode] - bench.contact.step(*move, bench.contact.start)[mode]
            time = AT_ONCE * more / (bench.law.stiffness[mode] * way)
            if time > max(1.05 * declared + 10 * AT_ONCE, worst.size):
                text = f"{KINDS[mode]} dashpot of {time * bench.law.stiffness[mode]:.4g} Pa s/m, over its stiffness"
                told = f"{time:.3g} s, and retardation_time {declared:g} s: the time step of a run is too long"
                worst = Finding(f"{text} {told}", time)
    return worst if worst.text else None


def _energy(bench: Bench) -> Finding | None:
    """The work done on a virgin contact is stored or lost at every rate, so never negative."""
    worst = Finding("")
    corners = {} if "energy" in bench.law.exceptions else designed_paths(bench.scale)
    for time_step in TIME_STEPS:
        contact = Contact(bench.law, time_step=time_step)
        for name, path in corners.items():
            trace = contact.trace(even_steps(path, FINE))
            gain = -float(np.nan_to_num(trace.work, nan=-np.inf).min())
            if gain > max(1e-2 * float(np.nanmax(np.abs(trace.work))), worst.size):
                i = int(np.nanargmin(trace.work))
                at = place((float(trace.opening[i]), float(trace.slip[i])))
                worst = Finding(
                    f"{name}, {time_step:g} s from point to point: gives {words(gain, 'J/m2')} up to {at}", gain
                )
    return worst if worst.text else None


def friction(bench: Bench) -> Finding | None:
    """Shear strength, intact or broken, does not fall as the pressure rises, nor rise as it is pulled."""
    scale = bench.scale
    moved = creep(bench) or stronger_in_tension(bench)
    if moved:
        return moved
    histories = {"shear": [(0.0, 0.0)], "break by pulling, shear": [(0.0, 0.0), (scale.tension.broken, 0.0)]}
    for history, before in histories.items():
        runs = []
        for closure in scale.closures:
            corners = [*before, (-closure, 0.0), (-closure, scale.far), (-closure, 0.0), (-closure, -scale.far)]
            run = drive(bench.contact, history, corners, scale)
            if not run.complete:
                return Finding(f"{history}: no finite answer beyond {place(run.points[-1])}")
            runs.append(run)
        for finding in (*weakening(runs, scale, history), *(driven_by_shear(scale, run) for run in runs)):
            if finding:
                return finding
    return pressed_while_sliding(bench)


def stronger_in_tension(bench: Bench) -> Finding | None:
    """Shear strength that grows as a bond is pulled, as where pressure is taken for positive."""
    tension, shear = bench.scale.tension, bench.scale.shear
    if not (shear.found and is_bonded(bench.contact, tension)):
        return None
    half = 0.5 * tension.displacement
    pulled = find_peak(bench.contact, 1, -half)
    if not pulled.found or pulled.strength < STRONGER * shear.strength:
        return None
    text = f"shear strength {words(pulled.strength, 'Pa')} at opening {words(half, 'm')}"
    text += f", {words(shear.strength, 'Pa')} without: tension counts positive"
    return Finding(text, pulled.strength - shear.strength)


def creep(bench: Bench) -> Finding | None:
    """Shear traction that goes on changing while nothing moves, as where plastic slip stops short of the strength."""
    scale = bench.scale
    for closure, peak in zip(scale.closures, scale.sheared_under, strict=True):
        path = even_steps([(0.0, 0.0), (-closure, 0.0), (-closure, 1.5 * peak.displacement)], 20)
        answers = bench.contact.run([point for point in path for _ in range(2)])[:, 1]
        change = np.abs(answers[1::2] - answers[::2])
        i = int(np.argmax(change > 0.01 * scale.shear.strength))
        if change[i] > 0.01 * scale.shear.strength:
            text = f"shear traction goes on from {words(answers[2 * i], 'Pa')} to {words(answers[2 * i + 1], 'Pa')}"
            return Finding(f"press, shear: {text} at rest, at {place(path[i])}", float(change[i]))
    return None


def weakening(runs: list[Response], scale: Scale, history: str) -> Iterator[Finding]:
    """Peak and last shear traction against pressure."""
    allowed = 1e-3 * scale.shear.strength
    out = [run.answers[run.corners[-4] : run.corners[-3] + 1, 1] for run in runs]
    strengths, lasts = [float(row.max()) for row in out], [float(row[-1]) for row in out]
    for what, tractions in (("shear strength", strengths), ("shear traction after long slip", lasts)):
        for (p, a), (q, b) in itertools.pairwise(zip(scale.pressures, tractions, strict=True)):
            if b < a - allowed:
                text = f"{history}: {what} falls from {words(a, 'Pa')} under {words(p, 'Pa')} pressure"
                yield Finding(f"{text} to {words(b, 'Pa')} under {words(q, 'Pa')}", a - b)


def driven_by_shear(scale: Scale, run: Response) -> Finding | None:
    """Where shear drives the slip it should oppose: while slip grows, or goes back beyond its start."""
    allowed = 1e-3 * scale.shear.strength
    out = slice(run.corners[-4], run.corners[-3] + 1)
    back = slice(run.corners[-2], run.corners[-1] + 1)
    for part, sign, when in ((out, 1, "slip grows"), (back, -1, "slip goes back beyond its start")):
        wrong = -sign * run.answers[part, 1]
        i = int(np.argmax(wrong))
        if wrong[i] > allowed:
            text = f"{run.name}: shear traction {words(run.answers[part, 1][i], 'Pa')} drives the contact while {when}"
            return Finding(f"{text}, at {place(run.points[part][i])}", float(wrong[i]))
    return None


def pressed_while_sliding(bench: Bench) -> Finding | None:
    """A contact that slides does not lose shear traction when it is pressed harder and slides on."""
    scale = bench.scale
    s, (low, high) = scale.shear.displacement, scale.closures[1::2]
    corners = [(0.0, 0.0), (-low, 0.0), (-low, scale.far), (-high, scale.far + 2 * s), (-high, 2 * scale.far + 4 * s)]
    run = drive(bench.contact, "slide, press, slide on", corners, scale)
    if not run.complete:
        return Finding(f"{run.name}: no finite answer beyond {place(run.points[-1])}")
    before, after = run.answers[run.corners[2], 1], run.answers[-1, 1]
    if after < before - 1e-3 * scale.shear.strength:
        text = f"{run.name}: shear traction falls from {words(before, 'Pa')} to {words(after, 'Pa')}"
        return Finding(f"{text} at {place(run.points[-1])}", float(before - after))
    return None


def first_response(bench: Bench) -> Finding | None:
    """The response of a virgin contact tends to ``stiffness`` as displacements get smaller, and is not stiffer nearby.

    A bonded contact is tried in either direction. One without a bond is closed only, and sheared when it is closed.
    Under closure it may stiffen, because the stable step follows the tangent there.
    """
    at_rest = bench.contact.step(0.0, 0.0, bench.contact.start)[:2]
    if max(map(abs, at_rest)) > 1e-9 * bench.scale.tension.strength:
        return Finding(f"traction of {words(at_rest[0], 'Pa')}, {words(at_rest[1], 'Pa')} with nothing imposed")
    opened, slipped = bench.scale.tension.displacement, bench.scale.shear.displacement
    bonded = is_bonded(bench.contact, bench.scale.tension)
    signs, closure = ((1, -1), 0.0) if bonded else ((-1,), opened)
    probes = [(0, sign * opened, 0.0) for sign in signs] + [(1, sign * slipped, -closure) for sign in (1, -1)]
    found = [finding for probe in probes for finding in (_limit(bench, *probe), _stiffest(bench, *probe)) if finding]
    return max(found, key=lambda finding: finding.size, default=None)


def _limit(bench: Bench, mode: int, size: float, opening: float) -> Finding | None:
    """The secants at ``SMALL`` shares of a displacement ``size`` (m) tend to the stiffness."""
    k = bench.law.stiffness[mode]
    secants = [bench.contact.step(*_point(mode, s * size, opening), bench.contact.start)[mode] for s in SMALL]
    a, b, c = (float(secant) / (share * size) for secant, share in zip(secants, SMALL, strict=True))
    left = (c - b) / (b - a) if b != a else 0.0
    # Exact where it bends as a power of the displacement.
    limit = c + (c - b) * left / (1 - left) if 0 < left < 1 else c
    error = min(abs(limit - k), abs(c - k)) / abs(k)
    if error <= EXACT:
        return None
    text = f"{KINDS[mode]} response {c:.6g} Pa/m at {words(SMALL[-1] * size, 'm')}, stiffness says {k:.6g} Pa/m"
    return Finding(text, error)


def _stiffest(bench: Bench, mode: int, size: float, opening: float) -> Finding | None:
    """No tangent up to a hundredth of a displacement ``size`` (m) exceeds the stiffness."""
    k, closing = bench.law.stiffness[mode], mode == 0 and size < 0
    shares = np.concatenate([[0.0], NEAR[NEAR <= SMALL[0]] if closing else NEAR])
    traction = bench.contact.run([_point(mode, share * size, opening) for share in shares])[:, mode]
    tangents = np.diff(traction) / np.diff(shares * size)
    i = int(np.argmax(tangents))
    if not tangents[i] > (1 + EXACT) * k:
        return None
    text = f"{KINDS[mode]} response rises by {tangents[i]:.6g} Pa/m at {words(shares[i + 1] * size, 'm')}"
    return Finding(f"{text}, stiffness says {k:.6g} Pa/m", float(tangents[i] / k - 1))


def released(bench: Bench) -> Finding | None:
    """No tangent exceeds the stiffness where a half broken contact is taken back."""
    return next((found for mode in (0, 1) if (found := _released(bench, mode))), None)


def _released(bench: Bench, mode: int) -> Finding | None:
    k, peak = bench.law.stiffness[mode], (bench.scale.tension, bench.scale.shear)[mode]
    if not peak.found:
        return None
    size = peak.half_broken
    count = min(math.ceil(size / (0.1 * peak.displacement)), MOST)
    back = np.concatenate([np.linspace(1, BACK[0], count, endpoint=False), BACK])
    answers = bench.contact.run([_point(mode, share * size, 0.0) for share in (*np.linspace(0, 1, FINE), *back)])
    tangents = np.diff(answers[FINE:, mode]) / np.diff(back * size)
    i = int(np.argmax(np.nan_to_num(tangents, nan=-np.inf)))
    if not tangents[i] > (1 + EXACT) * k:
        return None
    text = f"{KINDS[mode]} traction of a half broken contact falls by {tangents[i]:.6g} Pa/m on its way back"
    return Finding(f"{text}, at {words(back[i] * size, 'm')}, stiffness says {k:.6g} Pa/m", float(tangents[i] / k - 1))


def _point(mode: int, displacement: float, opening: float) -> tuple[float, float]:
    return (displacement, 0.0) if mode == 0 else (opening, displacement)


def units(component: Any) -> Finding | None:
    """Every number of a law or material is declared with its unit, also in its parts."""
    names = list(without_unit(component))
    return Finding(f'not declared with a unit, as gl.parameter("Pa") does: {", ".join(names)}') if names else None


def without_unit(component: Any, prefix: str = "") -> Iterator[str]:
    """Names of the numbers of a component and its parts that are not declared with a unit."""
    for field in attrs.fields(type(component)):
        value = getattr(component, field.name)
        if attrs.has(type(value)):
            yield from without_unit(value, f"{prefix}{field.name}.")
        elif not isinstance(value, (int, np.ndarray, enum.Enum)) and not field.metadata.get("unit"):
            yield prefix + field.name


def unread(kind: type) -> list[str]:
    """Names of the numbers of a law's class that none of its own code names."""
    classes = [base for base in kind.__mro__ if base not in ContactLaw.__mro__]
    held = [(name, getattr(value, "fget", value)) for base in classes for name, value in vars(base).items()]
    own = [value for name, value in held if not name.endswith("_") or name == "__attrs_post_init__"]  # none to print
    codes = [code_names(each.__code__) for each in own if isinstance(each, types.FunctionType)]
    if any("getattr" in loaded for loaded, _ in codes):
        return []
    return sorted({field.name for field in attrs.fields(kind)} - {name for _, read in codes for name in read})


def compiled_equals_interpreted(bench: Bench) -> Finding | None:
    """The machine code of a simulation gives the same answers, for many contacts at a time."""
    try:
        compiled = compile_law(bench.law)
    except CompilationError as error:
        lines = "; ".join(" ".join(line.split()) for line in str(error).splitlines())
        return Finding(f"does not compile: {lines.replace(':; ', ': ')}")
    if np.isnan(bench.first).all():  # what fails in compiled code would only be printed, at each point
        bench.contact.step(0.0, 0.0, bench.contact.start)
        return Finding(f"it fails wherever it is asked: {bench.contact.error or 'all answers are nan'}")
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


def mended(bench: Bench) -> Finding | None:
    """Tension that a contact bears again which was pulled until its damage was 1."""
    if "damage" not in bench.contact.names:
        return None
    peak = bench.scale.tension
    path = even_steps([(0.0, 0.0), (peak.broken, 0.0), (0.0, 0.0), (peak.broken, 0.0)], FINE)
    answers = bench.contact.run(path)
    broken = np.flatnonzero(bench.memory(answers, "damage") >= 1)
    if not len(broken):
        return None
    after = answers[broken[0] :, 0]
    i = int(np.argmax(np.nan_to_num(after)))
    if not after[i] > max(after[0], 0.0) + 1e-3 * peak.strength:
        return None
    text = f"pull, release, pull: it bears {words(after[i], 'Pa')} of tension after its damage was 1"
    return Finding(f"{text}, at {place(path[broken[0] + i])}", float(after[i] - after[0]))


def gone(bench: Bench) -> Finding | None:
    """A contact that was pulled until its damage was 1, and bears nothing where it is pressed."""
    if "damage" not in bench.contact.names:
        return None
    open_, closed = (bench.scale.tension.broken, 0.0), (-bench.scale.tension.displacement, 0.0)
    virgin = bench.contact.run([(0.0, 0.0), closed])[-1, 0]
    broken = bench.contact.run([*even_steps([(0.0, 0.0), open_], FINE), (0.0, 0.0), closed])
    if bench.memory(broken, "damage")[-1] < 1 or not broken[-1, 0] > LEFT * virgin:
        return None
    text = f"pull until its damage is 1, close: it bears {words(-broken[-1, 0], 'Pa')} of pressure"
    return Finding(f"{text}, {words(-virgin, 'Pa')} before it broke, at {place(closed)}", float(-virgin))


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
            bench.contact.run(path[: i + 1])  # the answers are known, what was wrong is not
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
    "units": lambda bench: units(bench.law),
    "stiffness": lambda bench: first_response(bench) or released(bench),
    "compiled": compiled_equals_interpreted,
    "odd in slip": odd_in_slip,
    "damage": lambda bench: damage_never_heals(bench) or mended(bench) or gone(bench),
    "energy": closed_paths_create_no_energy,
    "fracture energies": fracture_energies,
    "continuity": no_jump,
    "finite": finite,
    "friction": friction,
    "rate": rate,
    "no hidden state": no_hidden_state,
}
