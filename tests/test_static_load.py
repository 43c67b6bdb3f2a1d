"""Specimens brought under their loads by static solutions: closed forms, the same as in motion, and when it is left."""

from types import SimpleNamespace

import attrs
import numpy as np
import pytest
from support import BRITTLE, ROCK, STIFF, STRONG, small_sample, state_of
from test_restart import same

import grainlaw as gl
from grainlaw.columns import SUPPLIED, energy
from grainlaw.engine.stable_step import StableStep
from grainlaw.engine.stage_statics import steady_motion, stiffness_along
from grainlaw.engine.static_load import bring_under_load
from grainlaw.geometry import Bricks, rectangle
from grainlaw.laws import CohesiveCrack, Friction, Linear, MohrCoulomb
from grainlaw.protocols import BiaxialCompression
from grainlaw.units import MPa, mm

COHESIVE = CohesiveCrack(**STRONG, mode_i_energy=150, mode_ii_energy=300)
PRESSURE = 20 * MPa
WEAK = STIFF | {"friction_angle": 0.5, "residual_friction_angle": 0.1}


@attrs.frozen(kw_only=True)
class Confinement(gl.LoadingProtocol):
    """The first stage of a biaxial test."""

    static: bool = True
    confinement: float = PRESSURE
    rest: float = 1e-4

    @property
    def test(self):
        return BiaxialCompression(confinement=self.confinement)

    def stages(self, specimen):
        return [
            attrs.evolve(self.test.stages(specimen)[0], static=self.static, until=[gl.conditions.AtRest(self.rest)])
        ]

    def measure(self, state):
        return self.test.measure(state)

    def summary(self, curves, specimen):
        return {}


class Memory(gl.Observer):
    def observe(self, state, curves, stage, progress):
        self.normal, self.shear = state.normal.copy(), state.shear.copy()


def test_a_column_is_as_long_as_theory_says():
    """Equal pressure on all sides: (1 + nu)(1 - 2 nu) p / E in grains, p / kn in each of three contacts."""
    width, height = 20 * mm, 40 * mm
    column = gl.Specimen(Bricks(rows=4).tessellate(rectangle(width, height)), ROCK)
    curves = gl.simulate(column, BRITTLE, Confinement()).curves
    grains = PRESSURE * (1 + 0.25) * (1 - 2 * 0.25) / ROCK.youngs_modulus
    contacts = 3 * PRESSURE / (1.05e14 * height)
    # Stresses of 20 MPa turn with sides that shorten by some 1e-4.
    assert curves["strain"][0] == pytest.approx(grains + contacts, rel=1e-3)
    assert curves["lateral_strain"][0] == pytest.approx(-grains, rel=1e-3)
    work = PRESSURE / 2 * (2 * grains + contacts) * width * height
    assert energy(curves, SUPPLIED)[0] == pytest.approx(work, rel=2e-3)
    assert curves["step"][0] < 200


@pytest.mark.parametrize("loads", [
    [gl.loads.Pressure(boundary=side, pressure=1 * MPa) for side in ("top", "bottom")],
    [gl.loads.Traction(boundary=side, stress=(0, -1 * MPa, 0)) for side in ("top", "bottom")],
])  # fmt: skip
def test_of_the_work_of_a_load_at_once_half_is_stored_and_half_is_lost(loads):
    class AtOnce(Confinement):
        def stages(self, specimen):
            (stage,) = super().stages(specimen)
            return [attrs.evolve(stage, loads=loads)]

    curves = gl.simulate(small_sample(12), BRITTLE, AtOnce()).curves
    stored = curves["energy_zones"][-1] + curves["energy_contacts_normal"][-1] + curves["energy_contacts_shear"][-1]
    assert energy(curves, SUPPLIED)[-1] == pytest.approx(2 * stored, rel=1e-3)
    assert curves["energy_damping"][-1] == pytest.approx(stored, rel=1e-3)


@attrs.frozen(kw_only=True)
class Weight(gl.LoadingProtocol):
    """A column on a smooth floor, under its own weight."""

    static: bool = True
    gravity: float = 9.81  #: m/s2, downwards
    until: gl.conditions.Condition = gl.conditions.AtRest(1e-6)

    def stages(self, specimen):
        floor = gl.loads.Drive(boundary="bottom", axis=1, speed=0.0)
        return [
            gl.Stage(
                name="weigh", loads=[floor, gl.loads.Gravity(acceleration=(0, -self.gravity))],
                until=[self.until], interval=1e-3,
                static=self.static, integrator=gl.integration.DynamicRelaxation(),
            )
        ]  # fmt: skip

    def measure(self, state):
        return {"settlement": -state.moved("top")[1], "floor": state.reaction("bottom")[1]}

    def summary(self, curves, specimen):
        return {}


@pytest.mark.thorough
@pytest.mark.parametrize("material", [ROCK, gl.Rigid(density=3100)], ids=["elastic", "rigid"])
@pytest.mark.parametrize("law", [BRITTLE, COHESIVE], ids=lambda law: type(law).__name__)
def test_the_specimen_comes_to_rest_where_motion_would_bring_it(law, material):
    specimen, seen = small_sample(material=material), [Memory(), Memory()]
    still = gl.simulate(specimen, law, Confinement(), observers=[seen[0]])
    moved = gl.simulate(specimen, law, Confinement(static=False, rest=1e-6), observers=[seen[1]])
    assert still.curves["step"][-1] < moved.curves["step"][-1] / 3
    for name in ("strain", "lateral_strain", "stress"):
        assert still.curves[name][-1] == pytest.approx(moved.curves[name][-1], rel=1e-3, abs=1e-7)
    for name in ("normal", "shear"):
        assert getattr(seen[0], name) == pytest.approx(getattr(seen[1], name), abs=2e-3 * PRESSURE)
    assert still.curves["unbalanced"][0] < 1e-6
    assert still.curves["motion"][0] < 1e-7
    assert still.summary["energy_error"] < 1e-6
    assert "without_static_solution" not in still.summary


@pytest.mark.thorough
@pytest.mark.parametrize(
    "law",
    [
        MohrCoulomb(**WEAK, cohesion=0.05 * MPa, tensile_strength=0.05 * MPa),  # breaks
        MohrCoulomb(**WEAK, cohesion=3 * MPa, tensile_strength=3 * MPa),  # one contact point breaks
        Friction(**STIFF, friction_angle=54),  # may slide
    ],
    ids=["weak", "one breaks", "cohesionless"],
)
def test_without_one_equilibrium_it_is_brought_there_in_motion(law):
    """And the summary says so."""
    specimen = small_sample()
    still, moved = (gl.simulate(specimen, law, Confinement(static=static)) for static in (True, False))
    broken = still.summary["tensile_cracks"] + still.summary["shear_cracks"]
    told = [words for words in still.doubts if "no static solution" in words]
    assert bool(broken) == bool(told)
    assert all(words.startswith(f"{broken} contact points broke in the stage 'confine', whose loads") for words in told)
    assert still.summary.pop("without_static_solution") == 1
    same(still, moved)


def column(rows=8, material=ROCK):
    return gl.Specimen(Bricks(rows=rows).tessellate(rectangle(1.0, 10.0)), material)


SOFT = MohrCoulomb(**STRONG | {"kn": 1e11, "ks": 1e11})
GRAVITY = 9.81


def test_a_column_under_its_weight_settles_as_theory_says():
    """sigma = rho g (h - y); rho g h^2 / 2E' in grains, with E' of plane strain, sigma / kn in each contact."""
    height, rows, seen = 10.0, 8, Memory()
    found = gl.simulate(column(rows), SOFT, Weight(), observers=[seen])
    unit = ROCK.density * GRAVITY
    above = height * (1 - np.arange(1, rows) / rows)  # of each joint
    assert np.sort(-seen.normal.reshape(2, -1).mean(axis=0)) == pytest.approx(np.sort(unit * above), rel=1e-3)
    plane = ROCK.youngs_modulus / (1 - ROCK.poissons_ratio**2)
    settlement = unit * height**2 / (2 * plane) + (unit * above / SOFT.kn).sum()
    assert found.curves["settlement"][0] == pytest.approx(settlement, rel=2e-3)
    assert found.curves["floor"][0] == pytest.approx(unit * height, rel=1e-6)
    stored = unit**2 * height**3 / (6 * plane) + ((unit * above) ** 2 / (2 * SOFT.kn)).sum()
    assert energy(found.curves, SUPPLIED)[0] == pytest.approx(stored, rel=5e-3)  # of a weight at once: twice that
    assert found.curves["step"][0] < 100_000
    assert found.summary["energy_error"] < 1e-6


@pytest.mark.parametrize("material", [ROCK, gl.Rigid(density=3100)], ids=["elastic", "rigid"])
def test_a_weight_comes_to_rest_where_motion_would_bring_it(material):
    still, moved = (gl.simulate(column(4, material), SOFT, Weight(static=static)) for static in (True, False))
    assert still.curves["settlement"][0] == pytest.approx(moved.curves["settlement"][-1], rel=1e-3)
    assert still.curves["settlement"][-1] == pytest.approx(still.curves["settlement"][0], rel=1e-6)
    assert still.curves["unbalanced"][0] < 1e-6
    assert still.curves["step"][-1] < moved.curves["step"][-1] / 3


def test_a_weight_that_breaks_bonds_comes_in_motion():
    """A column that falls upwards, from a floor that it adheres to by too little."""
    weak, up = (
        attrs.evolve(SOFT, tensile_strength=0.1 * MPa),
        Weight(gravity=-GRAVITY, until=gl.conditions.Reaches("time", 5e-3)),
    )
    runs = [gl.simulate(column(4), weak, attrs.evolve(up, static=static)) for static in (True, False)]
    assert len(runs[0].cracks) > 0
    assert runs[0].summary.pop("without_static_solution") == 1
    same(*runs)


@pytest.mark.thorough
def test_any_number_of_threads_gives_the_same_bits():
    specimen = small_sample()
    same(*(gl.simulate(specimen, COHESIVE, Confinement(), threads=threads) for threads in (1, 2)))


def test_a_static_stage_moves_nothing_at_a_speed():
    pull = gl.loads.Drive(boundary="top", axis=1, speed=0.1)
    with pytest.raises(gl.ParameterError, match="Stage 'pull': static is for gravity, platens"):
        gl.Stage(name="pull", loads=[pull], until=[gl.conditions.AtRest()], interval=1e-4, static=True)


@pytest.mark.parametrize("reason", ["moves", "no bonds", "a law without cohesion", "touches", "stiffens"])
def test_each_reason_alone_leaves_a_static_solution_out(reason):
    """At once: nothing of the state is saved or changed."""
    groups = [SimpleNamespace(cohesive=np.array([True, reason != "a law without cohesion"])) for _ in range(2)]

    class Bonds:
        def __len__(self):
            return 0 if reason == "no bonds" else 4

    bonds = Bonds()
    bonds.groups = groups
    velocity = np.array([[0.0, 1.0 if reason == "moves" else 0.0]])
    held = SimpleNamespace(held_together=np.zeros((0, 2), int) if reason == "no bonds" else np.array([(0, 1)]))
    length = np.array([1e-3 if reason == "touches" else 0.0])
    contacts = SimpleNamespace(arrays=SimpleNamespace(length=length))
    specimen = SimpleNamespace(grains=SimpleNamespace(count=2))
    freedoms = SimpleNamespace(arrays=SimpleNamespace(velocity=velocity))
    state = SimpleNamespace(bonds=bonds, mesh=held, freedoms=freedoms, contacts=contacts, specimen=specimen)
    stability = SimpleNamespace(stiffening=reason == "stiffens")
    assert bring_under_load(state, None, stability) is False


def test_a_specimen_that_nothing_holds_neither_drifts_nor_turns():
    """Forces that balance move no centre of mass and turn nothing; the loads are equal pressures on all sides."""
    seen = []

    class Free(Confinement):
        def stages(self, specimen):
            (stage,) = super().stages(specimen)
            loads = [gl.loads.Pressure(boundary=side, pressure=1 * MPa, ramp=1e-9) for side in specimen.mesh.boundaries]
            return [attrs.evolve(stage, loads=loads)]

        def measure(self, state):
            mass, moved = state.specimen.node_masses, state.positions - state.mesh.nodes
            x, y = (state.mesh.nodes - np.average(state.mesh.nodes, axis=0, weights=mass)).T
            turned = np.sum(mass * (x * moved[:, 1] - y * moved[:, 0])) / np.sum(mass * (x**2 + y**2))
            seen.append((np.abs(moved).max(), *np.average(moved, axis=0, weights=mass), turned))
            return {}

    found = gl.simulate(small_sample(6), BRITTLE, Free())
    assert "without_static_solution" not in found.summary
    largest, x, y, turned = seen[0]
    assert largest > 1e-7
    assert max(abs(x), abs(y), abs(turned) * 20 * mm) < 1e-4 * largest


def test_a_high_stress_all_round_has_a_static_solution():
    """As any other under a linear law, though the loads are at once as high as they get, and follow what deforms."""

    class InSitu(Confinement):
        def stages(self, specimen):
            (stage,) = super().stages(specimen)
            stress = (-150 * MPa, -300 * MPa, 20 * MPa)
            loads = [gl.loads.Traction(boundary=side, stress=stress) for side in specimen.mesh.boundaries]
            return [attrs.evolve(stage, loads=loads)]

    for grains in (6, 60):
        found = gl.simulate(small_sample(grains), Linear(kn=1e14, ks=4e13), InSitu())
        assert "without_static_solution" not in found.summary
        assert found.summary["energy_error"] < 1e-4


@pytest.mark.parametrize("material", [attrs.evolve(ROCK, poissons_ratio=0.0), gl.Rigid(density=3100)])
def test_the_steady_motion_of_a_driven_column_is_that_of_springs_in_series(material):
    """Four grains of the stiffness E / h per area and three contacts of kn: each takes its share of 3 m/s."""
    width, height, speed, kn = 10 * mm, 10 * mm, 3.0, 6e12
    specimen = gl.Specimen(Bricks(rows=4, columns=1).tessellate(rectangle(width, 4 * height)), material)
    state = state_of(specimen, MohrCoulomb(**STRONG | {"kn": kn, "ks": 1e13}))
    drives = [gl.loads.Drive(boundary=name, axis=1, speed=each) for name, each in (("bottom", 0.0), ("top", speed))]
    state.begin(gl.Stage(name="pull", loads=drives, until=[gl.conditions.Reaches("time", 1.0)], interval=1e-6))
    step = StableStep(state)
    field, stiffness = steady_motion(state, step.stiffness(), step.frequency), step.stiffness()
    of_grain = 0.0 if specimen.is_rigid else height / ROCK.youngs_modulus  # m/Pa
    whole = 4 * of_grain + 3 / kn
    grain, y = specimen.mesh.node_grain, specimen.mesh.nodes[:, 1]
    below = np.round(specimen.grains.centroids[:, 1] / height - 0.5)[grain]
    expected = speed * (below / kn + of_grain * (y - y.min()) / height) / whole
    found = state.grains.nodes_at(field)
    assert found[1] == pytest.approx(expected, abs=1e-6 * speed)
    assert np.abs(found[0]).max() < 1e-6 * speed
    assert stiffness_along(state, stiffness, field) == pytest.approx(width * speed**2 / whole, rel=1e-6)
