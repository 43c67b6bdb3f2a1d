"""What is used of numba beyond its documented interface is named in three files, and nowhere else."""

import ast

import pytest
from support import offenders
from test_imports import MODULES

from grainlaw.compiler import numba_inner
from grainlaw.compiler import numba_private as private

DOCUMENTED = {"numba", "numba.extending", "numba.cuda"}
#: Of compiled functions, of what lowers an intrinsic, and of the cache: no other file may name them.
INSIDE = {
    "_cache", "_defn", "atomic_rmw", "fndesc", "get_dummy_value", "get_pointer_to_function", "instance_class",
    "inttoptr", "library", "load_atomic", "load_overload", "make_array", "magic_tuple", "nopython_signatures",
    "overloads", "py_func", "save_overload", "store_atomic", "target_context",
}  # fmt: skip
OF_A_DEVICE = "grainlaw.compiler.cuda_private"  #: which needs an extra to be imported
ELSEWHERE = [name for name in MODULES if name not in (private.__name__, numba_inner.__name__, OF_A_DEVICE)]


def numba_inside(tree):
    """Undocumented modules of numba that a source imports, and attributes of theirs that it names."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            names = [node.module, *(f"{node.module}.{alias.name}" for alias in node.names if alias.name == "core")]
        else:
            names = []
        yield from (name for name in names if name.split(".")[0] in ("numba", "llvmlite") and name not in DOCUMENTED)
        if isinstance(node, ast.Attribute) and node.attr in INSIDE:
            yield node.attr


def test_no_other_file_looks_inside_numba():
    def rule(module):
        assert not list(numba_inside(ast.parse(MODULES[module].read_text(encoding="utf-8"))))

    assert not offenders(rule, ELSEWHERE)


@pytest.mark.parametrize(
    "source", ["import numba.core.types", "from numba import core", "from llvmlite import ir", "f.overloads[s]"]
)
def test_a_look_inside_is_seen(source):
    assert list(numba_inside(ast.parse(source)))


def test_what_is_inside_is_named_by_the_one_file():
    """A name that it does not use any more need not be forbidden to the others."""
    tree = ast.parse(MODULES["grainlaw.compiler.numba_private"].read_text(encoding="utf-8"))
    defined = {node.name for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)}
    assert {*numba_inside(tree)} | defined >= INSIDE - {"nopython_signatures"}
