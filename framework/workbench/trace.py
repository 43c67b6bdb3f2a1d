"""The answer of one contact along a path of opening and slip."""

from __future__ import annotations

from typing import Any

import numpy as np

from grainlaw.arguments import checked, floats
from grainlaw.contact import ContactLaw
from grainlaw.fields import ParameterError, checked_number
from grainlaw.messages import refusal
from grainlaw.workbench.driver import Contact, Trace

FARTHEST = 1e6  #: m, beyond it energies overflow


@checked
def trace(law: ContactLaw, opening: Any, slip: Any, *, compiled: bool = False, time_step: float = 0.0) -> Trace:
    """Drive one contact alone along arrays of ``opening`` and ``slip`` (m; either may be a single number).

    For a law that knows time, ``time_step`` (s) passes from point to point; at 0 no time passes.
    Interpreted, or through the ``compiled`` code a simulation runs; both agree to 1e-12. Raises TypeError for a law
    that returns anything but its two tractions and its memory, ParameterError for arrays that are no path.
    """
    ends = _path("opening", opening), _path("slip", slip)
    if any(end.ndim > 1 for end in ends) or len({end.size for end in ends if end.size != 1}) > 1:
        raise ParameterError(
            f"trace: opening of shape {ends[0].shape} and slip of shape {ends[1].shape} are not allowed, they must be "
            "numbers or (i,) arrays of equal length"
        )
    checked_number("trace: time_step", time_step, "s", at_least=0)
    points = np.stack(np.broadcast_arrays(*map(np.atleast_1d, ends)), axis=1)
    return Contact(law, compiled=compiled, raises=True, time_step=time_step).trace(points.tolist())


def _path(name: str, value: Any) -> np.ndarray:
    try:
        path = floats(value)
    except (TypeError, ValueError, OverflowError):
        path = np.array(np.nan)
    if not (np.abs(path) <= FARTHEST).all():
        raise refusal(f"trace: {name}", value, f"a number of at most {FARTHEST:g} m or an array of them")
    return path
