"""Pictures of a material: one zone compressed under confinements, pulled, and sheared to and fro."""

from __future__ import annotations

import numpy as np

from grainlaw.arguments import checked
from grainlaw.drawing.figure import Figure
from grainlaw.drawing.palette import style
from grainlaw.fields import ParameterError
from grainlaw.material import Material
from grainlaw.workbench.law_figure import MPA, SHADES
from grainlaw.workbench.material_bench import MaterialBench
from grainlaw.workbench.zone import compress, trace_material

STEPS = 300
FAR = 12  #: times the strain at which the first response ends
BENT = 0.8  #: of the stress of the first response: a curve that ends below it shows what comes after
FURTHER = (1, 2, 4, 8)  #: times as far, for a material that bears more in compression


@checked
def plot_material(material: Material) -> Figure:
    """Draw what one zone of a material answers: compressed under four confinements, pulled, and sheared to and fro.

    Ranges follow the end of its first response. Raises ParameterError for one whose numbers differ from grain to grain.
    """
    bench = MaterialBench(material)
    far, modulus = FAR * bench.scale, float(bench.zone.stiffness[1, 1])
    furthest = next((k * far for k in FURTHER if _is_bent(material, k * far)), far)
    figure = Figure(figsize=(13.5, 4.4), layout="constrained")
    pressed, pulled, sheared = figure.subplots(1, 3)
    for k, share in enumerate((0.0, 0.2, 0.5, 1.0)):
        pressure = float(f"{share * bench.scale * modulus:.1g}")
        trace = _as_far(material, furthest, pressure)
        if trace is not None:
            label = f"confinement {pressure * MPA:.3g} MPa"
            pressed.plot(
                100 * (trace[0][0] - trace[0]), -MPA * trace[1], color=SHADES[k], linestyle=style(k), label=label
            )
    pressed.set(xlabel="shortening along y (%)", ylabel="stress along y (MPa)", title="compressed in plane strain")
    pressed.legend(frameon=False)
    trace = _as_far(material, -far, 0.0)
    if trace is not None:
        pulled.plot(100 * trace[0], MPA * trace[1], color=SHADES[0])
    pulled.set(xlabel="extension along y (%)", ylabel="stress along y (MPa)", title="pulled")
    angle = far * np.concatenate([np.linspace(0, 1, STEPS), np.linspace(1, -1, STEPS), np.linspace(-1, 1, STEPS)])
    found = trace_material(material, 0.0, 0.0, angle / 2)
    sheared.plot(100 * angle, MPA * found.stress[:, 2], color=SHADES[0])
    sheared.set(xlabel="shear angle (%)", ylabel="shear stress (MPa)", title="sheared to and fro")
    figure.suptitle(type(material).__name__)
    return figure


def _is_bent(material: Material, strain: float) -> bool:
    """Whether a zone that is pressed so far, without confinement, shows more than its first response."""
    trace = _as_far(material, strain, 0.0)
    if trace is None:
        return True
    along, stress = trace
    return bool(abs(stress[-1]) < BENT * abs(stress[1] / along[1] * along[-1]))


def _as_far(material: Material, strain: float, pressure: float) -> tuple[np.ndarray, np.ndarray] | None:
    """Strain and stress along y, as far as the zone keeps its confinement."""
    for share in (1.0, 0.5, 0.25, 0.1):
        try:
            found = compress(material, np.linspace(0, share * strain, STEPS), confinement=pressure)
        except ParameterError:  # it softens faster than it unloads
            continue
        return found.strain[:, 1], found.stress[:, 1]
    return None
