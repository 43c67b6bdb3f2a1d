"""What a run costs beside its steps: samples, hand-overs and searches of a compression test through its failure.

    python tests/benchmarks/host_cost.py [grains, 150 755] [repeats, 3]

CPU time of one thread; needs one idle core. Hand-overs contain their searches. The first run of each
compiles and is not counted.
"""

import statistics
import sys
import time
import warnings
from collections.abc import Callable
from typing import Any

import grainlaw as gl
from grainlaw.engine import step, stepping
from grainlaw.engine.state import State
from grainlaw.geometry import Voronoi, rectangle
from grainlaw.laws import MohrCoulomb
from grainlaw.protocols import UniaxialCompression
from grainlaw.runs.execution import Execution

ROCK = gl.Elastic(youngs_modulus=60e9, poissons_ratio=0.25, density=3100)
LAW = MohrCoulomb(
    kn=1.05e14, ks=9.45e13, tensile_strength=13e6, cohesion=29e6, friction_angle=54, residual_friction_angle=5
)
WHERE = {
    "steps": (step, "run"), "hand-overs": (stepping, "hand_over"), "searches": (State, "search"),
    "records": (Execution, "_record"),
}  # fmt: skip


def counted(seconds: dict[str, float], calls: dict[str, int], name: str, function: Callable[..., Any]) -> Any:
    def call(*given: Any, **named: Any) -> Any:
        began = time.process_time()
        answer = function(*given, **named)
        seconds[name] += time.process_time() - began
        calls[name] += 1
        return answer

    return call


def run(grains: int) -> tuple[float, dict[str, float], dict[str, int], int]:
    specimen = gl.Specimen(Voronoi(grains=grains, seed=3).tessellate(rectangle(0.02, 0.04)), ROCK)
    seconds, calls, before = dict.fromkeys(WHERE, 0.0), dict.fromkeys(WHERE, 0), {}
    for name, (place, attribute) in WHERE.items():
        before[name] = getattr(place, attribute)
        setattr(place, attribute, counted(seconds, calls, name, before[name]))
    try:
        began = time.process_time()
        result = gl.simulate(specimen, LAW, UniaxialCompression(), threads=1, progress=False)
        whole = time.process_time() - began
    finally:
        for name, (place, attribute) in WHERE.items():
            setattr(place, attribute, before[name])
    return whole, seconds, calls, result.summary["steps"]


def main() -> None:
    numbers = [int(word) for word in sys.argv[1:]]
    sizes = [number for number in numbers if number > 20] or [150, 755]
    repeats = next((number for number in numbers if number <= 20), 3)
    warnings.simplefilter("ignore")
    for grains in sizes:
        run(grains)
        runs = [run(grains) for _ in range(repeats)]
        whole = statistics.median(each[0] for each in runs)
        print(f"{grains} grains, {runs[0][3]} steps: {whole:.2f} s of CPU time")
        for name in WHERE:
            spent, calls = statistics.median(each[1][name] for each in runs), runs[0][2][name]
            print(f"  {name:10} {spent / whole:4.0%}  {calls:5} calls of {1e3 * spent / max(calls, 1):.2f} ms")


if __name__ == "__main__":
    main()
