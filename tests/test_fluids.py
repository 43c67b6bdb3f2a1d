"""Fluids in cracks: where they reach, what they press on, and closed forms of what comes of it."""

import attrs
import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from support import ROCK, STIFF, STRONG, small_sample

import grainlaw as gl
from grainlaw.engine.parts.connection import Connection
from grainlaw.geometry import Bricks, rectangle
from grainlaw.laws import Friction, MohrCoulomb

SIDES = ("left", "right", "top", "bottom")
JOINT = Friction(**STIFF, friction_angle=30)
FLOOR = gl.Drive(boundary="bottom", axis=1, speed=0.0)


@attrs.frozen(kw_only=True)
class Loads(gl.LoadingProtocol):
    """Stages of drives, pressures and fluids, each until it is at rest."""

    loads: tuple = ()
    ratio: float = 1e-4

    def stages(self, specimen):
        until = [gl.AtRest(self.ratio)]
        return [gl.Stage(name=f"load {k}", until=until, interval=1e-5, **load) for k, load in enumerate(self.loads)]

    def measure(self, state):
        wet, length = state.fluid_pressure > 0, state.contact_lengths
        return {
            "wet": int(wet.sum()),
            "normal": float(np.average(state.normal, weights=length)),
            "opening": float(np.average(state.opening, weights=length)),
            "widest": float(state.opening.max()),
            **{f"{side}_{axis}": state.moved(side)[k] for side in SIDES for k, axis in enumerate("xy")},
        }

    def summary(self, curves, specimen):
        return {name: float(values[-1]) for name, values in curves.items()}


def two_bricks(width=10e-3, height=4e-3):
    return gl.Specimen(Bricks(rows=2).tessellate(rectangle(width, height)), ROCK)


def fluid(boundary, pressure=5e6, **options):
    return gl.FluidPressure(boundary=boundary, pressure=pressure, ramp=2e-5, **options)


def pressed(stress, ramp=2e-5):
    return gl.Hold(boundary="top", axis=1, stress=-stress, ramp=ramp)


# --- where it reaches ------------------------------------------------------------------------------------------------


def flooded(mesh, ends, broken, boundary):
    """Points that a flood reaches from a boundary, node by node: those of one place are one corner."""
    place = {i: tuple(np.round(mesh.nodes[i] / 1e-9).astype(int)) for i in np.unique(ends)}
    count = len(ends)
    dry = {int(p) for p in np.flatnonzero(broken)}
    at = {place[i] for i in mesh.boundaries[boundary] if i in place}
    wet = set()
    while True:
        found = {p for p in dry if place[ends[p % count, p // count]] in at or (p + count) % (2 * count) in wet}
        if not found:
            return wet
        dry, wet = dry - found, wet | found
        at |= {place[ends[p % count, p // count]] for p in found}


@settings(max_examples=30, deadline=None)
@given(st.integers(1, 1000), st.floats(0.2, 0.9), st.sampled_from(SIDES), st.integers(0, 1))
def test_a_fluid_reaches_what_a_flood_reaches(seed, share, boundary, refinement):
    specimen = small_sample(25, refinement=refinement)
    mesh, ends = specimen.mesh, specimen.mesh.interfaces
    broken = np.random.default_rng(seed).random(2 * len(ends)) < share
    points, corners = Connection(mesh, ends).pieces(broken)
    reached = broken & np.isin(points, corners[mesh.boundaries[boundary]])
    assert set(np.flatnonzero(reached)) == flooded(mesh, ends, broken, boundary)


def test_what_breaks_later_is_entered_later():
    """Four bricks on each other pulled apart at the joint that has a tenth of the strength; it opens at one moment."""
    specimen = gl.Specimen(Bricks(rows=4).tessellate(rectangle(4e-3, 8e-3)), ROCK)
    law = MohrCoulomb(**STRONG | {"tensile_strength": 1e6})
    load = {
        "drives": [FLOOR, gl.Hold(boundary="top", axis=1, stress=0.99e6, ramp=2e-5)],
        "fluids": [fluid("left", 0.5e6)],
    }
    result = gl.simulate(specimen, law, Loads(loads=(load,)))
    assert result.summary["wet"] == 0
