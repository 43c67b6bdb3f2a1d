"""Grains from meshes of other programs, and out to gmsh."""

from __future__ import annotations

import contextlib
import ctypes
import io
import os
import threading
import warnings
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from grainlaw.arguments import checked
from grainlaw.fields import ParameterError, checked_number, checked_points
from grainlaw.geometry.cells.assembling import checked_merge, tessellation_of
from grainlaw.geometry.cells.outline import Names
from grainlaw.geometry.cells.shared_edges import cleaned, merged
from grainlaw.geometry.sizes import Graded
from grainlaw.messages import nearest, short, users_line
from grainlaw.polygon import areas_and_centroids, following
from grainlaw.tessellation import Tessellation

CORNERS = {"triangle": 3, "triangle6": 3, "triangle7": 3, "quad": 4, "quad8": 4, "quad9": 4}  #: of kinds of elements
LINES = ("line", "line3", "vertex")  #: kinds that a mesh of an area has beside
PHYSICAL = "gmsh:physical"  #: cell data of meshio: the physical group
WAIT, WAIT_PER_BYTE = 5.0, 3e-6  #: s, s/byte: twenty times what the slowest reader takes; it then loops without end
CLOSE = 1e-6  #: of the median size of elements: nearer nodes are one


@checked
def from_mesh(
    file: str | os.PathLike[str], *, unit: float = 1.0, grain_data: str | None = None, phase_data: str = PHYSICAL,
    merge: float = 0.0,
) -> Tessellation:  # fmt: skip
    """Grains from a mesh of an area in any format of meshio: every triangle, quadrilateral or polygon is one.

    ``unit`` is what one unit of length of the file is in m. ``grain_data`` names whole-number data of the elements:
    those with one number are the cells of one grain (``parent``); "gmsh:geometrical" has the surfaces of gmsh.
    ``phase_data`` names the data that are the phases, by default the physical groups of gmsh, with their names.
    Physical groups of lines name boundaries; without them the sides of an upright rectangle are bottom, right, top and
    left, those of another shape "boundary". Edges shorter than ``merge`` grain sizes, the root of the mean area of
    elements, vanish where these stay convex.

    Raises :class:`~grainlaw.fields.ParameterError` for what cannot be read, has three dimensions, overlaps or has
    parts that do not hang together.
    """
    where = f"from_mesh: {os.fspath(file)}"
    unit, merge = checked_number("from_mesh: unit", unit, "m", above=0), checked_merge("from_mesh", merge)
    try:
        mesh = _read(file)
    except (Exception, SystemExit) as error:  # meshio ends the program for what it cannot read
        raise ParameterError(f"{where} cannot be read as a mesh: {short(str(error))}") from None
    for block in mesh.cells:
        if block.type not in CORNERS and block.type not in LINES and not block.type.startswith("polygon"):
            raise ParameterError(f"{where} has elements of the kind {block.type}, it must be a mesh of an area")
    chosen = [k for k, block in enumerate(mesh.cells) if block.type not in LINES]
    elements = [np.asarray(e)[: CORNERS.get(mesh.cells[k].type)] for k in chosen for e in mesh.cells[k].data]
    if not elements:
        raise ParameterError(f"{where} has no triangles, quadrilaterals or polygons")
    first = np.cumsum([0, *map(len, elements)])
    points = checked_points(f"{where}: nodes", _flat(where, np.asarray(mesh.points)) * unit)
    named = np.concatenate(elements)
    if not np.issubdtype(named.dtype, np.integer):
        raise ParameterError(f"{where} has elements whose nodes are no whole numbers")
    if not 0 <= named.min() <= named.max() < len(points):
        wrong = named[(named < 0) | (named >= len(points))][0]
        raise ParameterError(f"{where} has an element with the node {wrong}, it must be one of 0 to {len(points) - 1}")
    nodes, corners = np.unique(named, return_inverse=True)
    size = float(np.median(np.sqrt(abs(areas_and_centroids(points[nodes][corners], first)[0]))))
    vertices, number = merged(points[nodes], CLOSE * size)
    lines = _boundaries(mesh, dict(zip(nodes.tolist(), number.tolist(), strict=True)))
    _warn_of_inner(where, lines, number[corners], first)
    phase, names = _phases(where, mesh, chosen, phase_data)
    parent = None if grain_data is None else _data(where, mesh, chosen, grain_data)
    return tessellation_of(
        where, cleaned(where, vertices, number[corners], first), tolerance=CLOSE * size,
        names=lines, phase=phase, phase_names=names, parent=parent, merge=merge,
    )  # fmt: skip


def _read(file: str | os.PathLike[str]) -> Any:
    import meshio  # here, for it takes long to load

    seconds = WAIT + WAIT_PER_BYTE * (os.path.getsize(file) if os.path.exists(file) else 0)
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()), _ends(seconds):
        return meshio.read(file)  # which prints empty lines, and errors once more


@contextlib.contextmanager
def _ends(seconds: float) -> Iterator[None]:
    """Raise TimeoutError in this thread if it is still here after some time.

    Readers of meshio loop over as many elements as a header claims, or until they find the end of it.
    """
    here = ctypes.c_ulong(threading.get_ident()), ctypes.py_object(TimeoutError)
    timer = threading.Timer(seconds, ctypes.pythonapi.PyThreadState_SetAsyncExc, here)
    timer.daemon = True
    timer.start()
    try:
        yield
    except TimeoutError:
        raise TimeoutError(f"it has no end within {seconds:.3g} s") from None
    finally:
        timer.cancel()


def _flat(where: str, points: np.ndarray) -> np.ndarray:
    if points.shape[1] == 3 and np.ptp(points[:, 2]) > 1e-9 * np.ptp(points[:, :2]):
        raise ParameterError(
            f"{where} has nodes at z = {points[:, 2].min():g} to {points[:, 2].max():g}, it must be plane"
        )
    return points[:, :2] + 0.0


def _data(where: str, mesh: Any, chosen: Sequence[int], name: str) -> np.ndarray:
    """Whole numbers (p,) of the elements."""
    if name not in mesh.cell_data:
        known = list(mesh.cell_data)
        raise ParameterError(
            f"{where} has no data '{name}' of its elements{nearest(name, known)} (it has: {', '.join(known) or 'none'})"
        )
    values = np.concatenate([np.asarray(mesh.cell_data[name][k]).ravel() for k in chosen])
    if not np.issubdtype(values.dtype, np.number) or not np.array_equal(values, np.round(values)):
        raise ParameterError(f"{where}: the data '{name}' of its elements must be whole numbers")
    return values.astype(np.int64)


def _phases(where: str, mesh: Any, chosen: Sequence[int], name: str) -> tuple[np.ndarray | None, tuple[str, ...]]:
    if name == PHYSICAL and name not in mesh.cell_data:
        return None, ()
    numbers, phase = np.unique(_data(where, mesh, chosen, name), return_inverse=True)
    named = _group_names(mesh, 2) if name == PHYSICAL else {}
    return phase, tuple(named.get(n, str(n)) for n in numbers.tolist())


def _group_names(mesh: Any, dimension: int) -> dict[int, str]:
    pairs = {name: data for name, data in mesh.field_data.items() if np.size(data) == 2}  # other formats have others
    return {int(tag): name for name, (tag, dim) in pairs.items() if dim == dimension}


def _boundaries(mesh: Any, vertex: dict[int, int]) -> Names:
    """Named physical groups of lines, by the vertices of their edges."""
    named, found = _group_names(mesh, 1), {}
    for block, tags in zip(mesh.cells, mesh.cell_data.get(PHYSICAL, []), strict=False):
        if block.type not in ("line", "line3"):
            continue
        for (i, j), tag in zip(np.asarray(block.data)[:, :2].tolist(), np.ravel(tags).tolist(), strict=True):
            if tag in named and i in vertex and j in vertex:
                a, b = sorted((vertex[i], vertex[j]))
                found[a, b] = named[tag]
    return found


def _warn_of_inner(where: str, lines: Names, corners: np.ndarray, first: np.ndarray) -> None:
    """Warn of physical groups of lines that have elements on both sides, as of a fault: they do not become joints."""
    ends = np.sort(np.column_stack([corners, corners[following(first)]]), axis=1)
    pairs, times = np.unique(ends, axis=0, return_counts=True)
    inside = dict.fromkeys(map(tuple, pairs[times > 1].tolist()))
    if found := sorted({name for edge, name in lines.items() if edge in inside}):
        warnings.warn(
            f"{where}: the physical groups of lines {', '.join(found)} lie between elements: they name no boundary and "
            "are left out; Jointed(...) cuts grains along traces",
            stacklevel=users_line(),
        )


@checked
def write_geo(grains: Tessellation, file: str | os.PathLike[str], size: float | Graded, *, unit: float = 1.0) -> None:
    """Write grains as a geometry of gmsh, to be meshed with elements of ``size`` (m), which may be graded.

    Every grain, or cell of one, is a surface; phases are physical groups of them, boundaries of edges. ``unit`` is what
    one unit of length of the file is in m. Raises :class:`~grainlaw.fields.ParameterError`, OSError.
    """
    unit = checked_number("write_geo: unit", unit, "m", above=0)
    if isinstance(size, Graded):
        sizes = size.at(grains.vertices) / unit
    else:
        sizes = np.full(len(grains.vertices), checked_number("write_geo: size", size, "m", above=0) / unit)
    edges = grains.edges
    points = ((grains.vertices + 0.0) / unit).tolist()
    corners = enumerate(zip(points, sizes.tolist(), strict=True), start=1)
    lines = [f"Point({v}) = {{{x!r}, {y!r}, 0, {h!r}}};" for v, ((x, y), h) in corners]
    ends = zip((edges.start + 1).tolist(), (edges.end + 1).tolist(), strict=True)
    lines += [f"Line({e}) = {{{i}, {j}}};" for e, (i, j) in enumerate(ends, start=1)]
    number = edges.of_corners
    for g, (a, b) in enumerate(zip(grains.first[:-1], grains.first[1:], strict=True), start=1):
        lines += [f"Curve Loop({g}) = {{{_listed(number[a:b])}}};", f"Plane Surface({g}) = {{{g}}};"]
    for phase in np.unique(grains.phase).tolist():
        name = grains.phase_name(phase).replace('"', "'")
        lines.append(f'Physical Surface("{name}") = {{{_listed(np.flatnonzero(grains.phase == phase) + 1)}}};')
    for k, name in enumerate(edges.boundary_names):
        if (edges.side == k).any():
            lines.append(f'Physical Curve("{name}") = {{{_listed(np.flatnonzero(edges.side == k) + 1)}}};')
    Path(file).write_text("\n".join([*lines, ""]), encoding="utf-8")


def _listed(numbers: np.ndarray) -> str:
    return ", ".join(map(str, numbers.tolist()))
