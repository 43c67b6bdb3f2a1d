"""Results as files for other programs: JSON and CSV."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from grainlaw.results.files import without_nan, write_atomically


def write_json(file: Path, content: Mapping[str, Any]) -> None:
    """Write nested names and values, null for what is not a finite number. Raises OSError."""
    text = json.dumps(without_nan(content), indent=2, allow_nan=False) + "\n"
    write_atomically(file, lambda path: path.write_text(text, encoding="utf-8"))


def write_curves(file: Path, curves: Mapping[str, Mapping[str, np.ndarray]]) -> None:
    """Write the curves of laws, by the laws' names, below each other. Raises OSError."""
    columns = list(dict.fromkeys(name for recorded in curves.values() for name in recorded))
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["law", *columns])
    for law, recorded in curves.items():
        count = max((len(values) for values in recorded.values()), default=0)
        table = [recorded.get(column, np.full(count, np.nan)) for column in columns]
        writer.writerows([law, *(f"{value:.9g}" for value in row)] for row in zip(*table, strict=True))
    write_atomically(file, lambda path: path.write_text(text.getvalue(), encoding="utf-8"))
