"""Motion that is prescribed: an integrator for trials, which moves every freedom by the velocity that it is given."""

from __future__ import annotations

from typing import Any

import attrs

from grainlaw.integration import Integrator


@attrs.frozen
class Coasting(Integrator):
    """Moves by the velocity that it is given, whatever the forces."""

    def step(self, force: Any, change: Any, velocity: Any, mass: Any, time_step: Any) -> tuple[Any, Any]:
        return velocity, -force

    def stable_step(self, highest_frequency: float) -> float:
        return 1 / highest_frequency
