"""Moments of a run as VTK files: grains, cracks and contacts, time series (.pvd) that ParaView opens directly."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import meshio
import numpy as np

from grainlaw.columns import COURSE, TIME, quantity_of
from grainlaw.engine.state import State
from grainlaw.material import Elastic, Material, Plane
from grainlaw.observation import Observer
from grainlaw.results.archive import law_name
from grainlaw.results.files import check_room, warn, writable_folder, write_atomically, write_text
from grainlaw.results.frames import Frame, FrameClock, take_frame
from grainlaw.results.result import contact_segments, interface_kinds
from grainlaw.specimen import Specimen
from grainlaw.stage import Stage
from grainlaw.unit_text import without_prefixes

Fields = Mapping[str, str | float | Sequence[str]]  #: by name: a text, a number, or several texts

GRID = "<UnstructuredGrid>\n"


def write_vtu(path: Path, mesh: meshio.Mesh, fields: Fields) -> None:
    """Write a mesh; the field data, which meshio cannot write, are put in. Raises OSError."""
    mesh.write(path, file_format="vtu")
    before, grid, after = path.read_text(encoding="ascii").partition(GRID)
    entries = "".join(_entry(name, value) for name, value in fields.items())
    path.write_text(f"{before}{grid}<FieldData>\n{entries}</FieldData>\n{after}", encoding="ascii")


def _entry(name: str, value: str | float | Sequence[str]) -> str:
    """Texts are the codes of their letters in UTF-8, each text with a 0 at its end."""
    if isinstance(value, (int, float)):
        return _array(name, "Float64", 1, repr(float(value)))
    texts = [value] if isinstance(value, str) else value
    codes = " ".join(str(code) for text in texts for code in (*text.encode("utf-8"), 0))
    return _array(name, "String", len(texts), codes)


def _array(name: str, kind: str, count: int, content: str) -> str:
    about = f'type="{kind}" Name={quoteattr(name)} NumberOfTuples="{count}" format="ascii"'
    return f"<DataArray {about}>\n{content}\n</DataArray>\n"


def unit_in_si(name: str) -> str:
    """Of an array, whose numbers are in SI."""
    return without_prefixes(quantity_of(name).unit)


def vtu(name: str, number: int) -> str:
    """The file of one moment of a series."""
    return f"{name}_{number:04d}.vtu"


def _in_space(plane: np.ndarray) -> np.ndarray:
    return np.column_stack([plane, np.zeros(len(plane))])


def tensors(specimen: Specimen, stress: np.ndarray, of: np.ndarray | None = None) -> np.ndarray:
    """(g, 6) Pa: XX, YY, ZZ, XY, YZ, XZ from (g, 3) xx, yy, xy; ZZ is nan where no elastic grain tells it.

    ``of`` are the grains of the rows, if these are not all grains in their order.
    """
    ratio, strain = _across(specimen)
    held = np.where(strain, ratio, 0.0)[slice(None) if of is None else of]
    return in_tensor(stress, held * (stress[:, 0] + stress[:, 1]))


def strains(specimen: Specimen, displacement: np.ndarray) -> np.ndarray:
    """(z, 6) XX, YY, ZZ, XY, YZ, XZ of each zone in the fixed axes, at displacements (i, 2) m; ZZ as for stresses.

    The gradient F = V R, with the rotation R of Eq. (2); the strain is V less the identity. XY is half of gamma.
    """
    mesh = specimen.mesh
    corner, now = mesh.nodes[mesh.zones], (mesh.nodes + displacement)[mesh.zones]
    edges, moved = (each[:, 1:] - each[:, :1] for each in (corner, now))
    gradient = np.linalg.solve(edges, moved).transpose(0, 2, 1)
    cos, sin = gradient[:, 0, 0] + gradient[:, 1, 1], gradient[:, 1, 0] - gradient[:, 0, 1]
    cos, sin = np.array([cos, sin]) / np.hypot(cos, sin)
    stretch = gradient @ np.stack([cos, sin, -sin, cos], axis=1).reshape(-1, 2, 2)  # F R^T
    xx, yy, xy = stretch[:, 0, 0] - 1, stretch[:, 1, 1] - 1, stretch[:, 0, 1]
    ratio, strain = (row[mesh.zone_grain] for row in _across(specimen))
    across = np.where(strain, 0.0 * ratio, -ratio / (1 - ratio) * (xx + yy))
    return in_tensor(np.column_stack([xx, yy, xy]), across)


def in_tensor(plane: np.ndarray, across: np.ndarray | float = 0.0) -> np.ndarray:
    """(n, 6) XX, YY, ZZ, XY, YZ, XZ of tensors (n, 3) xx, yy, xy of the plane, and what they are across it."""
    none = np.zeros(len(plane))
    return np.column_stack([plane[:, 0], plane[:, 1], none + across, plane[:, 2], none, none])


def _across(specimen: Specimen) -> tuple[np.ndarray, np.ndarray]:
    """(g,) Poisson's ratio of elastic grains, nan of others; and whether they are in plane strain."""
    ratio, strain = np.full(specimen.grains.count, np.nan), np.ones(specimen.grains.count, dtype=bool)
    for material, grains in specimen.materials:
        if isinstance(material, Material):
            strain[grains] = material.plane is Plane.STRAIN
        if isinstance(material, Elastic):
            ratio[grains] = material.poissons_ratio
    return ratio, strain


def principal(stress: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(g,) Pa, the larger and the smaller principal stress in the plane, from (g, 3) xx, yy, xy."""
    middle = (stress[:, 0] + stress[:, 1]) / 2
    radius = np.hypot((stress[:, 0] - stress[:, 1]) / 2, stress[:, 2])
    return middle + radius, middle - radius


class VtkSeries:
    """A folder that grows by .vtu files with each frame; the .pvd files list complete files only.

    Points lie on the deformed specimen. Grains: zones with grain number, that of the grain it is a cell of, phase; of
    their grain the mean stress (Pa, tensor XX, YY, ZZ, XY, YZ, XZ, and the principal ones in the plane, tension
    positive) and the rotation (rad); stress and strain of the zone itself where a frame has them; plastic strain and
    temperature (°C) where a material has them; displacement (m) and velocity (m/s) at nodes.
    Cracks: each contact point with damage, wet, or of a joint, as a line along its half of the interface, with its kind
    (the field data ``kinds`` has their names, from 0), damage, mode (share of shear), opening and slip (m), normal and
    shear traction (Pa), the pressure of a fluid on its faces (Pa), energy lost in opening and in slip (J/m2), time of
    breaking (s, nan where not broken), the two grains and whether it is inside of one. Contacts, where they are
    detected: contacts without a bond as lines along their length, with mean opening (negative) and slip (m), normal and
    shear traction (Pa) and the two grains. The field data have ``law``, ``phases`` (names of minerals), the stage, how
    far the test is and the time, the units of the arrays, and the version of grainlaw. Raises OSError where it cannot
    write.
    """

    def __init__(
        self, folder: str | os.PathLike[str], specimen: Specimen, interfaces: np.ndarray, law: str = ""
    ) -> None:
        self.folder = writable_folder(folder)
        self.specimen, self.interfaces, self.law = specimen, interfaces, law
        self.entries: dict[str, list[tuple[float, str]]] = {"grains": [], "cracks": [], "contacts": []}
        self._kind = interface_kinds(specimen.mesh, interfaces)

    def write(self, frame: Frame, curves: Mapping[str, np.ndarray] | None = None) -> None:
        """Add one frame, with how far the test is in ``curves`` by then."""
        grains = self.specimen.grains
        about: dict[str, Any] = {"law": self.law, "kinds": ", ".join(grains.kinds), "stage": frame.stage}
        if grains.phase_names:
            about["phases"] = ", ".join(grains.phase_names)
        about["time (s)"] = frame.time
        known = curves or {}
        reached = next((name for name in COURSE if name != TIME and name in known), None)
        if reached is not None:
            unit = unit_in_si(reached)
            heading = reached if unit == "1" else f"{reached} ({unit})"
            about[heading] = float(np.interp(frame.time, known[TIME], known[reached]))
        self._add("grains", frame.time, self._grains(frame), about)
        if len(self.interfaces):
            self._add("cracks", frame.time, self._cracks(frame), about)
        if frame.contacts:
            self._add("contacts", frame.time, self._contacts(frame), about)

    def _grains(self, frame: Frame) -> meshio.Mesh:
        mesh, grains = self.specimen.mesh, self.specimen.grains
        of = mesh.zone_grain
        of_grains = dict(zip(("stress_1", "stress_2"), principal(frame.stress), strict=True))
        of_grains["stress"] = tensors(self.specimen, frame.stress)
        of_grains["rotation"] = self.specimen.grain_rotations(self.specimen.mesh.nodes + frame.displacement)
        own = dict(frame.zones)
        if "stress" in own:
            own["zone_stress"] = tensors(self.specimen, own.pop("stress"), of)
            own["zone_strain"] = strains(self.specimen, frame.displacement)
        return meshio.Mesh(
            _in_space(mesh.nodes + frame.displacement),
            [("triangle", mesh.zones)],
            point_data={"displacement": _in_space(frame.displacement), "velocity": _in_space(frame.velocity)},
            cell_data={
                "grain": [of],
                "parent": [grains.parent[of]],
                "phase": [grains.phase[of]],
                **{name: [values[of]] for name, values in of_grains.items()},
                **{name: [row] for name, row in own.items()},
            },
        )  # fmt: skip

    def _cracks(self, frame: Frame) -> meshio.Mesh:
        place = self.specimen.mesh.nodes + frame.displacement
        begin, end = contact_segments(place, self.interfaces).swapaxes(0, 1)
        kind = np.tile(self._kind, 2)
        wet = frame.bonds.get("fluid_pressure", 0.0) > 0
        chosen = np.flatnonzero((frame.bonds["damage"] > 0) | wet | (kind > 1))
        if not len(chosen):  # some readers need a cell: one undamaged point as a line of length zero
            chosen, end = np.array([0]), begin
        count = len(chosen)
        points = np.empty((2 * count, 2))
        points[0::2], points[1::2] = begin[chosen], end[chosen]
        grain = self.specimen.mesh.node_grain[self.interfaces][chosen % len(self.interfaces)]
        data = {name: [values[chosen]] for name, values in frame.bonds.items()}
        data |= {"grain_a": [grain[:, 0]], "grain_b": [grain[:, 2]], "kind": [kind[chosen]]}
        parent = self.specimen.grains.parent[grain]
        data["inside"] = [(parent[:, 0] == parent[:, 2]).astype(np.int64)]
        return meshio.Mesh(_in_space(points), [("line", np.arange(2 * count).reshape(-1, 2))], cell_data=data)

    def _contacts(self, frame: Frame) -> meshio.Mesh:
        closed = dict(frame.contacts)
        position, tangent, grains = (closed.pop(name) for name in ("position", "tangent", "grains"))
        half = tangent * closed.pop("length")[:, None] / 2
        data = {**closed, "grain_a": grains[:, 0], "grain_b": grains[:, 1]}
        if not len(position):  # the same for contacts
            position = half = np.zeros((1, 2))
            data = {name: np.zeros(1, dtype=row.dtype) for name, row in data.items()}
        points = np.stack([position - half, position + half], axis=1).reshape(-1, 2)
        lines = np.arange(len(points)).reshape(-1, 2)
        return meshio.Mesh(_in_space(points), [("line", lines)], cell_data={name: [row] for name, row in data.items()})

    def _add(self, name: str, time: float, mesh: meshio.Mesh, about: Mapping[str, Any]) -> None:
        file = vtu(name, len(self.entries[name]))
        units = [f"{name}: {unit}" for name in (*mesh.point_data, *mesh.cell_data) if (unit := unit_in_si(name)) != "1"]
        fields = {**about, "units": units, "grainlaw": version("grainlaw")}
        write_atomically(self.folder / file, lambda path: write_vtu(path, mesh, fields), forced=True)
        self.entries[name].append((time, file))
        self._list(name)

    def go_on(self, times: Mapping[str, np.ndarray]) -> None:
        """Go on after the files of moments (s) of each kind, which are there; their lists may not be."""
        for name, known in self.entries.items():
            known[:] = [(time, vtu(name, k)) for k, time in enumerate(times.get(name, np.zeros(0)).tolist())]
            if known:
                self._list(name)

    def _list(self, name: str) -> None:
        lines = "\n".join(
            f'    <DataSet timestep="{time!r}" part="0" file={quoteattr(file)}/>' for time, file in self.entries[name]
        )
        text = (
            '<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1" byte_order="LittleEndian">\n'
            f"  <Collection>\n{lines}\n  </Collection>\n</VTKFile>\n"
        )
        write_text(self.folder / f"{name}.pvd", text)


class VtkWriter(Observer):
    """Writes about ``count`` frames, denser while cracks grow, to a folder while the run goes on.

    With ``zones`` also the stress and the strain of each zone. Where a file cannot be written, or less than ``RESERVE``
    bytes are free, it warns (:class:`OutputWarning`) and writes no more: the run goes on.
    """

    def __init__(self, folder: str | os.PathLike[str], count: int = 30, *, zones: bool = False) -> None:
        self.folder, self.clock, self.zones = writable_folder(folder), FrameClock(count), zones
        self.series: VtkSeries | None = None
        self.stopped = ""  #: why nothing more is written

    def observe(self, state: State, curves: Mapping[str, np.ndarray], stage: Stage, progress: float) -> None:
        if not self.clock.due(state, stage, progress) or self.stopped:
            return
        try:
            check_room(self.folder)
            self._series(state).write(take_frame(state, zones=self.zones), curves)
        except OSError as error:
            self.stopped = f"no more pictures for ParaView are written to {self.folder}: {error}"
            warn(self.stopped)

    def _series(self, state: State) -> VtkSeries:
        if self.series is None:
            self.series = VtkSeries(self.folder, state.specimen, state.bonds.ends, law_name(state.model.laws))
        return self.series

    def save(self) -> dict[str, np.ndarray]:
        """The moments written, and where the clock stands."""
        entries = {} if self.series is None else self.series.entries
        return self.clock.save() | {name: np.array([time for time, _ in each]) for name, each in entries.items()}

    def restore(self, state: State, saved: Mapping[str, np.ndarray]) -> None:
        """Go on in the same folder; files of moments after the checkpoint are written again."""
        self.clock.restore(saved)
        self._series(state).go_on(saved)
