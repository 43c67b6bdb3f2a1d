"""The energy balance and the measures of distance from rest, of numbers that are given."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

import grainlaw as gl
from grainlaw.columns import DISSIPATED, KINETIC, LOST, SUPPLIED
from grainlaw.engine.ledger import energies, least_work, motion, unbalanced
from grainlaw.engine.parts.gravity import Weight


def state(**changed):
    """Of two nodes, of which the second is driven along x; 0.2 s are a step."""
    arrays = SimpleNamespace(
        mass=np.array([[2.0, 3.0], [2.0, 3.0]]), force=np.array([[1.0, 2.0], [-3.0, 4.0]]),
        velocity=np.array([[10.0, 20.0], [30.0, 40.0]]), free=np.array([[1.0, 0.0], [1.0, 1.0]]),
    )  # fmt: skip
    driven = SimpleNamespace(reaction=np.array([5.0]), row=np.array([0]), place=np.array([1]))
    parts = {
        "weight": SimpleNamespace(energy=lambda time_step: {SUPPLIED: 1000 * time_step}),
        "damping": SimpleNamespace(energy=lambda time_step: {LOST: 7.0, SUPPLIED: 1.0}),
        "kinks": SimpleNamespace(energy=lambda time_step: {DISSIPATED: 0.5}),
    }
    given = {
        "freedoms": SimpleNamespace(arrays=arrays), "drives": SimpleNamespace(arrays=driven), "parts": parts,
        "time_step": 0.2, "kinetic_energy": 2500.0, "every_zone": SimpleNamespace(areas=np.array([3.0, 5.0])),
        "zone_state": lambda: (None, np.array([2.0, 4.0]), np.array([1.0, 2.0])), "time": 9.0, "began": 4.0,
        "specimen": SimpleNamespace(zone_stiffness=np.full((2, 3, 3), 1e6)),
        "imposed": SimpleNamespace(lasts=5.0, speeds=np.array([0.1, -0.4])), "steady": SimpleNamespace(pace=2.0),
        "mesh": SimpleNamespace(nodes=np.array([(1.0, 1.0), (4.0, 5.0)]), tied=np.zeros(0, dtype=int)),
        "nodes": SimpleNamespace(arrays=SimpleNamespace(force=np.array([(3.0, 9.0, -5.0), (4.0, 9.0, 12.0)]))),
        "gravity": SimpleNamespace(arrays=SimpleNamespace(weight=np.zeros((2, 2)))),
        "normal": np.zeros(0), "shear": np.zeros(0), "contact_lengths": np.zeros(0),
        "contacts": SimpleNamespace(arrays=SimpleNamespace(length=np.zeros(0), normal=np.zeros(0), shear=np.zeros(0))),
        "fluids": SimpleNamespace(forces=np.zeros(0)),
    }  # fmt: skip
    return SimpleNamespace(**given | changed)


def test_half_a_step_of_power_is_subtracted():
    """The drive gives 5 N * 20 m/s; with 1*10 + 2*20 - 3*30 + 4*40 W of the other forces, 220 W for 0.1 s."""
    found = energies(state())
    assert found[SUPPLIED] == pytest.approx(1000 * 0.2 + 1 - 0.1 * 100)
    assert found[KINETIC] == pytest.approx(2500 - 0.1 * 220)
    assert found["zones"] == pytest.approx(2 * 3 + 4 * 5)
    assert found[DISSIPATED] == pytest.approx(0.5 + 1 * 3 + 2 * 5)
    assert found[LOST] == 7.0


def test_a_run_is_judged_by_the_work_of_its_drives_or_by_rounding():
    assert least_work(state()) == pytest.approx(0.5 * 5.0 * (2 * 0.4) ** 2)
    weight = np.array([[0.0, 0.0], [-2e9, -3e9]])  # over a size of 5 m
    heavy = state(gravity=SimpleNamespace(arrays=SimpleNamespace(weight=weight)))
    assert least_work(heavy) == pytest.approx(1e-9 * 5 * 5e9)
    stiff = state(specimen=SimpleNamespace(zone_stiffness=np.full((2, 3, 3), 1e20)))  # of 3 and 5 m2
    assert least_work(stiff) == pytest.approx(1e-18 * 8e20)


def test_the_unbalanced_force_is_over_the_mean_of_all_that_act():
    """Of the three free translations 1, -3 and 4 N."""
    assert unbalanced(state()) == pytest.approx(8 / 3 / 5)  # of the reaction alone
    bonded = {"normal": np.array([3.0, 0.0]), "shear": np.array([4.0, -2.0]), "contact_lengths": np.array([2.0, 0.5])}
    assert unbalanced(state(**bonded)) == pytest.approx(8 / 3 / ((10 + 1) / 2))
    pressed = SimpleNamespace(
        length=np.array([0.0, 0.5, 1.0]), normal=np.array([-99.0, -12.0, 7.0]), shear=np.array([99.0, 5.0, -6.0])
    )
    loose = {"contacts": SimpleNamespace(arrays=pressed), "fluids": SimpleNamespace(forces=np.array([-4.5]))}
    assert unbalanced(state(**bonded, **loose)) == pytest.approx(8 / 3 / ((10 + 1 + 6.5 + 6 + 4.5) / 5))
    tied = state(mesh=SimpleNamespace(tied=np.array([0, 2])))  # 5 and 13 N
    assert unbalanced(tied) == pytest.approx(8 / 3 / 9)
    still = state()
    still.freedoms.arrays.free[:] = 0
    assert unbalanced(still) == 0
    assert unbalanced(state(drives=SimpleNamespace(arrays=SimpleNamespace(reaction=np.zeros(1))))) == 1


def test_motion_is_kinetic_over_stored_energy_without_a_drift_as_a_whole():
    """Nothing is driven along y: there 2 * 30 + 3 * 40 N s are a drift of 180^2 / 2 / 5 J."""
    stored = {"zones": 30.0, "contacts_normal": 50.0, "contacts_shear": 20.0}
    drift = 180**2 / 10
    assert motion(state(kinetic_energy=drift + 4), stored) == pytest.approx(0.2)
    assert motion(state(kinetic_energy=drift - 4), stored) == 0
    assert motion(state(kinetic_energy=drift + 400), stored) == 1
    assert motion(state(kinetic_energy=drift + 4), dict.fromkeys(stored, 0.0)) == 1
    assert motion(state(kinetic_energy=drift), dict.fromkeys(stored, 0.0)) == 0
    assert motion(state(kinetic_energy=drift, time=8.9), stored) == 1  # a load still changes
    along_y = SimpleNamespace(arrays=SimpleNamespace(row=np.array([1])))
    drift = (2 * 10 + 3 * 20) ** 2 / 10
    assert motion(state(kinetic_energy=drift + 9, drives=along_y), stored) == pytest.approx(math.sqrt(0.09))


class Moved:
    """Freedoms that were 0.5 m back when the last forces were found."""

    def __init__(self):
        self.arrays = SimpleNamespace(mass=np.ones((3, 2)), displacement=np.full((3, 2), 2.0), earlier=np.zeros((3, 2)))

    def displacement_at_forces(self, time_step):
        return self.arrays.displacement - time_step


def test_the_weight_works_on_the_way_between_forces_and_half_of_it_when_it_changes():
    """Masses of 2 and 3 kg fall by 1 m, then by 4 m with a weight that is raised in between by half of itself."""
    freedoms = Moved()
    weight = Weight(freedoms, np.array([2.0, 3.0]))
    stage = SimpleNamespace(of=lambda kind: [gl.loads.Gravity(acceleration=(0.0, -10.0))])
    weight.begin(stage, SimpleNamespace(time_step=0.5))
    assert freedoms.arrays.earlier.tolist() == [[0, 0], [-20, -30], [0, 0]]
    assert weight.energy(0.5) == {"external": 0.0}
    freedoms.arrays.displacement[1] -= 1
    assert weight.energy(0.5)["external"] == pytest.approx(50)
    weight.raise_to(1.5 * weight.arrays.weight, 0.5)
    # until the forces 50 J; the new weight of 75 N did half of the last 0.5 m, which go up, instead of the old one
    assert weight.energy(0.5)["external"] == pytest.approx(50 + 0.5 * 25 * 0.5)
    freedoms.arrays.displacement[1] -= 4
    assert weight.energy(0.5)["external"] == pytest.approx(50 + 0.5 * 25 * 0.5 + 75 * 4)
    weight.begin(stage, SimpleNamespace(time_step=0.5))
    assert freedoms.arrays.earlier[1].tolist() == [-20 + 10, -30 + 15]
    assert weight.energy(0.5) == {"external": 0.0}
