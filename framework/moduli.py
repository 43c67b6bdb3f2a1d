"""Elastic constants and work, from curves of load and displacement or stress and strain."""

from __future__ import annotations

import numpy as np

from grainlaw.material import Elastic, Plane
from grainlaw.specimen import Specimen


def slope(x: np.ndarray, y: np.ndarray) -> float:
    """Slope of the regression of y on x; nan for fewer than two points or where x does not change."""
    return float(np.polyfit(x, y, 1)[0]) if len(x) > 1 and np.ptp(x) > 0 else float("nan")


def work(load: np.ndarray, displacement: np.ndarray) -> float:
    """Work of a load on its displacement, by the trapezoidal rule; of a stress on its strain, it is in J/m3."""
    return float(np.sum((load[1:] + load[:-1]) / 2 * np.diff(displacement)))


def converted(young: float, poisson: float, specimen: Specimen) -> tuple[float, float]:
    """E and nu of the material from E* and nu* of its plane problem: nu = nu*/(1 + nu*), E = E* (1 - nu^2).

    Equal to E* and nu* where the material is in plane stress.
    """
    rock = specimen.material_of(int(specimen.grains.phase[0]))
    if isinstance(rock, Elastic) and rock.plane is Plane.STRESS:
        return young, poisson
    true = poisson / (1 + poisson)
    return young * (1 - true**2), true
