"""A component's scalar method as one C function over arrays, which the time loop calls by address.

Its numbers are run-time parameters, its flags and enumeration members constants; all of it is inlined into one loop
that the compiler vectorises.

The loop is generated as source, because a law decides how many numbers, rows and memory it has, and numba cannot pass a
row of an array as that many arguments: ``traction(opening[c], slip[c], *memory[:, c])`` fails, as the length of a row
is not known when it is compiled. For a law with one number and ``damage`` the generated line is
``normal[c], shear[c], m0[c] = traction(tuple0(p0), opening[c], slip[c], m0[c])``.
"""

from __future__ import annotations

import ctypes
import functools
import threading
from collections.abc import Callable
from typing import Any

import attrs
import numpy as np
from numba import carray, njit
from numba import types as nb

from grainlaw.compiler.cache import OPTIONS, keyed_njit, stored, tell_compiling
from grainlaw.compiler.compilation import Compilation, CompilationError, refusal
from grainlaw.compiler.fingerprint import NotCompilable, fingerprint
from grainlaw.compiler.loops import has_loop, interruptible
from grainlaw.compiler.numba_private import address_of, compile_for
from grainlaw.compiler.structure import Structure, other_numbers, spread
from grainlaw.contact import ContactLaw, law_arguments
from grainlaw.material import Material, material_arguments, material_memory
from grainlaw.memory import SCALARS, only_memory, only_scalars

__all__ = ["CompilationError", "Compiled", "compile_integrator", "compile_law", "compile_material"]

ABI = 8  #: raise when components are compiled differently


class _Writer:
    """Writes the expression that builds a component's tuple for contact ``c``."""

    def __init__(self, compilation: Compilation) -> None:
        self.compilation = compilation
        self.scope: dict[str, Any] = {}
        self.numbers, self.rows = 0, 0
        self.expression = self._write(compilation.structure)

    def _write(self, struct: Structure) -> str:
        terms = [f"p{self.numbers + i}" for i in range(len(struct.numbers))]
        self.numbers += len(terms)
        terms += [f"r{self.rows + i}[c]" for i in range(len(struct.rows))]
        self.rows += len(struct.rows)
        for value in struct.constants.values():
            name = f"k{len(self.scope)}"
            self.scope[name] = value
            terms.append(name)
        terms += [self._write(part) for part in struct.parts.values()]
        name = f"tuple{len(self.scope)}"
        self.scope[name] = self.compilation.classes[id(struct)]
        return f"{name}({', '.join(terms or ['0.0'])})"


@attrs.frozen
class _Point:
    """A scalar method that answers for one point: names of what it is given and of what it finds.

    Scalars of the step and the memory of the point follow what it is given; the memory follows what it finds unless it
    only reads it.
    """

    name: str
    given: tuple[str, ...]
    found: tuple[str, ...]
    keeps: bool = True
    arguments: tuple[str, ...] = ()  #: names of all that follows what it is given: scalars of the step, and memory
    memory: tuple[str, ...] = ()  #: in the order in which it is returned
    scalars: tuple[str, ...] = ()
    local: tuple[str, ...] = ()  #: scalars that each point has of its own: rows after the memory, only read


_TRACTION = _Point("traction", ("opening", "slip"), ("normal", "shear"))
_STRESS = _Point("stress", ("exx", "eyy", "exy"), ("sxx", "syy", "sxy"))
_ENERGY = _Point("energy", ("exx", "eyy", "exy"), ("stored",), keeps=False)


def _point_source(writer: _Writer, method: _Point) -> str:
    memory = (*method.memory, *method.local)
    p = [*(f"p{i}" for i in range(writer.numbers)), *method.scalars]  # scalars are the last of the numbers
    r = [f"r{i}" for i in range(writer.rows)]
    m = [f"m{i}" for i in range(len(memory))]
    ends = (*method.given, *method.found)
    rows = ", ".join([*p, *r, *m, *ends])
    others = (name if name in method.scalars else f"m{memory.index(name)}[c]" for name in method.arguments)
    values = ", ".join([*(f"{name}[c]" for name in method.given), *others])
    kept = m[: len(method.memory)] if method.keeps else []
    results = ", ".join(f"{name}[c]" for name in (*method.found, *kept))
    given = [f"P[{k}]" for k in range(len(p))]
    given += [f"R[{k}, :n]" for k in range(len(r))] + [f"M[{k}, :n]" for k in range(len(m))]
    given += [f"carray({name}, (n,))" for name in ends]
    return f"""
def inner({rows}):
    for c in range({method.given[0]}.shape[0]):
        {results} = {method.name}({writer.expression}, {values})

def batch(parameters, fields, field_stride, memory, memory_stride, {", ".join(ends)}, n):
    P = carray(parameters, ({len(p) or 1},))
    R = carray(fields, ({len(r) or 1}, field_stride))
    M = carray(memory, ({len(m) or 1}, memory_stride))
    inner({", ".join(given)})
"""


def _integrator_source(writer: _Writer) -> str:
    p = [f"p{i}" for i in range(writer.numbers)]
    return f"""
def inner({", ".join([*p, "time_step"])}, force, earlier, velocity, displacement, mass, free, imposed, loss):
    for c in range(force.shape[0]):
        before = velocity[c]
        steady = free[c] * imposed[c]
        after, damping = step({writer.expression}, force[c], force[c] - earlier[c], before - steady, mass[c], time_step)
        earlier[c] = force[c]
        after = free[c] * after + imposed[c]
        velocity[c] = after
        displacement[c] = move({writer.expression}, displacement[c], after, time_step)
        loss[c] -= free[c] * damping * 0.5 * (before + after) * time_step

def batch(parameters, force, earlier, velocity, displacement, mass, free, imposed, loss, n):
    P = carray(parameters, ({len(p) + 1},))
    inner({", ".join(f"P[{i}]" for i in range(len(p) + 1))},
          carray(force, (n,)), carray(earlier, (n,)), carray(velocity, (n,)), carray(displacement, (n,)),
          carray(mass, (n,)), carray(free, (n,)), carray(imposed, (n,)), carray(loss, (n,)))
"""


_POINTER = nb.CPointer(nb.float64)
_INTEGRATOR_SIGNATURE = (*(_POINTER,) * 9, nb.int64)


@attrs.frozen
class _Scalar:
    """A scalar method that the generated loop calls: how many numbers it takes, and how many it returns."""

    name: str
    inputs: int
    results: int


@attrs.frozen(eq=False)
class Compiled:
    """A component's batch function: where it is, and what it must be given."""

    address: int
    numbers: np.ndarray
    rows: np.ndarray  #: (r, count) parameters of each point
    memory: tuple[str, ...]
    key: str  #: hash of all that went into the code, without the numbers
    loops: bool  #: whether the code has a loop of its own, which may not end
    keep: Any = attrs.field(repr=False)  #: owns the machine code
    structure: Structure = attrs.field(repr=False)
    methods: tuple[_Scalar, ...] = attrs.field(repr=False)
    point: _Point | None = attrs.field(repr=False)
    found: int = 2  #: numbers that a point answers with, beside its memory
    scalars: tuple[str, ...] = ()  #: scalars of the step that it names: the last of its numbers

    def generated(self, array: Callable[..., Any]) -> dict[str, Any]:
        """The functions ``inner`` and ``batch`` for another machine, where ``array`` makes one at an address."""
        return _generated(Compilation(self.structure, self.key), self.methods, self.point, array)

    def tell(self, **scalars: float) -> None:
        """Give scalars of the step new values; those that the component does not name do not concern it."""
        for name, value in scalars.items():
            if name in self.scalars:
                self.numbers[self.scalars.index(name) - len(self.scalars)] = value

    def batch(self, *rows: np.ndarray) -> tuple[np.ndarray, ...]:
        """What n points of one component answer, each (n,): tractions, or a stress.

        Given are openings and slips, or strains, each (n,), and last the memory (m, n), which is changed.
        """
        if self.loops:
            return interruptible(lambda: self.call(*rows))
        return self.call(*rows)

    def call(self, *rows: np.ndarray) -> tuple[np.ndarray, ...]:
        """As :meth:`batch`, in this thread, which nothing can interrupt."""
        *given, memory = rows
        given = [np.ascontiguousarray(row) for row in given]
        found = tuple(np.empty_like(given[0]) for _ in range(self.found))
        ends = [row.ctypes.data for row in (*given, *found)]
        _foreign(6 + len(ends))(
            self.address, self.numbers.ctypes.data, self.rows.ctypes.data, self.rows.shape[1], memory.ctypes.data,
            memory.shape[1], *ends, len(given[0]),
        )  # fmt: skip
        return found

    def respond(self, *point: float) -> tuple[float, ...]:
        """One point: what it is given, then its memory, in; what it answers, then its memory, out."""
        given = len(point) - len(self.memory)
        rows = np.array([*point[given:], 0.0])[:, None]
        found = self.batch(*(np.array([value]) for value in point[:given]), rows)
        return (*(row[0] for row in found), *rows[:-1, 0])


@functools.cache
def _foreign(count: int) -> Callable[..., None]:
    prototype = ctypes.CFUNCTYPE(None, *(ctypes.c_int64,) * count)
    return lambda address, *arguments: prototype(address)(*arguments)


def compile_law(law: ContactLaw, count: int = 1) -> Compiled:
    """Compile ``law.traction`` for groups of ``count`` contacts. Raises :class:`CompilationError`."""
    return _compile_point(law, _TRACTION, law_arguments(law), count)


def compile_material(material: Material, count: int = 1, local: tuple[str, ...] = ()) -> tuple[Compiled, Compiled]:
    """Compile ``material.stress`` and ``material.energy`` for ``count`` grains. Raises :class:`CompilationError`.

    Scalars of the step that are ``local`` each zone has in a row of its own, after its memory.
    """
    material_memory(material)
    stress, energy = (
        _compile_point(material, attrs.evolve(method, local=local), material_arguments(material, method.name), count)
        for method in (_STRESS, _ENERGY)
    )
    return stress, energy


def _compile_point(component: Any, method: _Point, arguments: tuple[str, ...], count: int) -> Compiled:
    memory, found = only_memory(arguments), len(method.found)
    scalars = tuple(name for name in only_scalars(arguments) if name not in method.local)
    method = attrs.evolve(method, arguments=arguments, memory=memory, scalars=scalars)
    ends = (_POINTER,) * (len(method.given) + found)
    signature = (_POINTER, _POINTER, nb.int64, _POINTER, nb.int64, *ends, nb.int64)
    scalar = _Scalar(method.name, len(method.given) + len(arguments), found + method.keeps * len(memory))
    made = _compile(component, (scalar,), method, signature, count)
    numbers = np.append(made.numbers, [SCALARS[name] for name in scalars])
    return attrs.evolve(made, numbers=numbers, memory=memory, scalars=scalars, found=found)


def compile_integrator(integrator: Any, before: Compiled | None = None) -> Compiled:
    """Compile ``integrator.step`` and ``move``; their batch finds the time step after the parameters.

    Where the code is that of the integrator ``before``, as in each burst of dynamic relaxation, only the numbers are
    taken anew.
    """
    numbers = None if before is None else other_numbers(before.structure, integrator)
    if before is not None and numbers is not None:
        return attrs.evolve(before, numbers=np.array(numbers))
    return _compile(integrator, (_Scalar("step", 5, 2), _Scalar("move", 3, 1)), None, _INTEGRATOR_SIGNATURE, 1)


@functools.cache
def _entry_key() -> str:
    """What the generated code around a scalar method depends on."""
    return fingerprint(_point_source, _integrator_source, _Writer._write, extra=(ABI, repr(OPTIONS)))


_done: dict[str, Any] = {}  #: by key
_one_at_a_time = threading.RLock()


def _compile(
    component: Any, methods: tuple[_Scalar, ...], point: _Point | None, signature: Any, count: int
) -> Compiled:
    if not attrs.has(type(component)):
        raise CompilationError(f"{type(component).__name__} must be an attrs class: @attrs.frozen(kw_only=True)")
    try:
        struct, numbers, rows = spread(component, [method.name for method in methods], count)
        functions = [function for part in struct for function in part.methods.values()]
        names = point and (point.arguments, point.memory, point.local)
        key = fingerprint(*functions, extra=(_entry_key(), methods[0].name, names, struct.describe()))
        with _one_at_a_time:
            if key not in _done:
                _done[key] = stored(key, signature) or _build(struct, methods, point, signature, key)
    except NotCompilable as error:
        raise refusal(component, methods[0].name, str(error)) from None
    code = _done[key]
    return Compiled(address_of(code), numbers, rows, (), key, has_loop(functions), code, struct, methods, point)


def _build(struct: Structure, methods: tuple[_Scalar, ...], point: _Point | None, signature: Any, key: str) -> Any:
    tell_compiling(type(struct.component).__name__)
    compilation = Compilation(struct, key)
    for method in methods:
        problem = compilation.problem(method.name, (nb.float64,) * method.inputs, method.results)
        if problem:
            raise refusal(struct.component, method.name, problem)
    scope = _generated(compilation, methods, point, carray)
    # The key makes symbols of their own: without it two laws loaded from disk into one process would share the first's.
    for name in ("inner", "batch"):
        scope[name].__qualname__ = f"{name}_{key[:16]}"
    scope["inner"] = njit(**OPTIONS)(scope["inner"])
    return compile_for(keyed_njit(scope["batch"], key, by_address=True), signature)


def _generated(
    compilation: Compilation, methods: tuple[_Scalar, ...], point: _Point | None, array: Callable[..., Any]
) -> dict[str, Any]:
    """The generated functions ``inner`` and ``batch``, with all names that they know, not yet compiled.

    ``array`` makes the array of a shape at an address.
    """
    writer, struct = _Writer(compilation), compilation.structure
    source = _integrator_source(writer) if point is None else _point_source(writer, point)
    scalars = {method.name: compilation.copy(struct.methods[method.name]) for method in methods}
    scope = {"__name__": __name__, "carray": array, **scalars, **writer.scope}
    exec(compile(source, f"<batch of {type(struct.component).__name__}>", "exec"), scope)
    return scope
