"""Which edges between grains a key stands for: by the phases on both sides, cells of one grain, and joints."""

from __future__ import annotations

from collections.abc import Container, Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from grainlaw.fields import ParameterError
from grainlaw.messages import nearest, short
from grainlaw.tessellation import Tessellation

Names = tuple[int | str, ...]  #: number of a phase, and its name if it has one
CRACKS = "initial cracks"  #: what they are called unless they have a name of their own


def check_keys(where: str, keys: Iterable[Any]) -> None:
    """Raise :class:`ParameterError` for what is no key."""
    for key in keys:
        pair = isinstance(key, tuple) and len(key) == 2 and all(isinstance(p, (int, str)) or p is ... for p in key)
        if not (pair or isinstance(key, str) or key is ...):
            raise ParameterError(
                f"{where}: the key {short(key)} is not allowed, it must be a pair of phases by name or number, with "
                "... for any; 'between'; 'inside' or ('inside', phase); the name of a joint; or ... for all else"
            )


def key_between(keys: Container[Any], one: Names, other: Names, kind: str, where: str = "") -> Any:
    """The first key that is there of: the name of the joint; for cells of one grain ("inside", phase) and "inside"; the
    pair of phases, in any order; one of them with ``...``; "between", for grains; (..., ...); ``...``. None if none.

    Raises :class:`ParameterError`, which begins with ``where``, if given, for two keys of one rank.
    """
    ranks: list[list[Any]] = [
        [("inside", phase) for phase in one] if kind == "inside" else [],
        [kind] if kind != "between" else [],
        [pair for a in one for b in other for pair in ((a, b), (b, a))],
        [pair for phase in (*one, *other) for pair in ((phase, ...), (..., phase))],
        [kind] if kind == "between" else [],
        [(..., ...)],
        [...],
    ]
    found: list[list[Any]] = [[key for key in dict.fromkeys(rank) if key in keys] for rank in ranks]
    first = next(filter(None, found), [None])
    if where and len(first) > 1:
        a, b = map(_written, first[:2])
        pair = f"('{one[-1]}', '{other[-1]}')" if one != other else f"'{one[-1]}'"
        raise ParameterError(
            f"{where}: {a} and {b} are both for contacts of {pair}: leave one away, or give a key for it"
        )
    return first[0]


def words_of(key: Any) -> str:
    """What a key is for."""
    if isinstance(key, tuple) and key[0] == "inside":
        return f"inside {key[1]}"
    if isinstance(key, tuple) and ... not in key:
        return f"between {key[0]} and {key[1]}"
    if isinstance(key, tuple) and key != (..., ...):
        return f"between {next(phase for phase in key if phase is not ...)} and any other"
    return "elsewhere" if key is ... or isinstance(key, tuple) else "inside grains" if key == "inside" else str(key)


def _written(key: Any) -> str:
    """A key as one writes it in Python."""
    return repr(key).replace("Ellipsis", "...")


def check_known(where: str, keys: Iterable[Any], grains: Tessellation) -> None:
    """Raise :class:`ParameterError` for a key of a phase (by name or number) or joint that the grains do not have."""
    kinds = {*grains.kinds}
    for key in keys:
        phases = [part for part in key if part not in ("inside", ...)] if isinstance(key, tuple) else []
        if None in map(grains.phase_number, phases) or (isinstance(key, str) and key not in kinds):
            names, joints = grains.known_phases, ", ".join(grains.joints) or "none"
            known = [*grains.phase_names, *grains.joints]
            unknown = [str(part) for part in phases or [key] if part not in known]
            near = next(filter(None, (nearest(part, known) for part in unknown)), "")
            star = "; any other is ... in Python, as in ('mica', ...)" if "*" in key else ""
            raise ParameterError(
                f"{where}: {_written(key)} names what the grains do not have{near} (phases: {names}; joints: {joints})"
                f"{star}"
            )


def names_of(grains: Tessellation, phase: int) -> Names:
    """All that a phase is called."""
    names = grains.phase_names
    return (phase, names[phase]) if names else (phase,)


def keys_of(
    grains: Tessellation, keys: Sequence[Any], pairs: np.ndarray, kind: np.ndarray, where: str = ""
) -> np.ndarray:
    """(c,) number of the key of each edge between two grains, ``pairs`` (c, 2), of a ``kind`` (c,); -1 without one.

    Raises as :func:`key_between`.
    """
    phases = np.sort(grains.phase[pairs], axis=1)
    kinds, place = np.unique(np.column_stack([phases, kind]), axis=0, return_inverse=True)
    number: Mapping[Any, int] = {key: k for k, key in enumerate(keys)} | {None: -1}
    found = [
        number[key_between(number, names_of(grains, one), names_of(grains, other), grains.kinds[which], where)]
        for one, other, which in kinds.tolist()
    ]
    return np.array(found, dtype=int)[place.ravel()]
