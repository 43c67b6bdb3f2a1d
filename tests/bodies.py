"""Bodies in motion: a State that is driven directly, and what mechanics says of it."""

from __future__ import annotations

import itertools
from collections.abc import Callable

import attrs
import numpy as np
from support import state_of

import grainlaw as gl
from grainlaw.columns import KINETIC, SPENT, STORED, SUPPLIED
from grainlaw.compiler.batch import compile_integrator
from grainlaw.engine.ledger import energies
from grainlaw.engine.stable_step import StableStep
from grainlaw.engine.state import State
from grainlaw.engine.stepping import advance
from grainlaw.geometry import block, from_polygons, moved, together
from grainlaw.laws import Friction

RIGID = gl.Rigid(density=2600)
SOFT = gl.Elastic(youngs_modulus=1e9, poissons_ratio=0.2, density=2600)
FACES = Friction(kn=1e9, ks=1e9, friction_angle=30)
GRAVITY = 9.81  #: m/s2


def box(width, height, left=0.0, bottom=0.0, name="box"):
    """A rectangle whose lower left corner is at ``left, bottom``."""
    right, top = left + width, bottom + height
    return block([(left, bottom), (right, bottom), (right, top), (left, top)], name)


def sectors(radii, count):
    """Rings between radii (m), cut into ``count`` sectors; boundaries "hole" and "boundary", the joint "axes"."""
    angles = np.linspace(0, 2 * np.pi, count + 1)
    ray = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    cells = [
        [p * ray[k], q * ray[k], q * ray[k + 1], p * ray[k + 1]]
        for p, q in itertools.pairwise(radii)
        for k in range(count)
    ]
    grains = from_polygons(cells, holes=True)
    pairs = np.stack([grains.edges.start, grains.edges.end], axis=1)
    on_axis = (np.abs(grains.vertices[pairs]) < 1e-9 * radii[-1]).all(axis=1).any(axis=1)
    return attrs.evolve(grains, joints={"axes": pairs[on_axis]})


def turned(width, height, degrees, centre=(0.0, 0.0), name="box"):
    """A rectangle about its ``centre``."""
    return moved(box(width, height, -width / 2, -height / 2, name), by=centre, turn=degrees)


class Motion:
    """Bodies, what acts on them, and the engine that moves them; ``safety`` is the share of the stable step."""

    def __init__(
        self, grains, law, *, material=RIGID, detection=None, gravity=(0.0, 0.0), fixed=(), drives=(), velocity=None,
        damping=None, safety=0.9, threads=1,
    ):  # fmt: skip
        specimen = gl.Specimen(grains, material)
        self.state, self.threads = state_of(specimen, law, detection or gl.Detection()), threads
        self.integrator = gl.integration.CentralDifference(damping=damping or gl.integration.Undamped(), safety=safety)
        stable = StableStep(self.state)
        self.stage = gl.Stage(
            name="motion", until=[gl.conditions.Reaches("time", 1)], interval=1, integrator=self.integrator,
            loads=[
                *drives, gl.loads.Gravity(acceleration=gravity), gl.loads.Fixed(grains=fixed),
                *([] if velocity is None else [gl.loads.InitialVelocity(velocity=velocity(specimen))]),
            ],
        )  # fmt: skip
        self.state.begin(self.stage)
        self.state.time_step = stable.step(self.integrator)

    def steps(self, count):
        advance(self.state, compile_integrator(self.integrator), count, threads=self.threads)

    def run(self, seconds, samples=1, **measures: Callable[[State], float]):
        """(samples,) of each measure, of ``time``, and of each kind of energy."""
        rows, count = [], max(1, round(seconds / samples / self.state.time_step))
        for _ in range(samples):
            self.state.new_sample()
            self.steps(count)
            row = {"time": self.state.time, **{name: read(self.state) for name, read in measures.items()}}
            rows.append(row | energies(self.state))
        return {name: np.array([row[name] for row in rows]) for name in rows[0]}


def each(*velocities):
    """Velocity field that gives each grain a mean (x, y) m/s, and a spin (1/s) where a third number is given."""

    def field(specimen):
        centre = specimen.grains.centroids[specimen.mesh.node_grain]
        x, y = (specimen.mesh.nodes - centre).T
        rows = np.array([(*v, 0.0)[:3] for v in velocities])[specimen.mesh.node_grain].T
        return np.column_stack([rows[0] - rows[2] * y, rows[1] + rows[2] * x])

    return field


def thrown(seed, material):
    """Four polygons of any shape, apart from each other, and velocities of nodes towards their middle, with a spin."""
    rng, blocks = np.random.default_rng(seed), []
    for k, at in enumerate([(8e-3, 1e-3), (-1e-3, 9e-3), (-9e-3, -2e-3), (1e-3, -8e-3)]):
        sides = 3 + rng.integers(4)
        angles = 2 * np.pi * (np.arange(sides) + rng.uniform(-0.3, 0.3, sides)) / sides
        corners = np.column_stack([np.cos(angles), np.sin(angles)]) * rng.uniform(0.004, 0.007, 2)
        blocks.append(block(corners + at, f"rim {k}"))
    specimen = gl.Specimen(together(*blocks), material)
    centre = specimen.grains.centroids[specimen.mesh.node_grain]
    x, y = (specimen.mesh.nodes - centre).T
    spin = rng.normal(0, 1000, 4)[specimen.mesh.node_grain, None]
    return specimen, -5000 * centre + spin * np.column_stack([-y, x])


def momentum(state):
    """(3,) linear and angular momentum about the origin, after the last step."""
    mass, velocity = state.freedoms.arrays.mass, state.freedoms.arrays.velocity
    if state.grains.is_rigid:
        x, y = state.specimen.grains.centroids.T + state.freedoms.arrays.displacement[:2]
    else:
        x, y = state.positions.T
    px, py = mass[:2] * velocity[:2]
    spin = np.sum(mass[2] * velocity[2]) if state.grains.is_rigid else 0.0
    return np.array([px.sum(), py.sum(), np.sum(x * py - y * px) + spin])


def gap(row):
    """J that the ledger does not account for, over all rows of a run."""
    return np.abs(row[SUPPLIED] - sum(row[kind] for kind in SPENT))


def total(row):
    """J, kinetic and stored less the external work."""
    return sum(row[kind] for kind in (KINETIC, *STORED)) - row[SUPPLIED]


__all__ = [
    "FACES", "GRAVITY", "RIGID", "SOFT", "Motion", "box", "each", "gap", "momentum", "thrown", "together", "total",
    "turned",
]  # fmt: skip
