"""The arguments of a method that is written for one point: scalars of the step and memory, and what it returns."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable
from typing import Any

from grainlaw.fields import ParameterError
from grainlaw.messages import enumeration, short

BY_POSITION = (inspect.Parameter.POSITIONAL_ONLY, inspect.Parameter.POSITIONAL_OR_KEYWORD)


#: Scalars of the step that a method may name among its arguments, and what they are where no step is done: a law that
#: is asked at a time step of 0 answers as if no time passed, and divides by none. A specimen is at ROOM until a stage
#: heats it (°C). There is no strain ``ezz`` across the plane but for what a wrapper takes from it.
ROOM = 20.0
SCALARS = {"time_step": 0.0, "temperature": ROOM, "ezz": 0.0}


def names_of_arguments(component: Any, method: str, given: str, count: int) -> tuple[str, ...]:
    """Names of the arguments of a component's ``method`` after the ``count`` numbers of the point that it is given.

    Those of :data:`SCALARS` are scalars of the step, the others memory. ``*law`` at the end stands for all that the
    part ``law`` takes there: its scalars, then its memory. A name that the part has too is the part's memory, to be
    read. ``given`` are the numbers of the point in words: "opening and slip". Raises :class:`ParameterError` where
    they are fewer, and for memory without a name or a start at zero.
    """
    function: Callable = getattr(component, method)
    arguments = list(inspect.signature(function).parameters.values())
    where = f"{type(component).__name__}.{method}"
    if len(arguments) < count or not all(argument.kind in BY_POSITION for argument in arguments[:count]):
        raise ParameterError(f"{where} must take {given} before its memory, not ({', '.join(map(str, arguments))})")
    more: tuple[str, ...] = ()
    if arguments and arguments[-1].kind is inspect.Parameter.VAR_POSITIONAL:
        inner = getattr(component, arguments[-1].name, None)
        if hasattr(inner, method):
            arguments.pop()
            more = names_of_arguments(inner, method, given, count)
    for argument in arguments[count:]:
        if argument.kind not in BY_POSITION:
            raise ParameterError(
                f"{where}: {argument} is not allowed, the memory after {given} is given by position: "
                "write each number of it as a plain argument"
            )
        if argument.default is not argument.empty:
            raise ParameterError(
                f"{where}: {argument} is not allowed, an argument after {given} is memory and begins at 0: "
                f"leave the default away, or make it a field of the class if it is a constant"
            )
    return (*(argument.name for argument in arguments[count:]), *more)


def only_memory(arguments: tuple[str, ...]) -> tuple[str, ...]:
    """The memory among arguments, in the order in which a method returns it: each at its last place."""
    kept = dict.fromkeys(name for name in reversed(arguments) if name not in SCALARS)
    return tuple(reversed(kept))


def only_scalars(arguments: tuple[str, ...]) -> tuple[str, ...]:
    """The scalars of the step among arguments."""
    return tuple(name for name in SCALARS if name in arguments)


def refuse_untold(component: Any, method: str, arguments: tuple[str, ...], told: Iterable[str]) -> None:
    """Raise :class:`ParameterError` for a scalar of the step among ``arguments`` that a method is not ``told``."""
    for name in only_scalars(arguments):
        if name not in told:
            raise ParameterError(
                f"{type(component).__name__}.{method}: the argument {name} is not allowed, of the scalars of the step "
                f"{method} gets {enumeration(told)}; memory needs another name"
            )


def with_scalars(function: Callable, arguments: tuple[str, ...], scalars: dict[str, float]) -> Callable:
    """A method of one point as a function of the point and the memory alone, at given scalars of the step."""
    names = only_memory(arguments)
    if names == arguments:
        return function

    def respond(*point: float) -> Any:
        count = len(point) - len(names)
        known = scalars | dict(zip(names, point[count:], strict=True))
        return function(*point[:count], *(known[name] for name in arguments))

    return respond


def as_floats(component: Any, method: str, found: str, count: int, names: tuple[str, ...], answer: Any) -> Any:
    """What a ``method`` with a memory of these ``names`` returned, as floats. Raises TypeError.

    The ``count`` numbers before the memory are, in words, ``found``: "normal and shear traction".
    """
    if isinstance(answer, tuple) and len(answer) == count + len(names):
        try:
            return tuple(map(float, answer))
        except (TypeError, ValueError):
            pass
    raise TypeError(
        f"{type(component).__name__}.{method} must return {count + len(names)} numbers, {found} and "
        f"{', '.join(names) or 'no memory'}, not {short(answer)}"
    )
