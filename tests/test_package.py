"""What an installation brings, and that all that is said of the package in other places is the same."""

import importlib.util
import io
import re
import tarfile
import tomllib
from fnmatch import fnmatch
from importlib.metadata import distribution
from pathlib import Path

import pytest
import yaml

import grainlaw as gl

ROOT = Path(__file__).parents[1]
SETTINGS = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
PROJECT = SETTINGS["project"]
FOLDERS = SETTINGS["tool"]["setuptools"]["package-dir"]
RECIPE = ROOT / "packaging/conda/recipe.yaml"


def read_yaml(file):
    return yaml.safe_load((ROOT / file).read_text("utf-8"))


def test_only_one_name_is_installed():
    names = distribution("grainlaw").read_text("top_level.txt").split()
    assert names == ["grainlaw"]
    assert {name.split(".")[0] for name in SETTINGS["tool"]["setuptools"]["packages"]} == {"grainlaw"}
    assert PROJECT["scripts"].keys() == {"grainlaw"}


def test_every_source_folder_is_installed():
    files = [file for folder in FOLDERS.values() for file in (ROOT / folder).rglob("*.py")]
    assert {file.parent.relative_to(ROOT).as_posix() for file in files} == set(FOLDERS.values())
    assert sorted(FOLDERS) == sorted(SETTINGS["tool"]["setuptools"]["packages"])


def test_every_file_beside_the_sources_is_installed():
    kinds = SETTINGS["tool"]["setuptools"]["package-data"]["grainlaw"]
    left = []
    for folder in {folder.split("/")[0] for folder in FOLDERS.values()}:
        for file in (ROOT / folder).rglob("*.*"):
            name = file.relative_to(ROOT / folder).as_posix()
            if file.suffix not in (".py", ".pyc") and not (
                folder == "framework"
                and any(fnmatch(name, kind) and name.count("/") == kind.count("/") for kind in kinds)
            ):
                left.append(f"{folder}/{name}")
    assert left == []


# --- one version, one title, one list of what is needed ---------------------------------------------------------------


def test_the_version_is_the_same_everywhere():
    releases = re.findall(r"^## \[(.+?)\](?: - (\S+))?$", (ROOT / "CHANGELOG.md").read_text("utf-8"), re.M)
    citation = read_yaml("CITATION.cff")
    assert releases[0] == ("Unreleased", "")
    assert all(date for _, date in releases[1:])  # without one a release has no notes for the tool that cuts them out
    assert releases[1] == (gl.__version__, str(citation["date-released"]))
    assert citation["version"] == gl.__version__
    assert read_yaml(RECIPE)["context"]["version"] == gl.__version__
    assert distribution("grainlaw").version == gl.__version__, "install it again"


def test_a_citation_names_the_package_as_it_names_itself():
    citation, about = read_yaml("CITATION.cff"), read_yaml(RECIPE)["about"]
    assert citation["title"].lower() == f"grainlaw: {PROJECT['description']}".lower()
    assert [each["name"] for each in citation["authors"]] == [each["name"] for each in PROJECT["authors"]]
    assert citation["license"] == PROJECT["license"] == about["license"]
    assert citation["keywords"] == PROJECT["keywords"]
    assert about["summary"] == PROJECT["description"]


def test_whoever_cites_is_sent_to_what_a_run_asks_to_cite():
    """A rock by name has works to cite, which a run tells; the citation of the program says so."""
    assert all(gl.rocks[name].cite for name in gl.rocks)
    assert '"to cite"' in read_yaml("CITATION.cff")["message"]


def extra(name):
    """What an extra brings, also by other extras."""
    for one in PROJECT["optional-dependencies"][name]:
        inner = re.fullmatch(r"grainlaw\[(.*)\]", one)
        yield from (each for inner_name in inner[1].split(",") for each in extra(inner_name)) if inner else [one]


def test_all_is_all_that_runs_on_any_machine():
    names = set(PROJECT["optional-dependencies"]) - {"all", "gpu", "docs", "test"}
    assert set(extra("all")) == {one for name in names for one in extra(name)}
    assert set(extra("all")) < set(extra("test"))


def conda(requirements):
    """As conda writes them: the part of matplotlib without windows is a package of its own there."""
    return sorted(
        re.sub(r"^([\w-]+?)(-base)?(?=[<>=])", r"\1\2 ", one.replace("matplotlib", "matplotlib-base"))
        for one in requirements
    )


def test_the_recipe_for_conda_needs_what_the_package_needs():
    recipe = read_yaml(RECIPE)
    needs, python = recipe["requirements"], f"python {PROJECT['requires-python']}"
    assert sorted(needs["run"]) == sorted([python, *conda(PROJECT["dependencies"])])
    assert sorted(needs["host"]) == sorted([python, "pip", *conda(SETTINGS["build-system"]["requires"])])
    assert sorted(needs["run_constraints"]) == conda(set(extra("all")))
    commands = [" = ".join(each) for each in PROJECT["scripts"].items()]
    assert recipe["build"]["python"]["entry_points"] == commands


def test_the_recipe_for_conda_can_be_read():
    rattler = pytest.importorskip("rattler_build", reason="pip install py-rattler-build")
    (rendered,) = rattler.Stage0Recipe.from_file(RECIPE).render()
    assert rendered.recipe.package.version == gl.__version__


def test_other_environments_ask_for_extras_that_exist():
    files = (ROOT / "binder/requirements.txt", ROOT / "packaging/Dockerfile")
    asked = [
        name for file in files for names in re.findall(r"\[([\w,]+)\]", file.read_text()) for name in names.split(",")
    ]
    assert sorted(asked) == ["all", "all", "docs"]
    assert set(asked) <= set(PROJECT["optional-dependencies"])


# --- the same bytes ---------------------------------------------------------------------------------------------------


def archive(names, time, mode, owner):
    made = io.BytesIO()
    with tarfile.open(fileobj=made, mode="w:gz") as files:
        for name in names:
            entry = tarfile.TarInfo(name)
            entry.size, entry.mtime, entry.mode, entry.uname = len(name), time, mode, owner
            files.addfile(entry, io.BytesIO(name.encode()))
    return made.getvalue()


def test_an_archive_is_the_same_bytes_whoever_packs_it():
    spec = importlib.util.spec_from_file_location("distribution", ROOT / "packaging/distribution.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    one, other = archive("ab", 1.5, 0o644, "me"), archive("ba", 2e9, 0o775, "you")
    assert one != other
    made = module.normalised(one, 1_700_000_000)
    assert made == module.normalised(other, 1_700_000_000)
    with tarfile.open(fileobj=io.BytesIO(made)) as files:
        assert [(each.name, each.mtime, each.mode) for each in files] == [(n, 1.7e9, 0o644) for n in "ab"]
        assert files.extractfile("b").read() == b"b"
