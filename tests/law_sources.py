"""Sources of contact laws in every way a user may write them: where what is edited stands, and how it is loaded."""

import contextlib
import importlib
import sys

import attrs

import grainlaw as gl
from grainlaw.cli.law_file import find_with_files

KN, KS = 1e14, 9e13

HEAD = """
import attrs, builtins, enum, functools, math
import numpy as np
from typing import NamedTuple
from numba import njit
import grainlaw as gl
"""
LAW = """
@attrs.frozen(kw_only=True)
class Law({bases}gl.ContactLaw):
    kn: float = gl.parameter("Pa/m", default=1e14)
    ks: float = gl.parameter("Pa/m", default=9e13)
{body}
    stiffness = property(lambda self: (self.kn, self.ks))

    def traction(self, opening, slip):
        return self.kn * {normal}, self.ks * {shear}
"""


@attrs.frozen
class Change:
    """An expression in x, and the number it multiplies x by."""

    text: str
    factor: float


CHANGES = [
    Change("x * 0.25", 0.25), Change("x - 0.25 * x", 0.75), Change("x / 2.0", 0.5), Change("-x * 0.25", -0.25),
    Change("math.sqrt(0.25) * x - x", -0.5), Change("min(x, 2.0) * -0.0 + x", 1.0),
]  # fmt: skip
USED = ", ".join(f"A{k} = {change.factor}" for k, change in enumerate(CHANGES)).replace(", ", "; ")


@attrs.frozen
class Piece:
    """One slot of a law: what stands above the class, in it, and in helper files; ``use`` is asked with ``{v}``."""

    use: str
    top: str = ""
    body: str = ""
    files: dict[str, str] = attrs.field(factory=dict)
    base: str = ""


def _function(change: Change, name: str) -> str:
    return f"def {name}(x):\n    return {change.text}\n"


def _pieces(change: Change, s: str) -> dict[str, Piece]:
    """Every place for a change, its names ending in ``s``."""
    k, text, f = change.factor, change.text, _function(change, f"f{s}")
    far = f"import math\n{f}"
    method = f"    def m{s}(self, x):\n        return {text}\n"
    wraps = f"def d{s}(g):\n    @functools.wraps(g)\n    def inner(self, x): return g(self, x)\n    return inner\n"
    own = f"def d{s}(g):\n    return lambda self, x: {k} * g(self, x)\n"
    kept = f"    def m{s}(self, x):\n        return x\n"
    return {
        "in the method": Piece(f"({text.replace('x', '{v}')})".replace("ma{v}", "max").replace("e{v}p", "exp")),
        "method": Piece(f"self.m{s}({{v}})", body=method),
        "lambda": Piece(f"self.m{s}({{v}})", body=f"    m{s} = lambda self, x: {text}\n"),
        "class attribute": Piece(f"(self.a{s} * {{v}})", body=f"    a{s} = {k}\n"),
        "property": Piece(f"(self.a{s} * {{v}})", body=f"    a{s} = property(lambda self: {k})\n"),
        "field": Piece(f"(self.a{s} * {{v}})", body=f"    a{s}: float = {k}\n"),
        "function": Piece(f"f{s}({{v}})", top=f),
        "global": Piece(f"(G{s} * {{v}})", top=f"G{s} = {k}\n"),
        "tuple": Piece(f"(G{s}[1] * {{v}})", top=f"G{s} = (3.0, {k})\n"),
        "array": Piece(f"(G{s}[1] * {{v}})", top=f"G{s} = np.array([3.0, {k}])\n"),
        "enumeration": Piece(f"(E{s}.A.value * {{v}})", top=f"class E{s}(enum.Enum):\n    A = {k}\n    B = 7.0\n"),
        "second name of a member": Piece(
            f"(E{s}.USED.value * {{v}})", top=f"class E{s}(enum.Enum):\n    {USED}\n    USED = {k}\n"
        ),
        "member that prints alike": Piece(
            f"(self.e{s}.value * {{v}})",
            top=f"class E{s}(enum.Enum):\n    USED = {k}\n    __repr__ = lambda self: 'a member'\n",
            body=f"    e{s}: E{s} = E{s}.USED\n",
        ),
        "named tuple": Piece(f"(G{s}.a * {{v}})", top=f"class N{s}(NamedTuple):\n    a: float\nG{s} = N{s}({k})\n"),
        "default": Piece(f"f{s}({{v}})", top=f"def f{s}(x, a={k}):\n    return a * x\n"),
        "function as default": Piece(f"g{s}({{v}})", top=f"{f}def g{s}(x, g=f{s}):\n    return g(x)\n"),
        "function as argument": Piece(f"g{s}(f{s}, {{v}})", top=f"{f}def g{s}(g, x):\n    return g(x)\n"),
        "closure": Piece(f"f{s}({{v}})", top=f"def c{s}(a):\n    return lambda x: a * x\nf{s} = c{s}({k})\n"),
        "module in a closure": Piece(
            f"f{s}({{v}})",
            top=f"def c{s}():\n    import helper{s}\n    return lambda x: helper{s}.f{s}(x)\nf{s} = c{s}()\n",
            files={f"helper{s}.py": far},
        ),
        "module": Piece(f"helper{s}.f{s}({{v}})", top=f"import helper{s}\n", files={f"helper{s}.py": far}),
        "name of a module": Piece(f"f{s}({{v}})", top=f"from helper{s} import f{s}\n", files={f"helper{s}.py": far}),
        "number of a module": Piece(
            f"(helper{s}.K * {{v}})", top=f"import helper{s}\n", files={f"helper{s}.py": f"K = {k}\n"}
        ),
        "two modules away": Piece(
            f"near{s}.f{s}({{v}})", top=f"import near{s}\n",
            files={f"near{s}.py": f"import helper{s}\ndef f{s}(x):\n    return helper{s}.f{s}(x)\n",
                   f"helper{s}.py": far},
        ),
        "package": Piece(
            f"pack{s}.deep.f{s}({{v}})", top=f"import pack{s}.deep\n",
            files={f"pack{s}/__init__.py": "", f"pack{s}/deep.py": far},
        ),
        "base class": Piece(f"self.m{s}({{v}})", top=f"class B{s}:\n{method}\n", base=f"B{s}, "),
        "base class in a file": Piece(
            f"self.m{s}({{v}})", top=f"from helper{s} import B{s}\n", base=f"B{s}, ",
            files={f"helper{s}.py": f"import math\nclass B{s}:\n{method}\n"},
        ),
        "part": Piece(
            f"self.p{s}.m{s}({{v}})", top=f"@attrs.frozen\nclass P{s}:\n{method}\n", body=f"    p{s}: P{s} = P{s}()\n"
        ),
        "number of a part": Piece(
            f"(self.p{s}.a * {{v}})", top=f"@attrs.frozen\nclass P{s}:\n    a: float = {k}\n",
            body=f"    p{s}: P{s} = P{s}()\n",
        ),
        "decorated": Piece(f"self.m{s}({{v}})", top=wraps, body=f"    @d{s}\n{method}"),
        "decorator": Piece(f"self.m{s}({{v}})", top=own, body=f"    @d{s}\n{kept}"),
        "njit": Piece(f"f{s}({{v}})", top=f"@njit\n{f}"),
        "njit of a module": Piece(
            f"f{s}({{v}})", top=f"from helper{s} import f{s}\n",
            files={f"helper{s}.py": f"import math\nfrom numba import njit\n@njit\n{f}"},
        ),
    }  # fmt: skip


PLACES = list(_pieces(CHANGES[0], ""))


def source(normal: Piece, shear: Piece) -> tuple[list[str], dict[str, str]]:
    """The cells of a law of two pieces, and its helper files."""
    law = LAW.format(
        bases=normal.base + shear.base, body=normal.body + shear.body, normal=normal.use.format(v="opening"),
        shear=shear.use.format(v="slip"),
    )  # fmt: skip
    return [HEAD, normal.top + shear.top, law + "law = Law()\n"], normal.files | shear.files


def piece(place: str, change: Change, slot: str) -> Piece:
    return _pieces(change, slot)[place]


# --- how a source becomes a law ---------------------------------------------------------------------------------------


@contextlib.contextmanager
def importing(folder):
    """The folder in the search path, and what is imported from it forgotten afterwards, as by a new session."""
    known = set(sys.modules)
    sys.path.insert(0, str(folder))
    importlib.invalidate_caches()
    writes, sys.dont_write_bytecode = sys.dont_write_bytecode, True
    try:
        yield
    finally:
        sys.path.remove(str(folder))
        sys.dont_write_bytecode = writes
        for name in set(sys.modules) - known:
            if (getattr(sys.modules[name], "__file__", None) or "").startswith(str(folder)):
                del sys.modules[name]


def by_file(name):
    def load(cells, folder):
        (folder / f"{name}.py").write_text("".join(cells))
        return find_with_files(f"{folder / name}.py:law", gl.ContactLaw)[0]

    return load


def by_exec(scope, files=("<string>",) * 3):
    """Cell by cell, into a copy of a scope."""

    def load(cells, folder):
        with importing(folder):
            names = dict(scope)
            for cell, file in zip(cells, files, strict=True):
                exec(compile(cell, file, "exec"), names)
        return names["law"]

    return load


def by_import(cells, folder):
    (folder / "imported.py").write_text("".join(cells))
    with importing(folder):
        return importlib.import_module("imported").law


def in_a_function(cells, folder):
    """The class and all it uses are local variables: everything is reached by closures."""
    head, top, law = cells
    lines = "".join(f"    {line}\n" for line in (top + law).splitlines())
    return by_exec({})([head, f"def make():\n{lines}    return law\n", "law = make()\n"], folder)


STANDARD_NAMES = [
    "abc", "cmath", "code", "copy", "decimal", "enum", "fractions", "functools", "io", "math", "numpy", "operator",
    "queue", "random", "re", "select", "signal", "statistics", "string", "struct", "this", "time", "token", "trace",
    "types", "typing",
]  # fmt: skip
LOADERS = {f"{name}.py": by_file(name) for name in ["mine", *STANDARD_NAMES]} | {
    "exec": by_exec({}),
    "exec with a name": by_exec({"__name__": "mine"}),
    "exec with Python's name": by_exec({"__name__": "math", "__file__": "/usr/lib/python3/math.py"}),
    "cells of IPython": by_exec({"__name__": "__main__"}, [f"<ipython-input-{k}-abc>" for k in range(3)]),
    "cells of a kernel": by_exec({"__name__": "__main__"}, [f"/tmp/ipykernel_1/{k}23.py" for k in range(3)]),
    "import": by_import,
    "function": in_a_function,
}

STIFFER = """
import attrs
import grainlaw as gl

@attrs.frozen(kw_only=True)
class Stiffer(gl.ContactLaw):
    kn: float = gl.parameter("Pa/m", default=1e14)
    stiffness = property(lambda self: (self.kn / 100, self.kn / 100))

    def traction(self, opening, slip, asked):
        return (1.0e2 if asked > 50 else 1.0e-2) * self.kn * opening, 1.0e-2 * self.kn * slip, asked + 1
"""
