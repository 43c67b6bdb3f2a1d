"""What :func:`grainlaw.check_law` asks of a virgin contact: its first response is the law's ``stiffness``."""

from __future__ import annotations

import numpy as np

from grainlaw.workbench.bench import Bench
from grainlaw.workbench.finding import Finding, words
from grainlaw.workbench.scale import is_bonded

EXACT = 1e-5
SMALL = (1e-6, 1e-8, 1e-10)  #: shares of the displacement at the peak; smaller ones would show the rounding of 1 - exp
NEAR = np.geomspace(SMALL[-1], 1e-2, 25)


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
    text = f"{_kind(mode)} response {c:.6g} Pa/m at {words(SMALL[-1] * size, 'm')}, stiffness says {k:.6g} Pa/m"
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
    text = f"{_kind(mode)} response rises by {tangents[i]:.6g} Pa/m at {words(shares[i + 1] * size, 'm')}"
    return Finding(f"{text}, stiffness says {k:.6g} Pa/m", float(tangents[i] / k - 1))


def _point(mode: int, displacement: float, opening: float) -> tuple[float, float]:
    return (displacement, 0.0) if mode == 0 else (opening, displacement)


def _kind(mode: int) -> str:
    return ("normal", "shear")[mode]
