"""The memory of a method that is written for one point: its names, and what the method returns of it."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Any

from grainlaw.messages import short
from grainlaw.parameter import ParameterError

BY_POSITION = (inspect.Parameter.POSITIONAL_ONLY, inspect.Parameter.POSITIONAL_OR_KEYWORD)


def names_of_memory(component: Any, method: str, given: str, count: int) -> tuple[str, ...]:
    """Names of a component's memory: the arguments of its ``method`` after the ``count`` numbers that it is given.

    ``given`` are these in words: "opening and slip". Raises :class:`ParameterError` where they are fewer, and for
    memory without a name or a start at zero.
    """
    function: Callable = getattr(component, method)
    arguments = list(inspect.signature(function).parameters.values())
    where = f"{type(component).__name__}.{method}"
    if len(arguments) < count or not all(argument.kind in BY_POSITION for argument in arguments[:count]):
        raise ParameterError(f"{where} must take {given} before its memory, not ({', '.join(map(str, arguments))})")
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
    return tuple(argument.name for argument in arguments[count:])


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
