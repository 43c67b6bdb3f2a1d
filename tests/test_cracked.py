"""Initial cracks: which edges are drawn, and that they bear no tension."""

import numpy as np
import pytest
import pyvista
from hypothesis import given, settings
from hypothesis import strategies as st
from support import ROCK, STRONG

import grainlaw as gl
from grainlaw.fields import ParameterError
from grainlaw.geometry import Breakable, Bricks, Cracked, Jointed, Minerals, Voronoi, VoronoiCells, rectangle
from grainlaw.laws import Friction, MohrCoulomb
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
