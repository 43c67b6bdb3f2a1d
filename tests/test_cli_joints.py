"""Joints from a configuration: sets of parallel ones, traces of a network, laws by their names."""

import tomllib

import numpy as np
import pytest

from grainlaw.cli.configuration import configured
from grainlaw.cli.sections import toml
from grainlaw.fields import ParameterError
from grainlaw.geometry import Jointed, JointSet, JointSets, Minerals, Voronoi, rectangle, texture

SETS = """
[sample]
width = 10.0
height = 20.0
tessellator = "joint-sets"
sets = [{dip = -35, spacing = "2 m", name = "bedding"}, {dip = "55 deg", spacing = 3, through = ["50 cm", 0]}]
[law]
type = "mohr-coulomb"
[laws]
bedding = {type = "linear", kn = 1e12, ks = 1e11}
"set 2" = {cohesion = "20 MPa"}
"""
NETWORK = """
[sample]
width = "20 mm"
height = "40 mm"
grains = 150
seed = 3
minerals = {quartz = 0.4, mica = 0.6}
[sample.joints]
bedding = [[[0, "10 mm"], ["20 mm", "14 mm"]], [[0, 0.02], [0.01, 0.022]]]
fault = [[["5 mm", 0], [0.008, 0.02], [0.006, 0.04]]]
[laws]
fault = {type = "linear", kn = 1e12, ks = 1e11}
"""


def made(text):
    return configured("uniaxial-tension", tomllib.loads(text))


def test_joint_sets_with_their_own_laws():
    chosen = made(SETS)
    grains = chosen.specimen.grains
    sets = [
        JointSet(dip=-35, spacing=2, name="bedding"),
        JointSet(dip=55, spacing=3, through=(0.5, 0)),
    ]
    expected = JointSets(sets=sets).tessellate(rectangle(10, 20))
    assert np.array_equal(grains.vertices, expected.vertices)
    assert list(grains.joints) == ["bedding", "set 2"]
    assert np.array_equal(grains.joints["bedding"], expected.joints["bedding"])
    assert chosen.law["bedding"].kn == 1e12
    assert (chosen.law["set 2"].cohesion, chosen.law[...].cohesion) == (20e6, 29e6)


def test_a_network_cuts_grains_before_minerals_are_dealt():
    chosen = made(NETWORK)
    grains = chosen.specimen.grains
    traces = {
        "bedding": [[(0, 0.01), (0.02, 0.014)], [(0, 0.02), (0.01, 0.022)]],
        "fault": [[(0.005, 0), (0.008, 0.02), (0.006, 0.04)]],
    }
    cut = Jointed(Voronoi(grains=150, seed=3), traces)
    expected = Minerals(cut, {"quartz": 0.4, "mica": 0.6}, seed=3).tessellate(rectangle(0.02, 0.04))
    assert np.array_equal(grains.vertices, expected.vertices)
    assert np.array_equal(grains.phase, expected.phase)
    assert texture(grains).joints["fault"] == pytest.approx(0.0405, rel=0.1)
    assert np.bincount(grains.phase, grains.areas) / 8e-4 == pytest.approx([0.4, 0.6], abs=1e-3)
    assert chosen.law["fault"].ks == 1e11


def test_a_network_after_sizes_by_mineral():
    text = NETWORK.replace('grains = 150', 'grains = 150\ntessellator = "laguerre"').replace(
        "[sample.joints]", '[sample.sizes]\ntype = "by-phase"\nquartz = {type = "even", diameter = 3}\nmica = "even"\n'
        "[sample.joints]",
    )  # fmt: skip
    grains = made(text).specimen.grains
    assert len(np.unique(grains.parent)) == 150
    whole = np.bincount(np.unique(grains.parent, return_inverse=True)[1], grains.areas)
    quartz = np.unique(grains.parent[grains.phase == 0])
    assert np.median(whole[quartz]) > 5 * np.median(whole)
    assert list(grains.joints) == ["bedding", "fault"]


@pytest.mark.parametrize("text", [SETS, NETWORK])
def test_the_sections_make_the_same_again(text):
    first = made(text)
    again = made(toml(first.sections))
    assert again.sections == first.sections
    assert np.array_equal(again.specimen.grains.vertices, first.specimen.grains.vertices)
    assert again.law == first.law


@pytest.mark.parametrize(
    ("text", "change", "words"),
    [
        (SETS, ("dip = -35", "dips = -35"), r"there is no 'sample.sets\[0\].dips'; did you mean 'dip'"),
        (SETS, ('"2 m"', '"2 MPa"'), r"sample.sets\[0\].spacing"),
        (SETS, ("dip = -35, ", ""), r"sample.sets\[0\].dip \(deg\) is missing"),
        (SETS, ('"set 2"', '"set 3"'), "'set 3' names what the grains do not have"),
        (SETS, ('["50 cm", 0]', '["50 cm"]'), "JointSet: through"),
        (NETWORK, ("[0.006, 0.04]]]", "0.006]]"), "trace 0 of fault"),
        (NETWORK, ('["5 mm", 0]', '["5 mm", "0 s"]'), "sample.joints.fault"),
        (NETWORK, ("fault = {type", "faults = {type"), "'faults' names what the grains do not have"),
    ],
)
def test_what_is_refused(text, change, words):
    with pytest.raises(ParameterError, match=words):
        made(text.replace(*change))
