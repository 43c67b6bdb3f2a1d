"""Tessellation files of Neper (Quey, Dawson and Barbe 2011, doi:10.1016/j.cma.2011.01.002), of two dimensions."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from pathlib import Path

import attrs
import numpy as np

from grainlaw.arguments import checked
from grainlaw.fields import ParameterError, checked_number
from grainlaw.geometry.cells.assembling import checked_merge, tessellation_of
from grainlaw.geometry.cells.outline import BOX, Names
from grainlaw.geometry.cells.shared_edges import cleaned
from grainlaw.messages import short
from grainlaw.polygon import areas_and_centroids
from grainlaw.tessellation import Tessellation

LOWEST, HIGHEST = 2.0, 3.5  #: formats that can be read
FORMAT = "3.5"  #: that is written
BOX_LABELS = ("y0", "x1", "y1", "x0")  #: what Neper calls bottom, right, top and left
TYPES = ("line", "circle")  #: of domain edges, which may come with their parameters before a label
NEAR = 1e-9  #: of the grain size; files have 12 digits


@checked
def read_tess(
    file: str | os.PathLike[str], *, unit: float = 1.0, phases: Mapping[int, str] | None = None, merge: float = 0.0
) -> Tessellation:
    """Grains of a tessellation file of Neper of two dimensions, formats 2.0 to 3.5.

    ``unit`` is what one unit of length of the file is in m. Groups of cells are phases, named by ``phases`` or else by
    their numbers. Where a file has several scales, the cells of the first are the grains and those of the last their
    cells (``parent``). Sides of the domain give the boundaries their names, x0, x1, y0 and y1 as left, right, bottom
    and top. Seeds, orientations and periodicity are not read; a face that is not convex becomes a grain of cells.
    Edges shorter than ``merge`` grain sizes, the root of the mean area of cells, vanish where these stay convex.

    Raises :class:`~grainlaw.fields.ParameterError` for what is no such file or has three dimensions, OSError.
    """
    where = f"read_tess: {os.fspath(file)}"
    unit, merge = checked_number("read_tess: unit", unit, "m", above=0), checked_merge("read_tess", merge)
    try:
        raw = _Raw.of(where, Path(file).read_text(encoding="utf-8", errors="replace").split())
    except (ValueError, IndexError, KeyError, OverflowError) as error:
        if isinstance(error, ParameterError):
            raise
        raise ParameterError(f"{where} is no complete tessellation file of Neper: {short(str(error))}") from None
    vertices = raw.vertices * unit
    if len(raw.corners) == 0 or not 0 <= raw.corners.min() <= raw.corners.max() < len(vertices):
        raise ParameterError(f"{where}: faces must have numbers of the {len(vertices)} vertices, from 1")
    phase, names = _phases(where, raw.group, phases)
    size = float(np.median(np.sqrt(abs(areas_and_centroids(vertices[raw.corners], raw.first)[0]))))
    return tessellation_of(
        where, cleaned(where, vertices, raw.corners, raw.first), tolerance=NEAR * size, names=raw.names,
        phase=phase, phase_names=names, parent=raw.parent, merge=merge,
    )  # fmt: skip


def _phases(
    where: str, group: np.ndarray | None, named: Mapping[int, str] | None
) -> tuple[np.ndarray | None, tuple[str, ...]]:
    if group is None:
        if named:
            raise ParameterError(f"{where}: phases are given, but the file has no groups of cells (*group)")
        return None, ()
    numbers, phase = np.unique(group, return_inverse=True)
    missing = [n for n in numbers.tolist() if named is not None and n not in named]
    if missing:
        raise ParameterError(f"{where}: phases has no name for the group {missing[0]}")
    return phase, tuple(named[n] if named else str(n) for n in numbers.tolist())


@attrs.frozen(eq=False)
class _Raw:
    """What is read from a file; its numbers from 1 are numbers from 0 here."""

    vertices: np.ndarray  #: (v, 2) in the unit of the file
    corners: np.ndarray
    first: np.ndarray
    group: np.ndarray | None  #: (p,)
    parent: np.ndarray | None  #: (p,)
    names: Names

    @classmethod
    def of(cls, where: str, words: list[str]) -> _Raw:
        if words[:2] != ["***tess", "**format"]:
            raise ParameterError(f"{where} is no tessellation file of Neper: it does not begin with ***tess **format")
        version = float(words[2])
        if not LOWEST <= version <= HIGHEST:
            raise ParameterError(f"{where} has the format {words[2]}, it must be {LOWEST} to {HIGHEST}")
        parts = _sections(words)
        dimension = parts["**general"][0]
        if dimension != "2":
            raise ParameterError(f"{where} has {dimension} dimensions, it must have 2")
        table = _rows(parts["**vertex"], 5)
        if table[:, 3].any():
            raise ParameterError(f"{where}: vertex {1 + int(table[:, 3].astype(bool).argmax())} has z other than 0")
        faces = list(_faces(parts["**face"]))
        edges = _rows(parts["**edge"], 4)[:, 1:3]
        if (edges != np.round(edges)).any() or not np.all((1 <= edges) & (edges <= len(table))):
            raise ValueError(f"an edge ends at another vertex than 1 to {len(table)}")
        edges = edges.astype(int) - 1
        names = dict(_names(parts["**domain*edge"], edges)) if "**domain*edge" in parts else {}
        group = np.array(parts["**cell*group"], dtype=int) if "**cell*group" in parts else None
        parent = None
        scale_count = int(parts.get("**scale*general", ["1"])[0])
        if scale_count > 1:
            scales = np.array(parts["**scale*cellid"], dtype=int).reshape(len(faces), 1 + scale_count)
            parent = scales[np.argsort(scales[:, 0]), 1]
        for what in (each for each in (group, parent) if each is not None):
            if len(what) != len(faces):
                raise ValueError(f"{len(what)} numbers for {len(faces)} faces")
        full = np.array([len(face) > 0 for face in faces])  # a cell may be empty
        group, parent = (each if each is None else each[full] for each in (group, parent))
        faces = [face for face in faces if len(face)]
        first = np.cumsum([0, *map(len, faces)])
        return cls(table[:, 1:3] + 0.0, np.concatenate(faces), first, group, parent, names)  # + 0.0: no -0.0


def _sections(words: list[str]) -> dict[str, list[str]]:
    """What follows each heading; a heading of one star has that of two before it in its name."""
    parts: dict[str, list[str]] = {}
    above = name = ""
    for word in words:
        if word.startswith("***"):
            name = word
        elif word.startswith("**"):
            name = above = word
        elif word.startswith("*"):
            name = above + word
        if word.startswith("*"):
            parts[name] = []
        else:
            parts[name].append(word)
    if "***end" not in parts:
        raise ValueError("it has no ***end")
    return parts


def _rows(words: list[str], width: int) -> np.ndarray:
    """The table after its number of rows, in the order of the numbers in its first column."""
    table = np.array(words[1:], dtype=float).reshape(int(words[0]), width)
    if not np.array_equal(np.sort(table[:, 0]), np.arange(1, len(table) + 1)) or not np.isfinite(table).all():
        raise ValueError("rows are not numbered from 1, or a number is not finite")
    return table[np.argsort(table[:, 0])]


def _faces(words: list[str]) -> Iterator[np.ndarray]:
    """Vertices of each face, which come before its edges, plane, state and point."""
    at = 1
    for _ in range(int(words[0])):
        count = int(words[at + 1])
        yield np.array(words[at + 2 : at + 2 + count], dtype=int) - 1
        at += 2 + count + 1 + int(words[at + 2 + count]) + 9
    if at != len(words):
        raise ValueError("**face does not hold as many faces as it says")


def _names(words: list[str], edges: np.ndarray) -> Iterator[tuple[tuple[int, int], str]]:
    """Names of boundaries by the vertices of the edges on them."""
    at = 1
    for _ in range(int(words[0])):
        at += 2 + int(words[at + 1])
        if words[at] in TYPES:
            at += 2 + int(words[at + 1])
        label, count = words[at], int(words[at + 1])
        name = BOX[BOX_LABELS.index(label)] if label in BOX_LABELS else label
        for e in words[at + 2 : at + 2 + count]:
            if not 0 < int(e) <= len(edges):
                raise ValueError(f"there is no edge {e}")
            i, j = sorted(edges[int(e) - 1].tolist())
            yield (i, j), name
        at += 2 + count


@checked
def write_tess(grains: Tessellation, file: str | os.PathLike[str], *, unit: float = 1.0) -> None:
    """Write grains as a tessellation file of Neper, format 3.5, with all digits; ``unit`` as in :func:`read_tess`.

    Phases are groups, with the numbers that their names are, or else numbers from 1; a grain of several cells is one
    cell of the first of two scales. Raises :class:`~grainlaw.fields.ParameterError` for several bodies, loose
    grains, joints and holes, which the format does not know, OSError.
    """
    unit = checked_number("write_tess: unit", unit, "m", above=0)
    joints = bool(grains.joints) and any(map(len, grains.joints.values()))
    faults = ("several bodies", grains.bodies), ("loose grains", grains.loose.any()), ("joints or cracks", joints)
    for fault, found in faults:
        if found:
            raise ParameterError(f"write_tess: grains have {fault}, a tessellation file has none")
    if grains.region.holes:
        raise ParameterError("write_tess: the region has holes, the domain of a tessellation file has none")
    lines = ["***tess", " **format", f"   {FORMAT}", " **general", "   2 standard"]
    lines += [" **cell", f"  {grains.count}", "  *id", _row(range(1, grains.count + 1))]
    if grains.phase_names or grains.phase.any():
        lines += ["  *group", _row(_groups(grains))]
    lines += _geometry(grains, unit) + _domain(grains, unit)
    if grains.is_breakable:
        parent = np.unique(grains.parent, return_inverse=True)[1]
        inner = [int((parent[:g] == parent[g]).sum()) for g in range(grains.count)]
        lines += [" **scale", "  *general", "   2", "  *cellid"]
        lines += [_row((g + 1, parent[g] + 1, inner[g] + 1)) for g in range(grains.count)]
    Path(file).write_text("\n".join([*lines, "***end", ""]), encoding="utf-8")


def _row(numbers: object) -> str:
    return "   " + " ".join(map(str, numbers))  # type: ignore[call-overload]


def _groups(grains: Tessellation) -> list[int]:
    names = grains.phase_names
    if names and all(name.isdecimal() for name in names):
        return [int(names[phase]) for phase in grains.phase]
    return (grains.phase + 1).tolist()


def _point(point: np.ndarray) -> str:
    x, y = (point + 0.0).tolist()
    return f"{x!r} {y!r} 0.0"


def _geometry(grains: Tessellation, unit: float) -> list[str]:
    edges = grains.edges
    lines = [" **vertex", f" {len(grains.vertices)}"]
    lines += [f"   {v + 1} {_point(point / unit)} 0" for v, point in enumerate(grains.vertices)]
    ends = np.column_stack([edges.start, edges.end]) + 1
    lines += [" **edge", f" {len(edges)}"] + [f"   {e + 1} {i} {j} 0" for e, (i, j) in enumerate(ends.tolist())]
    number = edges.of_corners
    lines += [" **face", f" {grains.count}"]
    for g, (a, b) in enumerate(zip(grains.first[:-1], grains.first[1:], strict=True)):
        count, corners = b - a, (grains.corners[a:b] + 1).tolist()
        lines += [_row([g + 1, count, *corners]), _row([count, *number[a:b].tolist()]), "    0.0 0.0 0.0 1.0"]
        lines.append("     0 -1 0.0 0.0 0.0")
    return lines


def _domain(grains: Tessellation, unit: float) -> list[str]:
    """The region: its corners, and its sides with the edges on them."""
    region, edges = grains.region, grains.edges
    outer = np.flatnonzero(edges.right < 0)
    side = region.side_at(grains.vertices[np.column_stack([edges.start, edges.end])[outer]])
    labels = [BOX_LABELS[BOX.index(n)] if n in BOX else "_".join(n.split()) for n in region.names]
    lines = [" **domain", "  *general", f"   {'cube' if set(region.names) == set(BOX) else 'poly'}"]
    lines += ["  *vertex", f"   {len(region.outline)}"]
    for k, corner in enumerate(region.outline):
        vertex = int(np.hypot(*(grains.vertices - corner).T).argmin())
        label = "".join(sorted((labels[k - 1], labels[k])))  # x0y0 in a corner
        lines += [f"   {k + 1} {_point(corner / unit)} {label}", f"      1 {vertex + 1}"]
    lines += ["  *edge", f"   {len(region.outline)}"]
    for k, label in enumerate(labels):
        on = (outer[side == k] + 1).tolist()
        ends = [2, k + 1, (k + 1) % len(labels) + 1]
        lines += [_row([k + 1, *ends]), "     line", "     0", f"     {label}", _row([len(on), *on])]
    return lines
