"""What a component (a law, an integrator, a part) consists of, as compiled code sees it.

Only what its methods use, by the names in their byte code: a property that none of them reads may give text or fail.
"""

from __future__ import annotations

import enum
import inspect
import operator
import types
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import attrs
import numpy as np

from grainlaw.compiler.fingerprint import NotCompilable, code_names, reached
from grainlaw.compiler.numba_private import python_function
from grainlaw.fields import ParameterError


@attrs.frozen(eq=False)
class Structure:
    """A component taken apart; its iterator yields it and its parts, depth first."""

    component: Any
    numbers: tuple[str, ...]  #: run-time parameters, one value for all contacts
    rows: tuple[str, ...]  #: run-time parameters, one value per contact
    constants: dict[str, Any]  #: flags, integers and enumeration members
    parts: dict[str, Structure]
    methods: dict[str, types.FunctionType]

    def __iter__(self) -> Iterator[Structure]:
        yield self
        for part in self.parts.values():
            yield from part

    @property
    def fields(self) -> tuple[str, ...]:
        """Names of the entries of the tuple that represents the component."""
        return (*self.numbers, *self.rows, *self.constants, *self.parts) or ("nothing",)

    def describe(self) -> tuple:
        """What of the structure, other than functions, shapes the code."""
        parts = [(name, part.describe()) for name, part in self.parts.items()]
        return self.numbers, self.rows, tuple(self.constants.items()), parts, tuple(self.methods)


def _method(kind: type, name: str) -> types.FunctionType | None:
    """The plain function of a method that takes ``self``."""
    member = python_function(inspect.getattr_static(kind, name, None))
    return member if isinstance(member, types.FunctionType) else None


def structure(component: Any, *methods: str, asked: frozenset[str] = frozenset()) -> Structure:
    """Take a component apart, beginning with the scalar ``methods`` that are called from outside.

    ``asked`` are names of attributes that are read from outside.
    """
    kind = type(component)
    functions: dict[str, types.FunctionType] = {}
    waiting, names = list(methods), set(asked)
    while waiting:
        name = waiting.pop()
        functions[name] = python_function(getattr(kind, name))
        names.update(*(code_names(function.__code__)[1] for function in reached(functions[name])))
        found = {other for other in names if _method(kind, other)}
        waiting.extend(found - set(functions) - set(waiting))
    used = sorted(name for name in names - set(functions) if not name.startswith("__"))
    values = {name: getattr(component, name) for name in used if hasattr(component, name)}
    parts = {}
    for name, value in values.items():
        if attrs.has(type(value)):
            called = (other for other in sorted(names) if _method(type(value), other))
            parts[name] = structure(value, *called, asked=frozenset(names))
    return Structure(
        component,
        numbers=tuple(n for n, v in values.items() if isinstance(v, (float, np.floating))),
        rows=(),
        constants={n: v for n, v in values.items() if isinstance(v, (bool, int, np.bool_, np.integer, enum.Enum))},
        parts=parts,
        methods=dict(sorted(functions.items())),  # the key of the cache depends on the order
    )


def other_numbers(struct: Structure, component: Any) -> list[float] | None:
    """The numbers of another component if its code is that of ``struct``, in the order of the compiled code."""
    if type(component) is not type(struct.component) or struct.rows:
        return None
    numbers = [getattr(component, name) for name in struct.numbers]
    constants = [(type(c), c) for c in (getattr(component, name) for name in struct.constants)]
    if constants != [(type(c), c) for c in struct.constants.values()]:
        return None
    for name, part in struct.parts.items():
        more = other_numbers(part, getattr(component, name))
        if more is None:
            return None
        numbers += more
    return numbers if all(isinstance(number, (float, np.floating)) for number in numbers) else None


# --- parameters that differ between contacts -------------------------------------------------------------------------


def spread(component: Any, methods: Sequence[str], count: int) -> tuple[Structure, np.ndarray, np.ndarray]:
    """Structure, numbers (p,) and per-contact rows (r, count) of a component whose parameters may be arrays.

    Properties are evaluated for one contact at a time, as they are written, but only once for equal contacts.
    """
    arrays: list[np.ndarray] = []
    at = _picker(component, arrays, count)
    if at is None:
        struct = structure(component, *methods)
        return struct, np.array([read(component) for read in _readers(struct, "numbers")]), np.empty((0, count))
    contacts, place = np.unique(np.stack(arrays, axis=1), axis=0, return_inverse=True)
    struct = structure(at(contacts[0].tolist()), *methods)
    numbers, constants = _readers(struct, "numbers"), _readers(struct, "constants")
    first = [read(struct.component) for read in constants]
    table = np.empty((len(contacts), len(numbers)))
    for k, entries in enumerate(contacts.tolist()):
        one = at(entries)
        table[k] = [read(one) for read in numbers]
        if [read(one) for read in constants] != first:
            raise NotCompilable(
                "a whole number, flag or option differs between contacts; only numbers with a fraction (float) may: "
                f"it is one of {', '.join(name for part in struct for name in part.constants)}"
            )
    varying = np.any(table != table[0], axis=0)
    rows = np.ascontiguousarray(table[place.ravel()][:, varying].T)
    return _vary(struct, iter(varying.tolist())), table[0, ~varying].copy(), rows


def _readers(struct: Structure, what: str, path: str = "") -> list[Callable[[Any], Any]]:
    """Readers of the ``numbers`` or ``constants`` of a component and its parts, in the order of the compiled code."""
    readers: list[Callable[[Any], Any]] = [operator.attrgetter(path + name) for name in getattr(struct, what)]
    for name, part in struct.parts.items():
        readers += _readers(part, what, f"{path}{name}.")
    return readers


def _picker(component: Any, arrays: list[np.ndarray], count: int) -> Callable[[Sequence[float]], Any] | None:
    """A function that makes the component as one contact sees it from that contact's entries of the ``arrays``.

    None where no parameter is an array. Validators do not run again: they have seen the arrays.
    """
    kind = type(component)
    fixed: list[tuple[str, Any]] = []
    picked: list[tuple[str, Callable[[Sequence[float]], Any]]] = []
    for field in attrs.fields(kind):
        value = getattr(component, field.name)
        if isinstance(value, np.ndarray):
            if value.shape != (count,):
                raise ParameterError(
                    f"{kind.__name__}: {field.name} has {value.size} entries, "
                    f"it must have one for each of the {count} contact points"
                )
            picked.append((field.name, operator.itemgetter(len(arrays))))
            arrays.append(value)
        elif attrs.has(type(value)) and (part := _picker(value, arrays, count)):
            picked.append((field.name, part))
        else:
            fixed.append((field.name, value))

    def at(entries: Sequence[float]) -> Any:
        one = object.__new__(kind)
        for name, value in fixed:
            object.__setattr__(one, name, value)
        for name, pick in picked:
            object.__setattr__(one, name, pick(entries))
        return one

    return at if picked else None


def _vary(struct: Structure, varying: Iterator[bool]) -> Structure:
    """The structure with those of its numbers that differ between contacts turned into rows."""
    marks = {name: next(varying) for name in struct.numbers}
    return attrs.evolve(
        struct,
        numbers=tuple(n for n, v in marks.items() if not v),
        rows=tuple(n for n, v in marks.items() if v),
        parts={name: _vary(part, varying) for name, part in struct.parts.items()},
    )
