"""A component's scalar method, compiled into one C function over arrays that the time loop calls by address.

The component (a law, an integrator) becomes a named tuple inside the compiled code: its numbers are run-time
parameters, flags and enumeration members are constants, its parts are nested tuples, methods are overloads chosen by
the tuple's class. All of it is inlined into one loop that the compiler vectorises.
"""

from __future__ import annotations

import collections
import ctypes
import dis
import enum
import functools
import re
import textwrap
import types
from collections.abc import Callable, Iterator
from typing import Any

import attrs
import numpy as np
from numba import carray, njit
from numba import types as nb
from numba.core.errors import NumbaError
from numba.extending import overload_method

from grainlaw.contact import ContactLaw, memory_names
from grainlaw.kernels.cache import OPTIONS, keyed_njit
from grainlaw.kernels.fingerprint import NotCompilable, code_names, fingerprint, is_standard, plain, references

ABI = 1  #: raise when the generated entry changes


class CompilationError(TypeError):
    """A component cannot be compiled; the message names it, the place and the reason."""


# --- what a component consists of ------------------------------------------------------------------------------------


@attrs.frozen(eq=False)
class Structure:
    """A component as compiled code sees it."""

    component: Any
    numbers: tuple[str, ...]  #: run-time parameters, one value for all contacts
    arrays: tuple[str, ...]  #: run-time parameters, one value per contact
    constants: dict[str, Any]  #: flags, integers and enumeration members
    parts: dict[str, Structure]
    methods: dict[str, types.FunctionType]

    @functools.cached_property
    def tuple_class(self) -> Any:
        """The named tuple that stands for the component; equal structures share one class."""
        fields = (*self.numbers, *self.arrays, *self.constants, *self.parts) or ("nothing",)
        return _tuple_class(type(self.component), fields)

    def __iter__(self) -> Iterator[Structure]:
        yield self
        for part in self.parts.values():
            yield from part

    def describe(self) -> tuple:
        """What of the structure, other than functions, shapes the code."""
        constants = sorted((name, type(value).__name__, repr(value)) for name, value in self.constants.items())
        parts = [(name, part.describe()) for name, part in self.parts.items()]
        return self.numbers, self.arrays, constants, parts, sorted(self.methods)


@functools.cache
def _tuple_class(kind: type, fields: tuple[str, ...]) -> Any:
    return collections.namedtuple(kind.__name__, fields)  # type: ignore[misc]


def _reachable_names(function: Any, seen: set[int]) -> set[str]:
    """Attribute names used by a function and by every helper it reaches."""
    function = plain(function)
    if not isinstance(function, types.FunctionType) or id(function) in seen:
        return set()
    seen.add(id(function))
    names = code_names(function.__code__)[1]
    for _, value in references(function):
        names |= _reachable_names(value, seen)
    return names


def structure(component: Any, *methods: str) -> Structure:
    """Take a component apart, beginning with the scalar ``methods`` that are called from outside."""
    functions: dict[str, types.FunctionType] = {}
    values: dict[str, Any] = {}
    waiting, names = list(methods), set[str]()
    while waiting:
        name = waiting.pop()
        functions[name] = plain(getattr(type(component), name))
        names |= _reachable_names(functions[name], set())
        for other in names:
            member = getattr(type(component), other, None)
            if isinstance(member, types.FunctionType) and other not in functions and other not in waiting:
                waiting.append(other)
    for name in sorted(names - set(functions)):
        if not name.startswith("__") and hasattr(component, name):
            values[name] = getattr(component, name)
    numbers = tuple(n for n, v in values.items() if isinstance(v, (float, np.floating)))
    constants = {n: v for n, v in values.items() if isinstance(v, (bool, int, enum.Enum))}
    parts = {}
    for name, value in values.items():
        if attrs.has(type(value)):
            called = [n for n in sorted(names) if isinstance(getattr(type(value), n, None), types.FunctionType)]
            parts[name] = structure(value, *called)
    return Structure(component, numbers, (), constants, parts, functions)


def _numbers(struct: Structure) -> list[float]:
    """Run-time parameters of a component and its parts, in the order of the compiled code."""
    return [float(getattr(part.component, name)) for part in struct for name in part.numbers]


def _is_field_of_arrays(component: Any) -> bool:
    values = [getattr(component, field.name) for field in attrs.fields(type(component)) if field.init]
    return any(
        isinstance(value, np.ndarray) or (attrs.has(type(value)) and _is_field_of_arrays(value)) for value in values
    )


def _of_contact(component: Any, contact: int, count: int) -> Any:
    """The component as one contact sees it: entry ``contact`` of every parameter that is an array."""
    changes = {}
    for field in attrs.fields(type(component)):
        value = getattr(component, field.name)
        if isinstance(value, np.ndarray):
            if len(value) != count:
                raise ValueError(
                    f"{type(component).__name__}: {field.name} has {len(value)} entries, "
                    f"it must have one for each of the {count} contact points"
                )
            changes[field.name] = value[contact]
        elif attrs.has(type(value)) and field.init:
            changes[field.name] = _of_contact(value, contact, count)
    return attrs.evolve(component, **changes)


def _vary(struct: Structure, varying: Iterator[bool]) -> Structure:
    """The structure with those of its numbers that differ between contacts turned into rows."""
    marks = {name: next(varying) for name in struct.numbers}
    return attrs.evolve(
        struct,
        numbers=tuple(n for n, v in marks.items() if not v),
        arrays=tuple(n for n, v in marks.items() if v),
        parts={name: _vary(part, varying) for name, part in struct.parts.items()},
    )


def _spread(component: Any, method: str, count: int) -> tuple[Structure, np.ndarray, np.ndarray]:
    """Structure, numbers (p,) and per-contact rows (r, count) of a component, whose fields may be arrays."""
    if not _is_field_of_arrays(component):
        struct = structure(component, method)
        return struct, np.array(_numbers(struct)), np.zeros((1, count))
    table = np.array([_numbers(structure(_of_contact(component, c, count), method)) for c in range(count)])
    varying = np.any(table != table[0], axis=0)
    struct = _vary(structure(_of_contact(component, 0, count), method), iter(varying.tolist()))
    return struct, table[0, ~varying].copy(), np.ascontiguousarray(np.vstack([table[:, varying].T, table[:1, :1].repeat(count, 1)]))


# --- plain functions to compiled ones --------------------------------------------------------------------------------


MARK = "__method"  #: ending of method names in compiled code, so that no field of any tuple shares one


def compiled_copy(function: Any, methods: frozenset[str], memo: dict[int, Any]) -> Any:
    """A jitted copy of a plain function in which every plain function it reaches is jitted, and ``methods`` marked."""
    function = plain(function)
    if id(function) in memo:
        if memo[id(function)] is None:
            raise NotCompilable(f"{function.__name__} calls itself: recursion is not supported")
        return memo[id(function)]
    memo[id(function)] = None

    def convert(value: Any) -> Any:
        value = plain(value)
        return compiled_copy(value, methods, memo) if isinstance(value, types.FunctionType) else value

    def mark(name: str) -> str:
        return name + MARK if name in methods else name

    scope = dict(function.__globals__, __name__=__name__)  # numba imports this module when it reloads the cache
    names, attributes = code_names(function.__code__)
    for name in names & set(scope):
        value = scope[name]
        if isinstance(value, types.ModuleType) and not is_standard(value):
            module = types.ModuleType(value.__name__)  # `helpers.chi(...)`: a module of jitted functions
            for attribute in attributes:
                if hasattr(value, attribute):
                    setattr(module, mark(attribute), convert(getattr(value, attribute)))
            scope[name] = module
        else:
            scope[mark(name)] = convert(value)
    closure = tuple(types.CellType(convert(cell.cell_contents)) for cell in function.__closure__ or ()) or None
    code = function.__code__.replace(co_names=tuple(mark(name) for name in function.__code__.co_names))
    copy = types.FunctionType(code, scope, function.__name__, function.__defaults__, closure)
    copy.__kwdefaults__ = function.__kwdefaults__
    copy.__module__ = __name__
    memo[id(function)] = njit(forceinline=True, **OPTIONS)(copy)
    return memo[id(function)]


_methods: dict[Any, dict[str, Any]] = {}  #: of each tuple class, its compiled methods
_overloaded: set[str] = set()


def _make_overload(name: str) -> None:
    """Let compiled code call method ``name`` on the tuple of any component that has it."""
    if name in _overloaded:
        return
    _overloaded.add(name)

    def choose(self, *arguments):  # no annotations: numba compares the signatures
        method = _methods.get(self.instance_class, {}).get(name)
        if method is None:
            return None

        def respond(self, *arguments):
            return method(self, *arguments)

        return respond

    for kind in (nb.NamedTuple, nb.NamedUniTuple):  # a tuple of equal types is the second kind
        overload_method(kind, name + MARK)(choose)


def _compile_methods(struct: Structure, memo: dict[int, Any]) -> None:
    methods = frozenset(name for part in struct for name in part.methods)
    for part in struct:
        table = _methods.setdefault(part.tuple_class, {})
        for name, function in part.methods.items():
            table[name] = compiled_copy(function, methods, memo)
            _make_overload(name)


# --- the generated entry ---------------------------------------------------------------------------------------------


class _Writer:
    """Writes the expression that builds a component's tuple for contact ``c``."""

    def __init__(self, struct: Structure) -> None:
        self.scope: dict[str, Any] = {}
        self.numbers, self.rows = 0, 0
        self.expression = self._write(struct)

    def _write(self, struct: Structure) -> str:
        terms = [f"p{self.numbers + i}" for i in range(len(struct.numbers))]
        self.numbers += len(terms)
        terms += [f"r{self.rows + i}[c]" for i in range(len(struct.arrays))]
        self.rows += len(struct.arrays)
        for value in struct.constants.values():
            name = f"k{len(self.scope)}"
            self.scope[name] = value
            terms.append(name)
        terms += [self._write(part) for part in struct.parts.values()]
        name = f"tuple{len(self.scope)}"
        self.scope[name] = struct.tuple_class
        return f"{name}({', '.join(terms or ['0.0'])})"


def _law_source(writer: _Writer, memory: tuple[str, ...]) -> str:
    p = [f"p{i}" for i in range(writer.numbers)]
    r = [f"r{i}" for i in range(writer.rows)]
    m = [f"m{i}" for i in range(len(memory))]
    rows = ", ".join([*p, *r, *m, "opening", "slip", "normal", "shear"])
    values = ", ".join(["opening[c]", "slip[c]", *(f"{name}[c]" for name in m)])
    results = ", ".join(["normal[c]", "shear[c]", *(f"{name}[c]" for name in m)])
    return f"""
def inner({rows}):
    for c in range(opening.shape[0]):
        {results} = respond({writer.expression}, {values})

def batch(parameters, fields, field_stride, memory, memory_stride, opening, slip, normal, shear, n):
    P = carray(parameters, ({len(p) or 1},))
    R = carray(fields, ({len(r) or 1}, field_stride))
    M = carray(memory, ({len(m) or 1}, memory_stride))
    inner({", ".join([*(f"P[{i}]" for i in range(len(p))), *(f"R[{i}, :n]" for i in range(len(r))),
                      *(f"M[{i}, :n]" for i in range(len(m)))])}{"," if p or r or m else ""}
          carray(opening, (n,)), carray(slip, (n,)), carray(normal, (n,)), carray(shear, (n,)))
"""


def _integrator_source(writer: _Writer) -> str:
    p = [f"p{i}" for i in range(writer.numbers)]
    return f"""
def inner({", ".join([*p, "time_step"])}, force, velocity, displacement, mass, free, imposed, loss):
    for c in range(force.shape[0]):
        before = velocity[c]
        after, damping = respond({writer.expression}, force[c], before, mass[c], time_step)
        after = free[c] * after + imposed[c]
        velocity[c] = after
        displacement[c] += after * time_step
        loss[c] -= free[c] * damping * 0.5 * (before + after) * time_step

def batch(parameters, force, velocity, displacement, mass, free, imposed, loss, n):
    P = carray(parameters, ({len(p) + 1},))
    inner({", ".join(f"P[{i}]" for i in range(len(p) + 1))},
          carray(force, (n,)), carray(velocity, (n,)), carray(displacement, (n,)), carray(mass, (n,)),
          carray(free, (n,)), carray(imposed, (n,)), carray(loss, (n,)))
"""


_POINTER = nb.CPointer(nb.float64)
_LAW_SIGNATURE = (_POINTER, _POINTER, nb.int64, _POINTER, nb.int64, *(_POINTER,) * 4, nb.int64)
_INTEGRATOR_SIGNATURE = (*(_POINTER,) * 8, nb.int64)


@attrs.frozen(eq=False)
class Compiled:
    """A component's batch function: where it is, and what it must be given."""

    address: int
    numbers: np.ndarray
    rows: np.ndarray  #: (r, count) per-contact parameters
    memory: tuple[str, ...]
    keep: Any  #: owns the machine code

    def batch(self, opening: np.ndarray, slip: np.ndarray, memory: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Tractions (n,) of n contacts of one law; ``memory`` (m, n) is changed."""
        opening, slip = np.ascontiguousarray(opening), np.ascontiguousarray(slip)
        normal, shear = np.empty_like(opening), np.empty_like(opening)
        _foreign(10)(
            self.address, self.numbers.ctypes.data, self.rows.ctypes.data, self.rows.shape[1], memory.ctypes.data,
            memory.shape[1], opening.ctypes.data, slip.ctypes.data, normal.ctypes.data, shear.ctypes.data, len(opening),
        )  # fmt: skip
        return normal, shear

    def respond(self, opening: float, slip: float, *memory: float) -> tuple[float, ...]:
        """One contact: opening, slip, memory in; tractions, memory out."""
        rows = np.array([*memory, 0.0])[:, None]
        normal, shear = self.batch(np.array([opening]), np.array([slip]), rows)
        return (normal[0], shear[0], *rows[:-1, 0])


@functools.cache
def _foreign(count: int) -> Callable[..., None]:
    prototype = ctypes.CFUNCTYPE(None, *(ctypes.c_int64,) * count)
    return lambda address, *arguments: prototype(address)(*arguments)


def compile_law(law: ContactLaw, count: int = 1) -> Compiled:
    """Compile ``law.traction`` for groups of ``count`` contacts. Raises :class:`CompilationError`."""
    memory = memory_names(law)
    results = 2 + len(memory)
    return _entry(law, "traction", memory, _LAW_SIGNATURE, (nb.float64,) * results, results, count)


def compile_integrator(integrator: Any) -> Compiled:
    """Compile ``integrator.step``; its batch finds the time step after its parameters."""
    return _entry(integrator, "step", None, _INTEGRATOR_SIGNATURE, (nb.float64,) * 4, 2, 1)


_done: dict[tuple[str, Any], Any] = {}


def _entry(
    component: Any, method: str, memory: tuple[str, ...] | None, signature: Any, inputs: Any, results: int, count: int
) -> Compiled:
    if not attrs.has(type(component)):
        raise CompilationError(f"{type(component).__name__} must be an attrs class: @attrs.frozen(kw_only=True)")
    struct, numbers, rows = _spread(component, method, count)
    name, function = type(component).__name__, struct.methods[method]
    try:
        functions = [f for part in struct for f in part.methods.values()]
        key = fingerprint(*functions, extra=(ABI, OPTIONS["error_model"], method, memory, struct.describe()))
        if (key, struct.tuple_class) not in _done:
            _done[key, struct.tuple_class] = _build(struct, method, memory, signature, inputs, results, key)
    except NotCompilable as error:
        raise _refusal(name, function, str(error)) from None
    address, keep = _done[key, struct.tuple_class]
    return Compiled(address, numbers, rows, memory or (), keep)


def _build(
    struct: Structure, method: str, memory: tuple[str, ...] | None, signature: Any, inputs: Any, results: int, key: str
) -> tuple[int, Any]:
    memo: dict[int, Any] = {}
    _compile_methods(struct, memo)
    respond = memo[id(struct.methods[method])]
    writer = _Writer(struct)
    source = _integrator_source(writer) if memory is None else _law_source(writer, memory)
    scope = {"__name__": __name__, "carray": carray, "respond": respond, **writer.scope}
    exec(compile(source, f"<batch of {type(struct.component).__name__}>", "exec"), scope)
    scope["inner"] = njit(**OPTIONS)(scope["inner"])
    batch = keyed_njit(scope["batch"], key)
    if batch._cache.load_overload(signature, batch.targetctx) is None:
        # Not on disk: compile the scalar method by itself first, so that messages are about it and not its loop.
        problem = _problem(struct, respond, memo, inputs, results)
        if problem:
            raise _refusal(type(struct.component).__name__, struct.methods[method], problem)
    batch.compile(signature)
    compiled = batch.overloads[signature]
    return compiled.library.get_pointer_to_function(compiled.fndesc.llvm_cfunc_wrapper_name), batch


# --- errors ----------------------------------------------------------------------------------------------------------


def _refusal(name: str, function: types.FunctionType, problem: str) -> CompilationError:
    code = function.__code__
    return CompilationError(
        f"{name}.{function.__name__} ({code.co_filename}:{code.co_firstlineno}) cannot be compiled:\n"
        + textwrap.indent(problem, "    ")
        + "\nIt may use its arguments, the numbers, flags and parts of self, math.*, and other plain functions."
    )


def _tuple_type(struct: Structure) -> Any:
    from numba import typeof

    def value(part: Structure) -> Any:
        return part.tuple_class(
            *(0.0,) * (len(part.numbers) + len(part.arrays)), *part.constants.values(),
            *(value(inner) for inner in part.parts.values()),
            *((0.0,) if part.tuple_class._fields == ("nothing",) else ()),
        )  # fmt: skip

    return typeof(value(struct))


def _problem(struct: Structure, respond: Any, memo: dict[int, Any], inputs: Any, results: int) -> str | None:
    for dispatcher in memo.values():
        function = dispatcher.py_func
        if any(i.opname == "RAISE_VARARGS" for i in dis.get_instructions(function)):
            return (
                f"{function.__name__} raises: compiled code cannot stop in the middle of a batch, "
                "the other contacts would silently keep their old forces; return nan instead"
            )
    try:
        respond.compile((_tuple_type(struct), *inputs))
    except NumbaError as error:
        return _useful_lines(error)
    except Exception as error:
        return f"{type(error).__name__}: {error}"
    answer = respond.nopython_signatures[0].return_type
    if not (
        isinstance(answer, nb.BaseTuple)
        and len(answer) == results
        and all(isinstance(entry, (nb.Float, nb.Integer, nb.Boolean)) for entry in answer)
    ):
        return f"it must return {results} numbers on every path; the compiler sees {answer}"
    return None


def _useful_lines(error: Exception) -> str:
    """The lines of a numba error that speak of the user's code."""
    noise = (
        "During:", "Failed in nopython", "raised from", "This error may have been", "To see Python/NumPy",
        "For more information", "Pass nopython", "Enable logging",
    )  # fmt: skip
    text = re.sub(r"\x1b\[[0-9;]*m", "", str(error)).replace(MARK, "")
    lines = [line for line in text.splitlines() if line.strip() and not line.lstrip().startswith(noise)]
    return "\n".join(lines[:12])
