"""Grains from meshes, and geometries for gmsh."""

import re

import attrs
import meshio
import numpy as np
import pytest
from support import BRITTLE, ROCK
from tiling import BEAM, assert_tiles, shoelace

import grainlaw as gl
from grainlaw.fields import ParameterError
from grainlaw.geometry import Voronoi, from_mesh, meshes, rectangle, write_geo
from grainlaw.protocols import UniaxialCompression
from grainlaw.units import mm

POINTS = [(0, 0, 0), (2, 0, 0), (4, 0, 0), (0, 2, 0), (2, 2, 0), (4, 2, 0), (9, 9, 0)]


def mixed(folder, points=POINTS, **data):
    """A square of two triangles and, beside it, a quadrilateral that runs clockwise.

    Lines along the bottom, one on the right in a group without a name, and one to a node of no element.
    """
    cells = [("line", [(0, 1), (1, 2), (2, 5), (5, 6)]), ("triangle", [(0, 1, 4), (0, 4, 3)]), ("quad", [(1, 4, 5, 2)])]
    mesh = meshio.Mesh(points, cells, cell_data={k: [np.array(v) for v in each] for k, each in data.items()})
    mesh.field_data = {"base": np.array([5, 1]), "mica": np.array([2, 2])}
    file = folder / "x.msh"
    meshio.write(file, mesh, file_format="gmsh22", binary=False)
    return file


GROUPS = {"gmsh:physical": [[5, 5, 9, 5], [2, 2], [3]], "gmsh:geometrical": [[1, 2, 3, 4], [7, 7], [8]]}


def test_every_element_is_a_grain(tmp_path):
    grains = from_mesh(mixed(tmp_path, **GROUPS), unit=1e-3)
    assert_tiles(grains)
    assert grains.areas == pytest.approx([2e-6, 2e-6, 4e-6])
    assert [grains.phase_name(p) for p in grains.phase] == ["mica", "mica", "3"]
    assert grains.region.outline.tolist() == [[0, 0], [4e-3, 0], [4e-3, 2e-3], [0, 2e-3]]
    assert grains.region.sides == ("base", "right", "top", "left")
    assert not grains.is_breakable


def test_elements_with_one_number_are_the_cells_of_one_grain(tmp_path):
    file = mixed(tmp_path, **GROUPS)
    assert from_mesh(file, grain_data="gmsh:geometrical").parent.tolist() == [0, 0, 1]
    assert from_mesh(file, phase_data="gmsh:geometrical").phase_names == ("7", "8")


def test_lines_between_elements_are_told(tmp_path):
    """The edge between both triangles is in the group of the bottom."""
    file = mixed(tmp_path, **GROUPS)
    text = file.read_text().replace("1 1 2 5 1 1 2", "1 1 2 5 1 1 5")
    assert text != file.read_text()
    file.write_text(text)
    with pytest.warns(UserWarning, match="the physical groups of lines base lie between elements: they name no bound"):
        from_mesh(file)


def test_meshes_of_other_programs(tmp_path):
    """Without groups; two parts with nodes of their own, one with a node on an edge of the other."""
    points = [(0, 0), (1, 0), (1, 1), (0, 1), (1, 0), (2, 0), (2, 1), (1, 1), (1, 0.5)]
    cells = [("quad", [(0, 1, 2, 3)]), ("triangle", [(8, 4, 5), (8, 5, 6), (8, 6, 7)])]
    meshio.write(tmp_path / "x.vtu", meshio.Mesh(np.pad(np.array(points, dtype=float), ((0, 0), (0, 1))), cells))
    grains = from_mesh(tmp_path / "x.vtu")
    assert_tiles(grains)
    assert len(grains.vertices) == 7
    assert grains.phase_names == ()
    assert set(grains.boundary_names) == {"bottom", "right", "top", "left"}


def test_a_hole_of_the_mesh_is_one_of_the_region(tmp_path):
    outer, inner = np.array([(0, 0), (3, 0), (3, 3), (0, 3)]), np.array([(1, 1), (2, 1), (2, 2), (1, 2)])
    ring = [(k, (k + 1) % 4, 4 + (k + 1) % 4, 4 + k) for k in range(4)]
    meshio.write(tmp_path / "x.vtk", meshio.Mesh(np.pad(np.concatenate([outer, inner]), ((0, 0), (0, 1))) * 1.0,
                                                 [("quad", ring)]))  # fmt: skip
    assert from_mesh(tmp_path / "x.vtk").region.area == pytest.approx(8)


@pytest.mark.parametrize(
    ("points", "options", "said"),
    [
        ([*POINTS[:4], (2, 2, 1), *POINTS[5:]], {}, "nodes at z = 0 to 1, it must be plane"),
        (POINTS, {"grain_data": "gmsh:geometrcal"}, "did you mean 'gmsh:geometrical'"),
        (POINTS, {"phase_data": "mineral"}, "no data 'mineral' of its elements"),
        ([*POINTS[:4], (1.5, 0.5, 0), (0.4, 1, 0), POINTS[6]], {}, "overlap"),
    ],
)
def test_other_meshes_are_refused(points, options, said, tmp_path):
    file = mixed(tmp_path, points, **GROUPS)
    with pytest.raises(ParameterError, match=said):
        from_mesh(file, **options)


def test_what_is_no_mesh_of_an_area_is_refused(tmp_path):
    corner = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
    meshio.write(tmp_path / "x.vtk", meshio.Mesh(np.array(corner) * 1.0, [("tetra", [(0, 1, 2, 3)])]))
    with pytest.raises(ParameterError, match="elements of the kind tetra, it must be a mesh of an area"):
        from_mesh(tmp_path / "x.vtk")
    meshio.write(tmp_path / "y.vtk", meshio.Mesh(np.array(corner) * 1.0, [("line", [(0, 1)])]))
    with pytest.raises(ParameterError, match="has no triangles"):
        from_mesh(tmp_path / "y.vtk")
    (tmp_path / "z.msh").write_text("no mesh")
    for name in ("z.msh", "absent.msh", "z.unknown"):
        with pytest.raises(ParameterError, match="cannot be read as a mesh"):
            from_mesh(tmp_path / name)


@pytest.fixture
def gmsh():
    """The program, where it and the system libraries that it needs are installed."""
    try:
        import gmsh
    except (ImportError, OSError) as error:
        pytest.skip(f"gmsh cannot be loaded: {error}")
    gmsh.initialize(interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)
    yield gmsh
    gmsh.finalize()


def test_places_and_sizes_of_elements_are_in_units_of_the_file(tmp_path):
    grains = Voronoi(grains=5).tessellate(rectangle(0.02, 0.04))
    write_geo(grains, tmp_path / "x.geo", size=0.003, unit=1 * mm)
    points = re.findall(r"Point\(\d+\) = \{(.*), (.*), 0, (.*)\};", (tmp_path / "x.geo").read_text())
    x, y, size = np.array(points, dtype=float).T
    assert (x.max(), y.max()) == pytest.approx((20, 40))
    assert size == pytest.approx(3)


@pytest.mark.parametrize("version", [2.2, 4.1])
@pytest.mark.parametrize("region", [rectangle(0.02, 0.04), BEAM], ids=["rectangle", "beam"])
def test_grains_go_to_gmsh_and_come_back_with_triangles_inside(region, version, gmsh, tmp_path):
    grains = Voronoi(grains=20).tessellate(region)
    grains = attrs.evolve(grains, phase=np.arange(grains.count) % 2, phase_names=("quartz", "K-feldspar"))
    write_geo(grains, tmp_path / "x.geo", size=0.003, unit=1e-3)
    gmsh.open(str(tmp_path / "x.geo"))
    gmsh.model.mesh.generate(2)
    gmsh.option.setNumber("Mesh.MshFileVersion", version)
    gmsh.write(str(tmp_path / "x.msh"))
    cells = from_mesh(tmp_path / "x.msh", unit=1e-3, grain_data="gmsh:geometrical")
    assert np.bincount(cells.parent, cells.areas) == pytest.approx(grains.areas)
    assert [cells.phase_name(p) for p in cells.phase] == [grains.phase_name(grains.phase[p]) for p in cells.parent]
    assert set(cells.boundary_names) == set(grains.boundary_names)
    assert cells.count > 2 * grains.count


def test_a_mesh_of_triangles_is_compressed(gmsh, tmp_path):
    plane = gmsh.model.occ.addRectangle(0, 0, 0, 20, 40)
    gmsh.model.occ.synchronize()
    gmsh.model.addPhysicalGroup(2, [plane], name="granite")
    gmsh.option.setNumber("Mesh.MeshSizeMin", 6)
    gmsh.model.mesh.generate(2)
    gmsh.write(str(tmp_path / "x.msh"))
    grains = from_mesh(tmp_path / "x.msh", unit=1 * mm)
    assert_tiles(grains)
    assert grains.region.area == pytest.approx(20 * 40e-6)
    protocol = UniaxialCompression(loading=gl.Constant(speed=0.2), maximum_strain=5e-3, samples=100)
    summary = gl.simulate(gl.Specimen(grains, ROCK), {("granite", "granite"): BRITTLE}, protocol).summary
    # Plane strain; contacts of 105 TPa/m every 6 mm or so are in series with the rock.
    assert 0.6 < summary["apparent_modulus"] / (60e9 / (1 - 0.25**2)) < 1
    # A single joint at the worst angle fails at 2 c cos(phi) / (1 - sin(phi)) = 178 MPa.
    assert 0.5 * 178e6 < summary["strength"] < 2 * 178e6
    assert summary["energy_error"] < 1e-5


@pytest.mark.parametrize(
    ("node", "place", "said"),
    [
        (-1, 1.0, r"has an element with the node -1, it must be one of 0 to 3"),
        (4, 1.0, r"has an element with the node 4, it must be one of 0 to 3"),
        (3, np.nan, "nodes = .* is not allowed"), (3, np.inf, "nodes = .* is not allowed"),
        (3, 1e200, "nodes = .* is not allowed"),
    ],
)  # fmt: skip
def test_a_node_that_is_nowhere_is_named(node, place, said, tmp_path):
    points = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, place, 0)], dtype=float)
    meshio.write(tmp_path / "x.vtk", meshio.Mesh(points, [("triangle", [(0, 1, 2), (0, 2, node)])]))
    with pytest.raises(ParameterError, match=said):
        from_mesh(tmp_path / "x.vtk")


def test_the_loops_of_gmsh_run_round_their_grains(tmp_path):
    """Line by line, backwards where the number is negative: counter-clockwise, with the area of the grain."""
    grains = Voronoi(grains=12).tessellate(rectangle(0.02, 0.04))
    write_geo(grains, tmp_path / "x.geo", size=0.003)
    text = (tmp_path / "x.geo").read_text()
    point = {int(v): (float(x), float(y)) for v, x, y in re.findall(r"Point\((\d+)\) = \{(.*?), (.*?), 0", text)}
    line = {int(e): (int(i), int(j)) for e, i, j in re.findall(r"Line\((\d+)\) = \{(\d+), (\d+)\}", text)}
    loops = re.findall(r"Curve Loop\(\d+\) = \{(.*)\}", text)
    runs = [[line[abs(int(e))][:: 1 if int(e) > 0 else -1] for e in loop.split(", ")] for loop in loops]
    for run in runs:
        assert [end for _, end in run] == [start for start, _ in run[1:] + run[:1]]
    rings = [np.array([point[start] for start, _ in run]) for run in runs]
    assert [shoelace(ring) for ring in rings] == pytest.approx(grains.areas)


@pytest.mark.parametrize("values", [[1, 2.5], ["a", "b"]])
def test_data_of_elements_that_are_no_whole_numbers_are_refused(values):
    mesh = meshio.Mesh(POINTS, [("triangle", [(0, 1, 4), (0, 4, 3)])], cell_data={"mineral": [np.array(values)]})
    with pytest.raises(ParameterError, match=r"x\.msh: the data 'mineral' of its elements must be whole numbers"):
        meshes._data("x.msh", mesh, [0], "mineral")
    mesh.cell_data["mineral"] = [np.array([1.0, 2.0])]
    assert meshes._data("x.msh", mesh, [0], "mineral").tolist() == [1, 2]
