"""Cost of each law per contact and step, alone; and of a user's law against the same arithmetic without the framework.

    python tests/benchmarks/law_cost.py

Medians of CPU time over alternating rounds; intact, damaging and broken contacts mixed.
"""

import sys
import time
from pathlib import Path

import attrs
import numpy as np
from numba import njit

sys.path.insert(0, str(Path(__file__).parents[1]))
from support import STIFF, STRONG, Hillerborg

import grainlaw as gl
from grainlaw.compiler.batch import compile_law
from grainlaw.compiler.cache import OPTIONS
from grainlaw.laws import (
    BandisClosure,
    BartonBandis,
    BilinearMixedMode,
    CamachoOrtiz,
    CohesiveCrack,
    Coupling,
    ExponentialSoftening,
    HordijkSoftening,
    Linear,
    LinearSoftening,
    MohrCoulomb,
    MunjizaJoint,
    PeterssonSoftening,
    PrePeak,
    Residual,
    XuNeedleman,
)

COUNT, CALLS, ROUNDS = 4096, 40, 25


@attrs.frozen(kw_only=True)
class Branchy(gl.ContactLaw):
    """The same as a user would write it first."""

    kn: float = gl.parameter("Pa/m")
    ks: float = gl.parameter("Pa/m")
    strength: float = gl.parameter("Pa")
    energy: float = gl.parameter("J/m2")
    stiffness = property(lambda self: (self.kn, self.ks))

    def traction(self, opening, slip, damage, widest):
        peak, last = self.strength / self.kn, 2 * self.energy / self.strength
        if opening > widest:
            widest = opening
        if opening <= 0:
            return self.kn * opening, self.ks * slip, damage, widest
        if widest <= peak:
            return self.kn * opening, self.ks * slip, 0.0, widest
        if widest >= last:
            return 0.0, self.ks * slip, 1.0, widest
        damage = (widest - peak) / (last - peak)
        return self.strength * (1 - damage) / widest * opening, self.ks * slip, damage, widest


@njit(**OPTIONS)
def by_hand(kn, ks, strength, energy, opening, slip, normal, shear, damages, widests):
    """Hillerborg's arithmetic in a loop of its own."""
    for c in range(opening.shape[0]):
        peak, last = strength / kn, 2 * energy / strength
        widest = max(widests[c], opening[c], peak)
        damage = min((widest - peak) / (last - peak), 1.0)
        secant = strength * (1 - damage) / widest
        normal[c] = (secant if opening[c] > 0 else kn) * opening[c]
        shear[c] = ks * slip[c]
        damages[c] = damage
        widests[c] = widest


def costs():
    """Seconds of a call for all contacts by law, without the call itself."""
    rng = np.random.default_rng(0)
    opening, slip = rng.normal(size=(2, COUNT)) * np.where(np.arange(COUNT) % 3 == 0, 3e-5, 2e-6)
    energies = {"mode_i_energy": 150, "mode_ii_energy": 300}
    even = {name: value for name, value in STRONG.items() if name != "friction_angle"}
    factors = rng.weibull(10, COUNT)  # as WeibullField gives them
    random = {name: factors * STRONG[name] for name in ("tensile_strength", "cohesion")}
    simple = dict(**STIFF, strength=10e6, energy=50)
    laws = {
        "Linear": Linear(**STIFF),
        "MohrCoulomb": MohrCoulomb(**STRONG),
        "MohrCoulomb, random": MohrCoulomb(**STRONG | random),
        "CohesiveCrack": CohesiveCrack(**STRONG, **energies),
        "  linear softening": CohesiveCrack(**STRONG, **energies, softening=LinearSoftening()),
        "  exponential softening": CohesiveCrack(**STRONG, **energies, softening=ExponentialSoftening()),
        "  Hordijk's softening": CohesiveCrack(**STRONG, **energies, softening=HordijkSoftening()),
        "  Petersson's softening": CohesiveCrack(**STRONG, **energies, softening=PeterssonSoftening()),
        "  linear pre-peak": CohesiveCrack(**STRONG, **energies, pre_peak=PrePeak.LINEAR),
        "  blend": CohesiveCrack(**STRONG, **energies, residual=Residual.BLEND),
        "  Bandis closure": CohesiveCrack(**STRONG, **energies, closure=BandisClosure(maximum_closure=5e-6)),
        "CohesiveCrack, random": CohesiveCrack(**STRONG | random, **energies),
        "MunjizaJoint": MunjizaJoint(**STRONG, **energies),
        "MunjizaJoint, random": MunjizaJoint(**STRONG | random, **energies),
        "CamachoOrtiz": CamachoOrtiz(**even, **energies),
        "CamachoOrtiz, random": CamachoOrtiz(**even | random, **energies),
        "BilinearMixedMode": BilinearMixedMode(**even, **energies),
        "  with square roots": BilinearMixedMode(**even, **energies, eta=1.75),
        "BilinearMixedMode, random": BilinearMixedMode(**even | random, **energies),
        "XuNeedleman": XuNeedleman(**even),
        "  potential": XuNeedleman(**even, coupling=Coupling.POTENTIAL),
        "XuNeedleman, random": XuNeedleman(**even | random),
        "BartonBandis": BartonBandis(
            **STIFF, friction_angle=40, dilation_angle=15, closure=BandisClosure(maximum_closure=5e-6)
        ),
        "a user's Hillerborg": Hillerborg(**simple),
        "the same with branches": Branchy(**simple),
    }
    calls = {}
    for name, law in laws.items():
        compiled = compile_law(law, COUNT)
        memory = np.zeros((len(compiled.memory) or 1, COUNT))
        calls[name] = lambda c=compiled, m=memory: c.batch(opening, slip, m)
    rows = np.zeros((4, COUNT))
    calls["Hillerborg by hand"] = lambda: by_hand(1.05e14, 9.45e13, 10e6, 50.0, opening, slip, *rows)
    nothing = compile_law(Linear(**STIFF))
    few = np.zeros(1), np.zeros(1), np.zeros((1, 1))
    calls["(one call from Python)"] = lambda: nothing.batch(*few)
    times = {name: [] for name in calls}
    for call in calls.values():
        call()
    for _ in range(ROUNDS):
        for name, call in calls.items():
            start = time.thread_time()
            for _ in range(CALLS):
                call()
            times[name].append((time.thread_time() - start) / CALLS)
    overhead = np.median(times["(one call from Python)"])
    extra = {name: 0.0 if "one call" in name else 0.2e-6 if "by hand" in name else overhead for name in times}
    return {name: np.median(values) - extra[name] for name, values in times.items()}


def main():
    found = costs()
    for name, cost in found.items():
        note = f"{cost / found['CohesiveCrack']:.2f} of CohesiveCrack"
        if "Hillerborg" in name or "branches" in name:
            note += f", {cost / found['Hillerborg by hand']:.2f} of the same by hand"
        print(f"{name:26} {cost / COUNT * 1e9:6.2f} ns per contact  {note}")


if __name__ == "__main__":
    main()
