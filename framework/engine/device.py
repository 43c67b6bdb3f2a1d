"""A GPU as a team of many threads: the passes of the step, the laws and the materials as they are, in blocks.

A block of the device is the team of one model, or some blocks are that of a large one; ``barrier.wait`` is where its
threads meet, and a chunk of steps is one launch. Runs that share a device are gathered: a launch does the steps of all
that wait for some.
"""

from __future__ import annotations

import inspect
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any, NamedTuple

import numpy as np

from grainlaw.arguments import Checked
from grainlaw.compiler.batch import CompilationError, Compiled
from grainlaw.compiler.cache import code_kept, is_portable, keep_code
from grainlaw.compiler.entry import named_form
from grainlaw.compiler.fingerprint import fingerprint
from grainlaw.compiler.numba_private import python_function
from grainlaw.compiler.retarget import Retarget
from grainlaw.engine import device_table, step
from grainlaw.engine.contacts import contact_rows
from grainlaw.engine.contacts.contact_passes import ACTIVE, gather_at_node
from grainlaw.engine.parts.material_passes import add_material_forces
from grainlaw.engine.state import State
from grainlaw.fields import ParameterError
from grainlaw.messages import refusal

TEAM = 256  #: threads of a block
GRAINS = 64  #: at least, of a block where a team has several
REGISTERS = 128  #: of each thread: so two blocks share a multiprocessor
REGISTERS_OF_ALL = 65_536  #: that a multiprocessor has
ENGINE = "grainlaw.engine."
IN_PLACE_OF_OTHERS = (add_material_forces, gather_at_node)  #: which the step of a processor does not reach

#: The part whose shares a pass goes through, one after the other; other passes have a share for each thread.
BY_SHARE = {
    "clear_forces": "nodes", "add_zone_forces": "zones", "bond_forces": "bonds", "gather_bond_forces": "nodes",
    "gather_pressures": "nodes", "load": "tractions", "collect_forces": "grains", "add_weight": "gravity",
    "absorb": "quiet", "impose": "drives", "_remember": "nodes", "integrate": "freedoms", "place_corners": "grains",
    "collect_tied_forces": "grains", "place_tied_nodes": "nodes",
}  # fmt: skip
BY_THREAD = ("contact_step", "press", "sweep", "press_fluids", "move_platens", "follow_nodes")

#: A chunk of contacts, and of zones, is one.
_OF_CONTACTS = ("contacts.contact_passes", "contacts.contact_geometry", "contacts.contact_exchange")
_ROWS = {name: place for name, place in vars(contact_rows).items() if name.isupper() and isinstance(place, int)}
SINGLE = {(module, name): place // contact_rows.ROW for module in _OF_CONTACTS for name, place in _ROWS.items()} | {
    (module, name): 1 for module in (*_OF_CONTACTS, "parts.material_passes") for name in ("ROW", "BLOCK", "LANES")
}


class Machine(NamedTuple):
    """What a device gives to functions that run on it."""

    function: Callable[[Any], Any]  #: makes a function one that others call there
    width: Callable[..., Any]  #: threads of a team
    meet: Callable[..., Any]  #: where all of them wait for each other
    any: Callable[..., Any]  #: whether a number is not 0 in some thread; they meet there
    array: Any  #: the float64 array of a shape at an address
    address: Any  #: the address of a table
    table: Callable[[str], Any]  #: the function that makes the table of a part of an address


def _by_share(machine: Machine, function: Any, made: Any, part: str) -> Any:
    """A pass that goes through the shares of a part: each thread takes one, then one of those that are left."""
    names = list(inspect.signature(function).parameters)
    given = ", ".join("share" if name == "thread" else name for name in names)
    counts = "total += " if function.__name__ == "bond_forces" else ""
    return _written(machine, f"""
def {function.__name__}({", ".join(names)}):
    total = 0
    for share in range(thread, {part}.share.shape[{part}.share.ndim - 1] - 1, width()):
        {counts}made({given})
    meet()
    return total
""", made=made)  # fmt: skip


def _by_thread(machine: Machine, function: Any, made: Any) -> Any:
    """A pass after which all threads meet: the next one may share nodes in another way."""
    names = ", ".join(inspect.signature(function).parameters)
    return _written(machine, f"def {function.__name__}({names}):\n    made({names})\n    meet()\n", made=made)


def _if_any(machine: Machine, function: Any, made: Any) -> Any:
    """The gathering of contacts' forces by nodes, left out where there are none."""
    return _written(machine, f"""
def {function.__name__}(t, nodes, thread):
    if any(t.tally[thread, {ACTIVE}]) != 0:
        for place in range(thread, t.used.shape[0], width()):
            made(t, nodes, place)
    meet()
""", made=made)  # fmt: skip


def _written(machine: Machine, source: str, **names: Any) -> Any:
    """A function of the device from its source; it knows ``width``, ``meet`` and ``any``."""
    scope: dict[str, Any] = {"width": machine.width, "meet": machine.meet, "any": machine.any, **names}
    before = set(scope)
    exec(compile(source, "<device>", "exec"), scope)
    (name,) = set(scope) - before - {"__builtins__"}
    return machine.function(scope[name])


def _calls(machine: Machine, functions: Sequence[Any], arguments: int) -> Any:
    """In place of a call by address: of one of these functions by its number."""
    given = ", ".join(f"a[{k}]" for k in range(arguments))
    cases = "".join(f"    if number == {k}:\n        f{k}({given})\n" for k in range(len(functions)))
    return _written(
        machine, f"def call(number, a):\n{cases or '    pass'}\n", **{f"f{k}": f for k, f in enumerate(functions)}
    )


def _batches(machine: Machine, components: Sequence[Compiled]) -> list[Any]:
    """The generated loops of components, of one point on a device."""
    made = []
    for component in components:
        scope = component.generated(machine.array)
        scope["inner"] = machine.function(scope["inner"])
        made.append(machine.function(scope["batch"]))
    return made


class Components(NamedTuple):
    """What the step of some runs calls by address; each has a number, its place in its list."""

    laws: tuple[Compiled, ...] = ()
    stresses: tuple[Compiled, ...] = ()
    energies: tuple[Compiled, ...] = ()
    integrators: tuple[Compiled, ...] = ()

    def with_all(self, state: State, integrator: Compiled) -> Components:
        """With those of a run that are not yet among them; the numbers of the others stay."""
        groups = state.materials.groups
        more = (
            [group.compiled for group in (*state.bonds.groups, *state.contacts.groups)],
            [zones.stress for zones in groups], [zones.energy for zones in groups], [integrator],
        )  # fmt: skip
        return Components._make(map(_joined, self, more))

    def numbers(self, state: State, integrator: Compiled) -> dict[int, int]:
        """The number of each machine code of a run, by its address."""
        found: dict[int, int] = {}
        for own, all_ in zip(Components().with_all(state, integrator), self, strict=True):
            keys = [each.key for each in all_]
            found |= {each.address: keys.index(each.key) for each in own}
        return found

    @property
    def key(self) -> tuple[tuple[str, ...], ...]:
        """What decides the code."""
        return tuple(tuple(each.key for each in own) for own in self)


def _joined(known: tuple[Compiled, ...], more: Sequence[Compiled]) -> tuple[Compiled, ...]:
    found = {each.key: each for each in (*more, *known)}
    order = dict.fromkeys(each.key for each in (*known, *more))
    return tuple(found[key] for key in order)


def retargeted(machine: Machine, components: Components) -> tuple[Any, Retarget]:
    """The steps of a chunk for a machine; and the copies of all functions that they reach."""
    law = _calls(machine, _batches(machine, components.laws), 10)
    stress = _calls(machine, _batches(machine, components.stresses), 12)
    energy = _calls(machine, _batches(machine, components.energies), 10)
    move = _calls(machine, _batches(machine, components.integrators), 10)
    copies = Retarget(machine.function, {
        (ENGINE + "parts.laws", "call"): law, (ENGINE + "contacts.contact_passes", "call"): law,
        (ENGINE + "parts.material_passes", "_respond.call"): stress,
        (ENGINE + "parts.material_passes", "_stored_by.call"): energy,
        (ENGINE + "parts.freedoms", "call"): move, (ENGINE + "parts.platens", "call"): move,
        (ENGINE + "barrier", "wait"): _written(machine, "def wait(meeting, threads, pauses):\n    meet()\n"),
        **{(ENGINE + module, name): number for (module, name), number in SINGLE.items()},
    })  # fmt: skip
    here = step.__name__
    for name, part in BY_SHARE.items():
        function = python_function(getattr(step, name))
        copies.replaced[here, name] = _by_share(machine, function, copies.copy(function), part)
    for name in BY_THREAD:
        function = python_function(getattr(step, name))
        copies.replaced[here, name] = _by_thread(machine, function, copies.copy(function))
    gather, add = python_function(step.gather_contact_forces), python_function(add_material_forces)
    copies.replaced[here, gather.__name__] = _if_any(machine, gather, copies.copy(python_function(gather_at_node)))
    materials = _by_share(machine, add, copies.copy(add), "zones")
    copies.replaced[here, "_sum"] = _written(machine, """
def _sum(tally, column, thread):
    return any(tally[thread, column])
""")  # fmt: skip
    copies.replaced[here, "place_of"] = machine.address
    copies.replaced[here, "call"] = _written(machine, """
def call(number, a):
    materials(zones(a[0]), nodes(a[1]), a[2] != 0, a[3])
""", materials=materials, zones=machine.table("materials"), nodes=machine.table("nodes"))  # fmt: skip
    return copies.copy(step._steps), copies


def _cuda(tables: Any) -> tuple[Machine, Any]:
    """The machine of numba-cuda; and the places of team, parts and chunk."""
    from grainlaw.compiler import cuda_private as private

    team, parts, chunk = (private.place_of(table.kind) for table in tables)
    kinds = dict(zip(parts.fields, parts.kinds, strict=True))
    machine = Machine(
        private.device_function, private.width_of_team, private.meet_team, private.any_of_team, private.array_at,
        private.address_of, lambda name: private.at(kinds[name]),
    )  # fmt: skip
    return machine, (private.at(team), private.at(parts), private.at(chunk))


def kernel_of(components: Components, tables: Any) -> Any:
    """The kernel: a block for each row of the places (n, 7).

    These are the addresses of where blocks meet, of team, parts and chunk; whether grains have materials with a method
    for their stress; how many blocks the team has, and which of them this is.
    """
    from numba import cuda

    from grainlaw.compiler.cuda_private import join_team

    machine, (team_at, parts_at, chunk_at) = _cuda(tables)
    steps, _ = retargeted(machine, components)

    def kernel(places, done):
        block, thread = cuda.blockIdx.x, cuda.threadIdx.x
        join_team(places[block, 5], places[block, 0])
        count = steps(
            places[block, 6] * cuda.blockDim.x + thread, team_at(places[block, 1]), parts_at(places[block, 2]),
            chunk_at(places[block, 3]), places[block, 4],
        )  # fmt: skip
        if thread == 0:
            done[block] = count

    return kernel


def _sources() -> list[str]:
    """What makes a kernel of the step, as text."""
    from grainlaw.compiler import cuda_private, retarget

    return [inspect.getsource(module) for module in (cuda_private, retarget, sys.modules[__name__])]


class _Request(NamedTuple):
    """Steps that a run asks for."""

    state: State
    integrator: Compiled
    chunk: step.Chunk
    parameters: np.ndarray


class DeviceError(OSError):
    """A device has failed; the run is where it was before the steps that were asked for."""


class Gpu(metaclass=Checked):
    """An NVIDIA GPU, number ``number`` of this computer, that does the steps of runs; for ``device`` of a run.

    Runs that share one object are done side by side, a block of threads or some for each: the more runs, or the larger,
    the better it pays. Needs ``pip install grainlaw[gpu]``; raises :class:`ParameterError` where
    there is no device, or numba-cuda is missing.
    """

    name = "no device"

    def __init__(self, number: int = 0) -> None:
        if not isinstance(number, int) or number < 0:
            raise refusal("Gpu: number", number, "a whole number, at least 0")
        try:
            from grainlaw.compiler.cuda_private import Driver
        except ImportError as error:
            raise ParameterError(f"Gpu: numba-cuda is missing ({error}): pip install grainlaw[gpu]") from None
        try:
            self._begin(Driver(number), TEAM)
        except OSError as error:
            raise ParameterError(f"Gpu: number = {number!r} cannot be used: {error}") from None

    def _begin(self, driver: Any, team: int) -> None:
        self._driver, self._team, self._grains = driver, team, GRAINS
        self.name = str(driver.name)
        self.side_by_side: int = driver.multiprocessors * (REGISTERS_OF_ALL // (REGISTERS * TEAM))  #: blocks
        self._lock = threading.Condition()
        self._runs = 0
        self._asked: dict[int, _Request] = {}
        self._answers: dict[int, Any] = {}
        self._components, self._checked = Components(), set[str]()
        self._kernel: Any = None

    def __repr__(self) -> str:
        return f"Gpu({self.name})"

    @contextmanager
    def joined(self) -> Iterator[None]:
        """While a run goes on: others that want steps wait until it wants some too."""
        with self._lock:
            self._runs += 1
        try:
            yield
        finally:
            with self._lock:
                self._runs -= 1
                self._do_if_all_wait()

    def check(self, state: State, integrator: Compiled) -> None:
        """Raise :class:`CompilationError` for a law, material or integrator that cannot run there."""
        own = Components().with_all(state, integrator)
        with self._lock:
            for component in sorted({each for kind in own for each in kind}, key=lambda each: each.key):
                if component.key not in self._checked:
                    self._check(component)
                    self._checked.add(component.key)

    def _check(self, component: Compiled) -> None:
        from grainlaw.compiler import cuda_private as private

        made = private.device_function
        machine = Machine(made, made, made, made, private.array_at, None, made)
        try:
            private.compile_alone(_batches(machine, [component])[0], self._driver.capability)
        except Exception as error:
            kind = type(component.structure.component).__name__
            reason = "".join(str(error).strip().splitlines()[-1:]) or type(error).__name__
            raise CompilationError(f"{kind} cannot run on {self.name}: {reason}") from None

    def run(self, state: State, integrator: Compiled, chunk: step.Chunk, parameters: np.ndarray) -> tuple[int, Any]:
        """Do a chunk of steps of a run; how many were done, and the arrays of its parts as the device shares them."""
        me = threading.get_ident()
        with self._lock:
            self._asked[me] = _Request(state, integrator, chunk, parameters)
            self._do_if_all_wait()
            while me not in self._answers:
                self._lock.wait()
            answer = self._answers.pop(me)
        if isinstance(answer, BaseException):
            raise answer
        return answer, state.on_device.shared

    def _do_if_all_wait(self) -> None:
        if not self._asked or len(self._asked) < self._runs:
            return
        asked, self._asked = self._asked, {}
        try:
            done: Sequence[Any] = self._launched(list(asked.values()))
        except Exception as error:
            done = [DeviceError(f"{self.name} failed: {type(error).__name__}: {error}")] * len(asked)
        self._answers |= dict(zip(asked, done, strict=True))
        self._lock.notify_all()

    def _launched(self, requests: Sequence[_Request]) -> list[int]:
        self._driver.here()
        components = self._components
        for each in requests:
            components = components.with_all(each.state, each.integrator)
        rows, first = list[list[int]](), list[int]()
        for each in requests:
            table = self._table(each.state, len(requests))
            places = table.up(each.chunk, each.parameters, components.numbers(each.state, each.integrator))
            first.append(len(rows))
            rows += [[*places, table.blocks, block] for block in range(table.blocks)]
        if self._kernel is None or components.key != self._components.key:
            self._kernel, self._components = self._compiled(components, requests[0]), components
        done = self._driver.copied(np.zeros(len(rows), dtype=np.int64))
        where = self._driver.copied(np.array(rows, dtype=np.int64))
        self._driver.launch(self._kernel, self._team, where, done, together=len(rows) > len(requests))
        for each in requests:
            each.state.on_device.down()
        return done.copy_to_host()[first].tolist()

    def _table(self, state: State, runs: int) -> device_table.DeviceTable:
        """The arrays of one of so many runs on this device, whose blocks are all at work at once or one for each."""
        most = min(self.side_by_side // runs, state.specimen.grains.count // self._grains)
        blocks = 1 << max(most, 1).bit_length() - 1
        table: device_table.DeviceTable | None = state.on_device
        if table is None or table.driver is not self._driver or table.blocks != blocks:
            table = state.on_device = device_table.DeviceTable(self._driver, state, self._team, blocks)
        return table

    def _compiled(self, components: Components, request: _Request) -> Any:
        """The kernel of some components, compiled or from disk."""
        from grainlaw.compiler import cuda_private as private

        tables = step.tables_of(TEAM, request.state.on_device.shared, request.chunk)
        forms = [named_form(table.form) for table in tables]
        goes_in = (components.key, TEAM, REGISTERS, is_portable(), forms, *_sources())
        key = (
            fingerprint(step._steps, *IN_PLACE_OF_OTHERS, extra=goes_in),
            *map(str, (self._driver.capability, private.VERSION)),
        )  # fmt: skip
        found = code_kept(key, f"the time loop for {self.name}: this takes half a minute")
        if found is None:
            name, code = private.compile_kernel(kernel_of(components, tables), REGISTERS, self._driver.capability)
            found = {"kernel": name}, code
            keep_code(key, *found)
        header, code = found
        return self._driver.loaded(code, header["kernel"])
