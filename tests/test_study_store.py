"""A store whose files are cut, swapped, edited or linked: what cannot be read is missing, named and written again."""

import json
import os
import shutil
import time
import warnings

import pytest
from study_rows import row

import grainlaw as gl
from grainlaw.studies.store import InMemory, Store
from grainlaw.studies.table import Table

CASES = [row({"seed": seed}, {"strength": 1e6 * seed}) for seed in range(6)]
RUNS = {each["case"]: f"the run of {each['case']}".encode() * 20 for each in CASES}


def fill(folder):
    """Write what the store lacks, as a study does; the number of cases."""
    store, count = Store(folder), 0
    for each in CASES:
        if each["case"] not in store:
            run = RUNS[each["case"]]
            store.write(each | {"run": each["case"], "cost": {"bytes": len(run)}}, run)
            count += 1
    return count


def whole(folder):
    """Whether a store has all, and each row its own run."""
    store = Store(folder, make=False)
    table = Table(store.rows(each["case"] for each in CASES), ("seed",), store)
    assert table["strength"].tolist() == [1e6 * seed for seed in range(6)]
    assert all(store.run_of(case) == run for case, run in RUNS.items())
    assert {store.status(each["case"]) for each in CASES} == {"finished"}


@pytest.fixture(params=["loose", "packed"])
def made(request, tmp_path):
    folder = tmp_path / "store"
    assert fill(folder) == 6
    if request.param == "packed":
        assert Store(folder).pack(1) == 6
    whole(folder)
    return folder


def files_of(folder):
    return sorted(file for file in folder.rglob("*") if file.is_file() and not file.name.endswith(".lock"))


CUTS = {"empty": 0.0, "first": 0.02, "half": 0.5, "nearly": 0.98}


@pytest.mark.thorough
@pytest.mark.parametrize("cut", [*CUTS, "absent", "linked", "device", "folder"])
def test_what_cannot_be_read_is_missing_named_and_written_again(made, cut, tmp_path):
    for number, file in enumerate(files_of(made)):
        if cut == "folder" and (file.parent == made or made / "packs" in file.parents):
            continue  # no loss of power makes one; an error of the operating system says so
        name = file.relative_to(made)
        hurt = tmp_path / f"hurt {number}"
        shutil.copytree(made, hurt)
        content = file.read_bytes()
        (hurt / name).unlink()
        if cut in CUTS:
            (hurt / name).write_bytes(content[: int(CUTS[cut] * len(content))])
        elif cut == "linked":
            (hurt / name).symlink_to("/dev/zero")
        elif cut == "device":
            os.mkfifo(hurt / name)
        elif cut == "folder":
            (hurt / name).mkdir()
        with warnings.catch_warnings(record=True) as heard:
            warnings.simplefilter("always")
            missing = 6 - len(Store(hurt))
        said = " ".join(str(each.message) for each in heard)
        if missing and cut != "absent":
            assert name.name in said, (name, said)
        if cut == "folder":
            shutil.rmtree(hurt / name)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            assert fill(hurt) == missing
            whole(hurt)
            Store(hurt).pack(1)
            whole(hurt)


def cut(file):
    file.write_bytes(file.read_bytes()[:-1])


def link(file):
    other = file.with_suffix(".other")
    file.rename(other)
    file.symlink_to(other)


@pytest.mark.parametrize("what", ["cases", "runs"])
@pytest.mark.parametrize(
    "hurt", [cut, link, lambda file: os.truncate(file, 64_000_000), os.unlink], ids=["cut", "linked", "large", "absent"]
)
def test_a_file_that_is_hurt_is_missing(what, hurt, tmp_path):
    """A row, or the run that a row names; a large file is not even read."""
    fill(tmp_path)
    hurt(next((tmp_path / what).glob("*/*")))
    with warnings.catch_warnings(record=True) as heard:
        warnings.simplefilter("always")
        store = Store(tmp_path)
    assert len(store) == 5
    assert len(heard) == len(store.damaged) == (what == "runs" or hurt is not os.unlink)
    assert sum(each is not None for each in store.rows(case["case"] for case in CASES)) == 5


def test_several_hurt_files_are_one_warning(tmp_path):
    fill(tmp_path)
    for file in list((tmp_path / "cases").glob("*/*"))[:3]:
        cut(file)
    with pytest.warns(gl.OutputWarning, match="cannot be read, nor 2 others: what they hold") as heard:
        assert len(Store(tmp_path)) == 3
    assert len(heard) == 1


@pytest.mark.parametrize(("kind", "hurt", "left"), [("index", link, 0), ("jsonl", os.unlink, 0), ("zip", os.unlink, 0)])
def test_a_file_of_a_pack_that_is_hurt_is_named(kind, hurt, left, tmp_path):
    fill(tmp_path)
    Store(tmp_path).pack(1)
    assert not list((tmp_path / "cases").glob("*/*")) + list((tmp_path / "runs").glob("*/*"))
    hurt(tmp_path / "packs" / f"000001.{kind}")
    with pytest.warns(gl.OutputWarning) as heard:
        assert len(Store(tmp_path)) == left
    assert f"000001.{kind} cannot be read: what" in str(heard[0].message)


@pytest.mark.parametrize("lost", range(6, 18))  # within the line of the last case, whose checksum is the end of it
def test_an_index_that_is_cut_loses_the_case_where_it_is_cut(lost, tmp_path):
    fill(tmp_path)
    Store(tmp_path).pack(1)
    index = tmp_path / "packs" / "000001.index"
    index.write_bytes(index.read_bytes()[:-lost])
    with pytest.warns(gl.OutputWarning, match="cannot be read"):
        assert len(Store(tmp_path)) == (5 if lost > 7 else 6)  # the last seven are of its end


def test_an_index_leads_to_no_file_beyond_the_store(tmp_path):
    folder = tmp_path / "s"
    fill(folder)
    Store(folder).pack(1)
    index, case = folder / "packs" / "000001.index", CASES[0]["case"]
    index.write_text(index.read_text().replace(f"{case} {case}", f"{case} ../mine"))
    (folder / "mine.npz").write_bytes(b"")
    with pytest.warns(gl.OutputWarning, match="000001.* cannot be read"):
        assert len(Store(folder)) == 5


@pytest.mark.parametrize("what", ["cases", "runs"])
def test_what_cannot_be_read_is_not_packed(what, tmp_path):
    """It may be of another study, which will write it again."""
    fill(tmp_path)
    cut(next((tmp_path / what).glob("*/*")))
    with pytest.warns(gl.OutputWarning):
        store = Store(tmp_path)
    assert (store.pack(6), store.pack(5)) == (0, 5)
    with pytest.warns(gl.OutputWarning):
        assert fill(tmp_path) == 1
    whole(tmp_path)


def test_a_run_of_two_cases_may_be_in_the_pack_of_the_first(tmp_path):
    """As that of a function that was edited for nothing."""
    store, (first, second) = Store(tmp_path), CASES[:2]
    own = {"run": first["case"], "cost": {"bytes": 9}}
    store.write(first | own, b"their run")
    assert store.pack(1) == 1
    store.write(second | own, None)
    assert store.pack(1) == 1
    for again in (store, Store(tmp_path)):
        assert again.run_of(first["case"]) == again.run_of(second["case"]) == b"their run"


def test_cases_that_give_one_run_keep_it_whoever_writes_it_last(tmp_path):
    """Its file is of another size each time, by the time that it took."""
    store = Store(tmp_path)
    for each, run in zip(CASES[:3], (b"the run", b"the run, in more time", b"a run"), strict=True):
        store.write(each | {"run": CASES[0]["case"], "cost": {"bytes": len(run)}}, run)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert len(Store(tmp_path)) == 3


def test_packs_are_numbered_on(tmp_path):
    store = Store(tmp_path)
    for each in CASES[:4]:
        store.write(each, None)
        assert store.pack(1) == 1
    assert len(Store(tmp_path)) == len(store) == 4
    assert [file.name for file in sorted((tmp_path / "packs").glob("*.zip"))] == [f"00000{k}.zip" for k in (1, 2, 3, 4)]


def test_a_case_that_was_killed_and_then_finished_is_finished(tmp_path):
    """Also where the row of the kill was not removed, in whatever order the files are listed."""
    fill(tmp_path)
    for file in list((tmp_path / "cases").glob("*/*")):
        file.with_suffix(".killed.json").write_text(json.dumps(json.loads(file.read_text()) | {"status": "killed"}))
    whole(tmp_path)


@pytest.mark.parametrize("said", ["", "[1]", '["format"]', "{}", "[" * 10**5])
def test_what_a_store_says_of_itself_is_said_again(said, tmp_path):
    fill(tmp_path)
    (tmp_path / "study.json").write_text(said)
    whole(tmp_path)
    assert json.loads((tmp_path / "study.json").read_text()) == {"format": 2}


def test_a_case_that_is_not_there_has_no_row(made):
    store = Store(made)
    assert next(store.rows(["ab" * 32, CASES[0]["case"]])) is None
    assert (store.status("ab" * 32), "ab" * 32 in store) == ("", False)
    for of in (store.row, store.run_of, store.result):
        with pytest.raises(KeyError):
            of("ab" * 32)


def test_the_memory_of_a_program_keeps_cases_as_a_folder_does():
    memory = InMemory({"factors": ["seed"]})
    killed = row({"seed": 0}, status="killed")
    for each in (killed, CASES[1]):
        memory.write(each, None)
    assert memory.about == {"factors": ["seed"]}
    assert InMemory().about == {}
    assert [each["case"] in memory for each in (killed, CASES[1], CASES[2])] == [False, True, False]
    assert list(memory.rows(each["case"] for each in (CASES[2], CASES[1]))) == [None, CASES[1]]


def test_a_case_without_a_run_is_packed_too(tmp_path):
    """As one that was refused; one that was killed is not packed, and is there until it is done."""
    store = Store(tmp_path)
    refused, killed = (row({"seed": seed}, status=status) for seed, status in ((7, "refused"), (8, "killed")))
    for each in (refused, killed):
        store.write(each, None)
    fill(tmp_path)
    assert store.pack(8) == 0
    assert store.pack(7) == 7
    assert store.pack(0) == 0
    for again in (store, Store(tmp_path)):
        assert {again.status(each["case"]) for each in CASES} == {"finished"}
        assert (again.status(refused["case"]), again.status(killed["case"]), len(again)) == ("refused", "killed", 8)
        assert (refused["case"] in again, killed["case"] in again) == (True, False)
        assert again.row(refused["case"]).items() > refused.items()  # and when it was written
        with pytest.raises(KeyError):
            again.run_of(refused["case"])
    store.write({**killed, "status": "finished"}, None)
    assert [file.name for file in (tmp_path / "cases").glob("*/*")] == [f"{killed['case']}.json"]


def test_what_a_killed_process_had_half_written_is_removed_after_an_hour(tmp_path):
    fill(tmp_path)
    folder = next((tmp_path / "cases").iterdir())
    for age in (3500.0, 3700.0):
        part = folder / f".{age:.0f}.part.json"
        part.write_text("{")
        os.utime(part, (time.time() - age, time.time() - age))
    Store(tmp_path).pack()
    assert [file.name for file in tmp_path.rglob(".*.part*")] == [".3500.part.json"]


@pytest.mark.parametrize("how", ["another case", "a list", "a text", "no factors", "deep", "changed", "a number"])
def test_a_row_that_is_not_what_its_name_says_is_missing(how, tmp_path):
    fill(tmp_path)
    first, second = sorted((tmp_path / "cases").rglob("*.json"))[:2]
    content = json.loads(first.read_text())
    first.write_text({
        "another case": second.read_text(), "a list": "[1]", "a text": '"finished"', "deep": "[" * 10**5,
        "no factors": json.dumps({k: v for k, v in content.items() if k != "factors"}),
        "a number": json.dumps(content | {"run": 7}),
        "changed": json.dumps(content | {"run": "../../../etc/passwd"}),
    }[how])  # fmt: skip
    with pytest.warns(gl.OutputWarning, match="is missing, and is run again|missing"):
        store = Store(tmp_path)
    assert (len(store), store.damaged != []) == (5, True)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        assert fill(tmp_path) == 1
    whole(tmp_path)


def test_a_row_of_a_pack_that_was_edited_is_missing(tmp_path):
    fill(tmp_path)
    Store(tmp_path).pack(1)
    (text,) = (tmp_path / "packs").glob("*.jsonl")
    content = text.read_bytes()
    text.write_bytes(content.replace(b"3000000.0", b"9000000.0"))
    with pytest.warns(gl.OutputWarning, match="jsonl cannot be read"):
        assert len(Store(tmp_path)) == 5
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        assert fill(tmp_path) == 1
        whole(tmp_path)


def test_what_is_whole_is_not_warned_of(made):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        whole(made)
