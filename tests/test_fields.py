import enum
import math
from pathlib import Path
from types import SimpleNamespace

import attrs
import numpy as np
import pytest
from support import BRITTLE, PULL, small_sample

import grainlaw as gl
from grainlaw.fields import ParameterError, parameter, parameters
from grainlaw.geometry import Bricks, Hexagonal, Voronoi, disc
from grainlaw.laws import EvansMarathe, Linear
from grainlaw.protocols import UniaxialCompression
from grainlaw.results.result import Cracks


@attrs.frozen(kw_only=True)
class Joint:
    """One field of each kind of bound."""

    stiffness: float = parameter("Pa/m", default=1.0)
    cohesion: float = parameter("Pa", default=0.0, at_least=0)
    angle: float = parameter("deg", default=30.0, at_least=0, below=90)
    share: float = parameter("1", default=1.0, above=0, at_most=1)
    gap: float = parameter("m", default=math.inf, above=0, infinite=True)


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"stiffness": 0}, ["stiffness = 0 Pa/m", "a finite number", "above 0"]),
        ({"stiffness": -2}, ["stiffness = -2 Pa/m", "above 0"]),
        ({"stiffness": math.nan}, ["stiffness = nan Pa/m", "a finite number"]),
        ({"stiffness": math.inf}, ["stiffness = inf Pa/m", "a finite number"]),
        ({"cohesion": -1e-9}, ["cohesion = -1e-09 Pa", "at least 0"]),
        ({"angle": 90}, ["angle = 90 deg", "at least 0 and below 90"]),
        ({"angle": 120}, ["angle = 120 deg", "below 90"]),
        ({"share": 1.5}, ["share = 1.5 is", "above 0 and at most 1"]),
        ({"gap": math.nan}, ["gap = nan m", "a number", "above 0"]),
        ({"stiffness": "1e9"}, ["stiffness = '1e9'", "a finite number", "above 0", "Pa/m"]),
        ({"stiffness": None}, ["stiffness = None", "Pa/m"]),
        ({"stiffness": True}, ["stiffness = True"]),
        ({"stiffness": 1j}, ["stiffness = 1j"]),
        ({"stiffness": [[1.0]]}, ["stiffness = [[1.0]]"]),
        ({"cohesion": [1.0, math.nan]}, ["cohesion = nan Pa"]),
        ({"cohesion": 2e30}, ["cohesion = 2e+30 Pa", ", of size 1e-30 to 1e+30"]),
        ({"stiffness": 1e-31}, ["stiffness = 1e-31 Pa/m", "above 0", ", of size 1e-30 to 1e+30"]),
    ],
)
def test_a_refusal_names_component_parameter_value_and_bound(wrong, said):
    with pytest.raises(ParameterError) as refusal:
        Joint(**wrong)
    for words in ["Joint: ", "not allowed", *said]:
        assert words in str(refusal.value)
    assert ("of size" in str(refusal.value)) == ("of size" in said[-1])


def test_bounds_that_are_included_are_allowed():
    joint = Joint(cohesion=0, angle=0, share=1, gap=math.inf)
    assert (joint.cohesion, joint.angle, joint.share, joint.gap) == (0.0, 0.0, 1.0, math.inf)


def test_whole_numbers_become_floats():
    assert type(Joint(stiffness=np.int64(3)).stiffness) is float


def test_one_value_per_contact_is_copied_and_protected():
    values = np.array([1.0, 2.0])
    joint = Joint(stiffness=values)
    values[0] = -1.0
    assert joint.stiffness.tolist() == [1.0, 2.0]
    with pytest.raises(ValueError, match="read-only"):
        joint.stiffness[0] = 3.0
    assert joint == Joint(stiffness=[1.0, 2.0])
    assert joint != Joint(stiffness=[1.0, 3.0])


def test_parameters_of_a_component_by_name():
    assert parameters(Linear(kn=2, ks=1)) == {"kn": 2.0, "ks": 1.0}
    with pytest.raises(ParameterError, match=r"Linear: ks = 0 Pa/m is not allowed"):
        Linear(kn=2, ks=0)


WHOLE = [
    (lambda value: Voronoi(grains=value), "Voronoi: grains", ", at least 1"),
    (lambda value: Voronoi(grains=4, seed=value), "Voronoi: seed", ", at least 0"),
    (lambda value: Voronoi(grains=4, relaxation=value), "Voronoi: relaxation", " from 0 to 1000"),
    (lambda value: Hexagonal(grains=value), "Hexagonal: grains", ", at least 1"),
    (lambda value: UniaxialCompression(samples=value), "UniaxialCompression: samples", ", at least 10"),
    (lambda value: small_sample(4, refinement=value), "Specimen: refinement", " from 0 to 6"),
    (lambda value: gl.crack_rose(Cracks(*[np.zeros(0)] * 9), bins=value), "crack_rose: bins", " from 1 to 18000"),
    (
        lambda value: gl.compare(small_sample(4), {"law": BRITTLE}, PULL, threads=value),
        "threads",
        " from 1 to 128, or 'auto'",
    ),
]


@pytest.mark.parametrize(("make", "where", "bounds"), WHOLE, ids=[name for _, name, _ in WHOLE])
def test_a_whole_number_is_an_integer_of_python_or_numpy(make, where, bounds):
    for wrong in (2.0, 2.5, True, np.bool_(True), "2", -1, [2], math.nan):
        with pytest.raises(ParameterError) as refusal:
            make(wrong)
        assert str(refusal.value) == f"{where} = {wrong!r} is not allowed, it must be a whole number{bounds}"


def test_an_integer_of_numpy_becomes_one_of_python():
    for found in (
        Bricks(rows=np.int64(3)).rows, Voronoi(grains=np.uint8(3)).grains, Voronoi(grains=4, seed=np.int32(3)).seed,
        small_sample(4, refinement=np.int64(3)).refinement, EvansMarathe(c=np.int64(3)).c,
    ):  # fmt: skip
        assert found == 3
        assert type(found) is int
    assert np.array_equal(disc(1.0, sides=np.int64(16)).outline, disc(1.0, sides=16).outline)


def test_none_is_a_whole_number_only_where_it_is_the_default():
    assert Voronoi(grain_size=1e-3, grains=None).grains is None
    with pytest.raises(ParameterError, match="Voronoi: seed = None is not allowed"):
        Voronoi(grains=4, seed=None)


@pytest.mark.parametrize("value", [SimpleNamespace(name="a"), SimpleNamespace(value=3), Path("a", "b")])
def test_what_has_only_a_name_or_only_a_value_is_no_member_of_an_enumeration(value):
    @attrs.frozen
    class Holder:
        held: object

    assert parameters(Holder(value)) == {"held": value}
    member = enum.Enum("Kind", {"FIRST_ONE": 1}).FIRST_ONE
    assert parameters(Holder([member, (member,)])) == {"held": ["first_one", ["first_one"]]}
