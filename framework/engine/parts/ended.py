"""What has been supplied and lost in earlier stages, by kind: the book of parts that began anew."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from grainlaw.columns import ENERGIES
from grainlaw.engine.parts.part import Changing, Part


class EndedBooks(NamedTuple):
    """Kinds as in ``columns.ENERGIES``."""

    energy: Changing  #: (kinds,) J


class Ended(Part):
    """Energies of stages that have ended."""

    def __init__(self) -> None:
        self.books = EndedBooks(np.zeros(len(ENERGIES)))

    def take(self, energies: Mapping[str, float]) -> None:
        """Keep energies (J) by kind."""
        for kind, energy in energies.items():
            if kind not in ENERGIES:
                raise ValueError(f"a part has an energy of the kind {kind!r}, which is none of {', '.join(ENERGIES)}")
            self.books.energy[ENERGIES.index(kind)] += energy

    def energy(self, time_step: float) -> dict[str, float]:
        return dict(zip(ENERGIES, self.books.energy.tolist(), strict=True))
