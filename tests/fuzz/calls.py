"""Random calls of everything public: mostly right arguments, among them wrong ones of every kind."""

from __future__ import annotations

import enum
import functools
import inspect
import math
import random
from collections.abc import Iterator

import attrs
import numpy as np
from fuzz.limits import Case
from support import BRITTLE, HILLERBORG, ROCK, STIFF, small_sample

import grainlaw as gl
import grainlaw.geometry
import grainlaw.laws
import grainlaw.materials
import grainlaw.protocols
from grainlaw.conditions import Reaches
from grainlaw.engine.model import Model
from grainlaw.geometry import JointSet, Voronoi, rectangle
from grainlaw.integration import CentralDifference, Damping, Undamped
from grainlaw.laws import EvansMarathe, Linear, LinearClosure, Roughness
from grainlaw.loads import Drive, Gravity
from grainlaw.protocols import UniaxialCompression
from grainlaw.runs.first_questions import ask_first_questions

PACKAGES = (gl, gl.laws, gl.materials, gl.geometry, gl.protocols)
PRESS = UniaxialCompression(loading=gl.Constant(speed=1.0), maximum_strain=1e-4, samples=10)

EXTREMES = (0, -1, 1, 2, 3, 1e-9, 1e14, 1e300, -1e300, 5e-324, 10**9, 10**30, math.nan, math.inf, -math.inf)
ODD = (
    None, True, "", "top", "13 MPa", "ä\n", b"x", 1j, object(), int, len, lambda *given: None, (), [], {}, set(),
    [1], [1, 2], (1.0, math.nan), [[1, 2], [3]], {"a": 1}, {0: 1}, {(0, 0): None}, [None], ["top", "left"], range(3),
    np.zeros(0), np.zeros(3), np.full((2, 2), np.nan), np.array("x"), np.float64(2), np.int64(2), np.bool_(True),
    np.array([[0, 0], [1, 0], [1, 1]]), np.array([[0, 0], [1, 1], [1, 0], [0, 1.0]]), np.zeros((0, 2)), float, gl,
)  # fmt: skip


@functools.cache
def specimen() -> gl.Specimen:
    return small_sample(6, width=0.02, height=0.02)


@functools.cache
def result() -> gl.Result:
    return gl.simulate(specimen(), BRITTLE, PRESS)


def objects() -> tuple:
    """One of everything that takes part in a model."""
    return (
        specimen(), specimen().grains, rectangle(1, 1), BRITTLE, HILLERBORG, ROCK, PRESS, CentralDifference(),
        Undamped(), gl.GaussPoints(), gl.Plane.STRESS, Reaches("strain", 1.0), EvansMarathe(), LinearClosure(),
        Voronoi(grains=5), gl.Detection(), result(), result().cracks, Linear,
    )  # fmt: skip


SQUARE = [(0, 0), (1, 0), (1, 1), (0, 1)]


@functools.cache
def right() -> dict[str, tuple]:
    """Values of the right kind, by the name of the argument; numbers for every other name."""
    cracks = result().cracks
    return {
        "specimen": (specimen(),), "law": (BRITTLE, HILLERBORG, Linear(**STIFF)), "protocol": (PRESS,),
        "laws": ({"a": BRITTLE}, {"a": BRITTLE, "b": HILLERBORG}), "specimens": ({1: specimen()},),
        "test": (PRESS, lambda confinement: PRESS), "confinements": ([0.0], [0.0, 1e6]), "result": (result(),),
        "results": ({"a": result()},), "cracks": (cracks,), "times": (np.linspace(0, 1, 3),), "component": (BRITTLE,),
        "grains": (specimen().grains, 5, None), "region": (rectangle(1, 1),), "material": (ROCK, gl.Rigid(density=1)),
        "boundary": ("top", "left"), "name": ("top", "x"), "axis": (0, 1), "column": ("stress", "time"),
        "until": ([Reaches("stress", 1e6)],), "loads": ([Drive(boundary="top", axis=1, speed=1)], [Gravity()]),
        "integrator": (CentralDifference(),),
        "softening": (EvansMarathe(),), "closure": (LinearClosure(),), "poissons_ratio": (0.25,), "sets": ([_JOINTS],),
        "roughness": (Roughness(jrc=5, jcs=1e8, residual_friction_angle=30),), "fraction": (0.5,), "measures": ([],),
        "corners": (SQUARE, np.array(SQUARE, dtype=float)), "points": (SQUARE, (0, 1)), "outline": (SQUARE,),
        "sides": (("a", "b", "c", "d"), 16), "names": ("a", ("a", "b", "c", "d"), ("cohesion",)), "by": ((0, 1.0),),
        "window": (gl.within_circle((0, 0), 1),), "centre": ((0, 0),), "low": ((0, 0),), "high": ((1, 1),),
        "opening": (np.linspace(0, 1e-5, 4), 0.0), "slip": (np.linspace(0, 1e-5, 4), 0.0), "unit": ("Pa", "1"),
        "kind": (Damping, int), "default": (Undamped(), 3), "levels": ((1e-4, 2e-4),), "holes": ((), {}),
        "friction_angle": (50,), "residual_friction_angle": (5,), "dilation_angle": (5,), 
        "confinement": ([0, 1, 2, 3], 1),
        "strength": ([1, 3, 4, 6],), "bodies": ((),), "through": ((0.0, 0.0),), "places": ([(0, 0)],), 
        "frame": (-1, 0),
        "observers": ((),), "detection": (gl.Detection(), None), "kn": (1e14,), "ks": (9e13,), 
        "tensile_strength": (13e6,),
        "cohesion": (29e6,), "mode_i_energy": (150,), "mode_ii_energy": (300,), "phase": (0,), "threads": (1, 2, None),
        "stress": (1e6,), "duration": (1e-5,), "clock": (), "curves": (result().curves,),
    }  # fmt: skip


_JOINTS = JointSet(dip=30, spacing=0.3)
NUMBERS = (0.5, 1, 2, 0.01, 0, 4, 100)


@functools.cache
def callables() -> dict[str, object]:
    """Public classes and functions by name; without exceptions, options and aliases of types."""
    found = {}
    for package in PACKAGES:
        for name in package.__all__:
            value = getattr(package, name)
            wanted = not isinstance(value, type) or not issubclass(value, (BaseException, enum.Enum))
            if wanted and (isinstance(value, type) or inspect.isfunction(value)):
                found[f"{package.__name__}.{name}"] = value
    return found


def cases(seed: int, count: int) -> Iterator[Case]:
    """Calls, each with a name that says which one it is."""
    names = sorted(callables())
    for number in range(count):
        dice = random.Random(f"{seed} {number}")
        name = dice.choice(names)
        yield case(dice, name, f"{seed}-{number}-{name}")


def case(dice: random.Random, name: str, label: str) -> Case:
    function = callables()[name]
    signature = inspect.signature(function)
    named, given = {}, []
    for key, parameter in signature.parameters.items():
        if parameter.kind is parameter.VAR_POSITIONAL:
            given = [value_of(dice, "grains") for _ in range(dice.randrange(3))]
        elif parameter.kind is not parameter.VAR_KEYWORD and (
            parameter.default is parameter.empty or dice.random() < 0.3
        ):
            named[key] = value_of(dice, key)
    for _ in range(dice.choice((0, 1, 1, 1, 1, 2, 4))):
        fault = dice.randrange(30)
        if named and fault == 0:
            named.pop(dice.choice(sorted(named)))
        elif named and fault == 1:
            key = dice.choice(sorted(named))
            named[key[:-1] + dice.choice("xyz")] = named.pop(key)
        elif fault == 2:
            given = [odd(dice) for _ in range(dice.randrange(1, 3))]
        elif named:
            named[dice.choice(sorted(named))] = odd(dice)
    return Case(label, lambda: used(function(*given, **named)), f"{name}(*{given!r:.300}, **{named!r:.600})")


def value_of(dice: random.Random, name: str) -> object:
    return dice.choice(right().get(name) or NUMBERS)


def odd(dice: random.Random) -> object:
    return dice.choice(dice.choice((EXTREMES, EXTREMES, EXTREMES, ODD, ODD, objects())))


def used(made: object) -> None:
    """What a component is made for, where that takes no time."""
    if isinstance(made, gl.ContactLaw) and not _has_arrays(made):
        ask_first_questions(Model(specimen(), made))
    elif isinstance(made, gl.Tessellator):
        made.tessellate(rectangle(1, 1))
    elif isinstance(made, gl.LoadingProtocol):
        made.stages(specimen())
    elif isinstance(made, gl.Specimen):
        assert made.mesh is not None


def _has_arrays(law: gl.ContactLaw) -> bool:
    return any(isinstance(value, list) for value in gl.parameters(law).values()) or not attrs.has(type(law))
