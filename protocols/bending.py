"""What the two bending tests share: the load between two supports, and the work that breaks the ligament."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from grainlaw.engine.state import State
from grainlaw.protocols.platens import AtSpeed, refuse_platens, require_boundaries, sample_limit
from grainlaw.specimen import Specimen
from grainlaw.stage import Curves, Drive, FailsTo, Reaches, Stage

SUPPORTS = ("support_left", "support_right")


class BetweenRollers(AtSpeed, Protocol):
    """What the bending tests have in common."""

    @property
    def maximum_deflection(self) -> float: ...


def bending_stage(test: BetweenRollers, specimen: Specimen) -> Stage:
    """The load comes down between the supports, all rollers, to a deflection, or until the force has fallen."""
    require_boundaries(specimen, type(test).__name__, "load", *SUPPORTS)
    refuse_platens(
        specimen, type(test).__name__, "it is loaded at its own boundaries load and support, without platens"
    )
    interval = test.maximum_deflection / test.speed / test.samples
    return Stage(
        name="bend",
        drives=[
            Drive(boundary="load", axis=1, speed=-test.speed, ramp=test.ramp, roller=True),
            Drive(boundary="load", axis=0, speed=0.0, roller=True),
            *(Drive(boundary=support, axis=1, speed=0.0, roller=True) for support in SUPPORTS),
        ],
        until=[Reaches("deflection", test.maximum_deflection), FailsTo("force", test.stop_fraction)],
        interval=interval,
        integrator=test.integrator,
        sample_limit=sample_limit(test, interval),
    )


def measure_bending(state: State) -> dict[str, float]:
    """``deflection`` of the load against the supports, ``mouth`` opening of the notch (m), and ``force`` (N/m).

    ``force`` is the mean of the load and of the supports' reactions.
    """
    load_way, *support_ways = (float(state.displacement[state.mesh.middle(n), 1].mean()) for n in ("load", *SUPPORTS))
    load = -float(state.reaction("load")[1])
    carried = sum(float(state.reaction(support)[1]) for support in SUPPORTS)
    row = {
        "deflection": sum(support_ways) / 2 - load_way,
        "force": (load + carried) / 2,
        "stress_top": load,
        "stress_bottom": carried,
    }
    if "notch" in state.mesh.boundaries:
        row["mouth"] = mouth_opening(state)
    return row


def mouth_opening(state: State) -> float:
    """m by which the two lowest corners of the notch have parted."""
    nodes = state.mesh.boundaries["notch"]
    place = state.mesh.nodes[nodes]
    lowest = np.flatnonzero(place[:, 1] <= place[:, 1].min() + 1e-9 * np.ptp(place[:, 1]))
    left, right = lowest[np.argmin(place[lowest, 0])], lowest[np.argmax(place[lowest, 0])]
    return float(state.displacement[nodes[right], 0] - state.displacement[nodes[left], 0])


def ligament(specimen: Specimen) -> float:
    """Height (m) above the notch, or of the whole specimen if it has none."""
    low, high = specimen.grains.region.bounds
    if "notch" not in specimen.mesh.boundaries:
        return float(high[1] - low[1])
    return float(high[1] - specimen.mesh.nodes[specimen.mesh.boundaries["notch"], 1].max())


def notch_depth(specimen: Specimen) -> float:
    """m; 0 without a notch."""
    low, high = specimen.grains.region.bounds
    return float(high[1] - low[1]) - ligament(specimen)


def span(specimen: Specimen) -> float:
    """Distance (m) of the middles of the supports."""
    left, right = (specimen.mesh.nodes[specimen.mesh.boundaries[support], 0] for support in SUPPORTS)
    return float((right.min() + right.max()) / 2 - (left.min() + left.max()) / 2)


def work_of_fracture(curves: Curves, specimen: Specimen) -> float:
    """J/m2: work of the load over the ligament, without weight (RILEM TC 50-FMC 1985, doi:10.1007/BF02472918).

    It is the fracture energy only if the specimen has parted: what is left in it when the test ends counts as well.
    """
    force, way = curves["force"], curves["deflection"]
    return float(np.sum((force[1:] + force[:-1]) / 2 * np.diff(way)) / ligament(specimen))
