"""Laws and materials that name scalars of the step, and laws that are made of another law."""

import attrs
import numpy as np
import pytest
from support import advance, small_sample, state_of

import grainlaw as gl
from grainlaw.compiler.batch import compile_law
from grainlaw.laws import Linear, MohrCoulomb
from grainlaw.memory import names_of_arguments, only_memory

SOFT = Linear(kn=1e12, ks=5e11)
BRITTLE = MohrCoulomb(kn=1e12, ks=5e11, tensile_strength=1e6, cohesion=2e6, friction_angle=30.0)


@attrs.frozen(kw_only=True)
class Dashpot(gl.ContactLaw):
    """A spring beside a dashpot; and how long it has been there."""

    law: gl.ContactLaw
    viscosity: float = gl.parameter("Pa s/m")
    stiffness = property(lambda self: self.law.stiffness)

    def traction(self, opening, slip, time_step, before, age, *law):
        answer = self.law.traction(opening, slip, *law)
        rate = (opening - before) / time_step if time_step > 0 else 0.0
        return (answer[0] + self.viscosity * rate, answer[1], opening, age + time_step, *answer[2:])


@attrs.frozen(kw_only=True)
class Watching(gl.ContactLaw):
    """A law that reads the damage of another."""

    law: gl.ContactLaw
    stiffness = property(lambda self: self.law.stiffness)

    def traction(self, opening, slip, seen, damage, *law):
        answer = self.law.traction(opening, slip, *law)
        return (answer[0], answer[1], damage, *answer[2:])


def test_names_of_a_law_within_a_law():
    names = names_of_arguments(Dashpot(law=BRITTLE, viscosity=1.0), "traction", "opening and slip", 2)
    inner = ("damage", "mode", "plastic_slip", "dilation")
    assert names == ("time_step", "before", "age", *inner)
    assert only_memory(names) == names[1:]
    watching = names_of_arguments(Watching(law=BRITTLE), "traction", "opening and slip", 2)
    assert watching == ("seen", "damage", *inner)
    assert only_memory(watching) == ("seen", *inner)


@pytest.mark.parametrize("compiled", [False, True])
def test_a_dashpot_by_hand(compiled):
    law = Dashpot(law=SOFT, viscosity=2.0)
    found = gl.trace(law, [0.0, 1e-6, 4e-6], 0.0, time_step=1e-3, compiled=compiled)
    assert found.normal == pytest.approx([0.0, 1e6 + 2.0 * 1e-3, 4e6 + 2.0 * 3e-3], rel=1e-12)
    assert found.age == pytest.approx([1e-3, 2e-3, 3e-3])


def test_no_time_passes_unless_a_step_is_done():
    found = gl.trace(Dashpot(law=SOFT, viscosity=1e9), [0.0, 1e-6], 0.0)
    assert found.normal.tolist() == [0.0, 1e6]
    assert found.age.tolist() == [0.0, 0.0]


def test_a_modified_law_is_the_law_beside_what_is_added():
    path = np.array([0.0, 5e-7, 2e-6, 1e-6, -1e-6]), np.array([0.0, 1e-6, 2e-6, 3e-6, 8e-6])
    alone, both = (gl.trace(law, *path, compiled=True) for law in (BRITTLE, Watching(law=BRITTLE)))
    for name in ("normal", "shear", "damage", "mode", "plastic_slip"):
        assert np.array_equal(getattr(alone, name), getattr(both, name))
    assert both.seen.tolist() == [0.0, *alone.damage[:-1]]


def test_a_law_without_a_part_of_that_name_is_refused():
    @attrs.frozen(kw_only=True)
    class Wrong(gl.ContactLaw):
        stiffness = (1.0, 1.0)

        def traction(self, opening, slip, *memory):
            return opening, slip, *memory

    with pytest.raises(gl.ParameterError, match=r"\*memory is not allowed"):
        compile_law(Wrong())


def test_a_run_tells_its_time_step():
    state = state_of(small_sample(12), Dashpot(law=SOFT, viscosity=1e3))
    advance(state, 7, time_step=1e-9)
    assert state.memory("age") == pytest.approx(np.full(len(state.opening), 7e-9), rel=1e-9)
    assert not any(group.compiled.numbers[-1] for group in state.bonds.groups)  # between steps no time passes


def test_a_material_that_names_the_time_step():
    @attrs.frozen(kw_only=True)
    class Ageing(gl.Material):
        density: float = gl.parameter("kg/m3")
        modulus: float = gl.parameter("Pa")
        stiffness = property(lambda self: ((self.modulus, 0, 0), (0, self.modulus, 0), (0, 0, self.modulus)))

        def stress(self, exx, eyy, exy, time_step, age):
            return self.modulus * exx, self.modulus * eyy, 2 * self.modulus * exy, age + time_step

        def energy(self, exx, eyy, exy, age):
            return 0.5 * self.modulus * (exx * exx + eyy * eyy + 4 * exy * exy)

    state = state_of(small_sample(12, material=Ageing(density=2600.0, modulus=1e10)), SOFT)
    advance(state, 5, time_step=1e-9)
    assert state.materials.memory("age") == pytest.approx(np.full(len(state.mesh.zones), 5e-9), rel=1e-9)


@pytest.mark.parametrize("name", ["temperature", "ezz"])
def test_a_law_that_names_what_only_materials_get_is_refused(name):
    @attrs.frozen(kw_only=True)
    class Warm(gl.ContactLaw):
        stiffness = (1.0, 1.0)

    @attrs.frozen(kw_only=True)
    class Hot(Warm):
        def traction(self, opening, slip, temperature):
            return opening * temperature, slip

    @attrs.frozen(kw_only=True)
    class Thick(Warm):
        def traction(self, opening, slip, ezz):
            return opening + ezz, slip

    law = Hot() if name == "temperature" else Thick()
    within = Dashpot(law=law, viscosity=1.0)
    for wrong in (law, within):
        with pytest.raises(gl.ParameterError, match=rf"traction: the argument {name} is not allowed.*gets time_step"):
            state_of(small_sample(12), wrong)


def test_an_energy_that_names_the_time_step_is_refused():
    @attrs.frozen(kw_only=True)
    class Slow(gl.Elastic):
        def energy(self, exx, eyy, exy, ezz, time_step):
            return 0.0 * time_step

    slow = Slow(youngs_modulus=1e10, poissons_ratio=0.2, density=2600.0)
    with pytest.raises(
        gl.ParameterError, match=r"Slow\.energy: the argument time_step is not allowed.*temperature and"
    ):
        state_of(small_sample(12, material=slow), SOFT)
