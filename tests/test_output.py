"""What a run writes: VTK that reads back, pictures; and that a kill at any moment leaves it readable."""

import signal
import subprocess
import sys
import time
import xml.etree.ElementTree as ET

import attrs
import numpy as np
import pytest
import pyvista
from support import BRITTLE, PULL, ROCK, STIFF, STRONG, small_sample

import grainlaw as gl
from grainlaw.geometry import Bricks, rectangle
from grainlaw.laws import CohesiveCrack, Linear, MohrCoulomb
from grainlaw.protocols import UniaxialCompression
from grainlaw.results.vtk import VtkWriter


@pytest.fixture(scope="module")
def broken():
    """A sample of two phases after it has cracked."""
    specimen = small_sample()
    phase = np.arange(specimen.grains.count) % 2
    specimen = gl.Specimen(attrs.evolve(specimen.grains, phase=phase), ROCK)
    return gl.simulate(specimen, CohesiveCrack(**STRONG, mode_i_energy=1, mode_ii_energy=2), PULL, frames=6)


@pytest.fixture(scope="module")
def written(broken, tmp_path_factory):
    folder = tmp_path_factory.mktemp("vtk")
    broken.write_vtk(folder)
    return folder


def listed(folder, name):
    """Times and files of a .pvd."""
    sets = ET.parse(folder / f"{name}.pvd").getroot().findall("Collection/DataSet")
    return [float(entry.get("timestep")) for entry in sets], [folder / entry.get("file") for entry in sets]


@pytest.mark.parametrize("name", ["grains", "cracks"])
def test_series_list_ascending_times_and_every_file(broken, written, name):
    times, files = listed(written, name)
    assert times == [frame.time for frame in broken.frames]
    assert times == sorted(set(times))
    assert sorted(files) == sorted(written.glob(f"{name}_*.vtu"))
    assert {file.name for file in written.iterdir() if file.suffix not in (".pvd", ".vtu")} == {"show_in_paraview.py"}
    reader = pyvista.get_reader(written / f"{name}.pvd")
    assert reader.time_values == times
    reader.set_active_time_point(len(times) - 1)
    assert reader.read()[0].n_cells == pyvista.read(files[-1]).n_cells


def test_grains_read_back(broken, written):
    mesh, frame = broken.mesh, broken.frames[-1]
    file = listed(written, "grains")[1][-1]
    grid = pyvista.read(file)
    assert np.array_equal(grid.points[:, :2], mesh.nodes + frame.displacement)
    assert np.all(grid.points[:, 2] == 0)
    assert np.array_equal(grid.cells_dict[pyvista.CellType.TRIANGLE], mesh.zones)
    assert np.array_equal(grid.point_data["displacement"][:, :2], frame.displacement)
    assert np.array_equal(grid.point_data["velocity"][:, :2], frame.velocity)
    for name, expected in {
        "grain": mesh.zone_grain,
        "phase": mesh.zone_grain % 2,
    }.items():
        assert np.array_equal(grid.cell_data[name], expected), name
    xx, yy, zz, xy, *rest = grid.cell_data["stress"].T
    assert np.array_equal(np.column_stack([xx, yy, xy]), frame.stress[mesh.zone_grain])
    assert np.allclose(zz, 0.25 * (xx + yy), rtol=1e-12)
    assert not np.any(rest)
    planes = np.linalg.eigvalsh(np.stack([[xx, xy], [xy, yy]]).transpose(2, 0, 1))
    assert np.allclose(
        np.column_stack([grid.cell_data["stress_2"], grid.cell_data["stress_1"]]), planes, atol=1e-6 * 1e6
    )


def test_rotations_of_grains_are_those_of_the_engine(tmp_path):
    """A block that is turned by hand, whatever its strain and place."""
    specimen, angle = small_sample(6), 0.7
    nodes = specimen.mesh.nodes
    c, s = np.cos(angle), np.sin(angle)
    moved = nodes * [1.001, 0.999] @ np.array([[c, s], [-s, c]]) + [3.0, -2.0]
    assert specimen.grain_rotations(moved) == pytest.approx(angle, abs=1e-3)


def test_stress_of_bricks_under_uniform_pressure(tmp_path):
    """Known beforehand: smooth platens on level joints, so that every grain bears the same."""
    bricks = gl.Specimen(Bricks(rows=4, columns=2).tessellate(rectangle(0.02, 0.04)), ROCK)
    test = UniaxialCompression(loading=gl.Constant(speed=0.02), maximum_strain=1e-4, samples=10)
    result = gl.simulate(bricks, Linear(**STIFF), test, frames=2)
    result.write_vtk(tmp_path)
    xx, yy, _, xy, *_ = pyvista.read(listed(tmp_path, "grains")[1][-1]).cell_data["stress"].T
    modulus = 1 / ((1 - 0.25**2) / 60e9 + 3 / (STIFF["kn"] * 0.04))
    pressure = modulus * -pyvista.read(listed(tmp_path, "grains")[1][-1]).point_data["displacement"][:, 1].min() / 0.04
    assert np.allclose(yy, -pressure, rtol=0.02)
    assert np.abs(xx).max() < 0.05 * pressure
    assert np.abs(xy).max() < 0.05 * pressure


def test_cracks_read_back(broken, written):
    """Lines between the two grains that parted, with what the law remembers."""
    frame = broken.frames[-1]
    damaged = np.flatnonzero(frame.bonds["damage"] > 0)
    read = pyvista.read(listed(written, "cracks")[1][-1])
    data = dict(read.cell_data)
    assert len(damaged) > 5
    for name in ("damage", "mode", "opening", "slip", "normal", "shear", "broken_time"):
        assert np.array_equal(data[name], frame.bonds[name][damaged], equal_nan=True), name
    ends = read.points[read.cells_dict[pyvista.CellType.LINE]][:, :, :2]
    place = broken.mesh.nodes + frame.displacement
    assert {"grain_a", "grain_b"} <= set(data)
    for line, a, b, opening in zip(ends, data["grain_a"], data["grain_b"], data["opening"], strict=True):
        assert a != b
        for grain in (a, b):  # both ends lie half an opening from the rim of either grain
            rim = place[broken.mesh.node_grain == grain]
            near = min(np.hypot(*(rim - end).T).min() for end in line)
            assert near <= 0.51 * max(abs(opening), 1e-7) + 0.5 * np.hypot(*(line[1] - line[0])) + 1e-6
    assert np.hypot(*(ends[:, 1] - ends[:, 0]).T).sum() > 0
    assert np.nanmax(data["broken_time"]) <= frame.time


def test_an_unbroken_run_reads_back(tmp_path):
    result = gl.simulate(
        small_sample(8), Linear(**STIFF), attrs.evolve(PULL, maximum_strain=1e-5, samples=10), frames=2
    )
    result.write_vtk(tmp_path)
    files = listed(tmp_path, "cracks")[1]
    assert len(files) == len(result.frames) > 1
    for file in files:
        assert pyvista.read(file).cell_data["damage"].max() == 0


def test_cracks_of_a_result(broken):
    cracks = broken.cracks
    assert len(cracks) == broken.summary["tensile_cracks"] + broken.summary["shear_cracks"] > 3
    assert cracks.tensile.sum() == broken.summary["tensile_cracks"]
    assert np.all(np.diff(cracks.time) >= 0)
    assert np.all((cracks.orientation >= 0) & (cracks.orientation < np.pi))
    assert np.all((cracks.mode >= 0) & (cracks.mode <= 1))
    assert cracks.grains.shape == cracks.position.shape == (len(cracks), 2)
    assert np.all(cracks.grains[:, 0] != cracks.grains[:, 1])
    low, high = broken.specimen.grains.region.bounds
    assert np.all((cracks.position > low) & (cracks.position < high + 1e-4))
    lengths = np.hypot(*broken.mesh.interface_edges.T) / 2
    for k in range(len(cracks)):
        shared = np.flatnonzero((broken.mesh.interface_grains == cracks.grains[k]).all(axis=1))
        assert cracks.length[k] == pytest.approx(lengths[shared], rel=1e-12)
        edge = broken.mesh.interface_edges[shared[0]]
        turn = cracks.orientation[k] - np.arctan2(edge[1], edge[0])
        assert abs(np.sin(turn)) < 0.01  # grains have turned since
    # Pulled along y: what opens lies across.
    across = np.average(np.abs(np.sin(cracks.orientation)), weights=cracks.opening.clip(0) + 1e-30)
    assert across < np.sin(np.radians(45))


# --- while a run goes on ---------------------------------------------------------------------------------------------

ENDLESS = """
import sys
from support import STRONG, small_sample
import grainlaw as gl
from grainlaw.laws import MohrCoulomb
from grainlaw.protocols import UniaxialTension
from grainlaw.results.vtk import VtkWriter
test = UniaxialTension(loading=gl.Constant(speed=0.01), maximum_strain=0.01, samples=5000, stop_fraction=0)
gl.simulate(small_sample(150), MohrCoulomb(**STRONG), test, observers=[VtkWriter(sys.argv[1], count=5000)])
"""


@pytest.mark.thorough
@pytest.mark.skipif(sys.platform == "win32", reason="no SIGKILL")
def test_a_kill_leaves_the_series_readable(tmp_path):
    process = subprocess.Popen([sys.executable, "-c", ENDLESS, str(tmp_path)], cwd=str(tmp_path), env=environment())
    try:
        patience = time.monotonic() + 120
        while len(list(tmp_path.glob("grains_*.vtu"))) < 20:
            assert process.poll() is None, "it ended by itself"
            assert time.monotonic() < patience
            time.sleep(0.01)
    finally:
        process.send_signal(signal.SIGKILL)
        process.wait()
    for name in ("grains", "cracks"):
        times, files = listed(tmp_path, name)
        assert len(times) >= 18
        assert times == sorted(times)
        for file in files:
            assert len(pyvista.read(file).points) > 0


def environment():
    import os
    from pathlib import Path

    here = str(Path(__file__).parent)
    return os.environ | {"PYTHONPATH": os.pathsep.join([here, os.environ.get("PYTHONPATH", "")])}


def test_a_writer_writes_what_a_result_holds(tmp_path):
    test = attrs.evolve(PULL, samples=20)
    result = gl.simulate(small_sample(12), BRITTLE, test, frames=5, observers=[VtkWriter(tmp_path / "live", count=5)])
    result.write_vtk(tmp_path / "after")
    for name in ("grains", "cracks"):
        live, after = listed(tmp_path / "live", name), listed(tmp_path / "after", name)
        assert live[0] == after[0]
        for one, other in zip(live[1], after[1], strict=True):
            assert one.read_bytes() == other.read_bytes()


def test_any_name_of_a_law_makes_a_file(broken, tmp_path):
    gl.Comparison({"a/b: c?": broken}).write(tmp_path)
    assert (tmp_path / "cracks_a_b_ c_.png").exists()


def test_cracks_are_drawn_by_mode(broken):
    axes = broken.plot().axes[1]
    labels = axes.get_legend_handles_labels()[1]
    assert labels == [f"shear: {broken.summary['shear_cracks']}", f"tensile: {broken.summary['tensile_cracks']}"]


def test_a_window_shows_the_last_moment(broken, monkeypatch, tmp_path):
    """Off screen: that it opens, and what was put into it."""
    shown = []

    def show(plotter, *arguments, **options):
        shown.append({name: actor.mapper.dataset for name, actor in plotter.actors.items() if actor.mapper})

    monkeypatch.setattr(pyvista, "OFF_SCREEN", True)
    monkeypatch.setattr(pyvista.Plotter, "show", show)
    broken.show()
    (drawn,) = (list(entry.values()) for entry in shown)
    assert len(drawn) >= 2
    (grains,) = (each for each in drawn if each.n_cells == len(broken.mesh.zones))
    frame, tensile = broken.frames[-1], int(broken.cracks.tensile.sum())
    assert grains.points[:, :2] == pytest.approx(broken.mesh.nodes + frame.displacement, rel=1e-6)
    assert grains.cell_data["stress yy (MPa)"] == pytest.approx(frame.stress[broken.mesh.zone_grain, 1] / 1e6)
    lines = [each.n_cells for each in drawn if each is not grains]
    assert lines == [count for count in (tensile, len(broken.cracks) - tensile) if count]


@pytest.mark.thorough
def test_frames_are_denser_while_cracks_grow():
    """Failure takes little of the way to the strain limit, and is what pictures are wanted of."""
    test = UniaxialCompression(maximum_strain=0.05, stop_fraction=0.7, samples=5000, loading=gl.Constant(speed=0.2))
    result = gl.simulate(small_sample(40), MohrCoulomb(**STRONG), test, frames=5)
    broken = [np.count_nonzero(~np.isnan(frame.bonds["broken_time"])) for frame in result.frames]
    points = len(result.frames[0].bonds["broken_time"])
    assert broken[-1] > 0.1 * points
    assert len(result.frames) > 5
    assert np.diff(broken[:-1]).max() < 0.1 * points
