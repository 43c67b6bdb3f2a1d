"""What files for ParaView say of themselves, which moments they hold, and the script that shows them."""

import math
import os
import re
import sys
import types
from importlib.metadata import version
from pathlib import Path
from types import SimpleNamespace

import attrs
import numpy as np
import pytest
import pyvista
from command_line import invoke
from support import BRITTLE, PULL, ROCK, STRONG, nodal_forces, small_sample, state_of

import grainlaw as gl
from grainlaw.geometry import Bricks, rectangle
from grainlaw.laws import CohesiveCrack
from grainlaw.materials import Thermal
from grainlaw.results import files
from grainlaw.results.files import PARAVIEW
from grainlaw.results.frames import FrameClock, packed, take_frame, unpacked
from grainlaw.results.paraview import write_script
from grainlaw.results.tables import breaks
from grainlaw.results.vtk import VtkSeries, VtkWriter, principal, strains, tensors
from grainlaw.units import mm

LAW = CohesiveCrack(**STRONG, mode_i_energy=1, mode_ii_energy=2)
SHORT = attrs.evolve(PULL, samples=20)


UNITS = {
    "stress": "Pa", "stress_1": "Pa", "stress_2": "Pa", "rotation": "rad", "zone_stress": "Pa", "displacement": "m",
    "velocity": "m/s", "opening": "m", "slip": "m", "normal": "Pa", "shear": "Pa", "broken_time": "s",
    "lost_opening": "J/m2", "lost_slip": "J/m2", "made": "J/m2",
}  # fmt: skip


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A cracked sample, with its files, those of a run with zones in "zones"."""
    folder = tmp_path_factory.mktemp("vtk")
    result = gl.simulate(small_sample(12), LAW, SHORT, frames=5, observers=[VtkWriter(folder / "zones", 5, zones=True)])
    result.write_vtk(folder)
    return result, folder


def last(folder, name):
    return pyvista.read(sorted(folder.glob(f"{name}_*.vtu"))[-1])


def test_one_frame_is_enough_for_files(made, tmp_path):
    result, _ = made
    attrs.evolve(result, frames=result.frames[-1:]).write_vtk(tmp_path)
    assert [file.name for file in tmp_path.glob("grains*")] == ["grains.pvd", "grains_0000.vtu"]
    assert np.array_equal(last(tmp_path, "grains").points, last(made[1], "grains").points)


def test_minerals_have_their_names(made, tmp_path):
    result, _ = made
    grains = attrs.evolve(result.specimen.grains, phase_names=("quartz", "mica"))
    attrs.evolve(result, specimen=attrs.evolve(result.specimen, grains=grains)).write_vtk(tmp_path)
    assert last(tmp_path, "grains").field_data["phases"] == "quartz, mica"


def test_files_say_what_they_are(made):
    result, folder = made
    for place in (folder, folder / "zones"):
        for name in ("grains", "cracks"):
            read = last(place, name)
            said = {key: read.field_data[key] for key in read.field_data}
            assert said["law"] == "CohesiveCrack"
            assert said["kinds"] == "between, inside"
            assert "phases" not in said  # they have no names
            assert said["stage"] == "tension"
            assert said["strain"] == pytest.approx(result.curves["strain"][-1], rel=1e-12)
            assert said["time (s)"] == result.frames[-1].time
            assert said["grainlaw"] == version("grainlaw")
            units = dict(text.split(": ") for text in said["units"])
            arrays = {*read.cell_data, *read.point_data}
            assert units == {array: UNITS[array] for array in arrays & {*UNITS}}
            rest = {"grain", "parent", "phase", "damage", "mode", "grain_a", "grain_b", "inside", "kind", "zone_strain"}
            assert arrays <= {*UNITS} | rest  # what has no unit has none


def test_zones_have_their_own_stress_of_which_grains_have_the_mean(made):
    result, folder = made
    read, mesh = last(folder / "zones", "grains"), result.mesh
    assert "zone_stress" not in last(folder, "grains").cell_data
    count = result.specimen.grains.count
    rows = (read.cell_data["zone_stress"] * mesh.zone_areas[:, None]).T
    mean = np.array([np.bincount(mesh.zone_grain, row, count) for row in rows]).T
    mean /= result.specimen.grains.areas[:, None]
    assert np.allclose(mean, read.cell_data["stress"][mesh.first_zone[:-1]], rtol=1e-9, atol=1e-3)


def pulled_apart():
    """Three bricks of 10 x 2 mm, the lower two of one grain, each pulled 0.995 um off the one below."""
    bricks = attrs.evolve(Bricks(rows=3, columns=1).tessellate(rectangle(10 * mm, 6 * mm)), parent=np.array([0, 0, 1]))
    specimen = gl.Specimen(bricks, ROCK)
    state = state_of(specimen, BRITTLE)
    for opening in np.linspace(0, 0.995e-6, 200):
        nodal_forces(state, np.outer(specimen.mesh.node_grain, [0.0, opening]))
    state.note_breaks()
    return state


def test_breaks_in_a_table_and_in_a_picture_by_hand(tmp_path):
    state = pulled_apart()
    table = breaks(state)
    assert sorted(zip(table["grain_a"], table["grain_b"], table["x"], table["y"], table["inside"], strict=True)) == [
        pytest.approx(row)
        for row in [
            (0, 1, 0.0025, 0.002, 1),
            (0, 1, 0.0075, 0.002, 1),
            (1, 2, 0.0025, 0.004, 0),
            (1, 2, 0.0075, 0.004, 0),
        ]
    ]
    assert table["orientation"] == pytest.approx(0, abs=1e-12)
    assert table["length"] == pytest.approx(5 * mm)
    assert (table["mode"] == 0).all()
    assert table["spent"] == pytest.approx(13e6**2 / (2 * 1.05e14), rel=0.05)  # what a spring held
    frame = take_frame(state)
    assert frame.zones == {}
    lines = VtkSeries(tmp_path, state.specimen, state.bonds.ends)._cracks(frame)
    found = {name: rows[0].tolist() for name, rows in lines.cell_data.items()}
    assert found["kind"] == found["inside"] == [1, 0, 1, 0]
    assert (found["grain_a"], found["grain_b"]) == ([0, 1, 0, 1], [1, 2, 1, 2])
    middles = lines.points.reshape(-1, 2, 3).mean(axis=1)
    assert middles == pytest.approx(
        np.array([[7.5, 2.0005, 0], [7.5, 4.0015, 0], [2.5, 2.0005, 0], [2.5, 4.0015, 0]]) * mm, rel=1e-5
    )
    assert np.ptp(lines.points.reshape(-1, 2, 3), axis=1) == pytest.approx(np.array([[5 * mm, 0, 0]] * 4), abs=1e-12)


def test_cracks_in_a_picture_are_what_is_damaged_wet_or_of_a_joint(tmp_path):
    state = pulled_apart()
    series, frame = VtkSeries(tmp_path, state.specimen, state.bonds.ends), take_frame(state)

    def shown(kinds=(0, 1), **bonds):
        series._kind = np.array(kinds)
        lines = series._cracks(attrs.evolve(frame, bonds=frame.bonds | {"damage": np.zeros(4)} | bonds))
        return lines.points.reshape(-1, 2, 3)[:, :, :2], {
            name: row[0].tolist() for name, row in lines.cell_data.items()
        }

    (line,), _ = shown()  # nothing: one point, as a line of no length
    assert np.array_equal(line[0], line[1])
    assert shown(damage=np.array([0, 0, 0.5, 0]))[1]["damage"] == [0.5]
    assert shown(fluid_pressure=np.array([0, 7.0, 0, 0]))[1]["fluid_pressure"] == [7.0]
    lines, data = shown(kinds=(0, 2))
    assert (data["kind"], len(lines), data["grain_a"]) == ([2, 2], 2, [1, 1])


@pytest.mark.parametrize(
    ("curves", "said"),
    [
        (None, {}), ({}, {}), ({"time": [0, 4.0]}, {}), ({"strain": [0, 0.01]}, {"strain": 0.005}),
        ({"displacement": [1, 3.0], "force": [0, 1.0]}, {"displacement (m)": 2.0}),
    ],
)  # fmt: skip
def test_a_picture_says_how_far_the_test_is(curves, said, tmp_path, monkeypatch):
    state, added = pulled_apart(), []
    series, frame = VtkSeries(tmp_path, state.specimen, state.bonds.ends, "law"), take_frame(state)
    monkeypatch.setattr(series, "_add", lambda name, time, mesh, about: added.append((name, time, about)))
    series.write(attrs.evolve(frame, time=2.0, stage="pull"), curves and {"time": np.array([0, 4.0])} | curves)
    about = {"law": "law", "kinds": "between, inside", "stage": "pull", "time (s)": 2.0} | said
    assert added == [("grains", 2.0, about), ("cracks", 2.0, about)]


def test_a_contact_is_a_line_along_its_tangent_by_hand(tmp_path):
    contacts = {"position": np.array([[1.0, 2.0]]), "tangent": np.array([[0.6, 0.8]]), "length": np.array([2.0])}
    frame = SimpleNamespace(contacts=contacts | {"grains": np.array([[3, 5]]), "opening": np.array([-1e-6])})
    specimen = small_sample(6)
    lines = VtkSeries(tmp_path, specimen, specimen.mesh.interfaces)._contacts(frame)
    assert lines.points == pytest.approx(np.array([[0.4, 1.2, 0], [1.6, 2.8, 0]]))
    assert {name: rows[0].tolist() for name, rows in lines.cell_data.items()} == {
        "opening": [-1e-6], "grain_a": [3], "grain_b": [5],
    }  # fmt: skip


def test_principal_stresses_by_hand():
    """Mohr's circle about 2 MPa, of radius 5 MPa."""
    assert principal(np.array([[5.0, -1.0, 4.0]])) == (7.0, -3.0)


@pytest.mark.parametrize("plane", list(gl.Plane))
def test_stress_of_zones_follows_from_their_strain(plane):
    """By Hooke's law in three dimensions, also where grains have turned; nothing across, or no stress there."""
    specimen = small_sample(6, material=attrs.evolve(ROCK, plane=plane))
    state, nodes = state_of(specimen, LAW), specimen.mesh.nodes
    field = 1e-3 * np.sin(nodes @ np.array([[40.0, 90.0], [70.0, -30.0]])) * 0.02
    field += nodes @ np.array([[0, 0.3], [-0.3, 0]])  # a turn, and a stretch that stays small beside it
    nodal_forces(state, field)
    frame = take_frame(state, zones=True)
    strain = strains(specimen, frame.displacement)
    stress = tensors(specimen, frame.zones["stress"], specimen.mesh.zone_grain)
    lame, shear = 60e9 * 0.25 / (1.25 * 0.5), 60e9 / 2.5
    trace = strain[:, :3].sum(axis=1)[:, None] * np.array([1, 1, 1, 0, 0, 0])
    assert np.allclose(stress, lame * trace + 2 * shear * strain, rtol=1e-9, atol=1e-9 * np.abs(stress).max())
    assert np.abs(strain[:, [0, 1, 3]]).min(axis=0).max() > 0
    assert not (strain if plane is gl.Plane.STRAIN else stress)[:, 2].any()


@pytest.mark.parametrize("plane", list(gl.Plane))
def test_strain_does_not_see_a_turn(plane):
    """A stretch along an axis that is turned: by hand."""
    rock = attrs.evolve(ROCK, plane=plane)
    specimen, angle = small_sample(6, material=rock), 0.6
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, -s], [s, c]])
    nodes = specimen.mesh.nodes
    found = strains(specimen, (nodes * [1.002, 0.999]) @ turn.T - nodes)
    fixed = turn @ np.diag([0.002, -0.001]) @ turn.T
    assert np.allclose(found[:, [0, 1, 3]], [fixed[0, 0], fixed[1, 1], fixed[0, 1]], atol=1e-12)
    across = 0.0 if plane is gl.Plane.STRAIN else -0.25 / 0.75 * 0.001
    assert np.allclose(found[:, 2], across, atol=1e-12)
    flat = tensors(specimen, np.ones((6, 3)))
    assert np.allclose(flat[:, 2], 0.5 if plane is gl.Plane.STRAIN else 0.0)
    other = small_sample(6, material=Thermal(material=rock, expansion=1e-5))  # what is held in it is not known
    unknown = math.nan if plane is gl.Plane.STRAIN else 0.0
    assert np.array_equal(tensors(other, np.ones((6, 3)))[:, 2], np.full(6, unknown), equal_nan=True)


@pytest.mark.parametrize("shared", [False, True])
def test_a_file_is_whole_or_not_there_and_forced_where_it_must_outlast_a_loss_of_power(shared, tmp_path, monkeypatch):
    forced, file = [], tmp_path / "x.txt"
    monkeypatch.setattr(files, "_force", lambda place: forced.append((place, file.exists())))
    files.write_atomically(file, lambda path: path.write_text("one"), shared=shared)
    assert (forced, file.read_text()) == ([], "one")
    file.unlink()
    files.write_atomically(file, lambda path: path.write_text("two"), shared=shared, forced=True)
    part = f".x.{os.getpid()}.part.txt" if shared else ".x.part.txt"
    assert forced == [(tmp_path / part, False), (tmp_path, True)]  # its content, and then its name
    with pytest.raises(OSError, match="no room") as failed:
        files.write_atomically(file, lambda path: (_ for _ in ()).throw(OSError(28, "no room", "part")))
    assert (failed.value.filename, file.read_text()) == (str(file), "two")
    assert list(tmp_path.iterdir()) == [file]


def test_frames_are_counted_from_both_ends():
    three, none = SimpleNamespace(frames=["first", "second", "third"]), SimpleNamespace(frames=[])
    found = [gl.Result.frame(three, "f", number) for number in (0, 1, 2, -1, -2, -3)]
    assert found == ["first", "second", "third", "third", "second", "first"]
    for number in (3, -4):
        with pytest.raises(gl.ParameterError, match=f"f: frame = {number} is not allowed"):
            gl.Result.frame(three, "f", number)
    with pytest.raises(gl.ParameterError, match="f needs frames, and this result has none"):
        gl.Result.frame(none, "f", -1)


def test_frames_keep_their_stage(made):
    frame = made[0].frames[-1]
    assert frame.stage == unpacked(packed(frame), frame.nodes).stage == "tension"


def test_the_documents_list_every_array(made):
    page = (Path(__file__).parents[1] / "docs" / "results.md").read_text("utf-8")
    table = page[page.index("| file | array |") :].split("\n\n")[0]
    listed, kind = {}, ""
    for row in table.splitlines()[2:]:
        cells = row.split("|")
        kind = cells[1].strip().strip("`") or kind
        listed.setdefault(kind, set()).update(re.findall(r"`(\w+)`", cells[2]))
    folder = made[1] / "zones"
    for name in ("grains", "cracks", "contacts"):
        read = last(folder, name)
        assert {*read.cell_data, *read.point_data} == listed[name] - {
            "plastic_strain",
            "temperature",
            "fluid_pressure",
        }, name


def moments(count, stages, course):
    """How many frames a clock takes on a course of (stage, progress, share of the points broken)."""
    clock, taken = FrameClock(count), 0
    for stage, progress, share in course:
        state = SimpleNamespace(stages=stages, broken_time=np.where(np.arange(1000) < 1000 * share, 1.0, np.nan))
        taken += clock.due(state, SimpleNamespace(name=stage), progress)
    return taken


def test_about_as_many_frames_are_taken_as_were_asked_for():
    """However many stages a test has, and however much breaks."""
    way = np.linspace(0, 1, 500)
    assert moments(30, 1, [("all", p, 0) for p in way]) == pytest.approx(30, abs=1)
    cycles = [(f"cycle {k}", p, 0) for k in range(10) for p in way]
    assert moments(30, 10, cycles) == pytest.approx(40, abs=1)  # three each, and the end of each
    crushed = [("all", p, 0.6 * p**4) for p in way]
    assert 30 <= moments(30, 1, crushed) <= 45
    at_once = [("all", 0.1 * p, 0.6 * p) for p in way]
    assert 20 <= moments(30, 1, at_once) <= 40


# --- the script for ParaView -----------------------------------------------------------------------------------------


class Thing:
    """Stands for anything of ParaView: takes every attribute, and remembers where its data come from."""

    def __init__(self, file=None, after=None):
        self.__dict__.update(file=file or (after and after.file), name="")

    def __getattr__(self, name):
        if name == "ThresholdRange":
            raise AttributeError(name)
        part = Thing(after=self)
        self.__dict__[name] = part
        return part

    def __call__(self, *arguments, **options):
        return self

    def GetBounds(self):
        return [0.0, 2.0, 0.0, 1.0, 0.0, 0.0]


@pytest.fixture
def paraview(monkeypatch):
    """The calls of paraview.simple that the script makes; what it colours must be in the files that it opens."""
    seen = {"opened": [], "coloured": [], "moved": [], "named": [], "saved": []}
    simple = types.ModuleType("paraview.simple")

    def opened(FileName):
        assert Path(FileName).exists()
        seen["opened"].append(Path(FileName))
        return Thing(file=Path(FileName))

    def coloured(display, array):
        where, name = array
        assert where == "CELLS"
        reader = pyvista.get_reader(display.file)
        reader.set_active_time_point(len(reader.time_values) - 1)
        assert name in reader.read()[0].cell_data
        seen["coloured"].append((display.file.stem, name))

    simple.PVDReader, simple.ColorBy = opened, coloured
    simple.Transform = simple.Threshold = lambda Input: seen["moved"].append(thing := Thing(after=Input)) or thing
    simple.a3DText = lambda Text: seen["named"].append(Text) or Thing()
    simple.Show = lambda source, view: Thing(after=source)
    simple.SaveScreenshot = lambda file, view, **options: seen["saved"].append(file)
    for name in ("LoadPalette", "GetActiveViewOrCreate", "RenameSource", "Hide", "GetColorTransferFunction",
                 "GetScalarBar", "GetAnimationScene", "ResetCamera", "Render"):  # fmt: skip
        setattr(simple, name, lambda *arguments: Thing())
    simple.__all__ = [name for name in vars(simple) if not name.startswith("_")]
    package = types.ModuleType("paraview")
    package.simple = simple
    monkeypatch.setitem(sys.modules, "paraview", package)
    monkeypatch.setitem(sys.modules, "paraview.simple", simple)
    return seen


def shown(file, monkeypatch, *arguments):
    monkeypatch.setattr(sys, "argv", [str(file), *arguments])
    exec(compile(file.read_text("utf-8"), str(file), "exec"), {"__file__": str(file)})


def test_the_script_opens_what_a_result_has_written(made, paraview, monkeypatch):
    folder = made[1]
    shown(folder / PARAVIEW, monkeypatch, "picture.png")
    assert paraview["opened"] == [folder / "grains.pvd", folder / "cracks.pvd"]
    assert paraview["coloured"] == [("grains", "stress_2"), ("cracks", "mode")]
    assert paraview["saved"] == ["picture.png"]


def test_colours_of_grains_that_bear_nothing_end_below_nothing(tmp_path):
    grains = SimpleNamespace(vertices=np.array([[0.0, 0.0], [0.02, 0.04]]))
    for stress, lowest in ((0.0, -1.0), (-4e6, -4e6)):
        frame = SimpleNamespace(stress=np.full((3, 3), stress) * [1.0, 1.0, 0.0])
        result = SimpleNamespace(specimen=SimpleNamespace(grains=grains), frames=[frame])
        write_script(tmp_path, [[("alone", ".", result)]])
        text = (tmp_path / PARAVIEW).read_text("utf-8")
        assert f"\nLOWEST = {lowest!r}  #" in text
        assert f"\nWIDTH, HEIGHT = {1.3 * 0.02!r}, {1.3 * 0.04!r}  #" in text
    flat = SimpleNamespace(
        specimen=SimpleNamespace(grains=SimpleNamespace(vertices=np.diag([0.05, 0.01]))), frames=[frame]
    )
    write_script(tmp_path, [[("one", "a", result), ("other", "b", flat)]])
    assert f"\nWIDTH, HEIGHT = {1.3 * 0.05!r}, {1.3 * 0.04!r}  #" in (tmp_path / PARAVIEW).read_text("utf-8")


@pytest.mark.thorough
def test_the_script_of_a_comparison_shows_all_runs_beside_each_other(tmp_path, paraview, monkeypatch):
    few = ["compare", "--quick", "--threads", "1", "--grains", 6, "--seeds", "1,2", "--set", "test.samples=10"]
    options = ["--max-strain", "5e-5", "--laws", "linear,mohr-coulomb", "--out", tmp_path / "out"]
    result = invoke(*few, *options, "--set", "numerics.zones=true")
    assert result.exit_code == 0, result.output
    (tmp_path / "out").rename(tmp_path / "moved")  # it finds its files from its own place
    shown(tmp_path / "moved" / PARAVIEW, monkeypatch)
    runs = {file.parent.name for file in paraview["opened"]}
    assert runs == {"linear_seed_1", "mohr-coulomb_seed_1", "linear_seed_2", "mohr-coulomb_seed_2"}
    assert set(paraview["named"]) == {
        "linear, seed 1",
        "mohr-coulomb, seed 1",
        "linear, seed 2",
        "mohr-coulomb, seed 2",
    }
    moved = [thing for thing in paraview["moved"] if thing.file and "Transform" in vars(thing)]
    places = {tuple(thing.Transform.Translate) for thing in moved}
    assert len(places) == 4
    assert {place[:2] for place in places} == {(x, y) for x in (0.0, 1.3 * 0.02) for y in (0.0, 1.3 * 0.05)}
    assert not paraview["saved"]
    assert "zone_stress" in last(tmp_path / "moved" / "linear_seed_2", "grains").cell_data
