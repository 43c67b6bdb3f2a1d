"""A sample crushed to 5 % of strain: the load after the peak, and the pieces.

    python docs/examples/crushed_sample.py [--quick] [--confinement MPA] [--out FOLDER]

755 grains of the rock of the paper, minutes; --quick: 120 grains, half a minute. Grains that have come loose find each
other and rub. Without confinement the pieces fall apart and carry next to nothing. A membrane with a pressure p at the
sides keeps them together, and they go on carrying p (1 + sin(phi)) / (1 - sin(phi)), after Rankine; phi is at least the
friction angle of the broken contacts, and more where pieces interlock. Writes crushed_sample.png, and files for
ParaView to crushed_sample/.
"""

import attrs
import numpy as np
from matplotlib.figure import Figure
from moments import command_line, draw

import grainlaw as gl
from grainlaw.geometry import Voronoi, rectangle
from grainlaw.laws import CohesiveCrack
from grainlaw.protocols import BiaxialCompression
from grainlaw.results.fragments import fragments
from grainlaw.units import GPa, MPa, mm

ROCK = gl.Elastic(youngs_modulus=60 * GPa, poissons_ratio=0.25, density=3100)
LAW = CohesiveCrack(
    kn=1.05e14, ks=9.45e13, tensile_strength=13 * MPa, cohesion=29 * MPa, friction_angle=54, residual_friction_angle=5,
    mode_i_energy=150, mode_ii_energy=300,
)  # fmt: skip
FULL, QUICK = (755, 50 * mm, 125 * mm), (120, 20 * mm, 50 * mm)  #: grains, width, height
OTHERS = np.array(["#ee6677", "#228833", "#ccbb44", "#66ccee", "#aa3377"])  #: the largest piece is blue


@attrs.define
class Overlap(gl.Observer):
    """How deep contacts overlap at most (m), the most of them at a time, and how many bonds were handed over."""

    deepest: float = 0.0
    contacts: int = 0
    searches: int = 0
    handed_over: int = 0

    def observe(self, state, curves, stage, progress):
        closed = state.contacts.closed()
        self.deepest = max(self.deepest, -closed["opening"].min(initial=0.0))
        self.contacts = max(self.contacts, len(closed["opening"]))
        self.searches, self.handed_over = state.contacts.searches, int(state.replaced.sum())


def run(grains, width, height, confinement=0.0, strain=0.05, law=LAW, seed=1, **options):
    """Result and what the observer saw; ``confinement`` in Pa; ``options`` are those of `simulate`."""
    rock = gl.Specimen(Voronoi(grains=grains, seed=seed).tessellate(rectangle(width, height)), ROCK)
    watcher = Overlap()
    # After failure loose pieces lie between membrane and rock. All motion is damped, or the pressure would shoot them.
    test = BiaxialCompression(
        confinement=confinement, maximum_strain=strain, stop_fraction=0.0, samples=2000,
        loading=gl.Constant(speed=0.05),
        integrator=gl.integration.CentralDifference(damping=gl.integration.LocalDamping(), beside_loading=False),
    )  # fmt: skip
    return gl.simulate(rock, law, test, observers=[watcher], frames=60, **options), watcher


def residual(curves):
    """Pa, mean over the last fifth of the strain."""
    return float(curves["stress"][curves["strain"] > 0.8 * curves["strain"][-1]].mean())


def rankine(confinement, friction_angle):
    """Pa, axial stress of a sample without cohesion that yields under a confinement (Pa)."""
    sine = np.sin(np.radians(friction_angle))
    return confinement * (1 + sine) / (1 - sine)


def mobilised(stress, confinement):
    """Friction angle (degrees) of a sample without cohesion that carries this axial stress (Pa)."""
    return float(np.degrees(np.arcsin((stress - confinement) / (stress + confinement))))


def imbalance(curves):
    """Largest difference of both platens' stresses after the peak, means of 20 samples, over the peak."""
    peak = int(np.argmax(curves["stress"]))
    difference = (curves["stress_top"] - curves["stress_bottom"])[peak:]
    means = np.convolve(difference, np.full(20, 1 / 20), mode="valid")
    return float(np.abs(means).max() / curves["stress"][peak])


def drift(result, frame):
    """m to the right, mean of the mass: nothing holds a crushed specimen between smooth platens."""
    return float(frame.displacement[:, 0] @ result.specimen.node_masses / result.specimen.node_masses.sum())


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
    tail = axes.inset_axes((0.5, 0.45, 0.48, 0.5))
    tail.plot(curves["strain"] * 100, curves["stress"] / MPa, lw=0.8)
    highest = 4 * max(residual(curves) / MPa, 0.1)
    tail.set(xlim=(100 * curves["strain"][np.argmax(curves["stress"])], None), ylim=(0, highest), title="residual")
    times = np.array([frame.time for frame in result.frames])
    peak = curves["time"][np.argmax(curves["stress"])]
    for panel, time in zip(panels, np.linspace(peak, times[-1], 4), strict=True):
        k = int(np.argmin(abs(times - time)))
        pieces = fragments(result, k)
        colors = np.where(pieces.grains == 1, "#e8e4da", OTHERS[np.arange(len(pieces)) % len(OTHERS)])
        colors[0] = "#4477aa"
        draw(panel, result, result.frames[k], colors[pieces.of_grain], rim=0.2)
        away = drift(result, result.frames[k])
        panel.set(xlim=(left - margin + away, right + margin + away), ylim=(low, high))
        strain = 100 * np.interp(times[k], curves["time"], curves["strain"])
        panel.set_title(f"{strain:.2f} %, pieces: {len(pieces)}", fontsize=9)
    return figure


def main():
    confinement = {"type": float, "default": 0.0, "metavar": "MPA", "help": "pressure of a membrane at the sides (MPa)"}
    options = command_line(__doc__, confinement=confinement)
    confined = options.confinement * MPa
    result, watcher = run(*(QUICK if options.quick else FULL), confined)
    curves, summary = result.curves, result.summary
    size = float(np.median(np.sqrt(result.specimen.grains.areas)))
    left = residual(curves)
    print(f"peak {summary['strength'] / MPa:.2f} MPa, residual {left / MPa:.2f} MPa")
    if confined:
        angle = LAW.residual_friction_angle
        print(f"residual of a sample of {angle:g} degrees {rankine(confined, angle) / MPa:.2f} MPa (Rankine)")
        print(f"friction angle of the sample {mobilised(left, confined):.1f} degrees")
        width = np.ptp(result.specimen.grains.region.bounds[:, 0])
        print(f"it has moved sideways by {abs(drift(result, result.frames[-1])) / width:.2f} of its width")
    print(f"energy error {summary['energy_error']:.1e}")
    print(f"deepest mean overlap {watcher.deepest * 1e6:.1f} um, {watcher.deepest / size:.1e} of the grain size")
    print(f"imbalance {summary['imbalance']:.1e} before the peak, {imbalance(curves):.2f} after it")
    print(f"{len(fragments(result))} fragments, {watcher.handed_over} of {len(result.interfaces)} bonds handed over")
    print(f"{watcher.contacts} contacts at most, {watcher.searches} searches, {summary['seconds']:.0f} s")
    picture(result).savefig(options.out / "crushed_sample.png", dpi=100)
    result.write_vtk(options.out / "crushed_sample")


if __name__ == "__main__":
    main()
