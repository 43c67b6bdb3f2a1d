"""Minerals, breakable grains, rocks and laws by name from a configuration."""

import tomllib

import numpy as np
import pytest

import grainlaw as gl
from grainlaw.cli.configuration import configured
from grainlaw.cli.minerals import materials
from grainlaw.cli.sections import toml
from grainlaw.laws import Friction, Linear

TEXT = """
[sample]
width = "20 mm"
height = "40 mm"
grains = 150
seed = 3
minerals = {quartz = "31 %", K-feldspar = 0.43, mica = 0.26}
clustering = 1.3
breakable = {type = "trigons", count = 5}
[rock]
youngs_modulus = "70 GPa"
[rocks]
quartz = {youngs_modulus = "95 GPa"}
mica = {poissons_ratio = 0.3}
[law]
type = "mohr-coulomb"
[laws]
inside = {tensile_strength = "20 MPa"}
"inside/mica" = {tensile_strength = "5 MPa"}
"quartz/*" = {cohesion = "20 MPa"}
"mica/K-feldspar" = {type = "linear", kn = 1e14, ks = 1e14}
"""


def made(text=TEXT, **changes):
    sections = tomllib.loads(text)
    for path, value in changes.items():
        section, _, key = path.partition("__")
        sections[section] = sections.get(section, {}) | {key: value} if key else value
    return configured("uniaxial-tension", sections)


def test_minerals_rocks_and_laws():
    chosen = made()
    grains, specimen = chosen.specimen.grains, chosen.specimen
    assert grains.phase_names == ("quartz", "K-feldspar", "mica")
    shares = np.bincount(grains.phase, grains.areas) / grains.areas.sum()
    assert shares == pytest.approx([0.31, 0.43, 0.26], abs=1e-3)
    assert len(np.unique(grains.parent)) == 150
    assert grains.count > 500
    assert [specimen.material_of(k).youngs_modulus for k in range(3)] == [95e9, 70e9, 70e9]
    assert [specimen.material_of(k).poissons_ratio for k in range(3)] == [0.25, 0.25, 0.3]
    laws = chosen.law
    assert list(laws) == ["inside", ("inside", "mica"), ("quartz", ...), ("mica", "K-feldspar"), ...]
    assert [laws[k].tensile_strength for k in ("inside", ("inside", "mica"), ("quartz", ...))] == [20e6, 5e6, 13e6]
    assert (laws["quartz", ...].cohesion, laws[...].cohesion) == (20e6, 29e6)
    assert laws["mica", "K-feldspar"] == Linear(kn=1e14, ks=1e14)


def test_a_mineral_names_its_kind_where_that_of_the_rock_is_another():
    rock = gl.Elastic(youngs_modulus=60e9, poissons_ratio=0.2, density=2700)
    across = {"youngs_modulus": 6e10, "poissons_ratio": 0.2, "density": 2700, "youngs_modulus_across": 3e10}
    across |= {"poissons_ratio_across": 0.2, "shear_modulus_across": 1e10}
    given = {"quartz": {"youngs_modulus": 9e10}, "mica": {"type": "transversely-isotropic", **across}}
    found, section = materials(rock, given)
    assert (found["quartz"].youngs_modulus, found["quartz"].density, found[...]) == (9e10, 2700, rock)
    assert "type" not in section["quartz"]
    assert section["mica"]["type"] == "transversely-isotropic"
    assert materials(rock, {}) == (rock, {})


def test_minerals_that_are_whole_need_no_rock():
    """As in a test of heating, whose rock has an expansion that only the user can give."""
    expands = {"type": "thermal", "material": {"type": "elastic", "youngs_modulus": 9e10, "poissons_ratio": 0.1,
               "density": 2650}}  # fmt: skip
    rocks = {"quartz": expands | {"expansion": 1e-5}, "mica": expands | {"expansion": 2e-5}}
    given = {"sample": {"grains": 20, "minerals": {"quartz": 0.5, "mica": 0.5}}, "rocks": rocks, "test": {"to": 100}}
    found = configured("heating", given).specimen
    assert [found.material_of(k).expansion.coefficient for k in range(2)] == [1e-5, 2e-5]
    assert found.material[...] == found.material_of(0)
    with pytest.raises(gl.ParameterError, match=r"rock\.expansion \(1/K\) is missing"):
        configured("heating", given | {"rocks": {"quartz": rocks["quartz"]}})


def test_the_sections_make_the_same_again():
    first = made()
    again = configured("uniaxial-tension", tomllib.loads(toml(first.sections)))
    assert again.sections == first.sections
    assert np.array_equal(again.specimen.grains.phase, first.specimen.grains.phase)
    assert np.array_equal(again.specimen.grains.vertices, first.specimen.grains.vertices)
    assert again.law == first.law
    assert "laws" not in configured("uniaxial-tension", {}).sections


CRACKS = {"type": "friction", "kn": 1e14, "ks": 1e14, "friction_angle": 30}


@pytest.mark.thorough
def test_a_share_of_contacts_is_cracked_by_the_seed_of_the_sample():
    chosen = made(**{"sample__cracks": "20 %", "laws__initial cracks": CRACKS})
    edges, kinds = chosen.specimen.grains.edges, chosen.specimen.grains.kinds
    drawn = edges.kind == kinds.index("initial cracks")
    may = drawn | ((edges.kind == 0) & (edges.right >= 0))
    assert edges.length[drawn].sum() / edges.length[may].sum() == pytest.approx(0.2, abs=0.02)
    assert chosen.law["initial cracks"] == Friction(kn=1e14, ks=1e14, friction_angle=30)
    again = configured("uniaxial-tension", tomllib.loads(toml(chosen.sections)))
    assert again.sections == chosen.sections
    ends, same = (each.specimen.grains.joints["initial cracks"] for each in (chosen, again))
    assert np.array_equal(ends, same)
    table = {"share": 0.5, "between": ["mica/quartz"], "direction": "90 deg", "within": 45, "least": 0.1}
    some = made(**{"sample__cracks": table, "laws__initial cracks": CRACKS})
    assert some.sections["sample"]["cracks"] == {**table, "direction": 90}
    assert 0 < len(some.specimen.grains.joints["initial cracks"]) < drawn.sum()
    other = made(toml({"sample": chosen.sections["sample"]}), **{"sample__seed": 99, "laws__initial cracks": CRACKS})
    assert not np.array_equal(other.specimen.grains.joints["initial cracks"], ends)


@pytest.mark.parametrize(
    "given", [{"type": "voronoi", "size": "2 mm"}, {"size": "2 mm"}, {"type": "trigons", "size": "2 mm"}]
)
def test_cells_have_a_size_in_place_of_a_count(given):
    chosen = made("", sample__grains=12, sample__width="20 mm", sample__height="20 mm", sample__breakable=given)
    cells = chosen.sections["sample"]["breakable"]
    assert (cells["type"], "count" in cells) == (given.get("type", "voronoi"), False)
    assert chosen.specimen.grains.count == pytest.approx(100, rel=0.35)
    assert made("", **{f"sample__{k}": v for k, v in chosen.sections["sample"].items()}).sections == chosen.sections


def test_bricks_have_minerals_too():
    chosen = made(
        "", sample__tessellator="bricks", sample__rows=4, sample__columns=5, sample__width=1.0, sample__height=1.0,
        sample__minerals={"a": 0.5, "b": 0.5}, sample__seed=2,
    )  # fmt: skip
    assert np.bincount(chosen.specimen.grains.phase).tolist() == [10, 10]
    other = made(toml({"sample": chosen.sections["sample"]}), sample__seed=3)
    assert not np.array_equal(other.specimen.grains.phase, chosen.specimen.grains.phase)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"sample__minerals": {"quartz": 0.5}}, "fractions sum to 0.5, they must sum to 1"),
        ({"sample__minerals": "granite"}, "sample.minerals = 'granite' is not allowed, it must be a table"),
        ({"sample__minerals": {"quartz": "5 mm"}}, "sample.minerals.quartz"),
        ({"sample__breakable": {"type": "trigon"}}, "sample.breakable: there is no 'trigon'; did you mean 'trigons'"),
        ({"sample__breakable": {"type": "cleavage"}}, r"sample.breakable.spacing \(m\) is missing"),
        ({"sample__tessellator": "minerals"}, "sample.tessellator: there is no 'minerals'"),
        ({"rocks__mika": {"youngs_modulus": 1e10}}, "there is no phase 'mika'"),
        ({"rocks__mica": 3}, "rocks.mica = 3 is not allowed, it must be a table"),
        ({"rocks__mica": {"young": 3}}, "there is no 'rocks.mica.young'"),
        ({"rock": {"type": "rigid", "density": 2700}}, "rocks is not allowed: rock is rigid"),
        ({"sample__cracks": 0.1}, r"sample.cracks needs a law of its own in \[laws\]"),
        ({"sample__cracks": {"between": ["a/b"]}}, "sample.cracks.share is missing"),
        ({"sample__cracks": {"share": 0.1, "part": 1}}, "there is no 'sample.cracks.part'"),
        ({"sample__cracks": {"share": 0.1, "between": "mica/quartz"}}, "sample.cracks.between = 'mica/quartz' is not"),
        ({"sample__cracks": {"share": 0.1, "between": ["mica"]}}, r"sample.cracks.between = \['mica'\] is not"),
        ({"sample__cracks": {"share": 0.1, "between": [3]}}, r"sample.cracks.between = \[3\] is not"),
        ({"sample__cracks": {"share": 0.1, "between": 3}}, "sample.cracks.between = 3 is not"),
        ({"sample__tied": 3}, "sample.tied = 3 is not allowed, it must be a list of kinds"),
        ({"sample__slits": 3}, "sample.slits = 3 is not allowed, it must be a list of names"),
        ({"sample__cracks": "10 mm"}, "sample.cracks.share = '10 mm' is not allowed"),
        ({"laws__insight": {"cohesion": 25e6}}, "'insight' names what the grains do not have"),
        ({"laws__quartz/mika": {"cohesion": 25e6}}, r"\('quartz', 'mika'\) names what the grains do not have"),
        ({"laws__a/b/c": {"cohesion": 25e6}}, "the key 'a/b/c' is not allowed"),
        ({"laws__mica/...": {"cohesion": 25e6}}, r"the key 'mica/\.\.\.' is not allowed, .* quartz/\*"),
        ({"laws__inside": {"cohesive": 1e6}}, "there is no 'laws.inside.cohesive'"),
        ({"laws__inside": {"type": "my.py:LAW"}}, "a law of a file must be that of law.type"),
    ],
)
def test_what_is_refused(changes, words):
    with pytest.raises(gl.ParameterError, match=words):
        made(**changes)


def test_clustering_needs_minerals():
    with pytest.raises(gl.ParameterError, match=r"sample\.clustering is of the minerals of a sample, which has none"):
        configured("uniaxial-tension", {"sample": {"clustering": 1.2}})
