"""What an installation brings, and who imports whom."""

import ast
import tomllib
from importlib.metadata import distribution
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
SETTINGS = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
FOLDERS = SETTINGS["tool"]["setuptools"]["package-dir"]
SOURCES = {file: name for name, folder in FOLDERS.items() for file in sorted((ROOT / folder).glob("*.py"))}


def test_only_one_name_is_installed():
    names = distribution("grainlaw").read_text("top_level.txt").split()
    assert names == ["grainlaw"]
    assert {name.split(".")[0] for name in SETTINGS["tool"]["setuptools"]["packages"]} == {"grainlaw"}
    assert SETTINGS["project"]["scripts"].keys() == {"grainlaw"}


def test_every_source_folder_is_installed():
    files = [file for folder in FOLDERS.values() for file in (ROOT / folder).rglob("*.py")]
    assert {file.parent.relative_to(ROOT).as_posix() for file in files} == set(FOLDERS.values())
    assert sorted(FOLDERS) == sorted(SETTINGS["tool"]["setuptools"]["packages"])


def imports(file):
    """Modules a source file imports, those of type checking included."""
    for node in ast.walk(ast.parse(file.read_text("utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield "." * node.level + (node.module or "")
            if node.module in FOLDERS:
                yield from (f"{node.module}.{alias.name}" for alias in node.names)


@pytest.mark.parametrize("file", SOURCES, ids=lambda file: file.relative_to(ROOT).as_posix())
def test_imports_are_absolute_and_point_down(file):
    package, used = SOURCES[file], set(imports(file))
    bare = {"framework", "laws", "geometry", "protocols", "kernels"}
    assert not {name for name in used if name.startswith(".") or name.split(".")[0] in bare}
    components = {"grainlaw.laws", "grainlaw.geometry", "grainlaw.protocols"}
    if package in components:
        engine = {"grainlaw.simulation", "grainlaw.comparison", "grainlaw.cli", "grainlaw.kernels", "grainlaw"}
        forbidden = (components - {package}) | (engine - {"grainlaw"})
        assert "grainlaw" not in used  # the public names include the engine
    else:
        forbidden = components if file.stem != "cli" else set()
    assert not {name for name in used if any(name == f or name.startswith(f + ".") for f in forbidden)}
