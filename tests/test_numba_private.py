"""Each thing we use of numba beyond its documented interface, alone: with another numba, what broke has a name."""

import collections
import ctypes
import gc
import json
import math
import operator
import os
import threading

import numba
import numpy as np
import pytest
from numba import njit
from numba import types as nb
from numba.core.types.functions import BaseFunction
from numba.extending import intrinsic

from grainlaw.compiler import numba_inner
from grainlaw.compiler import numba_private as private

ADDRESS = ctypes.CFUNCTYPE(None, ctypes.c_int64, ctypes.c_int64)


def double(x):
    return 2.0 * x


def fill(address, value):
    numba.carray(address, (1,))[0] = value


COMPILED = private.compile_for(njit(double), (nb.float64,))


class Files:
    """A cache in memory; what it keeps has been through JSON."""

    def __init__(self):
        self.kept = {}

    def load(self, key):
        return self.kept.get(repr(key))

    def save(self, key, header, object_code):
        self.kept[repr(key)] = json.loads(json.dumps(header)), bytes(object_code)


def versions():
    assert private.VERSIONS[0] == numba.__version__
    assert all(part.isdigit() for part in private.VERSIONS[1].split(".")[:2])


def folders():
    assert os.path.dirname(os.path.realpath(numba.__file__)) in private.FOLDERS
    assert len(private.FOLDERS) == len(private.VERSIONS)


def numba_error():
    with pytest.raises(private.NumbaError, match="Unknown attribute 'nothing'"):
        njit(lambda x: x.nothing)(1.0)


def python_function():
    assert private.python_function(njit(double)) is double
    assert private.python_function(double) is double
    assert private.python_function(3) == 3


def definition():
    def identity(typing, x):
        return x(x), lambda context, builder, signature, args: args[0]

    assert private.definition(intrinsic(identity)) is identity
    assert private.definition(njit(double)) is None


def compile_for():
    jitted = njit(double)
    code = private.compile_for(jitted, (nb.float64,))
    assert private.compile_for(jitted, (nb.float64,)) is code
    assert private.compile_for(jitted, (nb.int64,)) is not code
    assert private.compile_for(jitted, (nb.float64,)) is code
    assert private.compile_for(njit(lambda *x: x[1]), (nb.int64, nb.float64)).signature.return_type == nb.float64


def return_type():
    assert private.return_type(private.compile_for(njit(double), (nb.float64,))) == nb.float64


def address_of():
    code = private.compile_for(njit(double), (nb.float64,))
    assert ctypes.CFUNCTYPE(ctypes.c_double, ctypes.c_double)(private.address_of(code))(1.5) == 3.0


def is_tuple_of_numbers():
    number, flag = numba.typeof(1.0), numba.typeof(True)
    assert private.is_tuple_of_numbers(nb.UniTuple(number, 2), 2)
    assert private.is_tuple_of_numbers(nb.Tuple((number, flag, nb.int64)), 3)
    assert not private.is_tuple_of_numbers(nb.UniTuple(number, 2), 3)
    assert not private.is_tuple_of_numbers(nb.Tuple((number, nb.none)), 2)
    assert not private.is_tuple_of_numbers(number, 1)


def is_number():
    assert private.is_number(numba.typeof(1.0))
    assert private.is_number(numba.typeof(True))
    assert not private.is_number(nb.UniTuple(numba.typeof(1.0), 1))


def named_tuple_method():
    same, mixed, other = (
        collections.namedtuple(name, fields) for name, fields in (("Same", "a b"), ("Mixed", "a b"), ("Other", "a"))
    )
    methods = {same: njit(lambda pair, x: pair.a + x), mixed: njit(lambda pair, x: pair.a * x)}
    private.named_tuple_method("applied", methods.get)
    apply = njit(lambda pair, x: pair.applied(x))
    assert apply(same(2.0, 3.0), 5.0) == 7.0
    assert apply(mixed(2.0, True), 5.0) == 10.0  # entries of two types
    with pytest.raises(private.NumbaError, match="applied"):
        apply(other(2.0), 5.0)


def disk_cache():
    """Another process finds by the key what one has compiled; here: another jitted function of the same key."""
    files, unkept = Files(), []

    def cache(key="key"):
        return private.DiskCache(key, files, lambda name, error: unkept.append(str(error)))

    assert cache().load((nb.float64,)) is None
    jitted = private.use_cache(njit(double), cache())
    private.compile_for(jitted, (nb.float64,))
    assert len(files.kept) == 1
    code = cache().load((nb.float64,))
    assert ctypes.CFUNCTYPE(ctypes.c_double, ctypes.c_double)(private.address_of(code))(1.5) == 3.0
    for key, signature in (("key", (nb.int64,)), ("other", (nb.float64,))):
        assert cache(key).load(signature) is None
    assert unkept == []


def use_cache():
    """The second function is not compiled, for its key is that of the first; it returns arrays as the first does."""
    files = Files()
    for function in (lambda x: (x.astype(np.int32), 2 * x), lambda x: math.nan):
        jitted = private.use_cache(njit(function), private.DiskCache("key", files, None))
        whole, twice = jitted(np.array([1.5, 2.5]))
        assert (whole.dtype, whole.tolist(), twice.tolist()) == (np.int32, [1, 2], [3.0, 5.0])
    with pytest.raises(private.NumbaError, match="undefined"):  # its type is not kept: no compiled code may call it
        njit(lambda x: jitted(x))(np.array([1.5]))


def inner_options():
    """Other code takes it in, with its constants; no machine code is made for it; Python can call it all the same."""
    options = numba_inner.inner_options({"error_model": "numpy"})
    inner = njit(**options)(lambda x: ((2 * x).astype(np.int32), 1.0 / x[1]))
    array = np.array([1.5, 0.0])
    code = private.compile_for(inner, (numba.typeof(array),))
    assert not code.library._codegen._engine.is_symbol_defined(code.fndesc.mangled_name)
    files = Files()
    outer = private.use_cache(njit(lambda x: inner(x)), private.DiskCache("key", files, None))
    for call in (outer, inner):
        whole, ratio = call(array)
        assert (whole.dtype, whole.tolist(), ratio) == (np.int32, [3, 0], math.inf)
    assert len(files.kept) == 1
    engine, taken_in = code.library._codegen._engine, private.compile_for(outer, (numba.typeof(array),))
    for environment in taken_in._find_referenced_environments():
        place = engine.get_global_value_address(environment.env_name)
        assert ctypes.c_void_p.from_address(place).value == id(environment)


def sooner():
    """numba is asked once which addition two numbers have; afterwards, also where that fails, all is as it was."""
    asked, usual, collected = [], BaseFunction.get_call_type, []

    def count(self, context, arguments, named):
        asked.append((self.typing_key, arguments))
        collected.append(gc.isenabled())
        return usual(self, context, arguments, named)

    BaseFunction.get_call_type = count
    try:
        options = numba_inner.sooner({"error_model": "numpy"})
        twice = njit(**options)(lambda x: x + x)
        assert njit(**options)(lambda x, y: x + y + x + twice(y) + y)(1.0, 0.5) == 4.0
        assert asked.count((operator.add, (nb.float64, nb.float64))) == 2  # once for each way to compile
        assert not any(collected)
        with pytest.raises(private.NumbaError, match="add"):
            njit(**options)(lambda x: x + math.sin)(1.0)
        assert BaseFunction.get_call_type is count
        assert gc.isenabled()
    finally:
        BaseFunction.get_call_type = usual


def uncounted():
    """A function whose arrays are not counted gives what others give; one that makes arrays does not compile."""
    rows = collections.namedtuple("Rows", "a b")(np.array([1.0, 2.0]), np.array([[3.0, 4.0]]))
    options = numba_inner.uncounted({"error_model": "numpy"})
    assert njit(**options)(lambda rows: rows.a[1:][0] + rows.b[0, 1])(rows) == 6.0
    with pytest.raises(private.NumbaError, match="Only accept returning of array passed"):
        njit(**options)(lambda count: np.empty(count)[0])(3)


def not_kept_error():
    """Code with addresses of this process, or objects of Python's, runs, and is not kept."""
    files, told = Files(), []
    native = ctypes.CFUNCTYPE(ctypes.c_double, ctypes.c_double)(private.address_of(COMPILED))

    def boxed(x):
        with numba.objmode(y="float64"):
            y = 2.0 * x
        return y

    for name, function in {"native": lambda x: native(x), "boxed": boxed}.items():
        cache = private.DiskCache(name, files, lambda *what: told.append(what))
        assert private.use_cache(njit(function), cache)(1.5) == 3.0
    assert not files.kept
    assert [type(error) for _, error in told] == 2 * [private.NotKeptError]
    assert "boxed" in told[1][0]
    assert private._written(np.dtype(float)) == [np.dtype(float).str]  # what is read again is the same type
    for other in (np.dtype([("a", float)]), object()):
        with pytest.raises(private.NotKeptError, match=f"an object of Python's {type(other).__name__}"):
            private._written(other)


def processor():
    name, features = private.processor()
    assert name
    assert {"+", "-"} >= {feature[0] for feature in features.split(",")}


def call():
    code = private.compile_for(njit(fill), (nb.CPointer(nb.int64), nb.int64))
    target = np.zeros(1, dtype=np.int64)

    @njit
    def through(address, place):
        private.call(address, (place, 7))

    through(private.address_of(code), target.ctypes.data)
    assert target[0] == 7


def table():
    """Compiled code finds the same numbers in memory; arrays that do not lie in one piece are refused."""
    inner = collections.namedtuple("Inner", "count ratio")(7, 0.1)
    rows = np.arange(6.0).reshape(2, 3), np.array([3, 5], dtype=np.int32), np.array([False, True])
    outer = collections.namedtuple("Outer", "a b c inner")(*rows, inner)
    both = private.Table(collections.namedtuple("Both", "first second")(private.Table(outer), private.Table(inner)))

    def total(both, others):
        first, second = both[0].first[0], both[0].second[0]
        first.a[1, 2] = -first.a[1, 2]
        found = first.a.sum() + first.b[1] + first.c[1] + first.inner.count + second.count
        return round(1000 * (found + 100 * second.ratio)) + len(first.a) + first.a.shape[1] + others

    code = private.compile_for(njit(total), (both.kind, nb.int64))
    call = ctypes.CFUNCTYPE(*(ctypes.c_int64,) * 3)(private.address_of(code))
    assert call(both.address, 20) == 1000 * (10 - 5 + 5 + 1 + 7 + 7 + 10) + 2 + 3 + 20
    assert rows[0][1, 2] == -5.0
    with pytest.raises(TypeError, match=r"^tuple.0 does not lie in one piece"):
        private.Table((rows[0].T,))


def laid():
    """A form by the kind of what is in it; words with arrays where they are said to be."""
    words, rows = [], np.arange(6, dtype=np.int32).reshape(2, 3)
    assert private.laid((rows, 0.5, 7), words, lambda array: 40) == (tuple, (np.dtype(np.int32), 2), float, int)
    assert words == [0, 0, 6, 4, 40, 2, 3, 12, 4, int(np.float64(0.5).view(np.int64)), 7]


def place_of():
    """The address of a table inside compiled code is that from outside."""
    pair = private.Table(collections.namedtuple("Pair", "a b")(1, 2))
    code = private.compile_for(njit(lambda pair: private.place_of(pair)), (pair.kind,))
    assert ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_int64)(private.address_of(code))(pair.address) == pair.address


def atomic_add():
    """From four threads at once no addition is lost, and each sees another sum before."""
    counter, seen = np.zeros(2, dtype=np.int64), np.zeros((4, 50_000), dtype=np.int64)

    @njit(nogil=True)
    def count(counter, before):
        for i in range(before.size):
            before[i] = private.atomic_add(counter, 1, 2)

    count(counter.copy(), seen[0].copy())
    threads = [threading.Thread(target=count, args=(counter, row)) for row in seen]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert counter.tolist() == [0, 2 * seen.size]
    assert np.array_equal(np.sort(seen, axis=None), 2 * np.arange(seen.size))


def atomic_load():
    assert njit(lambda array: private.atomic_load(array, 1))(np.array([3, 5])) == 5


def atomic_store():
    array = np.array([3, 5])
    njit(lambda array: private.atomic_store(array, 1, 7))(array)
    assert array.tolist() == [3, 7]


PIECES = {
    "VERSIONS": versions, "processor": processor,
    "FOLDERS": folders, "NumbaError": numba_error, "python_function": python_function,
    "definition": definition, "compile_for": compile_for, "return_type": return_type, "address_of": address_of,
    "is_number": is_number, "inner_options": inner_options, "sooner": sooner, "uncounted": uncounted,
    "is_tuple_of_numbers": is_tuple_of_numbers, "named_tuple_method": named_tuple_method, "DiskCache": disk_cache,
    "NotKeptError": not_kept_error, "use_cache": use_cache, "call": call, "Table": table, "place_of": place_of,
    "laid": laid, "atomic_add": atomic_add, "atomic_load": atomic_load, "atomic_store": atomic_store,
}  # fmt: skip


@pytest.mark.parametrize("name", PIECES)
def test_piece_fits_this_numba(name):
    try:
        PIECES[name]()
    except (Exception, pytest.fail.Exception) as error:
        pytest.fail(f"grainlaw.compiler: {name} does not fit numba {numba.__version__}: {error!r}")


def test_every_piece_has_its_test():
    assert {name.split(",")[0] for name in PIECES} == {*private.__all__, *numba_inner.__all__}
