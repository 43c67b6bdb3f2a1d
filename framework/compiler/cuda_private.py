"""What we use of numba-cuda, documented or not: compiling for an NVIDIA device, tables in its memory, launches.

No file but this imports it, and only where a device is asked for: it is an extra, ``grainlaw[gpu]``. Nothing here needs
a device but :class:`Driver`.
"""

from __future__ import annotations

import contextlib
import operator
import re
import types
from collections.abc import Callable, Iterator
from typing import Any

import numba_cuda
import numpy as np
from llvmlite import ir
from numba import cuda
from numba import types as cpu
from numba.cuda import compiler, cudadecl, cudaimpl, dispatcher
from numba.cuda import types as nb
from numba.cuda.cpython import slicing
from numba.cuda.extending import intrinsic, models, overload, overload_method, register_model
from numba.cuda.np.arrayobj import make_array, populate_array
from numba.cuda.typing.templates import AttributeTemplate

from grainlaw.compiler.cache import is_portable
from grainlaw.compiler.compilation import MARK, methods_of, overloaded

WORD = ir.IntType(64)
VERSION = numba_cuda.__version__


# --- tables in the memory of the device ------------------------------------------------------------------------------


class Place(nb.Type):
    """The address of a table: its fields are read from memory where they are used, so that none fills registers."""

    def __init__(self, name: str, fields: tuple[str, ...], kinds: tuple[Any, ...]) -> None:
        self.fields, self.kinds = fields, kinds
        super().__init__(name=f"Place({name})")  # which the class of the table has: all of one are alike

    @property
    def words(self) -> int:
        """How many words of 8 bytes the table has."""
        return sum(map(_words, self.kinds))


class _Within:
    """A table that lies in another, not beside it."""

    def __init__(self, place: Place) -> None:
        self.place = place


def _words(kind: Any) -> int:
    if isinstance(kind, _Within):
        return kind.place.words
    return 5 + 2 * kind.ndim if isinstance(kind, nb.Array) else 1


def place_of(table: Any) -> Place:
    """The kind of place of a table, from its type on the processor (``Table.kind``)."""

    def kind(entry: Any) -> Any:
        if isinstance(entry, cpu.CPointer):
            return place_of(entry)
        if isinstance(entry, (cpu.NamedTuple, cpu.NamedUniTuple)):
            return _Within(place_of(entry))
        if isinstance(entry, cpu.Array):
            return nb.Array(getattr(nb, str(entry.dtype)), entry.ndim, "C")
        return getattr(nb, str(entry))

    fields = table.dtype if isinstance(table, cpu.CPointer) else table
    return Place(fields.instance_class.__name__, fields.instance_class._fields, tuple(map(kind, fields.types)))


@register_model(Place)
class _PlaceModel(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, WORD)


@cudadecl.registry.register_attr
class _Fields(AttributeTemplate):
    key = Place

    def generic_resolve(self, place: Any, field: str) -> Any:
        if field not in place.fields:
            return None
        kind = place.kinds[place.fields.index(field)]
        return kind.place if isinstance(kind, _Within) else kind


@cudaimpl.registry.lower_getattr_generic(Place)
def _field(context: Any, builder: Any, place: Any, address: Any, field: str) -> Any:
    index = place.fields.index(field)
    kind, first = place.kinds[index], sum(map(_words, place.kinds[:index]))
    if isinstance(kind, _Within):
        return builder.add(address, WORD(8 * first))
    if not isinstance(kind, nb.Array):
        return _word(builder, address, first, context.get_value_type(kind))
    shape = [_word(builder, address, first + 5 + axis) for axis in range(kind.ndim)]
    return _array(context, builder, kind, _word(builder, address, first + 4), shape)


def _word(builder: Any, address: Any, number: int, kind: Any = WORD) -> Any:
    """A word of a table; no pass writes one, so that it need not be read again."""
    place = builder.inttoptr(builder.add(address, WORD(8 * number)), kind.as_pointer(1))
    value = builder.load(place)
    value.set_metadata("invariant.load", builder.module.add_metadata([]))
    return value


def _array(context: Any, builder: Any, kind: Any, address: Any, shape: Any) -> Any:
    """A C array at an address in the memory of the device, which the compiler is told it is."""
    number = context.get_data_type(kind.dtype)
    size = WORD(context.get_abi_sizeof(number))
    strides = [size]
    for length in reversed(shape[1:]):
        strides.insert(0, builder.mul(strides[0], length))
    data = builder.addrspacecast(builder.inttoptr(address, number.as_pointer(1)), number.as_pointer())
    array = make_array(kind)(context, builder)
    populate_array(array, data=data, shape=shape, strides=strides, itemsize=size, meminfo=None)
    return array._getvalue()


@overload(operator.getitem)
def _itself(table, index):
    """``table[0]`` is the table, as on the processor."""
    if isinstance(table, Place):
        return lambda table, index: table
    return None


def at(place: Place) -> Any:
    """The function that makes a table of an address, for compiled code."""

    @intrinsic
    def table_at(typing: Any, address: Any) -> Any:
        return place(nb.int64), lambda context, builder, signature, arguments: arguments[0]

    return table_at


@intrinsic
def address_of(typing: Any, table: Any) -> Any:
    """The address of a table, for compiled code."""
    return nb.int64(table), lambda context, builder, signature, arguments: arguments[0]


@intrinsic
def array_at(typing: Any, address: Any, shape: Any) -> Any:
    """The float64 array of a shape at an address, for compiled code."""
    kind = nb.Array(nb.float64, len(shape), "C")

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        lengths = [builder.extract_value(arguments[1], k) for k in range(len(shape))]
        return _array(context, builder, kind, arguments[0], lengths)

    return kind(nb.int64, shape), generate


# --- blocks that are one team ----------------------------------------------------------------------------------------

SHARED = 3  #: words that the threads of a block have in common: see :func:`join_team`
ARRIVED, RAISED = 0, 16  #: words where blocks meet: how many have come, ever; for which meetings flags were raised


@intrinsic
def words_at(typing: Any, address: Any) -> Any:
    """The array of 32 int64 at an address, for compiled code."""
    kind = nb.Array(nb.int64, 1, "C")

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return _array(context, builder, kind, arguments[0], [WORD(32)])

    return kind(nb.int64), generate


@cuda.jit(device=True)
def join_team(blocks, meeting):
    """Tell the threads of a block how many blocks its team has, and the address of where they meet."""
    shared = cuda.shared.array(0, nb.int64)
    if cuda.threadIdx.x == 0:
        shared[0], shared[1], shared[2] = blocks, meeting, 0
    cuda.syncthreads()


@cuda.jit(device=True)
def width_of_team():
    """Threads of a team."""
    return cuda.blockDim.x * cuda.shared.array(0, nb.int64)[0]


@cuda.jit(device=True)
def _meet_blocks(shared, found):
    """Wait, in one thread of each block, for all blocks of a team; whether one of them has found something.

    A flag is the number of the last meeting for which it was raised, of even and odd ones apart: none is ever lowered.
    """
    words, meeting = words_at(shared[1]), shared[2] + 1
    shared[2], flag = meeting, RAISED + meeting % 2
    if found != 0:
        cuda.atomic.max(words, flag, meeting)
    cuda.threadfence()
    cuda.atomic.add(words, ARRIVED, 1)
    while cuda.atomic.add(words, ARRIVED, 0) < meeting * shared[0]:
        pass
    cuda.threadfence()
    return cuda.atomic.add(words, flag, 0) == meeting


@cuda.jit(device=True)
def meet_team():
    """Where all threads of a team wait for each other, and see what the others have written.

    Not :func:`any_of_team` of a constant: its assembler would let one thread alone wait for a block.
    """
    shared = cuda.shared.array(0, nb.int64)
    cuda.syncthreads()
    if shared[0] > 1:
        if cuda.threadIdx.x == 0:
            _meet_blocks(shared, 0)
        cuda.syncthreads()


@cuda.jit(device=True)
def any_of_team(number):
    """Whether a number, which is not a constant, is not 0 in some thread of a team; they meet there."""
    found = cuda.syncthreads_or(np.int32(number))
    shared = cuda.shared.array(0, nb.int64)
    if shared[0] > 1:
        raised = 0
        if cuda.threadIdx.x == 0:
            raised = 1 if _meet_blocks(shared, found) else 0
        found = cuda.syncthreads_or(np.int32(raised))
    return found


# --- compiling -------------------------------------------------------------------------------------------------------


def device_function(function: Any) -> Any:
    """A function that others on the device call."""
    return cuda.jit(device=True)(function)


_known: set[str] = set()


def _let_call_methods() -> None:
    """Methods of a component's tuple are called on the device too."""
    for name in overloaded() - _known:
        _known.add(name)
        for kind in (nb.NamedTuple, nb.NamedUniTuple):
            overload_method(kind, name + MARK)(_chooser(name))


def _chooser(name: str) -> Any:
    def choose(self, *arguments):  # no annotations: numba compares the signatures
        method = methods_of(self.instance_class).get(name)
        if method is None:
            return None

        def respond(self, *arguments):
            return method(self, *arguments)

        return respond

    return choose


@contextlib.contextmanager
def _as_on_the_processor(capability: tuple[int, int]) -> Iterator[None]:
    """No index is checked or counted from the end, and, if code is portable, nothing is fused.

    numba does to each index and slice what Python does to those beyond an array, in 20 instructions and more; passes
    have none.
    """
    whole = compiler.compile_cuda

    def portable(*arguments: Any, nvvm_options: Any = None, **options: Any) -> Any:
        fused = {} if not is_portable() else {"fma": False}
        return whole(*arguments, nvvm_options={**(nvvm_options or {}), **fused}, **options)

    def clip(builder: Any, slice: Any, size: Any) -> None:
        open_end = builder.icmp_signed("==", slice.stop, size.type(2**63 - 1))
        slice.stop = builder.select(open_end, size, slice.stop)

    changed = [
        (compiler, "compile_cuda", portable), (dispatcher, "compile_cuda", portable),
        (dispatcher, "get_current_device", lambda: types.SimpleNamespace(compute_capability=capability)),
        (slicing, "fix_index", lambda builder, index, size: index), (slicing, "fix_slice", clip),
        (slicing, "guard_invalid_slice", lambda *_: None),
    ]  # fmt: skip
    before = [(module, name, getattr(module, name)) for module, name, _ in changed]
    for module, name, value in changed:
        setattr(module, name, value)
    try:
        yield
    finally:
        for module, name, value in before:
            setattr(module, name, value)


def compile_kernel(kernel: Callable[..., Any], registers: int, capability: tuple[int, int]) -> tuple[str, bytes]:
    """Name and machine code of a kernel of (n, k) and (n,) int64, with so many registers for each thread."""
    from cuda.core import Program, ProgramOptions

    _let_call_methods()
    with _as_on_the_processor(capability):
        ptx, _ = cuda.compile(kernel, (nb.int64[:, ::1], nb.int64[::1]), cc=capability, device=False, abi="numba")
    options = ProgramOptions(arch="sm_{}{}".format(*capability), max_register_count=registers)
    name = re.findall(r"\.entry (\w+)", ptx)[0]
    return name, bytes(Program(ptx, "ptx", options).compile("cubin").code)


def compile_alone(function: Any, capability: tuple[int, int]) -> str:
    """PTX of a function of int64 that others call, to see whether it compiles."""
    _let_call_methods()
    plain = function.py_func
    with _as_on_the_processor(capability):
        arguments = (nb.int64,) * plain.__code__.co_argcount
        code, _ = cuda.compile(plain, arguments, cc=capability, device=True, abi="numba")
    return str(code)


# --- the device itself -----------------------------------------------------------------------------------------------


class Driver:
    """A device: its memory, and kernels that run on it. Raises OSError where there is none."""

    def __init__(self, number: int = 0) -> None:
        from cuda.core import Device

        try:
            cuda.select_device(number)
            self._device = Device(number)
            self._device.set_current()
        except Exception as error:
            raise OSError(f"no NVIDIA device answers ({type(error).__name__}: {error})") from None
        self._number, self.name = number, str(self._device.name)
        capability = self._device.compute_capability
        self.capability = int(capability.major), int(capability.minor)
        self.multiprocessors = int(self._device.properties.multiprocessor_count)
        self._stream = self._device.default_stream

    def here(self) -> None:
        """Let the present thread use the device."""
        cuda.select_device(self._number)
        self._device.set_current()

    def loaded(self, code: bytes, name: str) -> Any:
        """A kernel of machine code, for :meth:`launch`."""
        from cuda.core import ObjectCode

        return ObjectCode.from_cubin(code).get_kernel(name)

    def launch(self, kernel: Any, threads: int, tables: Any, done: Any, together: bool) -> None:
        """Run a kernel in a block for each row of ``tables`` (n, k), and wait for it.

        Blocks that wait for each other must be at work ``together``: a device refuses more than it does side by side.
        """
        from cuda.core import LaunchConfig, launch

        (count, width), room = tables.shape, 8 * SHARED
        words = [0, 0, count * width, 8, self.pointer(tables), count, width, 8 * width, 8]
        words += [0, 0, count, 8, self.pointer(done), count, 8]
        config = LaunchConfig(grid=count, block=threads, shmem_size=room, is_cooperative=together)
        launch(self._stream, config, kernel, *map(np.uint64, words))
        self._stream.sync()

    @staticmethod
    def memory(size: int) -> Any:
        """So many bytes of the device's memory, all 0."""
        return cuda.to_device(np.zeros(size, dtype=np.uint8))

    @staticmethod
    def pinned(size: int) -> np.ndarray:
        """So many bytes of this computer's memory, from which the device copies fast."""
        return cuda.pinned_array(size, np.uint8)

    @staticmethod
    def copied(array: np.ndarray) -> Any:
        """A copy of an array in the device's memory."""
        return cuda.to_device(array)

    @staticmethod
    def pointer(array: Any) -> int:
        """Where an array is in the device's memory."""
        return int(array.__cuda_array_interface__["data"][0])
