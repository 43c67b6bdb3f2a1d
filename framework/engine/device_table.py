"""The arrays of a run in the memory of a device: where they lie, and which are copied when.

What a part declares decides: ``Constant`` arrays go up when a stage begins or a part has other arrays, ``Changing`` and
``Told`` ones go up before the steps and come down after them, ``Scratch`` stays there.
"""

from __future__ import annotations

import bisect
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from grainlaw.compiler.numba_private import laid
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


class _Constants(NamedTuple):
    """Arrays of a part that do not change within a stage, as they were copied."""

    when: tuple[Any, ...]
    arrays: list[np.ndarray]
    offsets: list[int]
    memory: Any


class DeviceTable:
    """The arrays of one run on a device, for a team of so many ``blocks``."""

    def __init__(self, driver: Any, state: State, threads: int, blocks: int = 1) -> None:
        self.driver, self.blocks, self._state, self._threads = driver, blocks, state, threads * blocks
        self._splits = splits(state, self._threads)
        self._laid: tuple[Any, ...] = ()  #: what the arrays in memory were laid for
        self._constants: dict[str, _Constants] = {}
        self._changing, self._scratch, self._tables, self._head = (_Buffer(driver) for _ in range(4))
        self._offsets: list[tuple[np.ndarray, int]] = []  #: arrays that change, and where they are
        self._ends: tuple[list[int], list[tuple[int, int]]] = [], []  #: first bytes here; bytes and place there
        self.shared: Shared

    def up(self, chunk: Chunk, parameters: np.ndarray, numbers: Mapping[int, int]) -> list[int]:
        """Copy what has changed to the device; the addresses of a meeting, team, parts and chunk there.

        After them, whether grains have materials with a method for their stress.
        ``numbers`` are those of machine code by its address here; ``parameters`` those of the integrator.
        """
        state = self._state
        self.shared = state.shared_by(self._splits)
        laid = (*self.shared.tables, *self._when, tuple(numbers))
        if len(laid) != len(self._laid) or any(a is not b and a != b for a, b in zip(laid, self._laid, strict=True)):
            self._laid = laid
            self._lay(numbers)
        for array, offset in self._offsets:
            self._changing.host[offset : offset + array.nbytes] = array.reshape(-1).view(np.uint8)
        self._changing.up()
        return [*self._up_head(chunk, parameters, numbers), int(bool(state.materials.groups))]

    def down(self) -> None:
        """Copy what steps have changed back into the arrays here."""
        self._changing.down()
        for array, offset in self._offsets:
            array.reshape(-1).view(np.uint8)[:] = self._changing.host[offset : offset + array.nbytes]

    # --- where arrays lie --------------------------------------------------------------------------------------------

    @property
    def _when(self) -> tuple[Any, ...]:
        """Other constants are other arrays, or another of these."""
        state = self._state
        return state.stage, state.began, state.time_step, state.mass_added

    def _lay(self, numbers: Mapping[int, int]) -> None:
        """Give each array its place, and copy those up that do not change, if they are others than before."""
        known = set[tuple[int, int]]()
        parts = dict(zip(Parts._fields, self.shared.parts, strict=True))
        sorted_: dict[str, dict[str, list[np.ndarray]]] = {}
        for name, rows in (*parts.items(), ("components", None)):
            regions = sorted_[name] = {"changing": [], "constant": [], "scratch": []}
            if rows is not None:
                for hint, array in _arrays(rows):
                    if hint != Address:
                        regions[REGIONS.get(hint, "constant")].append(array)
            else:
                for compiled in self._state.compiled:
                    if compiled.numbers.base is not self._state.materials.arrays.values:  # of materials they are in it
                        regions["changing"].append(compiled.numbers)
                    regions["constant"].append(compiled.rows)
            for arrays in regions.values():
                arrays[:] = [each for each in arrays if each.nbytes and _is_new(each, known)]
        together = [each for kind in ("changing", "scratch") for own in sorted_.values() for each in own[kind]]
        count = sum(len(own["changing"]) for own in sorted_.values())
        changing, scratch = _places(together[:count]), _places(together[count:])
        self._offsets = list(zip(together[:count], changing, strict=False))
        places = list(zip(together[:count], self._changing.fit(changing), strict=False))
        places += zip(together[count:], self._scratch.fit(scratch, host=False), strict=False)
        for name, own in sorted_.items():
            places += self._constant(name, own["constant"])
        places.sort(key=lambda each: each[0].ctypes.data)
        begins = [array.ctypes.data for array, _ in places]
        self._ends = begins, [(array.nbytes, place) for array, place in places]
        self._write_tables(numbers)

    def _constant(self, name: str, arrays: list[np.ndarray]) -> Iterable[tuple[np.ndarray, int]]:
        """Constant arrays of a part, and where they are on the device."""
        before = self._constants.get(name)
        same = before is not None and before.when == self._when and len(before.arrays) == len(arrays)
        if before is None or not same or any(a is not b for a, b in zip(arrays, before.arrays, strict=True)):
            *offsets, size = _places(arrays)
            all_ = np.zeros(max(size, 1), dtype=np.uint8)
            for array, offset in zip(arrays, offsets, strict=True):
                all_[offset : offset + array.nbytes] = array.reshape(-1).view(np.uint8)
            before = self._constants[name] = _Constants(self._when, arrays, offsets, self.driver.copied(all_))
        base = self.driver.pointer(before.memory)
        return [(array, base + offset) for array, offset in zip(arrays, before.offsets, strict=True)]

    def _write_tables(self, numbers: Mapping[int, int]) -> None:
        """Write the words of all tables, before them arrays of addresses, after them the places of all."""
        parts = self.shared.parts
        addresses = [array for part in parts for hint, array in _arrays(part) if hint == Address and array.size]
        sizes = [*(each.size for each in addresses), *(len(_words(part, lambda array: 0)) for part in parts)]
        first = np.cumsum([0, *sizes, len(parts)]) * 8
        base = self._tables.fit(first.tolist())
        moved = {array.ctypes.data: place for array, place in zip(addresses, base, strict=False)}
        words = [np.array([numbers.get(int(a), self._there(int(a))) for a in array.ravel()]) for array in addresses]
        words += [_words(p, lambda each: moved.get(each.ctypes.data, self._there(each.ctypes.data))) for p in parts]
        words.append(np.array(base[len(addresses) : -1]))
        self._tables.host[: first[-1]] = np.concatenate(words).astype(np.int64).view(np.uint8)
        self._tables.up()
        self._parts = base[-1]

    def _there(self, address: int) -> int:
        """The place on the device of a byte of an array here; 0 of another."""
        begins, ends = self._ends
        place = bisect.bisect_right(begins, address) - 1
        if place >= 0 and address < begins[place] + ends[place][0]:
            return ends[place][1] + address - begins[place]
        return 0

    # --- what is new with every chunk --------------------------------------------------------------------------------

    def _up_head(self, chunk: Chunk, parameters: np.ndarray, numbers: Mapping[int, int]) -> tuple[int, ...]:
        """The chunk, after where blocks meet and with the velocities of each thread behind what is copied."""
        columns, room, met = chunk.schedule.shape[1], 96 * 8, 32 * 8
        size = room + parameters.nbytes + chunk.schedule.nbytes
        base = self._head.fit([0, size, size + 8 * self._threads * columns])[0]
        host = self._head.host
        where = {
            id(parameters): base + room, id(chunk.schedule): base + room + parameters.nbytes, id(NONE): base + size,
        }  # fmt: skip
        own = np.empty((self._threads, columns))  # never read: only its form counts
        team = _words(Team(self._threads, NONE, Pauses(0, 0)), lambda array: base)
        told = chunk._replace(velocities=own, integrator=numbers[chunk.integrator], parameters=base + room)
        words = _words(told, lambda array: where.get(id(array), base + size))
        host[:met] = 0
        host[met : met + team.nbytes] = team.view(np.uint8)
        host[met + team.nbytes : met + team.nbytes + words.nbytes] = words.view(np.uint8)
        host[room : room + parameters.nbytes] = parameters.view(np.uint8)
        host[room + parameters.nbytes : size] = chunk.schedule.reshape(-1).view(np.uint8)
        self._head.up(size)
        return base, base + met, self._parts, base + met + team.nbytes


class _Buffer:
    """Some memory of a device, and as much here from which it is copied fast; both grow."""

    def __init__(self, driver: Any) -> None:
        self._driver, self._size = driver, 0
        self._memory: Any = None
        self.host = np.zeros(0, dtype=np.uint8)

    def fit(self, places: Sequence[int], host: bool = True) -> list[int]:
        """Have room for the last of some places; where these but the last are on the device."""
        self._size = places[-1]
        if self._memory is None or self._memory.size < max(self._size, 1):
            self._memory = self._driver.memory(max(self._size * 5 // 4, 1))
            self.host = self._driver.pinned(self._memory.size) if host else self.host
        base = self._driver.pointer(self._memory)
        return [base + place for place in places[:-1]]

    def up(self, size: int | None = None) -> None:
        if self._size:
            self._memory[: size or self._size].copy_to_device(self.host[: size or self._size])

    def down(self) -> None:
        if self._size:
            self._memory[: self._size].copy_to_host(self.host[: self._size])


def _places(arrays: Sequence[np.ndarray]) -> list[int]:
    """First bytes of arrays side by side, and the first byte after them."""
    sizes = [-(-each.nbytes // ALIGNED) * ALIGNED for each in arrays]
    return np.cumsum([0, *sizes]).tolist()


def _is_new(array: np.ndarray, known: set[tuple[int, int]]) -> bool:
    """Whether an array is not yet known; from now on it is."""
    key = array.ctypes.data, array.nbytes
    is_new = key not in known
    known.add(key)
    return is_new


def _arrays(rows: Any) -> Iterator[tuple[Any, np.ndarray]]:
    """What each array of a part is declared as, and the array."""
    hints = declared(rows.__class__)
    for field, value in zip(rows._fields, rows, strict=True):
        if isinstance(value, tuple):
            yield from _arrays(value)
        elif isinstance(value, np.ndarray):
            yield hints[field], value


def _words(value: Any, place: Callable[[np.ndarray], int]) -> np.ndarray:
    """The words of a table as compiled code has them (``numba_private.Table``), with arrays at their ``place``."""
    words: list[int] = []
    laid(value, words, place)
    return np.array(words, dtype=np.int64)
