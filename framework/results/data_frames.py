"""Results as tables of pandas, which is imported where it is used."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from grainlaw.fields import ParameterError

if TYPE_CHECKING:
    import pandas

PLACE, PLANE, TENSOR = ("x", "y"), ("_x", "_y"), ("_xx", "_yy", "_xy")


def data_frame(where: str, columns: Mapping[str, Any]) -> pandas.DataFrame:
    """Arrays by name, one row for each entry; those with several numbers for each become several columns.

    ``position`` becomes x and y, ``grains`` grain_a and grain_b, other vectors end in _x and _y, tensors in _xx, _yy
    and _xy. Raises ParameterError, which begins with ``where``, without pandas.
    """
    try:
        import pandas
    except ImportError:
        raise ParameterError(f"{where} needs pandas: pip install 'grainlaw[study]'") from None
    flat: dict[str, Any] = {}
    for name, values in columns.items():
        rows = np.asarray(values)
        if rows.ndim == 1:
            flat[name] = rows
        else:
            flat |= dict(zip(_names(name, rows.shape[1]), rows.T, strict=True))
    return pandas.DataFrame(flat)


def _names(name: str, count: int) -> list[str]:
    if name == "position":
        return list(PLACE)
    if name == "grains":
        return ["grain_a", "grain_b"]
    return [name + ending for ending in (PLANE if count == 2 else TENSOR)]
