"""Phases with names, cells of one grain and joints: which law is between two grains, and what tells cracks apart."""

import re

import attrs
import numpy as np
import pytest
from support import BRITTLE, ROCK, STRONG

import grainlaw as gl
from grainlaw.contact import law_between
from grainlaw.engine.model import laws_of_bonds
from grainlaw.geometry import Bricks, moved, rectangle, together
from grainlaw.laws import Linear, MohrCoulomb, WeibullField
from grainlaw.protocols import UniaxialTension
from grainlaw.tessellation import TilingError

A, B, C, D, E = (Linear(kn=k * 1e13, ks=1e13) for k in range(1, 6))
LAWS = {
    "bedding": A, ("inside", "quartz"): B, "inside": C, ("quartz", "mica"): D, ("mica", ...): E, ...: BRITTLE,
}  # fmt: skip
Q, M, F = (0, "quartz"), (1, "mica"), (2, "feldspar")


@pytest.mark.parametrize(
    ("one", "other", "kind", "law"),
    [
        (Q, M, "bedding", A), (Q, Q, "inside", B), (M, M, "inside", C), (Q, M, "between", D), (M, Q, "between", D),
        (M, F, "between", E), (M, M, "between", E), (F, F, "between", BRITTLE), (Q, F, "other joint", BRITTLE),
    ],
)  # fmt: skip
def test_the_law_is_that_of_the_most_special_key(one, other, kind, law):
    assert law_between(LAWS, one, other, kind) is law


def wall(phase, parent=None, names=("quartz", "mica", "feldspar"), joints=None):
    """Four bricks above each other."""
    made = Bricks(rows=4, columns=1).tessellate(rectangle(0.02, 0.04))
    return attrs.evolve(
        made, phase=np.array(phase), phase_names=names, parent=np.arange(4) if parent is None else np.array(parent),
        joints=joints or {},
    )  # fmt: skip


def laws_between(grains, laws):
    """The law of each bond from below."""
    specimen = gl.Specimen(grains, ROCK)
    order, sizes = laws_of_bonds(specimen, laws)
    each = [law for law, size in sizes for _ in range(size)]
    found = dict(zip(order.tolist(), each, strict=True))
    return [found[k] for k in range(len(order))]


def test_bonds_follow_phases_cells_and_joints():
    edges = wall([0, 0, 0, 1]).edges
    joint = np.column_stack([edges.start, edges.end])[edges.right == 1]
    grains = wall([0, 0, 0, 1], parent=[0, 1, 1, 2], joints={"bedding": joint})
    assert grains.is_breakable
    assert [law.kn if isinstance(law, Linear) else law for law in laws_between(grains, LAWS)] == [1e13, 2e13, 4e13]


@pytest.mark.parametrize(
    ("laws", "says"),
    [
        ({("quartz", ...): A, ("mica", ...): B}, "('quartz', ...) and ('mica', ...) are both for contacts of"),
        ({("mica", "quartz"): A, ("quartz", "mica"): B}, "('quartz', 'mica') and ('mica', 'quartz') are both for"),
        ({("quartz", 1): A, (0, "mica"): B}, "are both for contacts of ('quartz', 'mica')"),
        ({("mica", "mica"): A, (1, 1): B}, "(1, 1) and ('mica', 'mica') are both for contacts of 'mica'"),
    ],
)  # fmt: skip
def test_two_keys_of_one_rank_are_refused_where_a_contact_has_both(laws, says):
    laws = {("quartz", "quartz"): C, **laws, ...: BRITTLE}
    with pytest.raises(gl.ParameterError, match=re.escape(says)):
        laws_between(wall([0, 0, 1, 1]), laws)
    assert laws_between(wall([0, 0, 2, 2]), laws)[0] is C  # which has none


def test_cuts_beside_joints_say_how_they_become_whole():
    edges = wall([0, 0, 0, 0], names=()).edges
    joint = np.column_stack([edges.start, edges.end])[edges.right == 1]
    words = r"phases 0 and 0; give one .* beside joints .* tie them by .*tied=\['between'\]"
    with pytest.raises(gl.ParameterError, match=words):
        laws_between(wall([0, 0, 0, 0], names=(), joints={"bedding": joint}), {"bedding": A})


def test_phases_by_number_and_by_name_are_the_same():
    by_name = {("quartz", "quartz"): A, ("quartz", "mica"): B}
    by_number = {(0, 0): A, (1, 0): B}
    assert laws_between(wall([0, 0, 0, 1]), by_name) == laws_between(wall([0, 0, 0, 1]), by_number) == [A, A, B]


@pytest.mark.thorough
def test_a_specimen_of_one_mineral_is_the_one_without_minerals():
    pull = UniaxialTension(samples=20, maximum_strain=5e-4)
    plain = gl.simulate(gl.Specimen(Bricks(rows=4, columns=2).tessellate(rectangle(0.02, 0.04)), ROCK), BRITTLE, pull)
    grains = attrs.evolve(plain.specimen.grains, phase_names=("quartz",))
    named = gl.simulate(gl.Specimen(grains, {"quartz": ROCK}), {("quartz", ...): BRITTLE}, pull)
    assert all(np.array_equal(named.curves[name], row) for name, row in plain.curves.items())


@pytest.mark.parametrize(
    ("laws", "words"),
    [
        (
            {("quartz", "mika"): A, ...: A},
            r"\('quartz', 'mika'\) names what the grains do not have; did you mean 'mica'",
        ),
        ({"joint": A, ...: A}, "'joint' names what the grains do not have.*joints: none"),
        ({("quartz", "quartz"): A}, "no law is given for contacts between the phases quartz and mica"),
        ({1.5: A}, "the key 1.5 is not allowed, it must be a pair of phases"),
        ({("quartz", "mica", "inside"): A}, "the key .* is not allowed"),
    ],
)
def test_laws_that_do_not_fit_are_refused(laws, words):
    with pytest.raises(gl.ParameterError, match=words):
        laws_between(wall([0, 0, 0, 1]), laws)


@pytest.mark.parametrize(
    ("laws", "words"),
    [
        ({"inside": B, "bedding": A}, "the phases quartz and mica$"),
        ({"inside": B, "between": A}, r"the phases quartz and quartz \(bedding\)$"),
        ({"bedding": B, "between": A}, r"the phases quartz and quartz \(inside\)$"),
    ],
)
def test_a_bond_without_a_law_is_told_by_its_phases_and_its_kind(laws, words):
    edges = wall([0, 0, 0, 1]).edges
    joint = np.column_stack([edges.start, edges.end])[edges.right == 1]
    grains = wall([0, 0, 0, 1], parent=[0, 1, 1, 2], joints={"bedding": joint})
    with pytest.raises(gl.ParameterError, match=words):
        laws_between(grains, laws)


def test_materials_by_name_and_for_all_others():
    stiff = attrs.evolve(ROCK, youngs_modulus=120e9)
    grains = wall([0, 1, 2, 2])
    specimen = gl.Specimen(grains, {"mica": stiff, ...: ROCK})
    assert [specimen.material_of(k) for k in range(3)] == [ROCK, stiff, ROCK]
    for material, words in (
        ({"mika": ROCK, ...: ROCK}, "there is no phase 'mika' .phases: quartz, mica, feldspar."),
        ({"mica": ROCK}, "no entry for the phases quartz, feldspar"),
    ):
        with pytest.raises(gl.ParameterError, match=words):
            gl.Specimen(grains, material)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"phase_names": ("a", "a")}, "phase_names = .* is not allowed"),
        ({"phase_names": ("inside",)}, "none of them between or inside"),
        ({"phase_names": ("quartz",)}, "phase must be numbers of the 1 phase_names"),
        ({"parent": np.arange(3)}, "parent has the shape"),
        ({"joints": {"inside": np.zeros((1, 2), int)}}, "joints = .* is not allowed"),
    ],
)
def test_bad_names_are_refused(change, words):
    with pytest.raises(ValueError, match=words):
        attrs.evolve(wall([0, 0, 0, 1]), **change)


def test_bodies_together_keep_names_grains_and_joints():
    edges = wall([0, 0, 0, 1]).edges
    joint = np.column_stack([edges.start, edges.end])[edges.right == 2]
    lower = wall([0, 0, 0, 1], parent=[0, 0, 0, 1], names=("quartz", "mica"), joints={"bedding": joint})
    upper = wall([1, 1, 1, 0], names=("mica", "steel"))
    both = together(lower, moved(upper, by=(9, 0)))
    assert [both.phase_name(k) for k in both.phase] == ["quartz"] * 3 + ["mica"] + ["steel"] * 3 + ["mica"]
    assert both.parent.tolist() == [0, 0, 0, 1, 2, 3, 4, 5]
    assert np.array_equal(both.joints["bedding"], joint)


def test_cracks_inside_a_grain_are_told_from_those_between(tmp_path):
    """The joint in the middle is inside a grain and the weakest."""
    grains = wall([0, 0, 0, 0], parent=[0, 1, 1, 2])
    weak = MohrCoulomb(**STRONG | {"tensile_strength": 5e6})
    result = gl.simulate(
        gl.Specimen(grains, ROCK), {"inside": weak, ...: BRITTLE}, UniaxialTension(samples=50, maximum_strain=1e-3)
    )
    assert result.cracks.inside.tolist() == [True, True]
    assert result.summary["transgranular_cracks"] == 2
    result.save(tmp_path / "r.npz")
    again = gl.Result.load(tmp_path / "r.npz")
    assert again.specimen.grains.parent.tolist() == [0, 1, 1, 2]
    assert again.specimen.grains.phase_names == grains.phase_names
    assert list(again.law) == ["inside", ...]
    assert np.array_equal(again.cracks.inside, result.cracks.inside)


def test_scattered_strength_follows_the_keys():
    """Each bond has the factor of its interface, whatever key its law has."""
    edges = wall([0, 0, 0, 1]).edges
    joint = np.column_stack([edges.start, edges.end])[edges.right == 1]
    grains = wall([0, 0, 0, 1], parent=[0, 1, 1, 2], joints={"bedding": joint})
    specimen, field = gl.Specimen(grains, ROCK), WeibullField(modulus=4, seed=2)
    laws = field.scatter({"bedding": BRITTLE, ("inside", "quartz"): BRITTLE, ("mica", ...): BRITTLE}, specimen)
    found = [law.tensile_strength for law in laws.values()]
    assert [row.tolist() for row in found] == [[13e6 * f] * 2 for f in field.factors(specimen)]


def test_a_specimen_checks_its_grains_and_their_density():
    """Of two bricks one has a corner within the other; a material that says no density."""
    sound = Bricks(rows=1, columns=2).tessellate(rectangle(2, 1))
    assert gl.Specimen(sound, ROCK).grains is sound
    elsewhere = sound.vertices + 0.2 * (np.arange(len(sound.vertices)) == sound.corners[1])[:, None]
    with pytest.raises(TilingError):
        gl.Specimen(attrs.evolve(sound, vertices=elsewhere), ROCK)
    light = type(
        "Light", (gl.Material,), {name: getattr(gl.Elastic, name) for name in ("stiffness", "stress", "energy")}
    )
    with pytest.raises(gl.ParameterError, match="Light has no density; declare one: density: float"):
        gl.Specimen(sound, light())
