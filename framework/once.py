"""What is found once for each specimen or mesh, and kept as long as that lives."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any, TypeVar
from weakref import WeakKeyDictionary

import numpy as np

Function = TypeVar("Function", bound=Callable[..., np.ndarray])


def once_each(function: Function) -> Function:
    """Let a function of a thing and of names and numbers answer once for each; its arrays cannot be written to."""
    known: WeakKeyDictionary[Any, dict[tuple[Any, ...], np.ndarray]] = WeakKeyDictionary()

    @functools.wraps(function)
    def found(thing: Any, *rest: Any) -> np.ndarray:
        own = known.setdefault(thing, {})
        if rest not in own:
            own[rest] = function(thing, *rest)
            own[rest].flags.writeable = False
        return own[rest]

    return found  # type: ignore[return-value]
