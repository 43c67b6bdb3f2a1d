"""What :func:`grainlaw.check_law` asks of a fresh contact: its first response is the law's ``stiffness``."""

from __future__ import annotations

from grainlaw.bench import Bench, Finding
from grainlaw.probing import words


def first_response(bench: Bench) -> Finding | None:
    """A fresh contact answers little displacements with ``stiffness``, in either direction.

    One that nothing bonds resists closing alone, and slip when it is closed.
    """
    at_rest = bench.contact.step(0.0, 0.0, bench.contact.start)[:2]
    if max(map(abs, at_rest)) > 1e-9 * bench.scale.tension.strength:
        return Finding(f"traction of {words(at_rest[0], 'Pa')}, {words(at_rest[1], 'Pa')} with nothing imposed")
    opened, slipped = bench.scale.tension.displacement, bench.scale.shear.displacement
    bonded = bench.contact.run([(share * opened, 0.0) for share in (1e-6, 1e-3, 1.0)])[:, 0].any()
    signs, closure = ((1, -1), 0.0) if bonded else ((-1,), opened)
    probes = [(0, (sign * 1e-6 * opened, 0.0)) for sign in signs]
    probes += [(1, (-closure, sign * 1e-6 * slipped)) for sign in (1, -1)]
    worst = Finding("")
    for mode, point in probes:
        kind, k, size = ("normal", "shear")[mode], bench.law.stiffness[mode], point[mode]
        found = bench.contact.step(*point, bench.contact.start)[mode] / size
        error = abs(found - k) / abs(k)
        if not error <= max(1e-5, worst.size):
            text = f"{kind} response {found:.6g} Pa/m at {words(size, 'm')}, stiffness says {k:.6g} Pa/m"
            worst = Finding(text, error)
    return worst if worst.text else None
