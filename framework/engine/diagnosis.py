"""Where a run became unstable, in words."""

from __future__ import annotations

import numpy as np

from grainlaw.columns import CONTACTS
from grainlaw.contact import dilates, law_arguments
from grainlaw.engine.ledger import energies
from grainlaw.engine.state import State


def first_fault(state: State) -> str | None:
    """The contact point or grain whose numbers are no longer finite, in words."""
    tractions = state.normal + state.shear
    if not np.isfinite(tractions).all():
        p = int(np.argmin(np.isfinite(tractions)))
        a, b = _grains_at(state, p)
        where = f"contact point {p} between grains {a} and {b}"
        if np.isfinite(state.opening[p] + state.slip[p]):
            return (
                f"the law returned {state.normal[p]} and {state.shear[p]} Pa at {where} "
                f"(opening {state.opening[p]:.4g} m, slip {state.slip[p]:.4g} m); look at this law with gl.trace"
            )
        return f"opening and slip are not finite at {where}"
    speeds = state.freedoms.arrays.velocity
    if not np.isfinite(speeds).all():
        n = int(np.argmin(np.isfinite(speeds).all(axis=0)))
        grain = n if state.grains.is_rigid else state.mesh.node_grain[state.mesh.first_of_point[n]]
        return f"the velocity of grain {grain} is not finite"
    return None


def fastest(state: State) -> str:
    """The fastest grain and the contact point with the largest displacement, in words."""
    node = int(np.argmax(np.hypot(*state.velocity.T)))
    speed = float(np.hypot(*state.velocity[node]))
    grain = int(state.mesh.node_grain[node])
    if not len(state.bonds):
        return f"the energy balance does not close; grain {grain} moves at {speed:.4g} m/s"
    p = int(np.argmax(np.hypot(state.opening, state.slip)))
    a, b = _grains_at(state, p)
    works, lifted = energies(state), any(dilates(group.law) for group in state.bonds.groups)
    taken = [works[kind] for kind in CONTACTS]
    if sum(taken) < 0 if lifted else np.nanmin(taken) < 0:
        cause = "contacts that open and close within a step, which gave back more energy than they took"
    else:
        cause = "a time step that is too long for a law stiffer than its `stiffness` says"
        if any("time_step" in law_arguments(group.law) for group in state.bonds.groups):
            cause += ", or with a dashpot that its `retardation_time` does not"
    return (
        f"the energy balance does not close; grain {grain} moves at {speed:.4g} m/s, and contact point {p} "
        f"between grains {a} and {b} has opened by {state.opening[p]:.4g} m; likely cause: {cause}; lower the "
        "integrator's safety, or see the law with gl.trace"
    )


def _grains_at(state: State, point: int) -> tuple[int, int]:
    a, b = state.mesh.interface_grains[state.bonds.order[point % len(state.bonds)]]
    return int(a), int(b)
