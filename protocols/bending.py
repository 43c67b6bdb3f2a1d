"""What the two bending tests share: stage, columns and summary of a load between two supports."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

import numpy as np

from grainlaw.condition import Curves, Reaches
from grainlaw.engine.state import State
from grainlaw.loads import Drive
from grainlaw.moduli import work
from grainlaw.protocols.between_platens import UntilFailure, failing, refuse_platens, require_boundaries, sampling
from grainlaw.protocols.measures import certificate, failure_of, size, strength_of
from grainlaw.quantity import Quantity
from grainlaw.specimen import Specimen
from grainlaw.stage import Stage

SUPPORTS = ("support_left", "support_right")
QUANTITIES = (
    Quantity("deflection", "µm", meaning="of the load against the supports"),
    Quantity("mouth", "µm", words="mouth opening", meaning="of the notch"),
    Quantity("force_top", "kN/m", meaning="of the load"),
    Quantity("force_bottom", "kN/m", meaning="of both supports"),
    Quantity("failure_force", "kN/m"),
    Quantity("failure_deflection", "µm"),
    Quantity("flexural_strength", "MPa", form=".2f", is_main=True),
    Quantity("largest_force", "kN/m"),
    Quantity("largest_flexural_strength", "MPa", form=".2f"),
    Quantity("largest_toughness", "MPa √m", form=".3f", factor=1e-6),
    Quantity("work_of_fracture", "J/m2", is_main=True),
)


class BetweenRollers(UntilFailure, Protocol):
    """What the bending tests have in common."""

    @property
    def maximum_deflection(self) -> float: ...


def bending_stage(test: BetweenRollers, specimen: Specimen) -> Stage:
    """The load moves down between the supports, all on rollers, to a deflection or until the force has fallen."""
    require_boundaries(specimen, type(test).__name__, "load", *SUPPORTS)
    refuse_platens(
        specimen, type(test).__name__, "it is loaded at its own boundaries load and support, without platens"
    )
    return Stage(
        name="bend",
        loads=[
            Drive(boundary="load", axis=1, speed=-1.0, roller=True),
            Drive(boundary="load", axis=0, speed=0.0, roller=True),
            *(Drive(boundary=support, axis=1, speed=0.0, roller=True) for support in SUPPORTS),
        ],
        until=[Reaches("deflection", test.maximum_deflection), *failing(test, "force", "deflection", after_break=True)],
        **sampling(test, test.maximum_deflection),
    )


def measure_bending(state: State) -> dict[str, float]:
    """``deflection`` of the load against the supports, ``mouth`` opening of the notch (m), and forces (N/m).

    ``force_top`` is the load, ``force_bottom`` the reaction of both supports, ``force`` the mean of the two. There is
    no column ``stress``: a force over its small bearing face is not the stress in the beam.
    """
    load, *supports = (float(state.displacement[state.mesh.middle(name), 1].mean()) for name in ("load", *SUPPORTS))
    top = -float(state.reaction("load")[1])
    bottom = sum(float(state.reaction(support)[1]) for support in SUPPORTS)
    row = {
        "deflection": sum(supports) / 2 - load,
        "force": (top + bottom) / 2,
        "force_top": top,
        "force_bottom": bottom,
    }
    if "notch" in state.mesh.boundaries:
        row["mouth"] = mouth_opening(state)
    return row


def bending_summary(
    curves: Curves, specimen: Specimen, name: str, strength: Callable[[float, Specimen], float]
) -> dict[str, Any]:
    """Load (N/m) at the first failure, its deflection, the strength computed from it under ``name``, and the rest.

    The rest is the largest load and what would be computed from it, the work of fracture and the certificate.
    """
    found = failure_of(curves, "force", "deflection")
    force, largest = strength_of(found, curves["force"])
    return {
        "failure_force": force,
        "failure_deflection": strength_of(found, curves["deflection"])[0],
        name: strength(force, specimen),
        "largest_force": largest,
        f"largest_{name}": strength(largest, specimen),
        "work_of_fracture": work_of_fracture(curves, specimen),
        **certificate(curves, found, "force"),
    }


def mouth_opening(state: State) -> float:
    """m, change of the distance between the two lowest corners of the notch."""
    nodes = state.mesh.boundaries["notch"]
    place = state.mesh.nodes[nodes]
    lowest = np.flatnonzero(place[:, 1] <= place[:, 1].min() + 1e-9 * np.ptp(place[:, 1]))
    left, right = lowest[np.argmin(place[lowest, 0])], lowest[np.argmax(place[lowest, 0])]
    return float(state.displacement[nodes[right], 0] - state.displacement[nodes[left], 0])


def ligament(specimen: Specimen) -> float:
    """Height (m) above the notch, or of the whole specimen if it has none."""
    if "notch" not in specimen.mesh.boundaries:
        return size(specimen)[1]
    top = specimen.grains.region.bounds[1][1]
    return float(top - specimen.mesh.nodes[specimen.mesh.boundaries["notch"], 1].max())


def notch_depth(specimen: Specimen) -> float:
    """m; 0 without a notch."""
    return size(specimen)[1] - ligament(specimen)


def span(specimen: Specimen) -> float:
    """Distance (m) of the middles of the supports."""
    left, right = (specimen.mesh.nodes[specimen.mesh.boundaries[support], 0] for support in SUPPORTS)
    return float((right.min() + right.max()) / 2 - (left.min() + left.max()) / 2)


def work_of_fracture(curves: Curves, specimen: Specimen) -> float:
    """J/m2: work of the load over the ligament, without weight (RILEM TC 50-FMC 1985, doi:10.1007/BF02472918).

    It is the fracture energy only if the specimen has parted, for it includes the energy still stored at the end.
    """
    return work(curves["force"], curves["deflection"]) / ligament(specimen)
