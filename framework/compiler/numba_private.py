"""What we use of numba and llvmlite beyond their documented interfaces; no other file may.

Each function here has one purpose and a test of its own (tests/test_numba_private.py), which names it when another
version of numba does not fit. That is why pyproject.toml bounds the version of numba from above.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import Any

import llvmlite
import numba
from llvmlite import ir
from numba import types as nb
from numba.core import caching, cgutils
from numba.core.dispatcher import Dispatcher
from numba.core.errors import NumbaError
from numba.core.extending import _Intrinsic
from numba.core.registry import cpu_target
from numba.extending import intrinsic, overload_method

__all__ = [
    "FOLDERS",
    "VERSIONS",
    "DiskCache",
    "NumbaError",
    "address_of",
    "atomic_add",
    "atomic_load",
    "atomic_store",
    "call",
    "compile_for",
    "definition",
    "is_number",
    "is_tuple_of_numbers",
    "named_tuple_method",
    "processor",
    "python_function",
    "return_type",
    "serialized",
    "use_cache",
]

VERSIONS = (numba.__version__, llvmlite.__version__)
FOLDERS = [os.path.dirname(os.path.realpath(str(module.__file__))) for module in (numba, llvmlite)]


def processor() -> tuple[str, str]:
    """Name of the processor that code is compiled for, and its features, as LLVM has them."""
    codegen = cpu_target.target_context.codegen()
    _, name, features = codegen.magic_tuple()
    return name, features


# --- functions that numba has compiled -------------------------------------------------------------------------------


def python_function(thing: Any) -> Any:
    """The Python function behind a jitted one, or the object itself."""
    return thing.py_func if isinstance(thing, Dispatcher) else thing


def definition(thing: Any) -> Any:
    """The Python function behind an intrinsic; None where the object is none."""
    return thing._defn if isinstance(thing, _Intrinsic) else None


def compile_for(jitted: Any, signature: tuple[Any, ...]) -> Any:
    """Compile a jitted function for the types of its arguments; the result owns the machine code."""
    jitted.compile(signature)
    return jitted.overloads[signature]


def return_type(code: Any) -> Any:
    """The type that compiled code returns."""
    return code.signature.return_type


def address_of(code: Any) -> int:
    """Where the C function of compiled code is. It takes the arguments as C would, and knows no Python."""
    return code.library.get_pointer_to_function(code.fndesc.llvm_cfunc_wrapper_name)


# --- types -----------------------------------------------------------------------------------------------------------


def is_tuple_of_numbers(kind: Any, length: int) -> bool:
    """Whether a type is that of ``length`` numbers or flags in a tuple."""
    return isinstance(kind, nb.BaseTuple) and len(kind) == length and all(map(is_number, kind))


def is_number(kind: Any) -> bool:
    """Whether a type is that of a number or a flag."""
    return isinstance(kind, (nb.Float, nb.Integer, nb.Boolean))


def named_tuple_method(name: str, find: Callable[[type], Any]) -> None:
    """Let compiled code call method ``name`` on named tuples.

    ``find`` gives the jitted function of a tuple's class, which takes the tuple first, or None.
    """

    def choose(self, *arguments):  # no annotations: numba compares the signatures
        method = find(self.instance_class)
        if method is None:
            return None

        def respond(self, *arguments):
            return method(self, *arguments)

        return respond

    for kind in (nb.NamedTuple, nb.NamedUniTuple):  # a tuple of equal types is the second kind
        overload_method(kind, name)(choose)


# --- the cache on disk -----------------------------------------------------------------------------------------------


class _NoSource(caching._CacheLocator):
    """numba asks it for the source file a function comes from, by which it would judge the age of the cache."""

    def __init__(self, folder: str) -> None:
        self.folder = folder

    def get_cache_path(self) -> str:
        return self.folder

    def ensure_cache_path(self) -> None:
        pass

    def get_source_stamp(self) -> str:
        return ""

    def get_disambiguator(self) -> str:
        return ""

    @classmethod
    def from_function(cls, *_: Any) -> Any:
        return None


class _Implementation(caching.CompileResultCacheImpl):
    def __init__(self, given: tuple[str, str]) -> None:
        folder, key = given
        self._lineno, self._locator, self._filename_base = 0, _NoSource(folder), key


class DiskCache(caching.FunctionCache):
    """numba's cache with a ``key`` of our own in place of source file and line, and with ``files`` of our own.

    ``files`` has ``load(key)`` and ``save(key, data)``, where the key is a tuple of texts. What cannot be loaded is
    compiled again; ``unsaved`` is told what kept code from being saved.
    """

    _impl_class = _Implementation

    def __init__(self, key: str, files: Any, folder: str, unsaved: Callable[[Exception], None]) -> None:
        super().__init__((folder, key))
        self._key, self._cache_file, self._unsaved = key, files, unsaved

    def _index_key(self, signature: Any, codegen: Any) -> tuple:
        return str(signature), codegen.magic_tuple(), self._key

    def load_overload(self, signature: Any, context: Any) -> Any:
        try:
            return super().load_overload(signature, context)
        except Exception:  # missing or unreadable; the save below replaces it
            return None

    def save_overload(self, signature: Any, data: Any) -> None:
        try:
            super().save_overload(signature, data)
        except Exception as error:
            self._unsaved(error)

    def load(self, signature: tuple[Any, ...]) -> Any:
        """Code compiled before for the types of arguments, or None."""
        return self.load_overload(signature, cpu_target.target_context)


def use_cache(jitted: Any, cache: DiskCache) -> Any:
    """The jitted function, which now looks into ``cache`` before it compiles."""
    jitted._cache = cache
    return jitted


def serialized(data: Any) -> bytes:
    """Compiled code as bytes, which ``pickle`` reads."""
    return caching.dumps(data)


# --- instructions that Python has no word for ------------------------------------------------------------------------


@intrinsic
def call(typing: Any, address: Any, arguments: Any) -> Any:
    """Call the C function at ``address`` with a tuple of int64: numbers, or addresses of arrays.

    So the step calls laws and integrators. A jitted function as an argument would do too, but its type is its own:
    numba would compile the step again for each law.
    """

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        values = cgutils.unpack_tuple(builder, args[1])
        kind = ir.FunctionType(ir.VoidType(), [ir.IntType(64)] * len(values))
        builder.call(builder.inttoptr(args[0], kind.as_pointer()), values)
        return context.get_dummy_value()

    return nb.void(nb.int64, arguments), generate


def _entry(context: Any, builder: Any, kind: Any, array: Any, index: Any) -> Any:
    return builder.gep(context.make_array(kind)(context, builder, array).data, [index])


@intrinsic
def atomic_add(typing: Any, array: Any, index: Any, value: Any) -> Any:
    """Add to an entry of an int64 array, whatever other threads do to it, and return what it was."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        place = _entry(context, builder, signature.args[0], args[0], args[1])
        return builder.atomic_rmw("add", place, args[2], "seq_cst")

    return nb.int64(array, nb.int64, nb.int64), generate


@intrinsic
def atomic_load(typing: Any, array: Any, index: Any) -> Any:
    """Read an entry of an int64 array that another thread may write."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return builder.load_atomic(_entry(context, builder, signature.args[0], *args), "acquire", 8)

    return nb.int64(array, nb.int64), generate


@intrinsic
def atomic_store(typing: Any, array: Any, index: Any, value: Any) -> Any:
    """Write an entry of an int64 array that another thread may read."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        place = _entry(context, builder, signature.args[0], args[0], args[1])
        builder.store_atomic(args[2], place, "release", 8)
        return context.get_dummy_value()

    return nb.void(array, nb.int64, nb.int64), generate
