"""Specimens of every shape answer to load: a pull makes no energy, and a hole raises the stress beside it."""

import attrs
import numpy as np
import pytest
from support import ROCK, STIFF, static_solution

import grainlaw as gl
from grainlaw.geometry import Hexagonal, Voronoi, disc, notched_beam, polygon, semi_disc, shear_box
from grainlaw.laws import Linear

RADIUS = 0.08
ANGLE = np.arange(24) * np.pi / 12
PLATE = polygon(
    [(0, 0), (1, 0), (1, 1), (0, 1)],
    ("bottom", "right", "top", "left"),
    {"hole": 0.5 + RADIUS * np.column_stack([np.cos(ANGLE), np.sin(ANGLE)])},
)
PULLED = {
    "beam": (notched_beam(0.2, 0.06, notch_depth=0.02, notch_width=1e-3, span=0.16, bearing=0.01), "load", "bottom"),
    "semi_disc": (
        semi_disc(0.076, notch_depth=0.019, notch_width=1e-3, span=0.046, bearing=0.006), "load", "support_left",
    ),
    "disc": (disc(0.05), "top", "bottom"),
    "shear box": (shear_box(0.1, 0.08), "top", "bottom"),
    "plate": (PLATE, "top", "bottom"),
    "L": (polygon([(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)], list("abcdef")), "e", "a"),
}  # fmt: skip


@attrs.frozen(kw_only=True)
class Pull(gl.LoadingProtocol):
    """One boundary lifted from another, both glued."""

    upper: str
    lower: str
    integrator: gl.integration.Integrator = gl.integration.CentralDifference(damping=gl.integration.Undamped())

    def stages(self, specimen):
        height = np.ptp(specimen.grains.region.bounds[:, 1])
        drives = [
            gl.loads.Drive(boundary=self.upper, axis=1, speed=0.05),
            gl.loads.Drive(boundary=self.lower, axis=1, speed=0),
        ]
        drives += [gl.loads.Drive(boundary=name, axis=0, speed=0) for name in (self.upper, self.lower)]
        end = gl.conditions.Reaches("displacement", 1e-4 * height)
        return [gl.Stage(name="pull", loads=drives, until=[end], interval=1e-5)]

    def measure(self, state):
        names = self.upper, self.lower
        return {"displacement": state.moved(names[0])[1]} | {name: state.reaction(name)[1] for name in names}

    def summary(self, curves, specimen):
        return {}


@pytest.mark.thorough
@pytest.mark.parametrize("tessellator", [Hexagonal, Voronoi])
@pytest.mark.parametrize(("region", "upper", "lower"), PULLED.values(), ids=PULLED)
def test_specimens_of_every_shape_carry_load(tessellator, region, upper, lower):
    specimen = gl.Specimen(tessellator(grains=60).tessellate(region), ROCK)
    result = gl.simulate(specimen, Linear(**STIFF), Pull(upper=upper, lower=lower))
    assert result.summary["energy_error"] < 1e-5
    assert result.curves[upper][-1] > 0 > result.curves[lower][-1]


def vertical_stress(specimen, displacement):
    """(z,) Pa, of small strain, from the gradient of each triangle."""
    mesh = specimen.mesh
    x, u = mesh.nodes[mesh.zones], displacement[mesh.zones]
    edges, moved = x[:, 1:] - x[:, :1], u[:, 1:] - u[:, :1]
    gradient = np.linalg.solve(edges, moved)  # row: derivative by x or y
    normal, across = specimen.zone_stiffness[:, 0, :2].T
    return normal * gradient[:, 1, 1] + across * gradient[:, 0, 0]


@pytest.mark.thorough
def test_a_hole_raises_the_stress_as_kirsch_says():
    """Hoop stress at the ends of the diameter across the load; contacts so stiff that the plate is a continuum.

    Kirsch 1898, for an infinite plate; one of 6.25 diameters raises it by about 2 % (Howland 1930,
    doi:10.1098/rsta.1930.0002). The grains at the hole are as large as half its radius: their zones are compared with
    the formula at their own centroids, 2.3 of the applied stress in the mean and not the 3 at the rim.
    """
    specimen = gl.Specimen(Voronoi(grains=1500).tessellate(PLATE), ROCK, refinement=1)
    displacement, _ = static_solution(specimen, 1e16, 1e16, 1e-4)
    mesh, stress = specimen.mesh, vertical_stress(specimen, displacement)
    applied = (stress * mesh.zone_areas).sum()  # over the square of 1 m2: what passes through each of its sections
    x, y = mesh.nodes[mesh.zones].mean(axis=1).T - 0.5
    far, angle = np.hypot(x, y) / RADIUS, np.arctan2(y, x)
    beside = (far < 1.25) & (abs(y) < 0.2 * abs(x))
    kirsch = (1 + far**-2) / 2 + (1 + 3 * far**-4) / 2 * np.cos(2 * angle)
    weights = mesh.zone_areas[beside] / mesh.zone_areas[beside].sum()
    assert beside.sum() > 30
    assert (stress / applied)[beside] @ weights == pytest.approx(kirsch[beside] @ weights, rel=0.05)
    assert kirsch[beside].max() > 2.7
    assert (stress / applied)[beside].max() == pytest.approx(kirsch[beside].max(), rel=0.15)
