"""Random configurations of ``grainlaw test``: mostly right ones of a small test, with wrong values of every kind."""

from __future__ import annotations

import random
from collections.abc import Iterator
from typing import Any

import attrs
from fuzz.limits import Case

import grainlaw as gl
from grainlaw.cli.configuration import configured
from grainlaw.cli.sections import assign
from grainlaw.cli.setups import SETUPS
from grainlaw.engine.state import State
from grainlaw.observation import Observer
from grainlaw.runs.simulation import simulate

NEEDED = {
    "biaxial-compression": {"test.confinement": '"4 MPa"'}, "cyclic": {"test.levels": "[1e-4, 2e-4]"},
    "direct-shear": {"test.normal_stress": '"10 MPa"'}, "heating": {"test.to": "[60]", "rock.expansion": "8e-6"},
}  # fmt: skip
LAWS = ("linear", "mohr-coulomb", "cohesive-crack", "munjiza", "camacho-ortiz", "bilinear-mixed-mode", "xu-needleman")
#: right values, each for one key
RIGHT = {
    "sample.grains": ("8", "12"), "sample.seed": ("1", "7"), "sample.width": ('"20 mm"', "0.02"),
    "sample.height": ('"50 mm"',), "sample.tessellator": ('"hexagonal"', '"voronoi"', "bricks"),
    "sample.region": ('"rectangle"', "disc"), "sample.contact_points": ('"end"', '{type = "inset", inset = "0.1 mm"}'),
    "sample.relaxation": ("0", "3"), "sample.merge": ("0.25", "0"), "sample.grain_size": ('"10 mm"',),
    "sample.diameter": ('"50 mm"',), "rock.youngs_modulus": ('"60 GPa"', "5e10"), 
    "rock.density": ("3100", '"3.1 g/cm3"'),
    "rock.poissons_ratio": ("0.25",), "rock.plane": ('"stress"',), "rock.type": ('"rigid"', '"elastic"'),
    "law.kn": ('"105 TPa/m"',), "law.ks": ("9e13",), "law.tensile_strength": ('"13 MPa"',),
    "law.cohesion": ('"29 MPa"',), "law.friction_angle": ("54",), "law.softening": ('"exponential"', "hordijk"),
    "law.closure": ('{type = "bandis", maximum_closure = "5 um"}',), "law.mode_i_energy": ("150",),
    "test.loading": ('{type = "constant", speed = "0.2 m/s"}', '{type = "adaptive", rate = 0.01}'),
    "test.platens": ('"rough"',),
    "test.maximum_strain": ("1e-4",), "test.samples": ("10",), "test.stop_fraction": ("0.5",),
    "test.integrator": (
        '{type = "central-difference", damping = {type = "local", fraction = 0.7}}', '"dynamic-relaxation"'),
    "numerics.time_step_factor": ("0.5",), "numerics.mass_scaling": ("2",), "numerics.refinement": ("1",),
    "numerics.frames": ("3",), "numerics.threads": ("2",),
}  # fmt: skip
WRONG = (
    "0", "-1", "1e-9", "1e14", "1e300", "5e-324", "-1e300", "nan", "inf", "-inf", "1000000000", "10" * 20, "true",
    "[]", "[1, 2]", "[nan]", "{}", "{type = 3}", '{a = "b"}', '""', '"rough"', '"13 MPa"', '"5 um"', '"5 foo"', '"\\n"',
    "[[1], [2, 3]]", "1979-05-27", "['a']", "'voronoi'", "2.5", "'1e400 m'", "'9 m9'", "FILE.py:LAW", "x" * 300,
)  # fmt: skip
NAMES = ("sample", "rock", "law", "test", "numerics", "lawn", "", "law.softening", "test.integrator.damping", "a.b.c")


class _Enough(Exception):
    """Ends a run that goes well."""


@attrs.define
class _Few(Observer):
    """A few samples show whether a configuration runs."""

    left: int = 3

    def observe(self, *_: Any) -> None:
        self.left -= 1
        if not self.left:
            raise _Enough


def cases(seed: int, count: int) -> Iterator[Case]:
    for number in range(count):
        dice = random.Random(f"{seed} {number}")
        yield case(f"{seed}-{number}", *settings(dice))


def settings(dice: random.Random) -> tuple[str, list[str]]:
    """A test's name, and assignments as after ``--set``."""
    name = dice.choice(sorted(SETUPS)) if dice.random() < 0.95 else dice.choice(("uniaxial", "", "Brazilian", "x" * 99))
    grains = "8" if SETUPS.get(name) and "grains" in SETUPS[name].sample else ""
    given = {"sample.grains": grains} if grains else {}
    given |= NEEDED.get(name, {}) if dice.random() < 0.9 else {}
    given |= {"law.type": dice.choice(LAWS)} if dice.random() < 0.4 else {}
    for _ in range(dice.choice((0, 1, 1, 2, 3))):
        key = dice.choice(sorted(RIGHT))
        given[key] = dice.choice(RIGHT[key])
    for _ in range(dice.choice((0, 1, 1, 1, 2))):
        key = dice.choice([*RIGHT, *given])
        if dice.random() < 0.1:
            key = dice.choice(
                (f"{dice.choice(NAMES)}.{dice.choice(('type', 'x', 'speed'))}", key[:-1], key.upper(), key + ".")
            )
        given[key] = dice.choice(WRONG)
    return name, [f"{key}={value}" for key, value in given.items()]


def case(label: str, name: str, assignments: list[str]) -> Case:
    return Case(f"{label}-{name[:20]}", lambda: run(name, assignments), f"{name} {' '.join(assignments)}")


def run(name: str, assignments: list[str]) -> None:
    sections: dict[str, dict[str, Any]] = {}
    for assignment in assignments:
        assign(sections, assignment)
    made = configured(name, sections, quick=True)
    numerics = made.numerics
    threads = 2 if numerics.threads == "auto" else min(numerics.threads, 2)
    try:
        simulate(
            made.specimen, made.law, _limited(made.protocol), threads=threads, frames=numerics.frames,
            time_step_factor=numerics.time_step_factor, mass_scaling=numerics.mass_scaling, observers=[_Few()],
        )  # fmt: skip
    except _Enough:
        pass


@attrs.frozen
class _Short(gl.LoadingProtocol):
    """Another test with samples as short as a few steps, so that a case takes no time."""

    test: gl.LoadingProtocol

    def stages(self, specimen: gl.Specimen) -> list[gl.Stage]:
        return [attrs.evolve(stage, interval=min(stage.interval, 1e-6)) for stage in self.test.stages(specimen)]

    def measure(self, state: State) -> dict[str, float]:
        return self.test.measure(state)

    def summary(self, curves: Any, specimen: gl.Specimen) -> dict[str, Any]:
        return self.test.summary(curves, specimen)


def _limited(test: gl.LoadingProtocol) -> gl.LoadingProtocol:
    return _Short(test)
