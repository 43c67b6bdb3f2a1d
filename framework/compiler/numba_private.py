"""What we use of numba and llvmlite beyond their documented interfaces.

No file but this, numba_inner.py and cuda_private.py may.

Each function here has one purpose and a test of its own (tests/test_numba_private.py), which names it when another
version of numba does not fit. That is why pyproject.toml bounds the version of numba from above.
"""

from __future__ import annotations

import ctypes
import functools
import inspect
import os
from collections.abc import Callable
from typing import Any

import llvmlite
import numba
import numpy as np
from llvmlite import ir
from numba import types as nb
from numba.core import cgutils
from numba.core.compiler import compile_result
from numba.core.dispatcher import Dispatcher
from numba.core.environment import Environment, lookup_environment
from numba.core.errors import NumbaError
from numba.core.extending import _Intrinsic
from numba.core.funcdesc import FunctionDescriptor
from numba.core.registry import cpu_target
from numba.extending import intrinsic, overload_method

__all__ = [
    "FOLDERS",
    "VERSIONS",
    "DiskCache",
    "NotKeptError",
    "NumbaError",
    "Table",
    "address_of",
    "atomic_add",
    "atomic_load",
    "atomic_store",
    "call",
    "compile_for",
    "definition",
    "is_number",
    "is_tuple_of_numbers",
    "laid",
    "named_tuple_method",
    "place_of",
    "processor",
    "python_function",
    "return_type",
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
    if jitted.py_func.__code__.co_flags & inspect.CO_VARARGS:  # numba compiles for one tuple in place of ``*law``
        _, signature = jitted._compiler.fold_argument_types(signature, {})
    jitted.compile(signature)
    return jitted.overloads[signature]


def return_type(code: Any) -> Any:
    """The type that compiled code returns."""
    return code.signature.return_type


def address_of(code: Any) -> int:
    """Where the C function of compiled code is. It takes the arguments as C would, and knows no Python."""
    return code.library.get_pointer_to_function(code.fndesc.llvm_cfunc_wrapper_name)


# --- tables of arrays in memory ---------------------------------------------------------------------------------------


class Table:
    """A named tuple of arrays and numbers, or of such tuples, where compiled code finds it by its address.

    A function that is given the table itself is given each word of each array, of which the wrapper that numba writes
    for Python takes longer to compile than the function. In compiled code ``table[0]`` is the tuple. Raises TypeError
    for arrays that do not lie in one piece, row after row.
    """

    def __init__(self, value: Any) -> None:
        self.value = value  #: which owns the arrays
        words: list[int] = []
        self.form = laid(value, words, _data)  #: by which two tables of one kind are told, sooner than by their types
        self._words = np.array(words, dtype=np.int64)
        self.address = _data(self._words)

    @functools.cached_property
    def kind(self) -> Any:
        """The type of its address in compiled code."""
        return nb.CPointer(_kind_of(self.value))


def _kind_of(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return nb.Array(numba.from_dtype(value.dtype), value.ndim, "C")
    if isinstance(value, Table):
        return value.kind
    if isinstance(value, tuple):
        return nb.NamedTuple([_kind_of(entry) for entry in value], type(value))
    return nb.float64 if isinstance(value, float) else nb.int64


def laid(value: Any, words: list[int], place: Callable[[np.ndarray], int], name: str = "table") -> Any:
    """The form of a value; adds the words of 8 bytes in which numba has it, for an array after two on who counts it.

    ``name`` is told where an array is refused. ``place`` says where the numbers of an array are.
    """
    if isinstance(value, np.ndarray):
        if not value.flags.c_contiguous:
            raise TypeError(f"{name} does not lie in one piece, row after row, as np.ascontiguousarray(...) would")
        words += (0, 0, value.size, value.itemsize, place(value), *value.shape, *value.strides)
        return value.dtype, value.ndim
    if isinstance(value, Table):
        words.append(value.address)
        return value.form
    if isinstance(value, tuple):
        names = getattr(value, "_fields", map(str, range(len(value))))
        inside = (laid(each, words, place, f"{type(value).__name__}.{n}") for n, each in zip(names, value, strict=True))
        return type(value), *inside
    words.append(int(np.float64(value).view(np.int64)) if isinstance(value, float) else value)
    return float if isinstance(value, float) else int


def _data(array: np.ndarray) -> int:
    """Where the numbers of an array are: ``array.ctypes.data``, in a fifth of the time.

    It is the first field of numpy's ``PyArrayObject_fields``, after the head of every Python object.
    """
    return _pointer(id(array) + object.__basicsize__).value or 0


_pointer = ctypes.c_void_p.from_address


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


class NotKeptError(Exception):
    """Why compiled code cannot be used in another process."""


class DiskCache:
    """Takes the place of numba's cache, with a ``key`` in place of source file and line, and without pickles.

    ``files`` has ``load(key)`` and ``save(key, header, object_code)``, where the key is a tuple of texts and the header
    fits JSON; what ``load`` does not find is None. ``unkept`` is told the name of a function that cannot be kept, and
    why. Code found on disk is called from Python or by its address; other compiled code cannot call it, for the type of
    its result is not kept.
    """

    def __init__(self, key: str, files: Any, unkept: Callable[[str, NotKeptError], None], function: Any = None) -> None:
        self.key, self.files, self.unkept, self.function = key, files, unkept, function

    def _name(self, signature: Any, context: Any) -> tuple:
        return str(signature), context.codegen().magic_tuple(), self.key

    def load_overload(self, signature: Any, context: Any) -> Any:
        context.refresh()  # knows how to compile for this machine only afterwards
        found = self.files.load(self._name(signature, context))
        if found is None:
            return None
        header, object_code = found
        return _linked(header, object_code, self.function, signature, context)

    def save_overload(self, signature: Any, code: Any) -> None:
        _set_environments(code)
        try:
            header, object_code = _apart(code)
        except NotKeptError as error:
            self.unkept(code.fndesc.qualname, error)
        else:
            self.files.save(self._name(signature, code.target_context), header, object_code)

    def load(self, signature: tuple[Any, ...]) -> Any:
        """Code compiled before for the types of arguments, or None."""
        return self.load_overload(signature, cpu_target.target_context)


def use_cache(jitted: Any, cache: DiskCache) -> Any:
    """The jitted function, which now looks into ``cache`` before it compiles."""
    cache.function = jitted.py_func
    jitted._cache = cache
    return jitted


def _set_environments(code: Any) -> None:
    """Tell compiled code where the constants are of all that it has taken in."""
    for environment in code._find_referenced_environments():
        code.library.codegen.set_env(environment.env_name, environment)


def _apart(code: Any) -> tuple[dict[str, Any], bytes]:
    """Compiled code as the object code of all it calls, and the names by which to find it there."""
    if code.library.has_dynamic_globals:
        raise NotKeptError("it holds addresses of this process, as of a large array or a function of ctypes")
    if code.lifted or code.reload_init:
        raise NotKeptError("it calls Python, or needs something made when it is loaded")
    environments = (code.environment, *code._find_referenced_environments())  # its own, and those of what it calls
    header = {
        "function": code.fndesc.mangled_name,
        "environment": code.environment.env_name,
        "environments": {env.env_name: [_written(c) for c in env.consts] for env in environments},
    }
    return header, code.library._get_compiled_object()


def _written(constant: Any) -> Any:
    """A constant that compiled code has from Python: in practice the data type of an array that it returns."""
    if isinstance(constant, str):
        return constant
    if isinstance(constant, np.dtype) and np.dtype(constant.str) == constant:
        return [constant.str]
    raise NotKeptError(f"it needs an object of Python's {type(constant).__name__}")


def _linked(header: dict[str, Any], object_code: bytes, function: Any, signature: Any, context: Any) -> Any:
    """Compiled code from what :func:`_apart` has made of it; without ``function``, only for its address."""
    environments = {name: _environment(name, written) for name, written in header["environments"].items()}
    environment = environments[header["environment"]]
    described = FunctionDescriptor(
        native=True, modname=__name__, qualname=getattr(function, "__qualname__", ""), unique_name="", doc="",
        typemap=None, restype=nb.undefined, calltypes=None, args=(), kws=(), argtypes=tuple(signature),
        mangler=lambda *_, **__: header["function"], env_name=header["environment"],
    )  # fmt: skip
    library = context.codegen().create_library(header["function"])
    library.enable_object_caching()
    library._set_compiled_object(object_code)  # which LLVM takes, asked to compile the empty module
    library._finalize_final_module()
    names = {described.llvm_cfunc_wrapper_name, described.llvm_cpython_wrapper_name}
    library.codegen._engine._defined_symbols |= names
    for name, env in environments.items():
        library.codegen.set_env(name, env)
    return compile_result(
        target_context=context, typing_context=context.typing_context, library=library, environment=environment,
        entry_point=function and context.get_executable(library, described, environment), fndesc=described,
        signature=nb.undefined(*signature), objectmode=False, lifted=(), reload_init=[],
        referenced_envs=list(environments.values()),
    )  # fmt: skip


def _environment(name: str, written: list[Any]) -> Any:
    """Where compiled code finds its constants; one for all code of the same name, as numba has it."""
    environment = lookup_environment(name)
    if environment is None:
        environment = Environment(globals())
        environment.env_name = name
        environment.consts[:] = [np.dtype(*c) if isinstance(c, list) else c for c in written]
        Environment._memo[name] = environment
    return environment


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


@intrinsic
def place_of(typing: Any, table: Any) -> Any:
    """The address of a table (:class:`Table`) that compiled code was given, as :func:`call` takes it."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return builder.ptrtoint(args[0], ir.IntType(64))

    return nb.int64(table), generate


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
