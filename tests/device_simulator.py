"""A GPU as Python: memory of its own, and a Python thread for each thread of a block."""

import ctypes
import math
import threading
import types

import numpy as np

from grainlaw.engine import device, step
from grainlaw.engine.device import Machine

#: ``math`` that answers nan and infinity, as compiled code does, and does not raise.
QUIET = types.SimpleNamespace(**{**vars(math), "sqrt": np.sqrt})


def array_at(address, shape, kind=ctypes.c_double):
    """The array of a shape at an address, as compiled code makes it."""
    count = math.prod(map(int, shape))
    if count == 0 or address == 0:
        return np.zeros(shape)
    return np.ctypeslib.as_array((kind * count).from_address(int(address))).reshape(shape)


def table_at(address, example):
    """A named tuple from the words at an address; ``example`` has its form."""
    words = iter(array_at(address, (4096,), ctypes.c_int64))

    def read(like):
        if isinstance(like, np.ndarray):
            _, _, _, _, place = (next(words) for _ in range(5))
            shape = tuple(next(words) for _ in range(like.ndim))
            _ = [next(words) for _ in range(like.ndim)]
            return array_at(place, shape, np.ctypeslib.as_ctypes_type(like.dtype))
        if isinstance(like, tuple):
            values = [read(each) for each in like]
            return type(like)(*values) if hasattr(like, "_fields") else tuple(values)
        word = next(words)
        return float(word.view(np.float64)) if isinstance(like, float) else int(word)

    return read(example)


class Memory:
    """Some of the memory of the device."""

    def __init__(self, bytes_):
        self.bytes, self.size = bytes_, bytes_.size

    def __getitem__(self, part):
        return Memory(self.bytes[part])

    def copy_to_device(self, host):
        self.bytes[:] = host

    def copy_to_host(self, host=None):
        if host is None:
            return self.bytes
        host[:] = self.bytes
        return host


class Block:
    """The threads of a block, which meet."""

    def __init__(self, threads):
        self.threads, self.flags = threads, np.zeros(threads, dtype=bool)
        self.barrier, self.local = threading.Barrier(threads), threading.local()

    def meet(self):
        self.barrier.wait()

    def any(self, number):
        self.flags[self.local.thread] = number != 0
        self.barrier.wait()
        found = self.flags.any()
        self.barrier.wait()
        return found

    def machine(self):
        """What it gives to functions; a table is a tuple of one, of which the address is itself."""
        return Machine(
            lambda function: function, lambda: self.threads, self.meet, self.any, array_at, lambda table: table,
            lambda name: lambda table: table[0],
        )  # fmt: skip

    def run(self, steps, *arguments):
        """What all threads answer, which is the same."""
        answers, errors = [None] * self.threads, []

        def one(thread):
            self.local.thread = thread
            try:
                answers[thread] = steps(thread, *arguments)
            except Exception as error:
                errors.append(error)
                self.barrier.abort()

        crew = [threading.Thread(target=one, args=(thread,)) for thread in range(self.threads)]
        for each in crew:
            each.start()
        for each in crew:
            each.join()
        if errors:
            raise errors[0]
        assert len(set(answers)) == 1, answers
        return answers[0]


class Driver:
    """The driver of a device that is none."""

    name, multiprocessors = "a simulated device", 1

    def __init__(self):
        self.blocks = []  #: how many each launch had
        self.fails_at = math.inf  #: number of the launch at which it fails

    def here(self):
        pass

    def memory(self, size):
        return Memory(np.zeros(size, dtype=np.uint8))

    def pinned(self, size):
        return np.zeros(size, dtype=np.uint8)

    def copied(self, array):
        return Memory(array.copy())

    def pointer(self, memory):
        return memory.bytes.ctypes.data

    def launch(self, kernel, threads, tables, done, together):
        if len(self.blocks) >= self.fails_at:
            raise RuntimeError("out of memory")
        assert together == (tables.bytes[:, 5] > 1).any()
        self.blocks.append(len(tables.bytes))
        components, (team, parts, chunk) = kernel
        for sample, (_, team_at, parts_at, chunk_at, materials, blocks, which) in enumerate(tables.bytes.tolist()):
            if which > 0:
                continue
            block = Block(threads * blocks)
            steps, copies = device.retargeted(block.machine(), components)
            for copy in copies.copies.values():
                if "math" in copy.__globals__:
                    copy.__globals__["math"] = QUIET
            places = array_at(parts_at, (len(parts),), ctypes.c_int64)
            there = [(table_at(place, like),) for place, like in zip(places, parts, strict=True)]
            told = (table_at(team_at, team),), (step.Parts._make(there),), (table_at(chunk_at, chunk),)
            done.bytes[sample] = block.run(steps, *told, materials)


class Simulated(device.Gpu):
    """A device whose blocks are of a few Python threads."""

    def __init__(self, threads=3, grains=100):
        self._begin(Driver(), threads)
        self._grains = grains

    @property
    def blocks(self):
        """How many runs each launch did steps of."""
        return self._driver.blocks

    def fail_at(self, launch):
        """Let a launch fail, counted from 0."""
        self._driver.fails_at = launch

    def check(self, state, integrator):
        """Nothing has to be compiled."""

    def _compiled(self, components, request):
        team = step.Team(1, np.zeros(0, dtype=np.int64), (0, 0))
        return components, (team, request.state.on_device.shared.parts, request.chunk)
