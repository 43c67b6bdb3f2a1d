"""Grains of compiled materials in the engine: forces, energies, threads, checkpoints, mixtures with elastic ones."""

import attrs
import numpy as np
import pytest
from support import BRITTLE, PULL, ROCK, STIFF, advance, nodal_forces, small_sample, state_of
from test_determinism import assert_same_bits
from toy_materials import ALIKE, CUBIC, YIELDING, each_its_own

import grainlaw as gl
from grainlaw.engine import stepping
from grainlaw.engine.ledger import energies
from grainlaw.engine.parts.material_passes import BLOCK
from grainlaw.laws import Linear

MIXED = {0: ROCK, 1: CUBIC, 2: YIELDING}


def mixed(count=40):
    """Grains of three materials, one of them elastic."""
    grains = small_sample(count).grains
    phase = np.random.default_rng(2).integers(0, 3, count)
    return gl.Specimen(attrs.evolve(grains, phase=phase), MIXED)


@pytest.mark.thorough
def test_a_material_alike_gives_the_same_run():
    one, other = (gl.simulate(small_sample(material=material), BRITTLE, PULL) for material in (ROCK, ALIKE))
    before = np.flatnonzero(one.curves["damaged"] == 0)  # what breaks first depends on the last digit
    assert len(before) > 10
    for name in ("stress", "lateral_strain", "energy_zones"):
        there, here = other.curves[name][before], one.curves[name][before]
        assert there == pytest.approx(here, abs=1e-6 * np.abs(here).max())


def test_forces_are_the_gradient_of_the_energy_without_isotropy():
    """At rotations and strains that are not small; the sum of moments is zero only with the turn of the stress."""
    state = state_of(small_sample(12, material=CUBIC), Linear(**STIFF))
    rng = np.random.default_rng(3)
    place = rng.normal(size=(len(state.mesh.nodes), 2)) * 2e-4

    def stored(displacement):
        forces = nodal_forces(state, displacement)
        state.every_zone.known = None
        pull = 0.5 * (STIFF["kn"] * state.opening**2 + STIFF["ks"] * state.slip**2) @ state.contact_lengths
        return pull + state.zone_state()[1] @ state.mesh.zone_areas, forces

    _, forces = stored(place)
    x, y = state.positions.T
    assert abs((x * forces[:, 1] - y * forces[:, 0]).sum()) < 1e-12 * np.abs(forces).sum() * 0.04
    direction = rng.normal(size=place.shape)
    little = 1e-9
    slope = (stored(place + little * direction)[0] - stored(place - little * direction)[0]) / (2 * little)
    assert slope == pytest.approx(-(forces * direction).sum(), rel=1e-6)


@attrs.frozen(kw_only=True)
class Iterated(type(CUBIC)):
    """With a loop in its stress, as of one that is found step by step."""

    def stress(self, exx, eyy, exy):
        shear = 0.0
        while shear < 2 * self.c44 * abs(exy):
            shear = 2 * self.c44 * abs(exy)
        return self.c11 * exx + self.c12 * eyy, self.c12 * exx + self.c11 * eyy, np.copysign(shear, exy)


@pytest.mark.thorough
def test_a_run_in_a_material_with_a_loop_can_be_interrupted(monkeypatch):
    """Which is where compiled code runs in a thread of its own."""
    apart = []
    monkeypatch.setattr(stepping, "interruptible", lambda do: apart.append(1) or do())
    for kind, count in ((Iterated, 1), (type(CUBIC), 0)):
        state = state_of(small_sample(4, material=kind(**attrs.asdict(CUBIC))), Linear(**STIFF))
        apart.clear()
        advance(state, 3)
        assert len(apart) == count


def test_the_ledger_closes_with_what_the_material_dissipates():
    result = gl.simulate(small_sample(material=YIELDING), Linear(**STIFF), PULL)
    lost = result.curves["energy_zones_dissipated"]
    assert result.summary["energy_error"] < 1e-6
    assert lost[-1] > 1e-5 * result.curves["energy_external"].max()  # ten times what the ledger may miss
    assert np.diff(lost).min() > -1e-9 * lost[-1]


def test_shear_beyond_the_strength_dissipates_strength_times_plastic_strain():
    """One grain sheared: the stress stays at the strength, the rest of the work is lost."""
    specimen = gl.Specimen(small_sample(1).grains, YIELDING)
    state = state_of(specimen, Linear(**STIFF))
    for angle in np.linspace(0, 4e-4, 201):
        nodal_forces(state, np.stack([angle * specimen.mesh.nodes[:, 1], 0 * specimen.mesh.nodes[:, 1]], axis=1))
    state.every_zone.known = None
    stress, stored, lost = state.zone_state()
    yielded = 4e-4 - 1e5 / 24e9  # shear angle
    assert stress[:, 2] == pytest.approx(1e5, rel=1e-3)
    assert stored == pytest.approx((1e5) ** 2 / (2 * 24e9), rel=1e-3)
    assert lost == pytest.approx(1e5 * yielded, rel=1e-3)
    assert state.materials.memory("plastic_strain") == pytest.approx(yielded / 2, rel=1e-3)  # of the tensor


CASES = {
    "cubic": small_sample(material=CUBIC),
    "yielding": small_sample(material=YIELDING),
    "by grain": small_sample(material=each_its_own(YIELDING, "strength", 40)),
    "mixed": mixed(),
    "several blocks": small_sample(420, material=YIELDING, refinement=1),
}


def test_a_case_needs_several_blocks():
    assert len(CASES["several blocks"].mesh.zones) > 2 * BLOCK


@pytest.mark.parametrize("name", CASES)
@pytest.mark.alone
def test_any_number_of_threads(name):
    law, test = BRITTLE, attrs.evolve(PULL, samples=20)
    assert_same_bits(*(gl.simulate(CASES[name], law, test, threads=threads) for threads in (1, 3)))


def test_a_grain_has_its_own_parameter():
    """Zones of each grain yield at the strength of that grain."""
    material = each_its_own(YIELDING, "strength", 40)
    specimen = small_sample(material=material)
    state = state_of(specimen, Linear(kn=1e20, ks=1e20))
    x, y = specimen.mesh.nodes.T
    nodal_forces(state, np.stack([4e-4 * y, 0 * x], axis=1))
    shear = state.every_zone.mean_stress(state.zone_state()[0])[:, 2]
    assert shear == pytest.approx(material.strength, rel=2e-3)


def test_each_material_of_a_mixture_answers_for_its_grains():
    specimen = mixed()
    state = state_of(specimen, Linear(**STIFF))
    x, y = specimen.mesh.nodes.T
    nodal_forces(state, np.stack([2e-4 * x, 1e-4 * y], axis=1))
    stress = state.zone_state()[0]
    phase = specimen.grains.phase[specimen.mesh.zone_grain]
    for number, material in MIXED.items():
        expected = gl.trace_material(material, 2e-4, 1e-4, 0.0).stress[0]
        assert stress[phase == number] == pytest.approx(
            np.tile(expected[:3], (np.sum(phase == number), 1)), rel=1e-3, abs=1
        )


def test_a_restored_state_has_the_memory_of_the_material():
    state = state_of(small_sample(material=YIELDING), Linear(**STIFF))
    x, y = state.mesh.nodes.T
    nodal_forces(state, np.stack([4e-4 * y, 0 * x], axis=1))
    saved, ledger = state.save(), energies(state)
    memory = state.materials.memory("plastic_strain").copy()
    nodal_forces(state, np.stack([-4e-4 * y, 0 * x], axis=1))
    assert not np.allclose(state.materials.memory("plastic_strain"), memory)
    state.restore(saved)
    assert np.array_equal(state.materials.memory("plastic_strain"), memory)
    assert energies(state) == ledger


def test_a_run_goes_on_from_a_checkpoint_with_the_same_bits(tmp_path):
    specimen, stop = small_sample(material=YIELDING), gl.Stop()

    class Stops(gl.Observer):
        def observe(self, state, curves, stage, progress):
            if len(curves["time"]) == 9 and not (tmp_path / "was").exists():
                (tmp_path / "was").touch()
                stop.ask("enough")

    whole = gl.simulate(specimen, Linear(**STIFF), PULL)
    options = {"checkpoint": tmp_path / "run", "observers": [Stops()]}
    with pytest.raises(gl.Stopped):
        gl.simulate(specimen, Linear(**STIFF), PULL, stop=stop, **options)
    again = gl.simulate(specimen, Linear(**STIFF), PULL, restart=True, **options)
    assert whole.curves["energy_zones_dissipated"][-1] > 0
    assert all(np.array_equal(whole.curves[name], again.curves[name], equal_nan=True) for name in whole.curves)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            {"c12": 100e9},
            r"Cubic.stiffness = \[9e\+10, 1e\+11, 0; .*\] Pa .* must be positive definite",
        ),
        ({"c11": np.full(7, 9e10)}, "Cubic: c11 has 7 entries, it must have one for each of the 40 grains"),
        ({"c11": np.array([9e10])}, "Cubic: c11 has 1 entries, it must have one for each of the 40 grains"),
    ],
)
def test_a_bad_stiffness_is_refused(change, message):
    with pytest.raises(gl.ParameterError, match=message):
        gl.simulate(small_sample(material=attrs.evolve(CUBIC, **change)), BRITTLE, PULL)


def test_a_stored_result_knows_its_material(tmp_path):
    from grainlaw.results.archive import called, from_bytes, listed, to_bytes

    result = gl.simulate(small_sample(12, material=CUBIC), BRITTLE, attrs.evolve(PULL, samples=10))
    again = from_bytes(to_bytes(result)).specimen
    assert (called(again.material), listed(again.material)["c44"]) == ("Cubic", 5e9)
    assert np.array_equal(again.node_masses, result.specimen.node_masses)
    assert np.array_equal(again.zone_stiffness, result.specimen.zone_stiffness)
