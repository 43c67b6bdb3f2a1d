"""Initial cracks: which edges are drawn, and that they bear no tension."""

import attrs
import numpy as np
import pytest
import pyvista
from hypothesis import given, settings
from hypothesis import strategies as st
from support import ROCK, STRONG

import grainlaw as gl
from grainlaw.fields import ParameterError
from grainlaw.geometry import Breakable, Bricks, Cracked, Jointed, Minerals, Voronoi, VoronoiCells, rectangle
from grainlaw.laws import Friction, Linear, MohrCoulomb
from grainlaw.protocols import UniaxialTension

UNIT = rectangle(1, 1)
GRAINS = Minerals(Voronoi(grains=60, seed=2), {"quartz": 0.5, "mica": 0.5})
CLOSED = Friction(kn=STRONG["kn"], ks=STRONG["ks"], friction_angle=30)


def cracks(tessellation, name="initial cracks"):
    """Lengths and directions (0 to 180 degrees) of the cracks, and the phases beside them; the rim has none."""
    edges = tessellation.edges
    chosen = edges.kind == tessellation.kinds.index(name)
    assert (edges.right[chosen] >= 0).all()
    x, y = (tessellation.vertices[edges.end] - tessellation.vertices[edges.start])[chosen].T
    phases = np.sort(tessellation.phase[np.stack([edges.left, edges.right])][:, chosen], axis=0)
    return edges.length[chosen], np.degrees(np.arctan2(y, x)) % 180, phases


@pytest.mark.thorough
@settings(max_examples=25, deadline=None)
@given(share=st.floats(0.01, 1), seed=st.integers(0, 99))
def test_a_share_of_the_length_is_cracked(share, seed):
    made = Cracked(GRAINS, share, seed=seed).tessellate(UNIT)
    edges = made.edges
    inner = edges.length[edges.right >= 0]
    length = cracks(made)[0]
    assert abs(length.sum() - share * inner.sum()) <= max(edges.length.max() / 2, share * 1e-12)
    fewer = Cracked(GRAINS, share / 2, seed=seed).tessellate(UNIT).joints["initial cracks"]
    assert np.array_equal(fewer, made.joints["initial cracks"][: len(fewer)])


def test_minerals_lengths_and_directions_are_asked_for():
    _, _, phases = cracks(Cracked(GRAINS, 0.5, between=[("mica", "quartz")]).tessellate(UNIT))
    assert (phases == [[0], [1]]).all()
    length, direction, _ = cracks(Cracked(GRAINS, 1.0, least=0.5, direction=170, within=20).tessellate(UNIT))
    assert length.min() >= 0.5 * GRAINS.tessellate(UNIT).grain_size
    assert len(direction) > 3
    assert np.all((direction <= 10 + 1e-9) | (direction >= 150 - 1e-9))
    assert direction.min() < 10 < 150 < direction.max()


def test_joints_and_cells_stay_what_they_are():
    jointed = Jointed(Breakable(Voronoi(grains=20), VoronoiCells(count=4)), {"fault": [[(-1, 0.5), (2, 0.5)]]})
    made = Cracked(Cracked(jointed, 0.3), 0.2, seed=2, name="open").tessellate(UNIT)
    plain = jointed.tessellate(UNIT)
    assert made.kinds == ("between", "inside", "fault", "initial cracks", "open")
    assert np.array_equal(made.edges.kind == 2, plain.edges.kind == 2)
    assert np.array_equal(made.edges.kind == 1, plain.edges.kind == 1)
    made.check()


@pytest.mark.parametrize(
    ("wrong", "says"),
    [
        ({"share": 0.0}, "Cracked: share"),
        ({"share": 1.1}, "Cracked: share"),
        ({"between": [("quartz", "mika")]}, r"no pair \('quartz', 'mika'\) \(phases: quartz, mica\)"),
        ({"between": [(0, 2)]}, r"no pair \(0, 2\)"),
        ({"between": "quartz"}, "Cracked: between = 'quartz' is not allowed"),
        ({"between": [("quartz",)]}, "a pair of phases"),
        ({"least": 50}, "no edge of the 60 grains is asked for by least = 50"),
        ({"name": "inside"}, "Cracked: name = 'inside' is not allowed"),
        ({"within": 0}, "Cracked: within"),
    ],
)
def test_what_cannot_be_is_refused(wrong, says):
    with pytest.raises(ParameterError, match=says):
        Cracked(GRAINS, **{"share": 0.5, **wrong}).tessellate(UNIT)


def test_cracks_without_a_law_of_their_own_are_refused():
    specimen = gl.Specimen(Cracked(Voronoi(grains=12, seed=1), share=0.5).tessellate(rectangle(0.02, 0.04)), ROCK)
    for laws in (CLOSED, {...: CLOSED}):
        with pytest.raises(gl.ParameterError, match="the initial cracks have no law of their own"):
            gl.simulate(specimen, laws, UniaxialTension())
        with pytest.raises(gl.ParameterError, match="the initial cracks have no law of their own"):
            gl.elastic_properties(specimen, laws)


def test_names_do_not_meet():
    with pytest.raises(ParameterError, match="the grains have joints of this name"):
        Cracked(Cracked(GRAINS, 0.1), 0.1).tessellate(UNIT)


def test_paraview_shows_them_from_the_start_by_their_kind(tmp_path):
    """Half of each edge as a line: their lengths sum to that of the cracks; what is whole is not shown."""
    made = Cracked(Voronoi(grains=20), 0.3).tessellate(rectangle(0.01, 0.02))
    test = UniaxialTension(loading=gl.Constant(speed=1e-3), maximum_strain=1e-8, samples=10, stop_fraction=0)
    law = {"initial cracks": CLOSED, ...: MohrCoulomb(**STRONG)}
    gl.simulate(gl.Specimen(made, ROCK), law, test).write_vtk(tmp_path)
    shown = pyvista.read(sorted(tmp_path.glob("cracks_*.vtu"))[0])
    assert shown.field_data["kinds"].tolist() == ["between, inside, initial cracks"]
    assert np.all(shown.cell_data["kind"] == 2)
    lengths = np.linalg.norm(np.diff(shown.points.reshape(-1, 2, 3), axis=1), axis=2)
    assert lengths.sum() == pytest.approx(cracks(made)[0].sum(), rel=1e-5)


def test_a_crack_across_bears_pressure_and_no_tension():
    """The whole of the one interface: pulled it bears nothing; its stiffness is that of the bond that it replaces."""
    bricks, plate = Bricks(rows=2, columns=1), rectangle(0.01, 0.02)
    law = {"initial cracks": CLOSED, ...: MohrCoulomb(**STRONG)}
    sound, cracked = (gl.Specimen(made.tessellate(plate), ROCK) for made in (bricks, Cracked(bricks, 1.0)))
    test = UniaxialTension(loading=gl.Constant(speed=2e-3), maximum_strain=2e-5, samples=20, stop_fraction=0)
    stress = [gl.simulate(*each, test).curves["stress"] for each in ((sound, law[...]), (cracked, law))]
    assert stress[0][-1] > 0.5e6
    assert np.abs(stress[1]).max() < 0.03 * stress[0][-1]  # half the plate is set in motion
    moduli = [gl.elastic_properties(*each).apparent_modulus for each in ((sound, law[...]), (cracked, law))]
    assert moduli[1] == pytest.approx(moduli[0])


@attrs.frozen(kw_only=True)
class Pressed(gl.LoadingProtocol):
    """A pressure along y on the whole rim."""

    pressure: float  #: Pa

    def stages(self, specimen):
        stress = (0, -self.pressure, 0)
        rim = [gl.loads.Traction(boundary=name, stress=stress, ramp=4e-5) for name in specimen.mesh.boundaries]
        return [gl.Stage(name="press", loads=rim, until=[gl.conditions.AtRest(ratio=1e-3)], interval=2e-6)]

    def measure(self, state):
        return {}

    def summary(self, curves, specimen):
        return {}


@pytest.mark.thorough
def test_an_open_crack_closes_at_the_stress_of_the_handbook():
    """A slit of 20 mm and a gap of 2 um in a plate of 50 mm x 100 mm.

    Its faces come nearer by 4 sigma a V / E* in the middle (Tada, Paris and Irwin 2000, doi:10.1115/1.801535). Zones of
    constant strain are too stiff at the tips, by half as much where they are half as large.
    """
    width, half, gap = 0.05, 0.01, 2e-6
    trace = [(width / 2 - half, width), (width / 2 + half, width)]
    grains = Jointed(Voronoi(grains=1200, seed=1), {"slit": [trace]}).tessellate(rectangle(width, 2 * width))
    half = np.ptp(grains.vertices[grains.joints["slit"]][..., 0]) / 2
    share = 2 * half / width
    wider = -0.071 - 0.535 * share + 0.169 * share**2 + 0.020 * share**3 - 1.071 / share * np.log(1 - share)
    bond = Linear(kn=4e15, ks=4e15)
    laws = {"slit": Friction(kn=4e15, ks=4e15, friction_angle=0, gap=gap), ...: bond}

    def pressed(times, refinement):
        """Opening and pressure of the slit under a stress that should close it so many times."""
        specimen = gl.Specimen(grains, ROCK, refinement=refinement)
        closes = gap * gl.elastic_properties(specimen, bond).apparent_modulus / (4 * half * wider)
        result = gl.simulate(specimen, laws, Pressed(pressure=times * closes), frames=2)
        x, y = specimen.mesh.nodes[result.interfaces].mean(axis=1).T
        slit = np.tile((abs(y - width) < 1e-9) & (abs(x - width / 2) < half), 2)
        return [result.frames[-1].bonds[name][slit] for name in ("opening", "normal")]

    coarse, fine = pressed(0.9, 0), pressed(0.9, 1)
    assert not coarse[1].any()
    assert not fine[1].any()
    assert 2 * fine[0].min() - coarse[0].min() == pytest.approx(-0.9 * gap, rel=0.02)
    opening, normal = pressed(1.2, 0)
    assert 0 < (normal < 0).mean() < 0.7  # the ends stay open
    assert np.all((opening < -gap) == (normal < 0))
