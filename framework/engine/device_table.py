"""The arrays of a run in the memory of a device: where they lie, and which are copied when.

What a part declares decides: ``Constant`` arrays go up when a stage begins or a part has other arrays, ``Changing`` and
``Told`` ones go up before the steps and come down after them, ``Scratch`` stays there.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

import numpy as np

from grainlaw.engine.barrier import Pauses
from grainlaw.engine.parts.part import Address, Changing, Scratch, Split, Told, declared
from grainlaw.engine.state import State
from grainlaw.engine.step import Chunk, Parts, Shared, Team

ALIGNED = 256  #: bytes, as a device reads them
NONE = np.zeros(0)
REGIONS = {Changing: "changing", Told: "changing", Scratch: "scratch"}  #: other arrays are constant


def splits(state: State, threads: int) -> dict[str, Split]:
    """How a team of a device shares the parts of a model.

    By grains, bonds or nodes where passes take one after the other; by ``threads`` where each thread keeps rows of its
    own, or adds to nodes of faces that meet.
    """
    grains, mesh = state.specimen.grains.count, state.mesh
    team, each = state.split(threads, alone=True), np.arange(grains + 1)
    grain = Split(grains, each, mesh.first_node, alone=True)
    point = Split(max(len(state.bonds), 1), each, np.arange(len(mesh.nodes) + 1), alone=True)
    by_team = dict.fromkeys(("contacts", "pressures", "fluids", "platens"), team)
    return {**dict.fromkeys(Parts._fields, point), **dict.fromkeys(("nodes", "zones", "materials"), grain), **by_team}


class _Region(NamedTuple):
    """Arrays that lie side by side, and how many bytes they take."""

    arrays: list[np.ndarray]
    offsets: list[int]


class DeviceTable:
    """The arrays of one run on a device; ``numbers`` are those of its compiled components, by their keys."""

    def __init__(self, driver: Any, state: State, threads: int) -> None:
        self._driver, self._state, self._threads = driver, state, threads
        self._splits = splits(state, threads)
        self._laid: tuple[Any, ...] = ()  #: what the arrays in memory were laid for
        self._memory: Any = None
        self._host = self._head_host = np.zeros(0, dtype=np.uint8)
        self._head: Any = None
        self._ends: list[tuple[int, int, int]] = []  #: first byte and one after the last of arrays here, place there
        self.shared: Shared

    def up(self, chunk: Chunk, parameters: np.ndarray, numbers: Mapping[int, int]) -> list[int]:
        """Copy what has changed to the device; the addresses of team, parts and chunk there.

        ``numbers`` are those of machine code by its address here; ``parameters`` those of the integrator.
        """
        state = self._state
        self.shared = state.shared_by(self._splits)
        laid = (*self.shared.tables, state.stage, state.began, state.time_step, state.mass_added, tuple(numbers))
        if len(laid) != len(self._laid) or any(a is not b and a != b for a, b in zip(laid, self._laid, strict=True)):
            self._laid = laid
            self._lay(numbers)
        changing = self._regions["changing"]
        for array, offset in zip(changing.arrays, changing.offsets, strict=True):
            self._bytes(offset, array.nbytes)[:] = array.reshape(-1).view(np.uint8)
        self._copy_up(0, self._changing_end)
        return [*self._up_head(chunk, parameters, numbers), int(bool(self._state.materials.groups))]

    def down(self) -> None:
        """Copy what steps have changed back into the arrays here."""
        end = self._changing_end
        self._memory[:end].copy_to_host(self._host[:end])
        changing = self._regions["changing"]
        for array, offset in zip(changing.arrays, changing.offsets, strict=True):
            array.reshape(-1).view(np.uint8)[:] = self._bytes(offset, array.nbytes)

    # --- where arrays lie --------------------------------------------------------------------------------------------

    def _lay(self, numbers: Mapping[int, int]) -> None:
        """Give each array its place, and copy those up that do not change."""
        regions: dict[str, list[np.ndarray]] = {"changing": [], "constant": [], "scratch": []}
        for name, part in zip(Parts._fields, self.shared.parts, strict=True):
            _collect(part, name, regions)
        for compiled in self._components():
            regions["changing"].append(compiled.numbers)
            regions["constant"].append(compiled.rows)
        at, known, self._regions = 0, set[tuple[int, int]](), {}
        for kind, arrays in regions.items():
            own = _Region([], [])
            for array in arrays:
                key = array.ctypes.data, array.nbytes
                if array.nbytes and key not in known:
                    known.add(key)
                    own.arrays.append(array)
                    own.offsets.append(at)
                    at += -(-array.nbytes // ALIGNED) * ALIGNED
            self._regions[kind] = own
            if kind == "changing":
                self._changing_end = at
        tables = at
        at += sum(8 * (len(_words(part, lambda array: 0)) + 32) for part in self.shared.parts) + 8 * len(Parts._fields)
        at += sum(-(-a.nbytes // ALIGNED) * ALIGNED for p in self.shared.parts for a in _addresses(p))
        if at > self._host.size:
            self._memory, self._host = self._driver.memory(at), self._driver.pinned(at)
            self._base = self._driver.pointer(self._memory)
        self._ends = sorted(
            (array.ctypes.data, array.ctypes.data + array.nbytes, self._base + offset)
            for region in self._regions.values()
            for array, offset in zip(region.arrays, region.offsets, strict=True)
        )
        constant = self._regions["constant"]
        for array, offset in zip(constant.arrays, constant.offsets, strict=True):
            self._bytes(offset, array.nbytes)[:] = array.reshape(-1).view(np.uint8)
        end = self._write_tables(tables, numbers)
        self._copy_up(self._changing_end, end)

    def _components(self) -> Iterable[Any]:
        """Compiled laws and materials of the model."""
        state = self._state
        for group in (*state.bonds.groups, *state.contacts.groups):
            yield group.compiled
        for zones in state.materials.groups:
            yield from (zones.stress, zones.energy)

    def _write_tables(self, at: int, numbers: Mapping[int, int]) -> int:
        """Write the words of all tables; the first byte after them."""
        moved: dict[int, int] = {}  #: place of arrays of addresses, by their own address here
        for part in self.shared.parts:
            for array in _addresses(part):
                there = [numbers.get(int(a), self._there(int(a))) for a in array.ravel()]
                moved[array.ctypes.data] = self._base + at
                at = self._put(at, np.array(there, dtype=np.int64))
        places = []
        for part in self.shared.parts:
            places.append(self._base + at)
            at = self._put(at, _words(part, lambda array: moved.get(array.ctypes.data, self._there(array.ctypes.data))))
        self._parts = self._base + at
        return self._put(at, np.array(places, dtype=np.int64))

    def _there(self, address: int) -> int:
        """The place on the device of a byte of an array here; 0 of another."""
        place = np.searchsorted([begin for begin, _, _ in self._ends], address, side="right") - 1
        if place >= 0:
            begin, end, there = self._ends[place]
            if begin <= address < end:
                return there + address - begin
        return 0

    def _put(self, at: int, words: np.ndarray) -> int:
        self._bytes(at, words.nbytes)[:] = words.view(np.uint8)
        return at + -(-words.nbytes // 8) * 8

    def _bytes(self, offset: int, count: int) -> np.ndarray:
        return self._host[offset : offset + count]

    def _copy_up(self, first: int, last: int) -> None:
        if first < last:
            self._memory[first:last].copy_to_device(self._host[first:last])

    # --- what is new with every chunk --------------------------------------------------------------------------------

    def _up_head(self, chunk: Chunk, parameters: np.ndarray, numbers: Mapping[int, int]) -> tuple[int, int, int]:
        """The chunk, with the velocities of each thread behind what is copied."""
        columns, room = chunk.schedule.shape[1], 64 * 8
        size = room + parameters.nbytes + chunk.schedule.nbytes
        whole = size + 8 * self._threads * columns
        if whole > self._head_host.size:
            self._head, self._head_host = self._driver.memory(2 * whole), self._driver.pinned(2 * whole)
        base = self._driver.pointer(self._head)
        where = {
            id(parameters): base + room, id(chunk.schedule): base + room + parameters.nbytes, id(NONE): base + size,
        }  # fmt: skip
        own = np.broadcast_to(0.0, (self._threads, columns))
        team = _words(Team(self._threads, NONE, Pauses(0, 0)), lambda array: base)
        told = chunk._replace(velocities=own, integrator=numbers[chunk.integrator], parameters=base + room)
        words = _words(told, lambda array: where.get(id(array), base + size))
        self._head_host[: team.nbytes] = team.view(np.uint8)
        self._head_host[team.nbytes : team.nbytes + words.nbytes] = words.view(np.uint8)
        self._head_host[room : room + parameters.nbytes] = parameters.view(np.uint8)
        self._head_host[room + parameters.nbytes : size] = chunk.schedule.reshape(-1).view(np.uint8)
        self._head[:size].copy_to_device(self._head_host[:size])
        return base, self._parts, base + team.nbytes


def _collect(rows: Any, name: str, regions: Mapping[str, list[np.ndarray]]) -> None:
    """Sort the arrays of a part by what they are declared as."""
    hints = declared(rows.__class__)
    for field, value in zip(rows._fields, rows, strict=True):
        if isinstance(value, tuple):
            _collect(value, field, regions)
        elif isinstance(value, np.ndarray) and hints[field] != Address:
            regions[REGIONS.get(hints[field], "constant")].append(value)


def _addresses(rows: Any) -> Iterable[np.ndarray]:
    """The arrays of a part that hold addresses."""
    for field, value in zip(rows._fields, rows, strict=True):
        if isinstance(value, tuple):
            yield from _addresses(value)
        elif declared(rows.__class__)[field] == Address and value.size:
            yield value


def _words(value: Any, place: Any) -> np.ndarray:
    """The words of a table as compiled code has them (``numba_private.Table``), with arrays at their ``place``."""
    words: list[int] = []

    def add(entry: Any) -> None:
        if isinstance(entry, np.ndarray):
            words.extend((0, 0, entry.size, entry.itemsize, place(entry), *entry.shape, *entry.strides))
        elif isinstance(entry, tuple):
            for each in entry:
                add(each)
        else:
            words.append(int(np.float64(entry).view(np.int64)) if isinstance(entry, float) else int(entry))

    add(value)
    return np.array(words, dtype=np.int64)
