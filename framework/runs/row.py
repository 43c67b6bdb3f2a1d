"""What a run records at every sample of any test: :data:`grainlaw.columns.EVERY_TEST` and the energies."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from grainlaw.columns import ENERGY
from grainlaw.engine.ledger import motion, unbalanced
from grainlaw.engine.state import State


def row_of(state: State, energies: Mapping[str, float]) -> dict[str, float]:
    """Columns of the present moment, by name, beside time, step and stage."""
    row = {
        "loading_speed": state.steady.pace,
        "temperature": state.heat.temperature,
        "vibration": state.steady.vibration(),
        "tensile_cracks": int(np.sum(state.broken_mode < 0.5)),
        "shear_cracks": int(np.sum(state.broken_mode >= 0.5)),
        "damaged": int(np.count_nonzero(state.memory("damage") > 0)),
        "unbalanced": unbalanced(state),
        "motion": motion(state, energies),
    }
    return row | {ENERGY + kind: value for kind, value in energies.items()}
