"""A sample crushed to 5 % of strain: the load after the peak, and the pieces.

    python docs/examples/crushed_sample.py [--quick] [--out FOLDER]

755 grains of the rock of the paper, minutes; --quick: 120 grains, half a minute. Grains that have come loose find each
other and rub: the load falls to a residual instead of nothing, or to grains that pass through each other. Writes
crushed_sample.png, and files for ParaView to crushed_sample/.
"""

import attrs
import numpy as np
from matplotlib.figure import Figure
from moments import command_line, draw

import grainlaw as gl
from grainlaw.fragments import fragments
from grainlaw.geometry import Voronoi, rectangle
from grainlaw.laws import CohesiveCrack
from grainlaw.protocols import UniaxialCompression
from grainlaw.units import GPa, MPa, mm

ROCK = gl.Elastic(youngs_modulus=60 * GPa, poissons_ratio=0.25, density=3100)
LAW = CohesiveCrack(
    kn=1.05e14, ks=9.45e13, tensile_strength=13 * MPa, cohesion=29 * MPa, friction_angle=54, residual_friction_angle=5,
    mode_i_energy=150, mode_ii_energy=300,
)  # fmt: skip


@attrs.define
class Overlap(gl.Observer):
    """How deep contacts overlap at most (m), the most of them at a time, and how many bonds were handed over."""

    deepest: float = 0.0
    contacts: int = 0
    searches: int = 0
    handed_over: int = 0

    def observe(self, state, curves, stage, progress):
        closed = state.touches.closed()
        self.deepest = max(self.deepest, -closed["opening"].min(initial=0.0))
        self.contacts = max(self.contacts, len(closed["opening"]))
        self.searches, self.handed_over = state.touches.searches, int(state.retired.sum())


def run(grains, width, height, strain=0.05, law=LAW, seed=1, **options):
    """Result and what the observer saw."""
    rock = gl.Specimen(Voronoi(grains=grains, seed=seed).tessellate(rectangle(width, height)), ROCK)
    watcher = Overlap()
    test = UniaxialCompression(maximum_strain=strain, stop_fraction=0.0, samples=2000)
    return gl.simulate(rock, law, test, observers=[watcher], frames=60, **options), watcher


def residual(curves):
    """Pa, mean over the last fifth of the strain."""
    return float(curves["stress"][curves["strain"] > 0.8 * curves["strain"][-1]].mean())


def imbalance(curves):
    """Largest difference of both platens' stresses after the peak, means of 20 samples, over the peak."""
    peak = int(np.argmax(curves["stress"]))
    difference = (curves["stress_top"] - curves["stress_bottom"])[peak:]
    means = np.convolve(difference, np.full(20, 1 / 20), mode="valid")
    return float(np.abs(means).max() / curves["stress"][peak])


def picture(result):
    """Stress over strain, and the fragments at four moments, the largest in colours."""
    curves = result.curves
    (left, low), (right, high) = result.specimen.grains.region.bounds
    margin = (right - left) / 3
    figure = Figure(figsize=(14, 5.5), layout="constrained")
    axes, *panels = figure.subplots(1, 5, width_ratios=[1.8, 1, 1, 1, 1])
    axes.plot(curves["strain"] * 100, curves["stress"] / MPa, lw=0.8)
    axes.set(xlabel="axial strain (%)", ylabel="axial stress (MPa)", xlim=0, ylim=0)
    axes.grid(alpha=0.25)
    times = np.array([frame.time for frame in result.frames])
    peak = curves["time"][np.argmax(curves["stress"])]
    colors = np.array(["#4477aa", "#ee6677", "#228833", "#ccbb44", "#66ccee", "#aa3377"] * 200)
    for panel, time in zip(panels, (peak, times[-1] / 5, times[-1] / 2, times[-1]), strict=True):
        k = int(np.argmin(abs(times - time)))
        pieces = fragments(result, k)
        single = pieces.grains[pieces.of_grain] == 1
        draw(panel, result, result.frames[k], np.where(single, "#e8e4da", colors[pieces.of_grain % 1200]), rim=0.2)
        panel.set(xlim=(left - margin, right + margin), ylim=(low, high))
        strain = 100 * np.interp(times[k], curves["time"], curves["strain"])
        panel.set_title(f"{strain:.2f} %, {len(pieces)} fragments", fontsize=9)
    return figure


def main():
    options = command_line(__doc__)
    result, watcher = run(*((120, 20 * mm, 50 * mm) if options.quick else (755, 50 * mm, 125 * mm)))
    curves, summary = result.curves, result.summary
    size = float(np.median(np.sqrt(result.specimen.grains.areas)))
    print(f"peak {summary['peak_stress'] / MPa:.2f} MPa, residual {residual(curves) / MPa:.2f} MPa")
    print(f"energy error {summary['energy_error']:.1e}")
    print(f"deepest mean overlap {watcher.deepest * 1e6:.1f} um, {watcher.deepest / size:.1e} of the grain size")
    print(f"platen imbalance {summary['platen_imbalance']:.1e} before the peak, {imbalance(curves):.2f} after it")
    print(f"{len(fragments(result))} fragments, {watcher.handed_over} of {len(result.interfaces)} bonds handed over")
    print(f"{watcher.contacts} contacts at most, {watcher.searches} searches, {summary['seconds']:.0f} s")
    picture(result).savefig(options.out / "crushed_sample.png", dpi=100)
    result.write_vtk(options.out / "crushed_sample")


if __name__ == "__main__":
    main()
