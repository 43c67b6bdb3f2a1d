"""Grains from a file in the section [sample]: which reader, its options, and runs that can be repeated."""

import re
import tomllib

import meshio
import numpy as np
import pytest
from command_line import invoke
from tess_files import GROUPS, tess

from grainlaw.cli.configuration import configured
from grainlaw.cli.law_copy import copied_grains
from grainlaw.cli.sections import read_file, toml
from grainlaw.fields import ParameterError
from grainlaw.geometry import from_labels, from_mesh, read_tess, rectangle

LABELS = np.repeat(np.repeat([[1, 2], [3, 4], [5, 6]], 8, axis=0), 8, axis=1)


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "x.tess").write_text(tess(cell=GROUPS))
    np.save(tmp_path / "x.npy", LABELS)
    points = [(0, 0, 0), (1, 0, 0), (1, 2, 0), (0, 2, 0)]
    data = {"grain": [np.array([4, 4])]}
    meshio.write(tmp_path / "x.vtk", meshio.Mesh(np.array(points) * 1.0, [("triangle", [(0, 1, 2), (0, 2, 3)])],
                                                 cell_data=data))  # fmt: skip
    return tmp_path


@pytest.mark.parametrize(
    ("name", "options", "read"),
    [
        ("x.tess", {"unit": "10 mm"}, lambda file: read_tess(file, unit=0.01)),
        (
            "x.tess", {"unit": 0.02, "phases": {"1": "quartz", "2": "mica"}},
            lambda file: read_tess(file, unit=0.02, phases={1: "quartz", 2: "mica"}),
        ),
        ("x.npy", {"pixel": "1 mm"}, lambda file: from_labels(LABELS, 1e-3)),
        (
            "x.npy",
            {
                "pixel": "1 mm", "corner": ["-3 mm", -3.2e-3],
                "region": {"type": "rectangle", "width": "9 mm", "height": 0.012},
            },
            lambda file: from_labels(LABELS, 1e-3, region=rectangle(9e-3, 0.012), corner=(-3e-3, -3.2e-3)),
        ),
        (
            "x.npy", {"pixel": "1 mm", "cell_size": "3 mm", "seed": 2},
            lambda file: from_labels(LABELS, 1e-3, cell_size=3e-3, seed=2),
        ),
        (
            "x.vtk", {"unit": "10 mm", "grain_data": "grain"},
            lambda file: from_mesh(file, unit=0.01, grain_data="grain"),
        ),
    ],
)  # fmt: skip
def test_the_ending_tells_the_reader(name, options, read, folder):
    config = folder / "x.toml"
    config.write_text(toml({"sample": {"file": name, **options}}))
    made = configured("uniaxial-compression", read_file(config))
    grains, wanted = made.specimen.grains, read(folder / name)
    for field in ("vertices", "corners", "parent", "phase"):
        assert np.array_equal(getattr(grains, field), getattr(wanted, field))
    assert grains.phase_names == wanted.phase_names
    again = configured("uniaxial-compression", tomllib.loads(toml(made.sections)))
    assert again.sections == made.sections
    assert np.array_equal(again.specimen.grains.vertices, grains.vertices)


@pytest.mark.parametrize(
    ("sample", "said"),
    [
        ({"file": "absent.tess"}, "there is no such file"),
        ({"file": 3}, "sample.file = 3 is not allowed"),
        ({"file": "x.tess", "grains": 20}, "there is no 'sample.grains'"),
        ({"file": "x.tess", "pixel": 1}, "there is no 'sample.pixel'"),
        ({"file": "x.tess", "unit": "10 MPa"}, "sample.unit = '10 MPa' is not allowed"),
        ({"file": "x.npy"}, "sample.pixel is missing"),
        ({"file": "x.npy", "pixel": "1 mm", "phases": {"1": "quartz"}}, "no entry for the label 2"),
        (
            {"file": "x.npy", "pixel": "1 mm", "phases": ["quartz"]},
            "phases = ['quartz'] is not allowed, it must be a mapping",
        ),
        ({"file": "x.npy", "pixel": 1e-3, "cell_size": 3e-3, "seed": {"1": 2}}, "seed = {'1': 2} is not allowed"),
        ({"file": "x.npy", "pixel": "1 mm", "region": "disc"}, "sample.diameter is missing: the region disc needs it"),
        ({"file": "x.npy", "pixel": "1 mm", "region": {"type": "disk"}}, "there is no 'disk'; did you mean 'disc'?"),
        ({"file": "x.npy", "pixel": "1 mm", "region": {"type": "disc", "size": 1}}, "there is no 'sample.region.size'"),
        ({"file": "x.npy", "pixel": "1 mm", "region": 3}, "sample.region = 3 is not allowed, it must be a name or"),
        ({"file": "x.vtk", "region": "disc"}, "there is no 'sample.region'"),
        ({"file": "x.vtk", "grain_data": "grains"}, "did you mean 'grain'?"),
    ],
)
def test_other_sections_are_refused(sample, said, folder, monkeypatch):
    monkeypatch.chdir(folder)
    with pytest.raises(ParameterError, match=re.escape(said)):
        configured("uniaxial-compression", {"sample": sample})


@pytest.mark.thorough
def test_a_run_of_a_file_is_repeated_without_it(folder):
    (folder / "x.toml").write_text(
        '[sample]\nfile = "x.tess"\nunit = "10 mm"\n[test]\nmaximum_strain = 2e-4\nsamples = 20\n'
    )
    done = invoke("test", "uniaxial-compression", "--config", folder / "x.toml", "--out", folder / "out")
    assert done.exit_code == 0, done.output
    (folder / "x.tess").unlink()
    assert 'file = "grain_files/x.tess"' in (folder / "out" / "config.toml").read_text()
    again = invoke("rerun", folder / "out")
    assert again.exit_code == 0, again.output
    assert "every number is the same" in again.output


def test_the_file_of_the_grains_is_copied_once(folder):
    """A run that is repeated in its own folder has it there."""
    section, (record,) = copied_grains({"file": str(folder / "x.npy"), "pixel": "1 mm"}, folder / "out")
    copy = folder / "out" / section["file"]
    assert copy.read_bytes() == (folder / "x.npy").read_bytes()
    assert record["file"] == str((folder / "x.npy").resolve())
    again, _ = copied_grains({**section, "file": str(copy)}, folder / "out")
    assert again == section


def test_a_file_that_cannot_be_read_ends_in_one_line(folder):
    (folder / "y.tess").write_text(tess(dimension=3))
    done = invoke("test", "uniaxial-compression", "--set", f"sample.file={folder / 'y.tess'}", "--out", folder / "out")
    assert done.exit_code == 2
    assert "has 3 dimensions, it must have 2" in done.output
    assert not (folder / "out").exists()
