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
import grainlaw.geometry
import grainlaw.laws
import grainlaw.materials
import grainlaw.protocols
from grainlaw.declared import parameters_of
from grainlaw.messages import nearest, short
from grainlaw.parameter import ParameterError
from grainlaw.unit_text import quantity, written

PACKAGES: tuple[ModuleType, ...] = (
    grainlaw, grainlaw.laws, grainlaw.materials, grainlaw.geometry, grainlaw.protocols,
)  # fmt: skip
Kind = type | tuple[type, ...]


def name_of(cls: type, kind: Kind = ()) -> str:
    """``HordijkSoftening`` is hordijk where a Softening is asked for, and hordijk-softening elsewhere."""
    words = _words(cls)
    common = set(_words(kind)) if isinstance(kind, type) else set()
    while len(words) > 1 and words[-1] in common:
        words.pop()
    return "-".join(words)


def _words(cls: type) -> list[str]:
    return [word.lower() for word in re.findall(r"[A-Z]+[a-z0-9]*", cls.__name__)]


def choices(kind: Kind) -> dict[str, type]:
    """The components of a kind that the packages offer, by name."""
    public = [getattr(package, name) for package in PACKAGES for name in package.__all__]
    found = [c for c in public if isinstance(c, type) and issubclass(c, kind) and attrs.has(c)]
    return {name_of(c, kind): c for c in dict.fromkeys(found) if not inspect.isabstract(c)}


def instances(kind: Kind) -> dict[str, Any]:
    """The ready components of a kind that the packages offer, such as the expansion ``quartz``, by name."""
    public = {name: getattr(package, name) for package in PACKAGES for name in package.__all__ if name.isupper()}
    return {name.lower().replace("_", "-"): each for name, each in public.items() if isinstance(each, kind)}


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
    :class:`~grainlaw.parameter.ParameterError`, which suggests the nearest name.
    """
    if not isinstance(raw, (str, Mapping)):
        raise ParameterError(f"{where} = {short(raw)} is not allowed, it must be a name or a table")
    if isinstance(raw, str) and (ready := instances(kind).get(raw.lower().replace("_", "-"))) is not None:
        return ready
    given = {"type": raw} if isinstance(raw, str) else dict(raw)
    cls = _class(kind, given.pop("type", None), where, base)
    return evolved(base if type(base) is cls else cls, given, where)


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
        if str(name).lower().replace("_", "-") in (own, name_of(cls), cls.__name__.lower()):
            return cls
    known |= instances(kind)
    raise ParameterError(
        f"{where}: there is no {short(str(name))}{nearest(str(name), known)} (there are: {', '.join(known)})"
    )


def evolved(base: Any, given: Mapping[str, Any], where: str) -> Any:
    """The same component with other parameters, or, from a class, one with these. Raises ParameterError."""
    cls = base if isinstance(base, type) else type(base)
    fields = {field.name: field for field in attrs.fields(cls) if field.init}
    refuse_unknown(where, given, fields)
    kinds = _kinds(cls)
    values = {}
    for name, raw in given.items():
        present = fields[name].default if base is cls else getattr(base, name)
        values[name] = _value(fields[name], kinds.get(name, ()), raw, f"{where}.{name}", present)
    if base is not cls:
        return attrs.evolve(base, **values)
    needed = [f for f in fields.values() if f.default is attrs.NOTHING and f.name not in values]
    if needed:
        first = needed[0]
        unit = first.metadata.get("unit", "")
        raise ParameterError(f"{where}.{first.name}{unit and f' ({unit})'} is missing: {cls.__name__} needs it")
    return cls(**values)


def _kinds(cls: type) -> dict[str, tuple[type, ...]]:
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
    if "unit" in field.metadata and not isinstance(raw, Mapping) and not _names_one(_interface(kinds), raw):
        return quantities(raw, field.metadata["unit"], where)
    of_present = present is not attrs.NOTHING and present is not None
    if of_present and not kinds:
        kinds = (type(present), *(base for base in type(present).__mro__ if inspect.isabstract(base)))
    for kind in kinds:
        if issubclass(kind, enum.Enum):
            return _member(kind, raw, where)
    interface = _interface(kinds)
    if interface and isinstance(raw, list):
        return tuple(component(interface, each, f"{where}[{k}]") for k, each in enumerate(raw))
    if interface:
        return component(interface, raw, where, present if of_present and isinstance(present, interface) else None)
    if int in kinds and isinstance(raw, str) and re.fullmatch(r"[+-]?\d+", raw):
        return int(raw)
    return tuple(raw) if isinstance(raw, list) else raw


def _interface(kinds: tuple[type, ...]) -> type | None:
    return next((kind for kind in reversed(kinds) if inspect.isabstract(kind) or attrs.has(kind)), None)


def _names_one(interface: type | None, raw: Any) -> bool:
    """Whether a text is meant as the name of a ready component, not as a number with its unit."""
    words = isinstance(raw, str) and not any(map(str.isdigit, raw))
    return words and interface is not None and bool(instances(interface))


def explained(cls: type) -> dict[str, str]:
    """Each parameter's unit or names to choose from, what is allowed, and its meaning, in words."""
    kinds, found = _kinds(cls), {}
    for name, kind, allowed, _, meaning in parameters_of(cls):
        first = next((each for each in kinds.get(name, ()) if inspect.isabstract(each)), None)
        if first is not None:
            kind = f"one of {', '.join(choices(first))}"
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
    members = {member.name.lower().replace("_", "-"): member for member in kind}
    name = str(raw).lower().replace("_", "-")
    if name not in members:
        raise ParameterError(
            f"{where} = {short(raw)} is not allowed{nearest(name, members)} (one of: {', '.join(members)})"
        )
    return members[name]


def settings(made: Any, kind: Kind = ()) -> dict[str, Any]:
    """What :func:`component` makes the same component of, with all its parameters."""
    found: dict[str, Any] = {"type": name_of(type(made), kind)}
    kinds = _kinds(type(made))
    for field in attrs.fields(type(made)):
        value = getattr(made, field.name)
        if not field.init or value is None:
            continue
        ready = [name for name, each in instances(type(value)).items() if each == value]
        if ready:
            found[field.name] = ready[0]
        elif attrs.has(type(value)):
            kind = next((k for k in kinds.get(field.name, ()) if inspect.isabstract(k)), ())
            found[field.name] = settings(value, kind)
        elif isinstance(value, tuple) and value and all(attrs.has(type(each)) for each in value):
            found[field.name] = [settings(each) for each in value]
        elif isinstance(value, enum.Enum):
            found[field.name] = value.name.lower().replace("_", "-")
        elif "unit" in field.metadata and isinstance(value, (np.ndarray, tuple)):
            found[field.name] = np.array(value).tolist()
        elif "unit" in field.metadata:
            text = written(value, field.metadata["unit"])
            found[field.name] = text if " " in text else value
        else:
            found[field.name] = value
    return found
