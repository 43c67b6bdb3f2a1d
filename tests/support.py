"""What several tests share: small specimens, and single evaluations of the engine."""

import attrs
import numpy as np
from scipy.sparse.linalg import spsolve

import grainlaw as gl
from grainlaw.compiler.batch import compile_integrator
from grainlaw.engine import stepping
from grainlaw.engine.model import Model
from grainlaw.engine.stability import stiffness_matrix
from grainlaw.engine.state import State
from grainlaw.geometry import Voronoi, rectangle
from grainlaw.laws import MohrCoulomb
from grainlaw.protocols import UniaxialTension
from grainlaw.units import GPa, MPa, mm

STIFF = {"kn": 1.05e14, "ks": 9.45e13}
STRONG = STIFF | {
    "tensile_strength": 13 * MPa, "cohesion": 29 * MPa, "friction_angle": 54, "residual_friction_angle": 5,
}  # fmt: skip
ROCK = gl.Elastic(youngs_modulus=60 * GPa, poissons_ratio=0.25, density=3100)
BRITTLE = MohrCoulomb(**STRONG)
PULL = UniaxialTension(loading=gl.Constant(speed=0.3), maximum_strain=5e-4, samples=40, stop_fraction=0)


@attrs.frozen(kw_only=True)
class Hillerborg(gl.ContactLaw):
    """A user's law, as the documents show it: linear tension softening over the fracture energy; elastic in shear."""

    kn: float = gl.parameter("Pa/m")
    ks: float = gl.parameter("Pa/m")
    strength: float = gl.parameter("Pa")
    energy: float = gl.parameter("J/m2")
    stiffness = property(lambda self: (self.kn, self.ks))

    def traction(self, opening, slip, damage, widest):
        peak, last = self.strength / self.kn, 2 * self.energy / self.strength
        widest = max(widest, opening, peak)
        damage = min((widest - peak) / (last - peak), 1.0)
        secant = self.strength * (1 - damage) / widest
        return (secant if opening > 0 else self.kn) * opening, self.ks * slip, damage, widest


HILLERBORG = Hillerborg(**STIFF, strength=13e6, energy=50)


def small_sample(grains=40, seed=1, width=20 * mm, height=40 * mm, material=ROCK, **options):
    """A few Voronoi grains."""
    return gl.Specimen(Voronoi(grains=grains, seed=seed).tessellate(rectangle(width, height)), material, **options)


def offenders(rule, things):
    """Those of many things that break a rule, which asserts, with what it says."""
    found = {}
    for thing in things:
        try:
            rule(thing)
        except AssertionError as error:
            found[thing] = str(error).splitlines()[0] if str(error) else ""
    return found


def state_of(specimen, laws, detection=None):
    """A specimen before its first step."""
    return State(Model(specimen, laws, detection))


def impose(state, loads):
    """Begin a stage of loads."""
    state.begin(gl.Stage(name="loads", loads=loads, until=[gl.conditions.Reaches("time", 1)], interval=1))


def with_quiet(stage, *boundaries):
    """A stage with other quiet boundaries."""
    return attrs.evolve(
        stage, loads=[*(one for one in stage.loads if not isinstance(one, gl.loads.Quiet)), *boundaries]
    )


def advance(state, steps=1, time_step=1e-30, integrator=None, threads=1):
    """Let the engine do steps on a state by itself, without driven boundaries; undamped if not told otherwise."""
    state.time_step = time_step
    stepping.advance(
        state,
        compile_integrator(integrator or gl.integration.CentralDifference(damping=gl.integration.Undamped())),
        steps,
        threads=threads,
    )


def nodal_forces(state, displacement):
    """Forces (i, 2) N of zones and contacts at a displacement (i, 2) m."""
    state.nodes.arrays.displacement[:] = np.asarray(displacement).T
    state.freedoms.arrays.velocity[:] = 0
    advance(state)
    state.freedoms.arrays.velocity[:] = 0
    return state.nodes.arrays.force.T.copy()


def static_solution(specimen, kn, ks, strain):
    """Displacement (i, 2) of smooth compression by a sparse solve: independent of the engine's loop."""
    mesh = specimen.mesh
    count = len(mesh.interfaces)
    matrix = stiffness_matrix(specimen, np.full((2, count), kn), np.full((2, count), ks))
    held = {2 * i + 1: 0.0 for i in mesh.boundaries["bottom"]}
    held |= {2 * i + 1: -strain * np.ptp(mesh.nodes[:, 1]) for i in mesh.boundaries["top"]}
    held[2 * int(mesh.boundaries["bottom"][0])] = 0.0
    fixed = np.array(sorted(held))
    free = np.setdiff1d(np.arange(2 * len(mesh.nodes)), fixed)
    u = np.zeros(2 * len(mesh.nodes))
    u[fixed] = [held[k] for k in fixed]
    u[free] = spsolve(matrix[free][:, free].tocsc(), -matrix[free][:, fixed] @ u[fixed])
    return u.reshape(-1, 2), free
