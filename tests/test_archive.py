"""Results in one file: what is written is read again with the same bits, and what is no result is refused."""

import io
import json
import zipfile

import attrs
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from support import BRITTLE, PULL, ROCK, STIFF, STRONG, small_sample

import grainlaw as gl
from grainlaw.geometry import Bricks, Voronoi, apart, between_platens, polygon, rectangle
from grainlaw.laws import CohesiveCrack, Linear, StaticFatigue, WeibullField
from grainlaw.material import Plane
from grainlaw.protocols import UniaxialCompression
from grainlaw.results.archive import FORMAT, Recorded, from_bytes, law_name, listed, to_bytes
from grainlaw.results.figures.cracks import crack_lines
from grainlaw.results.result import Cracks
from grainlaw.units import mm

SHORT = attrs.evolve(PULL, samples=10)
FIELDS = [field.name for field in attrs.fields(Cracks)]


def pulled(specimen, law=BRITTLE, test=SHORT, **options):
    return gl.simulate(specimen, law, test, **options)


def halves(grains):
    """The same grains, the upper half of another phase."""
    return attrs.evolve(grains, phase=(grains.centroids[:, 1] > 20 * mm).astype(int))


def plain():
    return pulled(small_sample(12))


def by_phase():
    grains = halves(small_sample(12).grains)
    soft = gl.Elastic(youngs_modulus=40e9, poissons_ratio=0.2, density=2700, plane=Plane.STRESS)
    rocks = {0: attrs.evolve(ROCK, plane=Plane.STRESS), 1: soft}
    return pulled(gl.Specimen(grains, rocks), {(0, 0): BRITTLE, (0, 1): Linear(**STIFF), (1, 1): BRITTLE})


def scattered():
    specimen = small_sample(12)
    return pulled(specimen, WeibullField(modulus=5).scatter(BRITTLE, specimen))


def with_a_hole():
    hole = [(8 * mm, 18 * mm), (12 * mm, 18 * mm), (12 * mm, 22 * mm), (8 * mm, 22 * mm)]
    corners, sides = [(0, 0), (20 * mm, 0), (20 * mm, 40 * mm), (0, 40 * mm)], ["bottom", "right", "top", "left"]
    grains = Voronoi(grains=30, seed=2).tessellate(polygon(corners, sides, holes={"borehole": hole}))
    return pulled(gl.Specimen(grains, ROCK, refinement=1))


def with_rigid_grains():
    return pulled(
        gl.Specimen(Bricks(rows=6).tessellate(rectangle(20 * mm, 40 * mm)), gl.Rigid(density=2600)), Linear(**STIFF)
    )


def with_bodies():
    bodies = between_platens(small_sample(12).grains, thickness=5 * mm)
    steel = gl.Elastic(youngs_modulus=200e9, poissons_ratio=0.3, density=7800)
    laws = {(0, 0): BRITTLE, (0, 1): Linear(**STIFF), (1, 1): Linear(**STIFF)}
    test = UniaxialCompression(samples=10, maximum_strain=2e-4, loading=gl.Constant(speed=0.5))
    return pulled(gl.Specimen(bodies, {0: ROCK, 1: steel}, contact_points=gl.EndPoints()), laws, test)


def with_contacts():
    loose = gl.Specimen(apart(small_sample(12).grains), ROCK)
    test = UniaxialCompression(samples=10, maximum_strain=1e-3, loading=gl.Constant(speed=0.5))
    return pulled(loose, test=test, detection=gl.Detection(law=Linear(**STIFF)))


KINDS = [plain, by_phase, scattered, with_a_hole, with_rigid_grains, with_bodies, with_contacts]


@pytest.fixture(scope="module", params=KINDS, ids=lambda kind: kind.__name__)
def result(request):
    return request.param()


@pytest.fixture(scope="module")
def content():
    return to_bytes(plain())


def same(one, other):
    """Whether arrays are equal bit for bit, nan where nan."""
    one, other = np.asarray(one), np.asarray(other)
    return one.dtype == other.dtype and one.shape == other.shape and one.tobytes() == other.tobytes()


def assert_same(read, result):
    assert list(read.curves) == list(result.curves)
    assert all(same(read.curves[name], result.curves[name]) for name in result.curves)
    assert all(same(getattr(read.cracks, name), getattr(result.cracks, name)) for name in FIELDS)
    assert same(read.interfaces, result.interfaces)
    assert list(read.summary) == list(result.summary)
    for name, value in result.summary.items():
        assert read.summary[name] == value or (np.isnan(read.summary[name]) and np.isnan(value)), name
    assert same(read.mesh.nodes, result.mesh.nodes)
    assert same(read.mesh.zones, result.mesh.zones)
    assert list(read.mesh.boundaries) == list(result.mesh.boundaries)
    assert all(same(read.mesh.boundaries[name], result.mesh.boundaries[name]) for name in result.mesh.boundaries)
    assert read.specimen.material == result.specimen.material
    assert read.specimen.contact_points == result.specimen.contact_points


# --- what is read is what was written --------------------------------------------------------------------------------


def test_a_result_is_read_again_as_it_was(result, tmp_path):
    result.save(tmp_path / "run.npz")
    read = gl.Result.load(tmp_path / "run.npz")
    assert_same(read, result)
    assert len(read.frames) == len(result.frames) > 0
    for mine, other in zip(read.frames, result.frames, strict=True):
        assert mine.time == other.time
        assert all(same(getattr(mine, n), getattr(other, n)) for n in ("displacement", "velocity", "stress"))
        for kind in ("bonds", "contacts"):
            one, two = getattr(mine, kind), getattr(other, kind)
            assert list(one) == list(two)
            assert all(same(one[name], two[name]) for name in two)
    assert read.laboratory.properties == pytest.approx(result.laboratory.properties, rel=0, abs=0, nan_ok=True)


def test_without_frames_all_else_is_there(result, tmp_path):
    result.save(tmp_path / "run.npz", frames=False)
    read = gl.Result.load(tmp_path / "run.npz")
    assert_same(read, result)
    assert read.frames == []
    assert (tmp_path / "run.npz").stat().st_size < 0.7 * len(to_bytes(result))


def test_a_result_that_is_read_is_written_again_the_same(result):
    content = to_bytes(result)
    assert to_bytes(from_bytes(content)) == content


@pytest.mark.thorough
def test_laws_and_tests_are_names_and_numbers():
    read = from_bytes(to_bytes(by_phase()))
    assert list(read.law) == [(0, 0), (0, 1), (1, 1)]
    assert isinstance(read.law[0, 0], Recorded)
    assert (read.law[0, 0].type, read.law[0, 1].type) == ("MohrCoulomb", "Linear")
    assert {name: read.law[0, 0].parameters[name] for name in STRONG} == STRONG
    assert (read.protocol.type, read.protocol.parameters["samples"]) == ("UniaxialTension", 10)
    field = from_bytes(to_bytes(scattered())).law
    assert len(field.parameters["cohesion"]) == 2 * len(small_sample(12).mesh.interfaces)
    assert listed(field) is not field.parameters  # a copy
    tough = attrs.evolve(plain(), law=CohesiveCrack(**STRONG, mode_i_energy=150, mode_ii_energy=300))
    assert from_bytes(to_bytes(tough)).law.parameters["softening"]["type"] == "EvansMarathe"


def test_a_summary_of_the_users_own_is_kept():
    summary = {
        "a": np.nan, "b": np.inf, "c": np.float32(0.5), "d": np.int64(7), "e": True, "f": "text", "g": [1.5, np.nan],
        "h": np.array([1.0, np.nan]), "i": np.bool_(True), "j": {"k": np.nan},
    }  # fmt: skip
    read = from_bytes(to_bytes(attrs.evolve(plain(), summary=summary))).summary
    assert np.isnan([read["a"], read["b"]]).all()
    assert {name: read[name] for name in "cdefghij"} == {
        "c": 0.5, "d": 7, "e": True, "f": "text", "g": [1.5, None], "h": [1.0, None], "i": True, "j": {"k": None},
    }  # fmt: skip
    assert read["i"] is True


def test_cracks_lie_where_the_last_frame_has_them():
    """Lines from position, orientation and length, against the ends of the interfaces that broke."""
    result = plain()
    lines = crack_lines(result.cracks)
    place = result.mesh.nodes + result.frames[-1].displacement
    ends = place[result.interfaces]
    first, second = (ends[:, 0] + ends[:, 2]) / 2, (ends[:, 1] + ends[:, 3]) / 2
    halves = np.concatenate([np.stack([first, (first + second) / 2], 1), np.stack([(first + second) / 2, second], 1)])
    broken = halves[~np.isnan(result.frames[-1].bonds["broken_time"])]
    assert len(lines) == len(broken) > 0
    middle = np.sort(lines.mean(axis=1), axis=0)
    assert middle == pytest.approx(np.sort(broken.mean(axis=1), axis=0), abs=1e-9)
    drawn = np.linalg.norm(lines[:, 1] - lines[:, 0], axis=1)  # of the undeformed interfaces
    assert np.sort(drawn) == pytest.approx(np.sort(np.linalg.norm(broken[:, 1] - broken[:, 0], axis=1)), rel=0.02)
    assert np.all(np.abs(np.arctan2(*(lines[:, 1] - lines[:, 0]).T[::-1]) % np.pi - result.cracks.orientation) < 1e-9)


@pytest.mark.parametrize("ask", [
    lambda r, _: r.frame("picture", -1),
    lambda r, _: r.laboratory.fragments,
    lambda r, _: r.laboratory.energy_lost,
    lambda r, folder: r.write_vtk(folder),
    lambda r, _: r.show(),
])  # fmt: skip
def test_what_needs_frames_says_so(content, tmp_path, ask):
    bare = attrs.evolve(from_bytes(content), frames=[])
    with pytest.raises(gl.ParameterError, match="needs frames"):
        ask(bare, tmp_path)
    assert not list(tmp_path.iterdir())


def test_the_rest_is_told_without_frames(content, tmp_path):
    whole, bare = from_bytes(content), attrs.evolve(from_bytes(content), frames=[])
    known, found = whole.laboratory.properties, bare.laboratory.properties
    lacking = [name for name in known if np.isfinite(known[name]) and np.isnan(found[name])]
    assert lacking == [name for name in gl.MEASURES if gl.MEASURES[name].of_frames and np.isfinite(known[name])]
    assert "saved without frames, as by a study: no lost opening, lost slip" in bare.laboratory.note
    bare.write_report(tmp_path / "r.html")
    assert "saved without frames" in (tmp_path / "r.html").read_text("utf-8")
    assert len(whole.laboratory.plot().axes) - len(bare.laboratory.plot().axes) == 2


def test_what_needs_none_is_drawn_and_measured(content):
    whole, bare = from_bytes(content), attrs.evolve(from_bytes(content), frames=[])
    assert bare.laboratory.value("tensile_length") == whole.laboratory.value("tensile_length") > 0
    labels = [each.get_label() for each in bare.plot().axes[1].collections]
    assert labels == [f"shear: {np.sum(~bare.cracks.tensile)}", f"tensile: {np.sum(bare.cracks.tensile)}"]


# --- what is no result -----------------------------------------------------------------------------------------------


def rewritten(content, name, data):
    """The same file with another array, or without it."""
    stream = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(content)) as old, zipfile.ZipFile(stream, "w") as new:
        for each in old.namelist():
            if each != f"{name}.npy":
                new.writestr(each, old.read(each))
        if data is not None:
            array = io.BytesIO()
            np.save(array, data)
            new.writestr(f"{name}.npy", array.getvalue())
    return stream.getvalue()


def about(content, **changes):
    with np.load(io.BytesIO(content)) as stored:
        return np.array(json.dumps(json.loads(str(stored["about"])) | changes))


def test_a_law_around_another_is_called_by_both_also_after_it_was_read():
    aged = StaticFatigue(law=BRITTLE, rate=1e-6)
    assert law_name({("a", "a"): aged, ...: BRITTLE}) == "StaticFatigue of MohrCoulomb, MohrCoulomb"
    read = Recorded("Delayed", {"law": {"type": "StaticFatigue", "law": {"type": "Linear", "kn": 1.0}}})
    assert (law_name(aged), law_name(read)) == ("StaticFatigue of MohrCoulomb", "Delayed of StaticFatigue of Linear")
    assert law_name(Recorded("Own", {"law": 3})) == "Own"


@pytest.mark.parametrize("other", [b"", b"no archive", b"PK\x05\x06" + bytes(18), b"\x93NUMPY"])
def test_what_is_no_result_is_refused(other, tmp_path):
    (tmp_path / "run.npz").write_bytes(other)
    with pytest.raises(gl.ParameterError, match=r"run\.npz is no result that can be read") as refused:
        gl.Result.load(tmp_path / "run.npz")
    assert "pickle" not in str(refused.value)


def test_other_files_of_numpy_are_refused(tmp_path):
    np.savez(tmp_path / "a.npz", about=np.arange(3))
    np.save(tmp_path / "b.npy", np.arange(3))
    for name in ("a.npz", "b.npy"):
        with pytest.raises(gl.ParameterError, match="no result that can be read"):
            gl.Result.load(tmp_path / name)
    with pytest.raises(OSError, match=r"c\.npz"):
        gl.Result.load(tmp_path / "c.npz")


@pytest.mark.parametrize("name", ["about", "interfaces", "cracks/mode", "grains/vertices", "regions/0/outline"])
def test_a_file_without_one_of_its_arrays_is_refused(content, name):
    with pytest.raises(gl.ParameterError, match=r"the content (is no result|cannot be read)"):
        from_bytes(rewritten(content, name, None))


def test_another_format_is_named(content):
    assert from_bytes(rewritten(content, "about", about(content))).curves  # it is as before
    with pytest.raises(gl.ParameterError, match=rf"format {FORMAT + 1}; this version of grainlaw reads {FORMAT}"):
        from_bytes(rewritten(content, "about", about(content, format=FORMAT + 1)))


def test_a_material_of_another_version_is_named(content):
    with pytest.raises(gl.ParameterError, match="the content cannot be read: there is no Plastic"):
        from_bytes(rewritten(content, "about", about(content, material={"type": "Plastic", "parameters": {}})))


@pytest.mark.thorough
@settings(max_examples=60)
@given(data=st.data())
def test_a_damaged_file_is_refused_or_read_as_it_was(content, data):
    """What a bit changes that no checksum covers, such as a date in the archive, changes nothing that is read."""
    if data.draw(st.booleans()):
        damaged = content[: data.draw(st.integers(0, len(content) - 1))]
    else:
        place = data.draw(st.integers(0, len(content) - 1))
        bit = 1 << data.draw(st.integers(0, 7))
        damaged = content[:place] + bytes([content[place] ^ bit]) + content[place + 1 :]
    assume(damaged != content)
    try:
        read = from_bytes(damaged)
    except gl.ParameterError as error:
        assert str(error).startswith("the content ")  # noqa: PT017
        return
    assert_same(read, from_bytes(content))


def test_a_disk_that_is_full_leaves_no_part(content, tmp_path, monkeypatch):
    result = from_bytes(content)
    result.save(tmp_path / "run.npz")
    before = (tmp_path / "run.npz").read_bytes()

    def full(path, _):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("pathlib.Path.write_bytes", full)
    with pytest.raises(OSError, match=r"No space left on device.*run\.npz"):
        result.save(tmp_path / "run.npz", frames=False)
    assert [(file.name, file.read_bytes()) for file in tmp_path.iterdir()] == [("run.npz", before)]
