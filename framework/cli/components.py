"""Components from a configuration, by names made of their classes' names, with quantities as people write them."""

from __future__ import annotations

import enum
import inspect
import re
import typing
from collections.abc import Iterable, Mapping
from types import ModuleType
from typing import Any

import attrs
import numpy as np

import grainlaw
from grainlaw.declared import parameters_of
from grainlaw.fields import WITHOUT, ParameterError
from grainlaw.messages import nearest, refusal, short
from grainlaw.time_series import TimeSeries
from grainlaw.unit_text import quantity, written

PACKAGES: tuple[ModuleType, ...] = (grainlaw, *(getattr(grainlaw, name) for name in grainlaw.MODULES))
Kind = type | tuple[type, ...]
FILL_IN = "FILL IN"  #: in a template, in the place of a value that is needed
KINDS = {  #: of parameters, in the words of a configuration
    "int": "whole number", "float": "number", "bool": "true or false", "str": "text",
    "tuple[float, ...]": "list of numbers", "tuple[tuple[float, float], ...]": "list of points [x, y]",
    "tuple[str, ...]": "list of names", "Sequence[str]": "list of names", "Threads": 'whole number or "auto"',
}  # fmt: skip


def name_of(cls: type, kind: Kind = ()) -> str:
    """``HordijkSoftening`` is hordijk where a Softening is asked for, and hordijk-softening elsewhere."""
    words = _words(cls)
    common = set(_words(kind)) if isinstance(kind, type) else set()
    while len(words) > 1 and words[-1] in common:
        words.pop()
    return "-".join(words)


def _words(cls: type) -> list[str]:
    return [word.lower() for word in re.findall(r"[A-Z]+[a-z0-9]*", cls.__name__)]


def as_written(name: Any) -> str:
    """A name as files and the command line have it: in small letters, with hyphens."""
    return str(name).lower().replace("_", "-")


def choices(kind: Kind) -> dict[str, type]:
    """The components of a kind that the packages offer, by name."""
    public = [getattr(p, name) for p in PACKAGES for name in p.__all__ if name[0].isupper() and name != "Rock"]
    found = [c for c in public if isinstance(c, type) and issubclass(c, kind) and attrs.has(c)]
    return {name_of(c, kind): c for c in dict.fromkeys(found) if not inspect.isabstract(c)}


def instances(kind: Kind) -> dict[str, Any]:
    """The ready components of a kind that the packages offer, such as the expansion ``quartz``, by name."""
    public = {name: getattr(package, name) for package in PACKAGES for name in package.__all__ if name.isupper()}
    return {as_written(name): each for name, each in public.items() if isinstance(each, kind)}


def refuse_unknown(where: str, given: Iterable[str], known: Iterable[str]) -> None:
    """Raise :class:`ParameterError` for the first key that is not known."""
    known = list(known)
    for key in given:
        if key not in known:
            has = f"{where} has: {', '.join(known) or 'nothing'}"
            raise ParameterError(f"there is no '{where}.{key}'{nearest(key, known)} ({has})")


def component(kind: Kind, raw: Any, where: str, base: Any = None) -> Any:
    """A component of a kind from its name, or from a table with its ``type`` and parameters.

    Without a type, and where it is that of ``base``, the parameters that are not given are those of ``base``. Raises
    :class:`~grainlaw.fields.ParameterError`, which suggests the nearest name.
    """
    if not isinstance(raw, (str, Mapping)):
        raise refusal(where, raw, "a name or a table")
    if isinstance(raw, str) and (ready := instances(kind).get(as_written(raw))) is not None:
        return ready
    given = {"type": raw} if isinstance(raw, str) else raw
    return evolved(begin_with(kind, given, where, base), own(given), where)


def own(given: Mapping[str, Any]) -> dict[str, Any]:
    """The parameters of a table, without its type."""
    return {name: value for name, value in given.items() if name != "type"}


def shared(given: Mapping[str, Any], cls: type) -> dict[str, Any]:
    """The parameters of a table that a class has, too."""
    return {name: value for name, value in given.items() if name in attrs.fields_dict(cls)}


def begin_with(kind: Kind, given: Mapping[str, Any], where: str, base: Any = None) -> Any:
    """What :func:`evolved` makes a component of: ``base`` where it is of the type that is given, else the class."""
    cls = _class(kind, given.get("type"), where, base)
    return base if type(base) is cls else cls


def _class(kind: Kind, name: Any, where: str, base: Any) -> type:
    if name is None and base is not None:
        return type(base)
    if name is None and isinstance(kind, type) and attrs.has(kind) and not inspect.isabstract(kind):
        return kind  # there is only one
    known: dict[str, Any] = choices(kind)
    if base is not None:
        known.setdefault(name_of(type(base), kind), type(base))
    if name is None:
        raise ParameterError(f"{where}.type is missing, it must be one of {', '.join(known)}")
    for own, cls in known.items():
        if as_written(name) in (own, name_of(cls), cls.__name__.lower()):
            return cls
    known |= instances(kind)
    raise ParameterError(
        f"{where}: there is no {short(str(name))}{nearest(str(name), known)} (there are: {', '.join(known)})"
    )


def evolved(base: Any, given: Mapping[str, Any], where: str) -> Any:
    """The same component with other parameters, or, from a class, one with these. Raises ParameterError."""
    cls = base if isinstance(base, type) else type(base)
    values = _values(base, given, where)
    if base is not cls:
        return attrs.evolve(base, **values)
    if needed := [_place(where, field) for field in _needed(base, values)]:
        is_, it = ("is", "it") if len(needed) == 1 else ("are", "them")
        raise ParameterError(f"{', '.join(needed)} {is_} missing: {cls.__name__} needs {it}")
    return cls(**values)


def drafted(base: Any, given: Mapping[str, Any], where: str) -> dict[str, Any]:
    """The settings of the component of :func:`evolved`, with all that could be given.

    What is needed and not given is ``FILL_IN``; what is None is there, too. Raises ParameterError.
    """
    given = {name: raw for name, raw in given.items() if raw != FILL_IN}
    needed = _needed(base, given)
    if needed:
        values = {field.name: field.default for field in attrs.fields(base)} | _values(base, given, where)
        values |= {field.name: FILL_IN for field in needed}
        return _settings(base, values)
    made = evolved(base, given, where)
    return _settings(type(made), {field.name: getattr(made, field.name) for field in attrs.fields(type(made))})


def _needed(base: Any, given: Iterable[str]) -> list[attrs.Attribute]:
    """Fields of a class without a default that are not given; none of a component."""
    fields = attrs.fields(base) if isinstance(base, type) else ()
    return [field for field in fields if field.init and field.default is attrs.NOTHING and field.name not in given]


def _place(where: str, field: attrs.Attribute) -> str:
    unit = field.metadata.get("unit", "")
    return f"{where}.{field.name}{unit and f' ({unit})'}"


def _values(base: Any, given: Mapping[str, Any], where: str) -> dict[str, Any]:
    cls = base if isinstance(base, type) else type(base)
    fields = {field.name: field for field in attrs.fields(cls) if field.init}
    refuse_unknown(where, given, fields)
    kinds, values = kinds_of(cls), {}
    for name, raw in given.items():
        if isinstance(raw, str) and raw == FILL_IN:
            raise ParameterError(f"{_place(where, fields[name])} is still to be filled in: {cls.__name__} needs it")
        present = fields[name].default if base is cls else getattr(base, name)
        values[name] = _value(fields[name], kinds.get(name, ()), raw, f"{where}.{name}", present)
    return values


def kinds_of(cls: type) -> dict[str, tuple[type, ...]]:
    """Classes that a field's annotation names; none where a file of the user's names what cannot be found."""
    try:
        hints = typing.get_type_hints(cls)
    except NameError:
        return {}
    return {
        name: tuple(kind for kind in typing.get_args(hint) or (hint,) if isinstance(kind, type))
        for name, hint in hints.items()
    }


def _value(field: attrs.Attribute, kinds: tuple[type, ...], raw: Any, where: str, present: Any) -> Any:
    if field.metadata.get("varies") and isinstance(raw, list):
        return [tuple(map(quantity, point, ("s", field.metadata["unit"]), (where, where))) for point in raw]
    if "unit" in field.metadata and not isinstance(raw, Mapping) and not _names_one(interface_of(kinds), raw):
        return quantities(raw, field.metadata["unit"], where)
    if present is not attrs.NOTHING and not kinds:
        kinds = (type(present), *(base for base in type(present).__mro__ if inspect.isabstract(base)))
    for kind in kinds:
        if issubclass(kind, enum.Enum):
            return _member(kind, raw, where)
    interface = interface_of(kinds)
    if interface and isinstance(raw, list):
        return tuple(component(interface, each, f"{where}[{k}]") for k, each in enumerate(raw))
    if interface:
        return component(interface, raw, where, present if isinstance(present, interface) else None)
    return tuple(raw) if isinstance(raw, list) else raw


def interface_of(kinds: tuple[type, ...]) -> type | None:
    """The interface or component among the kinds of a field; None for a number, a text or an enumeration."""
    return next((kind for kind in reversed(kinds) if inspect.isabstract(kind) or attrs.has(kind)), None)


def _names_one(interface: type | None, raw: Any) -> bool:
    """Whether a text is meant as the name of a ready component, not as a number with its unit."""
    words = isinstance(raw, str) and not any(map(str.isdigit, raw))
    return words and interface is not None and bool(instances(interface))


def explained(cls: type) -> dict[str, str]:
    """Each parameter's unit or names to choose from, what is allowed, and its meaning, in words."""
    kinds, found = kinds_of(cls), {}
    varying = {field.name for field in attrs.fields(cls) if field.metadata.get("varies")}
    without = {field.name: field.metadata.get(WITHOUT) for field in attrs.fields(cls)}
    for name, plain, allowed, _, meaning in parameters_of(cls):
        kind = KINDS.get(plain.removesuffix(" | None"), plain)
        if name in varying:
            allowed = "a number, or a list of points [time, value]"
        first = next((each for each in kinds.get(name, ()) if inspect.isabstract(each)), None)
        if first is not None and (ready := instances(first)):
            kind = f"{plain}, or one of {', '.join([*ready, *choices(first)])}"
        elif first is not None:
            fit = [one for one, each in choices(first).items() if each is not without.get(name)]
            kind = f"one of {', '.join(fit)}"
        elif any(issubclass(each, enum.Enum) for each in kinds.get(name, ())):
            kind, allowed = f"one of {allowed.lower().replace('_', '-')}", ""
        found[name] = "; ".join(words for words in (kind, allowed, meaning) if words)
    return found


def quantities(raw: Any, unit: str, where: str) -> Any:
    """A number in the unit, or a tuple of numbers, or of such tuples, of lists."""
    if isinstance(raw, list):
        return tuple(quantities(each, unit, where) for each in raw)
    return quantity(raw, unit, where)


def _member(kind: type[enum.Enum], raw: Any, where: str) -> enum.Enum:
    members = {as_written(member.name): member for member in kind}
    name = as_written(raw)
    if name not in members:
        raise ParameterError(
            f"{where} = {short(raw)} is not allowed{nearest(name, members)} (one of: {', '.join(members)})"
        )
    return members[name]


def settings(made: Any, kind: Kind = ()) -> dict[str, Any]:
    """What :func:`component` makes the same component of, with all its parameters."""
    values = {field.name: getattr(made, field.name) for field in attrs.fields(type(made))}
    return _settings(type(made), {name: value for name, value in values.items() if value is not None}, kind)


def _settings(cls: type, values: Mapping[str, Any], kind: Kind = ()) -> dict[str, Any]:
    kinds, given = kinds_of(cls), [field for field in attrs.fields(cls) if field.init and field.name in values]
    shown = {field.name: _shown(field, values[field.name], kinds.get(field.name, ())) for field in given}
    return {"type": name_of(cls, kind), **shown}


def _shown(field: attrs.Attribute, value: Any, kinds: tuple[type, ...]) -> Any:
    """A value as a configuration has it."""
    if value is None or (isinstance(value, str) and value == FILL_IN):
        return value
    if ready := [name for name, each in instances(type(value)).items() if each == value]:
        return ready[0]
    if isinstance(value, TimeSeries):
        points = zip(value.times.tolist(), value.values.tolist(), strict=True)
        return [[written(t, "s"), written(v, field.metadata["unit"])] for t, v in points]
    if attrs.has(type(value)):
        return settings(value, next((kind for kind in kinds if inspect.isabstract(kind)), ()))
    if isinstance(value, tuple) and value and all(attrs.has(type(each)) for each in value):
        return [settings(each) for each in value]
    if isinstance(value, enum.Enum):
        return as_written(value.name)
    if "unit" in field.metadata and isinstance(value, (np.ndarray, tuple)):
        return np.array(value).tolist()
    text = written(value, field.metadata["unit"]) if "unit" in field.metadata else ""
    return text if " " in text else value
