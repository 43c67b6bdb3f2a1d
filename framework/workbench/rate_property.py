"""What :func:`grainlaw.check_law` asks of a law that names the time step: a limit without time, and no energy made."""

from __future__ import annotations

import numpy as np

from grainlaw.contact import ContactLaw, law_arguments, memory_names
from grainlaw.workbench.bench import Bench, label
from grainlaw.workbench.driver import Contact
from grainlaw.workbench.finding import Finding, place, words
from grainlaw.workbench.paths import designed_paths, even_steps

SLOW, FAST = 1e60, 1e-60  #: s between two answers: nothing has a rate, nothing ages
EVEN = 1e-6  #: of the largest traction or memory
TIME_STEPS = (1e-9, 1e-4, 10.0, 1e6)  #: s
FINE = 40  #: steps of a leg


def rate(bench: Bench) -> Finding | None:
    """Infinitely slow, or at once, the law is as if no time passed; a modified law is then the law alone.

    At no rate between does a virgin contact give energy, unless the law declares that it does without time too.
    """
    if "time_step" not in law_arguments(bench.law):
        return None
    return _as_alone(bench) or _limit(bench) or _energy(bench)


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


def _limit(bench: Bench) -> Finding | None:
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
