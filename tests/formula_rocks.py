"""Rocks whose laboratory is a formula, for tests of calibration: the answers are known, and cost nothing."""

import zlib

import numpy as np
from support import STIFF

from grainlaw.calibration.space import space_of
from grainlaw.calibration.targets import Targets
from grainlaw.calibration.trials import Simulator
from grainlaw.calibration.waves import Search
from grainlaw.laws import CohesiveCrack
from grainlaw.units import MPa

RANGES = {
    "tensile_strength": (5 * MPa, 30 * MPa), "cohesion": (20 * MPa, 60 * MPa), "friction_angle": (30, 50),
    "mode_i_energy": (5, 300),
}  # fmt: skip
BASE = CohesiveCrack(
    **STIFF, tensile_strength=10 * MPa, cohesion=40 * MPa, friction_angle=40, residual_friction_angle=5,
    mode_i_energy=50, mode_ii_energy=100,
)  # fmt: skip
FOUR = ("ucs", "cohesion", "friction_angle", "tensile_strength")  #: quantities
#: parameters
HIDDEN = {"tensile_strength": 11 * MPa, "cohesion": 33 * MPa, "friction_angle": 41.0, "mode_i_energy": 40.0}
UNDER = (20, 75)  #: MPa, confinements of strengths
TIED = {"mode_ii_energy": ("mode_i_energy", 2)}


class FormulaRock(Simulator):
    """Strengths that grow as similarity says; each seed is as weak or strong at all points, and a little its own."""

    def __init__(self, common=0.05, own=0.02):
        self.common, self.own, self.asked = common, own, []

    def values(self, points, quantities, seeds, scales):
        self.asked.append(len(points))
        every = [exact(point, scale) for point, scale in zip(points, scales, strict=True)]
        return {
            name: np.array([
                [value[name] * self.factor(name, seed, point) for seed in seeds]
                for value, point in zip(every, points, strict=True)
            ])
            for name in quantities
        }  # fmt: skip

    def factor(self, name, seed, point):
        common = 0.0 if name == "friction_angle" else self.common
        shared = np.random.default_rng(seed).standard_normal()
        text = repr((name, seed, sorted(point.items()))).encode()
        return np.exp(common * shared + self.own * np.random.default_rng(zlib.crc32(text)).standard_normal())


def exact(point, scale=1.0):
    """Values of all seeds together; the energy counts by its group, and saturates. Confined is a rock ``scale`` times
    as strong.
    """
    strength, angle = point["tensile_strength"], 0.9 * point.get("friction_angle", 40.0)
    tough = point.get("mode_i_energy", np.inf) * STIFF["kn"] / strength**2 / 50
    tough = 1 / (1 + 1 / tough)
    root = np.tan(np.pi / 4 + np.radians(angle) / 2)
    cohesion = 0.8 * point.get("cohesion", 33 * MPa) * (0.5 + 0.5 * tough)
    ucs = 2 * cohesion * root
    under = {f"strength at {p} MPa": ucs + root**2 * p * MPa / scale for p in UNDER}
    return under | {
        "ucs": ucs, "cohesion": cohesion, "friction_angle": angle, "tensile_strength": 0.8 * strength * tough**0.2,
        "brazilian_strength": 0.9 * strength * tough**0.3, "crack_initiation": 0.4 * ucs, "crack_damage": 0.8 * ucs,
    }  # fmt: skip


def space(law=BASE, free=RANGES, tied=TIED):
    return space_of(law, free, tied, {})


def targets_at(point, names, uncertainty=0.01, **changed):
    """What a laboratory finds of a hidden rock."""
    values = {**exact(point), **changed}
    wanted = {name: (values[name], uncertainty * values[name]) for name in names}
    triaxial = {p * MPa: wanted.pop(f"strength at {p} MPa") for p in UNDER if f"strength at {p} MPa" in wanted}
    return Targets(**wanted, triaxial=triaxial)


def searched(targets, names=(), rock=None, budget=60, seed=0, seeds=(1, 2, 3), more=(), **given):
    """A search for targets, in which further quantities are measured."""
    rock = FormulaRock() if rock is None else rock
    quantities = (*targets.tested, *names)
    return Search(space(**given), targets.tested, quantities, rock, seeds, budget, seed, more).run()
