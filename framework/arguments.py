"""Arguments held to a signature: their names, with the nearest that exists, and the kinds of their values."""

from __future__ import annotations

import functools
import inspect
import re
import sys
import types
import typing
from abc import ABCMeta
from collections.abc import Callable, Mapping, Sequence
from numbers import Integral, Real
from typing import Any, TypeVar

import attrs
import numpy as np

from grainlaw.declared import signature_of, text_of
from grainlaw.messages import ParameterError, nearest, refusal
from grainlaw.short_form import as_table, in_one_line, inherited

Function = TypeVar("Function", bound=Callable)
Hints = Mapping[str, Any]


class Checked(ABCMeta):
    """Classes whose arguments are checked before an instance is made; a user's class inherits it from its interface.

    ``class Elastic(metaclass=Checked)``. Raises :class:`ParameterError` for a name that is not known, for one that is
    missing, for a value of another kind than the annotation of a field says, and where an interface is not filled.
    Fields with a converter or a validator check their values themselves, and what takes a number checks its bounds.

    An instance prints in one line, and in a notebook as a table, unless its class says otherwise; ``help`` shows unit,
    bound and meaning of what is declared.
    """

    def __new__(mcs, name: str, bases: tuple[type, ...], content: dict[str, Any], **options: Any) -> Any:
        # attrs writes a __repr__ of its own, with every number of every array, where the body of a class has none.
        for shows, otherwise in (("__repr__", in_one_line), ("_repr_html_", as_table)):
            content.setdefault(shows, inherited(bases, shows, otherwise))
        return super().__new__(mcs, name, bases, content, **options)

    def __call__(cls, *given: Any, **named: Any) -> Any:
        if cls.__abstractmethods__:
            missing = ", ".join(sorted(cls.__abstractmethods__))
            raise ParameterError(f"{cls.__name__} cannot be made: it must define {missing}")
        _check(cls.__name__, _of_class(cls), given, named)
        return super().__call__(*given, **named)

    @property
    def __signature__(cls) -> inspect.Signature:  # Python would show that of __call__
        return signature_of(cls, _of_class(cls).signature)

    @property  # of the classes; this one, for which ``help`` is of no use, loses its own
    def __doc__(cls) -> str | None:
        return text_of(cls, _WRITTEN.__get__(cls, type(cls)))

    @__doc__.setter
    def __doc__(cls, text: str | None) -> None:  # a class that comes from another process is given its own
        _WRITTEN.__set__(cls, text)


_WRITTEN: Any = vars(type)["__doc__"]  #: of Python itself: the docstring as it is written


def checked(function: Function) -> Function:
    """A function whose arguments are checked before it runs. Raises :class:`ParameterError`."""

    @functools.wraps(function)
    def call(*given: Any, **named: Any) -> Any:
        _check(function.__name__, _of_function(function), given, named)
        return function(*given, **named)

    return typing.cast(Function, call)


@attrs.frozen
class _Declared:
    """What a function or class declares of its arguments."""

    signature: inspect.Signature
    hints: Hints  #: of the values that are checked here
    required: frozenset[str]  #: parameters without a default
    named: frozenset[str]  #: parameters that can be given by name


def _declared(signature: inspect.Signature, hints: Hints) -> _Declared:
    several = (inspect.Parameter.VAR_KEYWORD, inspect.Parameter.VAR_POSITIONAL)
    single = [name for name, p in signature.parameters.items() if p.kind not in several]
    required = frozenset(name for name in single if signature.parameters[name].default is inspect.Parameter.empty)
    checked_here = {name: hint for name, hint in hints.items() if hint not in _BOUNDED and hint is not Any}
    return _Declared(signature, checked_here, required, frozenset(single))


def _check(where: str, declared: _Declared, given: tuple, named: dict[str, Any]) -> None:
    # Two components are made in every burst of dynamic relaxation; a signature takes long to bind.
    simple = not given and declared.required <= named.keys() <= declared.named
    for name, value in (named if simple else _bound(where, declared.signature, given, named)).items():
        hint = declared.hints.get(name, Any)
        several = not simple and declared.signature.parameters[name].kind is inspect.Parameter.VAR_POSITIONAL
        for each in value if several else (value,):
            if not fits(each, hint):
                raise refusal(f"{where}: {name}", each, wanted(hint))


def _bound(where: str, signature: inspect.Signature, given: tuple, named: dict[str, Any]) -> dict[str, Any]:
    """Values by the names of parameters."""
    names = [name for name, p in signature.parameters.items() if p.kind not in (p.VAR_KEYWORD, p.VAR_POSITIONAL)]
    if not any(p.kind is p.VAR_KEYWORD for p in signature.parameters.values()):
        for name in named:
            if name not in names:
                has = f"{where} has: {', '.join(names) or 'nothing'}"
                raise ParameterError(f"{where}: there is no '{name}'{nearest(name, names)} ({has})")
    try:
        return signature.bind(*given, **named).arguments
    except TypeError as error:
        raise ParameterError(f"{where}: {error} ({where}{_names(signature)})") from None


def _names(signature: inspect.Signature) -> str:
    plain = [p.replace(annotation=p.empty) for p in signature.parameters.values()]
    return str(inspect.Signature(plain))


@functools.cache
def _of_function(function: Callable) -> _Declared:
    names = vars(sys.modules[function.__module__])
    hints = {k: _evaluated(text, names) for k, text in function.__annotations__.items()}
    return _declared(inspect.signature(function), hints)


@functools.cache
def _of_class(cls: type) -> _Declared:
    """What ``__init__`` takes, and the annotations of fields that do not check themselves."""
    made: Any = cls.__init__  # type: ignore[misc]
    if made is object.__init__:
        return _declared(inspect.Signature(), {})
    _self, *others = inspect.signature(made).parameters.values()
    signature = inspect.Signature(others)
    if not attrs.has(cls):
        return _declared(
            signature, {name: _evaluated(text, made.__globals__) for name, text in made.__annotations__.items()}
        )
    hints = {}
    for field in attrs.fields(cls):
        if field.converter is None and field.validator is None:
            owner = next(base for base in cls.__mro__ if field.name in vars(base).get("__annotations__", {}))
            module = sys.modules.get(owner.__module__)
            hints[field.alias] = _evaluated(field.type, vars(module)) if module else Any
    return _declared(signature, hints)


def _evaluated(hint: Any, names: Mapping[str, Any]) -> Any:
    """What an annotation means; anything where it names what is imported for types alone."""
    if not isinstance(hint, str):
        return hint
    try:
        return eval(hint, dict(names))
    except Exception:
        return Any


def fits(value: Any, hint: Any) -> bool:
    """Whether a value is of the kind that an annotation says; True where the annotation cannot say it."""
    if hint in _KINDS:
        return _KINDS[hint][2](value)
    if isinstance(hint, Checked):
        return isinstance(value, hint)
    origin, inner = typing.get_origin(hint), typing.get_args(hint)
    if origin in (typing.Union, types.UnionType):
        return any(fits(value, kind) for kind in inner)
    if origin is Callable or hint is Callable:
        return callable(value)
    if isinstance(origin, type):
        return _holds(value, origin, inner)
    if hint is None:
        return value is None
    return not isinstance(hint, type) or isinstance(value, hint)


def _holds(value: Any, kind: type, inner: tuple[Any, ...]) -> bool:
    """Whether a container is of a kind and holds what it should; what can be gone through only once is not tried."""
    if issubclass(kind, Mapping):
        if not isinstance(value, Mapping):
            return False
        return all(fits(key, inner[0]) and fits(entry, inner[1]) for key, entry in value.items())
    if issubclass(kind, tuple) and inner[-1:] != (...,):
        return _is_list(value) and len(value) == len(inner) and all(map(fits, value, inner))
    if issubclass(kind, Sequence):
        return _is_list(value) and all(fits(entry, inner[0]) for entry in value)
    return isinstance(value, kind)


def _is_list(value: Any) -> bool:
    if isinstance(value, np.ndarray):
        return value.ndim > 0
    return isinstance(value, Sequence) and not isinstance(value, (str, bytes))


def is_number(value: Any, kind: type = Real) -> bool:
    """Whether a value is a single number, of Python or numpy; True and False are none, nor is what no float holds."""
    is_one = isinstance(value, kind) and not isinstance(value, (bool, np.bool_))
    return is_one and not (isinstance(value, int) and abs(value) > sys.float_info.max)


def floats(value: Any) -> np.ndarray:
    """Numbers as a new array of float. Raises TypeError, ValueError for texts, flags, complex numbers and others."""
    if _has_flag(value):
        raise TypeError("True and False are no numbers")
    array = np.array(value)
    if array.size and array.dtype.kind not in "iuf":
        raise TypeError(f"{array.dtype} is no kind of number")
    return array.astype(float)


def floats_or_nan(value: Any) -> np.ndarray:
    """As :func:`floats`; a single nan for what is none."""
    try:
        return floats(value)
    except (TypeError, ValueError, OverflowError):
        return np.array(np.nan)


def _has_flag(value: Any) -> bool:
    if isinstance(value, (list, tuple)):
        return any(map(_has_flag, value))
    return isinstance(value, (bool, np.bool_))


#: annotations that say less, or more, than their class: one and several of them in words, and what fits them
_KINDS: dict[Any, tuple[str, str, Callable[[Any], bool]]] = {
    Any: ("anything", "anything", lambda value: True),
    float: ("a number", "numbers", is_number),
    int: ("a whole number", "whole numbers", lambda value: is_number(value, Integral)),
    bool: ("True or False", "True or False", lambda value: isinstance(value, (bool, np.bool_))),
    str: ("a text", "texts", lambda value: isinstance(value, str)),
    np.ndarray: ("an array", "arrays", lambda value: isinstance(value, np.ndarray)),
    types.NoneType: ("None", "None", lambda value: value is None),
}
#: numbers by themselves, left to the function that knows their bounds
_BOUNDED = (float, int, float | None, int | None)


def wanted(hint: Any, several: bool = False) -> str:
    """An annotation in words."""
    origin, inner = typing.get_origin(hint), typing.get_args(hint)
    if origin in (typing.Union, types.UnionType):
        return " or ".join(wanted(kind, several) for kind in inner)
    if hint in _KINDS:
        one, more, _fits = _KINDS[hint]
        return more if several else one
    if origin is Callable or hint is Callable:
        one, more = "a function", ""
    elif isinstance(origin, type) and issubclass(origin, Mapping):
        one, more = "a mapping", f" from {wanted(inner[0], True)} to {wanted(inner[1], True)}"
    elif isinstance(origin, type) and issubclass(origin, tuple) and inner[-1:] != (...,):
        one, more = "a pair" if len(inner) == 2 else "a tuple", f" of {wanted(inner[0], True)}"
    elif isinstance(origin, type):
        one, more = "a list", f" of {wanted(inner[0], True)}"
    else:
        name = getattr(hint, "__name__", str(hint))
        one, more = f"{'an' if name[0] in 'AEIOU' else 'a'} {name}", ""
    if not several:
        return one + more
    return re.sub("([^aeiou])y$", r"\1ie", one.partition(" ")[2]) + "s" + more
