"""Who imports whom: absolute imports only, arrows that point down to leaves, and one copy of every class."""

import ast
import importlib
import re
import subprocess
import sys
from pathlib import Path

import pytest
from support import offenders

import grainlaw

FRAMEWORK = Path(grainlaw.__file__).resolve().parent
ROOTS = {
    "": FRAMEWORK,
    **{
        name: Path(importlib.import_module(f"grainlaw.{name}").__file__).resolve().parent
        for name in ("laws", "materials", "geometry", "protocols")
    },
}
COMPONENTS = ("laws", "materials", "geometry", "protocols")
KNOW_COMPONENTS = (*COMPONENTS, "cli", "calibration")


def order():
    """Lines of modules and rooms (ending in a slash) as docs/architecture.md lists them, top down."""
    text = Path(__file__).parents[1].joinpath("docs/architecture.md").read_text(encoding="utf-8")
    block = re.search(r"for types alone\.\n\n((?:    .*\n)+)", text)[1]
    return [re.split(r"\s{2,}", line.strip())[0].split() for line in block.splitlines()]


#: of each module and room its line and place
PLACE = {name.rstrip("/"): (y, x) for y, line in enumerate(order()) for x, name in enumerate(line)}
ROOMS = {name.rstrip("/") for line in order() for name in line if name.endswith("/")}
#: What a component may see of the framework: interfaces and data.
INTERFACES = set(PLACE) - ROOMS | {"engine.state"}


def modules():
    """Module name and file of every source."""
    found = {}
    for package, folder in ROOTS.items():
        for file in folder.rglob("*.py"):
            parts = [package, *file.relative_to(folder).with_suffix("").parts]
            name = ".".join(["grainlaw", *(part for part in parts if part not in ("", "__init__"))])
            if package or not name.startswith(tuple(f"grainlaw.{c}." for c in COMPONENTS)):
                found[name] = file
    return found


MODULES = modules()


def imports(file, *, running=False):
    """Names of modules that a file imports; ``running``: at the top level, when it is imported itself."""
    tree = ast.parse(file.read_text(encoding="utf-8"))
    nodes = tree.body if running else ast.walk(tree)
    for node in nodes:
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{file}:{node.lineno} imports relatively"
            for alias in node.names:
                inner = f"{node.module}.{alias.name}"
                yield inner if inner in MODULES else node.module


def part_of(module):
    """The component package a module belongs to, or the framework's module."""
    return module.split(".")[1] if "." in module else ""


def test_all_sources_are_seen():
    assert {"grainlaw.runs.simulation", "grainlaw.engine.step", "grainlaw.laws.linear"} <= set(MODULES)
    assert len(MODULES) > 40


def test_our_packages_are_imported_under_one_name():
    bare = {"framework", "laws", "materials", "geometry", "protocols", "kernels"}

    def rule(file):
        assert not [name for name in imports(file) if name.split(".")[0] in bare]

    assert not offenders(rule, [*MODULES.values(), *Path(__file__).parent.rglob("*.py")])


@pytest.mark.parametrize("name", ["framework", "laws", "materials", "geometry", "protocols"])
def test_bare_packages_are_out_of_reach(name):
    with pytest.raises(ModuleNotFoundError):
        importlib.import_module(name)


def test_components_see_interfaces_and_their_own_package():
    def rule(module):
        for name in imports(MODULES[module]):
            if name.split(".")[0] == "grainlaw":
                assert name.removeprefix("grainlaw.") in INTERFACES or part_of(name) == part_of(module), name

    assert not offenders(rule, [name for name in MODULES if part_of(name) in COMPONENTS])


def test_only_the_command_line_and_calibration_know_concrete_components():
    def rule(module):
        for name in imports(MODULES[module]):
            assert name.split(".")[0] != "grainlaw" or part_of(name) not in COMPONENTS, name

    assert not offenders(rule, [name for name in MODULES if part_of(name) not in KNOW_COMPONENTS])


def own(module):
    """The name in the order of a framework module: itself, or its room."""
    name = module.removeprefix("grainlaw.")
    return name.split(".")[0] if name.split(".")[0] in ROOMS else name


FRAME = [name for name in MODULES if part_of(name) not in (*COMPONENTS, "", "__main__")]


def test_the_order_names_every_module_and_room():
    assert {own(module) for module in FRAME} == set(PLACE)


def test_imports_point_up_the_list_of_the_architecture():
    """Also imports inside functions and for types alone: none hides a circle between rooms."""

    def rule(module):
        for name in imports(MODULES[module]):
            if name in MODULES and part_of(name) not in (*COMPONENTS, ""):
                assert own(name) == own(module) or PLACE[own(name)] < PLACE[own(module)], name

    assert not offenders(rule, FRAME)


def test_no_module_imports_itself_in_a_circle():
    arrows = {name: {n for n in imports(file, running=True) if n in MODULES} for name, file in MODULES.items()}
    for name in arrows:
        arrows[name].discard("grainlaw")
    open_, done = [], set()

    def visit(name):
        assert name not in open_, " -> ".join([*open_[open_.index(name) :], name])
        if name not in done:
            open_.append(name)
            for other in sorted(arrows[name]):
                visit(other)
            done.add(open_.pop())

    for name in sorted(arrows):
        visit(name)


FIRST = """
import importlib, sys, traceback
for name in sys.argv[1:]:
    for loaded in [each for each in sys.modules if each.split(".")[0] == "grainlaw"]:
        del sys.modules[loaded]
    try:
        importlib.import_module(name)
    except Exception:
        print(name, traceback.format_exc())
"""


@pytest.mark.slow
def test_every_module_can_be_the_first():
    """No import works only after another one; without circles, as the test above says, none should.

    In an interpreter of its own, where all of grainlaw is forgotten before each module.
    """
    names = sorted(set(MODULES) - {"grainlaw", "grainlaw.__main__"})
    command = [sys.executable, "-c", FIRST, *names]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert done.stdout == ""


HEAVY = {"llvmlite", "matplotlib", "meshio", "numba", "pyvista"}


def loaded_by(module):
    """Packages that a module imports when it is imported itself, in turn through our own, in the order they are met."""
    waiting, seen, found = [module], set(), set()
    while waiting:
        name = waiting.pop()
        if name in MODULES:
            new = set(imports(MODULES[name], running=True)) - seen - {"grainlaw"}
            seen |= new
            waiting.extend(new)
        else:
            found.add(name.split(".")[0])
    return found


@pytest.mark.parametrize("module", sorted(INTERFACES - {"engine.state", "protocol", "observation"}))
def test_what_a_model_is_made_of_needs_neither_compiler_nor_pictures(module):
    """By its own imports."""
    assert not loaded_by(f"grainlaw.{module}") & HEAVY


def test_heavy_packages_are_seen():
    assert "numba" in loaded_by("grainlaw.runs.simulation")
    assert "matplotlib" in loaded_by("grainlaw.workbench.law_figure")


@pytest.mark.thorough
def test_what_takes_long_to_load_is_loaded_where_it_is_used():
    late = "'pyvista', 'matplotlib', 'scipy.stats', 'scipy.optimize', 'sklearn', 'pandas', 'scipy.linalg', 'rich'"
    for modules, names in (
        ("grainlaw, grainlaw.cli.commands", "'numpy', 'numba', 'scipy', 'attrs'"),  # names load what they need
        ("grainlaw.runs.simulation", f"{late}, 'scipy.sparse', 'scipy.spatial'"),
        ("grainlaw.cli.test", late.replace(", 'scipy.linalg', 'rich'", "")),
    ):
        code = f"import sys, {modules}; print(*sorted({{{names}}} & set(sys.modules)))"
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
        assert done.stdout.split() == []


def names_of(package):
    """The file that lists the public names: of the package itself, which loads them when they are used, the stub."""
    stub = MODULES[package].with_suffix(".pyi")
    return stub if stub.exists() else MODULES[package]


@pytest.mark.parametrize("package", ["grainlaw", *(f"grainlaw.{name}" for name in COMPONENTS)])
def test_public_names_are_declared(package):
    loaded = importlib.import_module(package)
    assert all(hasattr(loaded, name) for name in loaded.__all__)
    assert len(set(loaded.__all__)) == len(loaded.__all__)
    public = {
        alias.asname or alias.name
        for node in ast.parse(names_of(package).read_text(encoding="utf-8")).body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
    assert public - {*getattr(loaded, "MODULES", ()), "units"} <= set(loaded.__all__)
