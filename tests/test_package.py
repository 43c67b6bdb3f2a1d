"""What an installation brings."""

import tomllib
from importlib.metadata import distribution
from pathlib import Path

ROOT = Path(__file__).parents[1]
SETTINGS = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
FOLDERS = SETTINGS["tool"]["setuptools"]["package-dir"]


def test_only_one_name_is_installed():
    names = distribution("grainlaw").read_text("top_level.txt").split()
    assert names == ["grainlaw"]
    assert {name.split(".")[0] for name in SETTINGS["tool"]["setuptools"]["packages"]} == {"grainlaw"}
    assert SETTINGS["project"]["scripts"].keys() == {"grainlaw"}


def test_every_source_folder_is_installed():
    files = [file for folder in FOLDERS.values() for file in (ROOT / folder).rglob("*.py")]
    assert {file.parent.relative_to(ROOT).as_posix() for file in files} == set(FOLDERS.values())
    assert sorted(FOLDERS) == sorted(SETTINGS["tool"]["setuptools"]["packages"])
