"""How long a store of many rows takes: to be opened, asked for its status, and found finished by its study.

    python tests/benchmarks/store_scale.py [rows in thousands, 1000]

Rows are written by this script, packed as a study packs them.
"""

import json
import shutil
import sys
import tempfile
import time
from pathlib import Path

import psutil

import grainlaw as gl
from grainlaw.studies.store import PACKED, Store

SUMMARY = {f"quantity_{k}": k / 7 for k in range(45)}


def case(seed):
    raise AssertionError("a finished case is built")


def main() -> None:
    count = 1000 * int(sys.argv[1] if len(sys.argv) > 1 else 1000)
    folder = Path(tempfile.mkdtemp())
    study = gl.Study(case, seed=range(count))
    try:
        write(study, folder / "store")
        size = sum(file.stat().st_size for file in (folder / "store").rglob("*") if file.is_file())
        files = sum(file.is_file() for file in (folder / "store").rglob("*"))
        print(f"{count} rows: {files} files, {size / 1e9:.2f} GB")
        show("open", lambda: Store(folder / "store"))
        show("status", lambda: study.status(folder / "store"))
        store = Store(folder / "store")
        show("missing cases", lambda: sum(case not in store for case, _ in study._cases()))
        if count <= 100_000:
            show("resume, with the whole table", lambda: study.run(folder / "store", progress=False))
    finally:
        shutil.rmtree(folder)


def write(study: gl.Study, place: Path) -> None:
    Store(place)
    rows, index, start, number = [], [], 0, 1
    for case_key, factors in study._cases():
        row = {"case": case_key, "run": case_key, "factors": factors, "status": "finished", "reason": "",
               "summary": SUMMARY, "measures": {}, "measured": "", "cost": {"cpu": 1.0, "bytes": 0}}  # fmt: skip
        text = json.dumps(row).encode()
        rows.append(text)
        index.append(f"{case_key} {case_key} finished {start} {len(text)}\n")
        start += len(text) + 1
        if len(rows) == PACKED:
            flush(place, number, rows, index)
            rows, index, start, number = [], [], 0, number + 1
    if rows:
        flush(place, number, rows, index)


def flush(place: Path, number: int, rows: list[bytes], index: list[str]) -> None:
    file = place / "packs" / f"{number:06d}"
    file.with_suffix(".jsonl").write_bytes(b"".join(text + b"\n" for text in rows))
    file.with_suffix(".index").write_text("".join(index))


def show(words: str, do, *_: object) -> None:
    began = time.perf_counter()
    found = do()
    memory = psutil.Process().memory_info().rss / 1e9
    print(f"{words:<32} {time.perf_counter() - began:7.2f} s  {memory:5.2f} GB  {str(found).splitlines()[0][:60]}")


if __name__ == "__main__":
    main()
