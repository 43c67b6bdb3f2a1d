"""Rows of a study that are written by hand, for tests of the store and of the table."""

import hashlib
import json

from grainlaw.studies.store import Store
from grainlaw.studies.table import Table


def row(factors, summary=None, status="finished", reason="", measures=None, cost=None):
    """One row as a worker writes it; its key is that of its factors."""
    key = hashlib.sha256(json.dumps(factors, sort_keys=True).encode()).hexdigest()
    return {
        "case": key, "run": "", "factors": factors, "status": status, "reason": reason,
        "summary": summary or {}, "measures": measures or {}, "cost": cost or {"seconds": 2.0, "cpu": 1.5, "bytes": 0},
        "measured": "",
    }  # fmt: skip


def table_of(rows, folder, runs=()):
    """The table of rows that went through a store; ``runs`` (bytes) belong to the first of them."""
    store = Store(folder)
    for number, each in enumerate(rows):
        run = runs[number] if number < len(runs) else None
        stored = {"run": each["case"], "cost": {**each["cost"], "bytes": len(run)}} if run else {}
        store.write(each | stored, run)
    store = Store(folder, make=False)
    return Table(list(store.rows(each["case"] for each in rows)), tuple(rows[0]["factors"]) if rows else (), store)


def peaks(values, folder, names=("law", "seed")):
    """A table of peak stresses (Pa) by the levels of two factors; None for a case that was refused."""
    rows = [
        row(dict(zip(names, key, strict=True)), {"strength": value})
        if value is not None
        else row(dict(zip(names, key, strict=True)), {"strength": 1e12}, "unstable", "it broke")
        for key, value in values.items()
    ]
    return table_of(rows, folder)
