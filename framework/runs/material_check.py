"""The conformance kit of materials: what the workbench asks of one zone, and a grain that turns in the engine."""

from __future__ import annotations

import math

import numpy as np

from grainlaw.arguments import checked
from grainlaw.compiler.batch import compile_integrator
from grainlaw.engine.model import Model
from grainlaw.engine.state import State
from grainlaw.engine.stepping import advance
from grainlaw.integration import CentralDifference, Undamped
from grainlaw.material import Material
from grainlaw.region import Region
from grainlaw.specimen import Specimen
from grainlaw.tessellation import Tessellation
from grainlaw.workbench.bench import Finding
from grainlaw.workbench.conformance import Report, entry
from grainlaw.workbench.material_bench import MaterialBench
from grainlaw.workbench.material_properties import PROPERTIES

EXCUSABLE = ("symmetry", "energy", "stiffness", "temperature")  #: properties a material may declare that it breaks
ANGLES = (0.0, 35.0, 200.0)  #: degrees by which the strained grain is turned
SAME = 1e-9  #: of the largest stress
ROUNDED = 1e-14  #: strain by which the displacements of a turned grain are rounded, and some more


@checked
def check_material(material: Material) -> Report:
    """Ask a material for every property that makes it safe to run.

    The paths are scaled from its own first response: stretch, shear, both while pressed, turning axes, random ones. The
    machine code must give the same answers, and the engine the same stress in a grain that turns while it is strained.
    Raises ParameterError for what is no material, one whose numbers differ from grain to grain, and one whose stiffness
    is not positive definite.
    """
    bench = MaterialBench(material)
    with np.errstate(all="ignore"):
        found = {name: ask(bench) for name, ask in PROPERTIES.items()}
        fit = found["finite"] is None and found["compiled"] is None
        found["objectivity"] = objectivity(bench) if fit else Finding("not asked: it takes finite, compiled answers")
    excused = {name: text for name, text in material.exceptions.items() if name in EXCUSABLE}
    return Report(type(material).__name__, tuple(entry(name, each, excused) for name, each in found.items()))


def objectivity(bench: MaterialBench) -> Finding | None:
    """A grain of the engine that is strained and turned has the turned stress, and its forces have no moment."""
    outline = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]) * 1e-2
    region = Region(outline, ("bottom", "right", "top", "left"))
    grains = Tessellation(region, outline, np.arange(4), np.array([0, 4]))
    specimen = Specimen(grains, bench.material)
    integrator = compile_integrator(CentralDifference(damping=Undamped()))
    name = "shear while pressed"
    points = bench.paths[name][: len(bench.paths[name]) // 3 : 3]
    expected = bench.zone.trace(points).stress
    allowed = max(SAME * float(np.abs(expected).max()), ROUNDED * float(np.abs(bench.zone.stiffness).max()))  # Pa
    for angle in map(math.radians, ANGLES):
        state = State(Model(specimen, {}))
        for i, (xx, yy, xy) in enumerate(points.tolist()):
            turned = angle * i / len(points)
            c, s = math.cos(turned), math.sin(turned)
            gradient = np.array([[c, -s], [s, c]]) @ [[1 + xx, xy], [xy, 1 + yy]]
            state.nodes.arrays.displacement[:] = (specimen.mesh.nodes @ gradient.T - specimen.mesh.nodes).T
            state.freedoms.arrays.velocity[:] = 0
            state.time_step = 1e-30
            advance(state, integrator, 1)
            state.freedoms.arrays.velocity[:] = 0
            state.count_steps(0, 0.0)
            stress = state.zone_state()[0]
            back = np.array([[c, s], [-s, c]])
            full = stress[:, [0, 2, 2, 1]].reshape(-1, 2, 2)
            found = (back @ full @ back.T).reshape(-1, 4)[:, [0, 3, 1]]
            wrong = float(np.abs(found - expected[i]).max())
            if not wrong <= allowed:
                text = f"turned by {math.degrees(turned):.3g} degrees the stress of a grain differs by {wrong:.4g} Pa"
                return Finding(f"{name}: {text}", wrong)
            force, place = state.nodes.arrays.force, state.positions.T
            moment = float(np.sum(place[0] * force[1] - place[1] * force[0]))
            if not abs(moment) <= allowed * 1e-4:
                return Finding(f"{name}: the forces of a grain have a moment of {moment:.4g} N", abs(moment))
    return None
