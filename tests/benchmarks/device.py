"""Runs on an NVIDIA device against the processor: bits, and microseconds a step.

    GRAINLAW_PORTABLE=1 python tests/benchmarks/device.py [runs at a time x grains: 132x755 1x100000 ...]

Needs a device and grainlaw[gpu]. Of a batch it prints what launches take, the copies up and down, and the whole.
"""

import sys
import threading
import time
import warnings

import attrs
import numpy as np

import grainlaw as gl
from grainlaw.engine.device_table import DeviceTable
from grainlaw.geometry import Voronoi, rectangle
from grainlaw.laws import CohesiveCrack, MohrCoulomb
from grainlaw.protocols import BiaxialCompression, UniaxialCompression, UniaxialTension

ROCK = gl.Elastic(youngs_modulus=60e9, poissons_ratio=0.25, density=2700)
BOND = dict(kn=3e14, ks=1.5e14, tensile_strength=10e6, cohesion=30e6, friction_angle=35, residual_friction_angle=30)
CRACK = CohesiveCrack(**BOND, mode_i_energy=50, mode_ii_energy=150)
GRAIN = 1e-3
SECONDS: dict[str, float] = {}


def specimen(grains, seed):
    width = GRAIN * np.sqrt(grains / 2)
    return gl.Specimen(Voronoi(grain_size=GRAIN, seed=seed).tessellate(rectangle(width, 2 * width)), ROCK)


BEYOND_FAILURE = {
    "compression": (60, CRACK, UniaxialCompression(maximum_strain=1.2e-2, samples=50)),
    "confined": (40, MohrCoulomb(**BOND), BiaxialCompression(confinement=5e6, maximum_strain=1.5e-2, samples=50)),
    "tension": (50, attrs.evolve(CRACK, cohesion=20e6), UniaxialTension(maximum_strain=2e-3, samples=50)),
}


def batch(cases, there):
    found = [None] * len(cases)

    def work(k):
        found[k] = gl.simulate(*cases[k], device=there, progress=False, frames=1)

    crew = [threading.Thread(target=work, args=(k,)) for k in range(len(cases))]
    for each in crew:
        each.start()
    for each in crew:
        each.join()
    return found


def timed(owner, name):
    function = getattr(owner, name)

    def measured(*given, **named):
        start = time.perf_counter()
        try:
            return function(*given, **named)
        finally:
            SECONDS[name] = SECONDS.get(name, 0.0) + time.perf_counter() - start

    setattr(owner, name, measured)


def bits(there):
    cases = [(specimen(grains, k), law, test) for k, (grains, law, test) in enumerate(BEYOND_FAILURE.values(), 1)]
    here = [gl.simulate(*case, threads=1, progress=False, frames=1) for case in cases]
    for name, one, other in zip(BEYOND_FAILURE, here, batch(cases, there), strict=True):
        same = sum(np.array_equal(one.curves[n], other.curves[n], equal_nan=True) for n in one.curves)
        cracks = sum(int(one.curves[f"{kind}_cracks"][-1]) for kind in ("tensile", "shear"))
        steps = int(one.curves["step"][-1])
        print(f"{name}: {steps} steps, {cracks} cracks, {same} of {len(one.curves)} columns are equal")


@attrs.frozen(kw_only=True)
class Push(gl.LoadingProtocol):
    """Both ends move at 2 m/s for 6 us, some 300 steps."""

    def stages(self, specimen):
        ends = [gl.loads.Drive(boundary=name, axis=1, speed=speed) for name, speed in (("top", -2), ("bottom", 2))]
        return [gl.Stage(name="push", loads=ends, until=[gl.conditions.Reaches("time", 6e-6)], interval=6e-6)]

    def measure(self, state):
        return {"moved": float(np.abs(state.displacement).sum())}

    def summary(self, curves, specimen):
        return {}


def speed(there, count, grains):
    rock = specimen(grains, 1)
    cases = [(rock, attrs.evolve(CRACK, cohesion=30e6 + 1e3 * k), Push()) for k in range(count)]
    batch(cases, there)
    SECONDS.clear()
    start = time.perf_counter()
    steps = int(batch(cases, there)[0].curves["step"][-1])
    whole, launch = time.perf_counter() - start, SECONDS["launch"]
    print(
        f"{count} of {grains} grains: {1e6 * launch / steps:.0f} us a step, {1e6 * launch / steps / count:.2f} us "
        f"a run; launches {launch:.2f} s, up {SECONDS['up']:.2f} s, down {SECONDS['down']:.2f} s of {whole:.1f} s"
    )


def main():
    warnings.simplefilter("ignore")
    there = gl.Gpu()
    print(there)
    bits(there)
    for owner, name in ((DeviceTable, "up"), (DeviceTable, "down"), (type(there._driver), "launch")):
        timed(owner, name)
    for text in sys.argv[1:] or ["1x755", "132x755", "1x10000", "1x100000"]:
        speed(there, *map(int, text.split("x")))


if __name__ == "__main__":
    main()
