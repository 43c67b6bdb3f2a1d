"""A device does the steps of runs as the processor does; tried with one that is Python (device_simulator.py)."""

import importlib.util
import inspect
import os
import subprocess
import sys
import threading
import types
from pathlib import Path

import attrs
import numpy as np
import pytest
from command_line import LAWS as VARIED
from command_line import SMALL, invoke, study_file
from device_simulator import Block, Simulated
from support import BRITTLE, ROCK, small_sample
from test_laws_properties import LAWS

import grainlaw as gl
from grainlaw.compiler.batch import compile_integrator, compile_law
from grainlaw.compiler.numba_private import python_function
from grainlaw.engine import device, device_table, step, stepping
from grainlaw.engine.device import Components
from grainlaw.engine.model import Model
from grainlaw.engine.parts import material_passes
from grainlaw.engine.parts.part import Changing, Told, declared
from grainlaw.engine.state import State
from grainlaw.materials import MohrCoulombPlastic, Thermal
from grainlaw.protocols import BiaxialCompression, Heating, UniaxialCompression
from grainlaw.units import MPa, mm

HERE = Path(__file__).parent
FAST, SLOW = gl.Constant(speed=60.0), gl.Constant(speed=5.0)
ELASTIC = {name: getattr(ROCK, name) for name in ("youngs_modulus", "poissons_ratio", "density")}
YIELDING = MohrCoulombPlastic(**ELASTIC, tensile_strength=6 * MPa, cohesion=6 * MPa, friction_angle=20)


def rock(cohesion, grains, seed):
    law = attrs.evolve(BRITTLE, cohesion=cohesion, tensile_strength=cohesion / 3)
    return small_sample(grains=grains, seed=seed, width=20 * mm, height=20 * mm), law


def crush(strain, loading=FAST):
    return UniaxialCompression(maximum_strain=strain, samples=10, loading=loading)


def differing(one, other):
    """Columns of curves that are not the same bit for bit."""
    return [n for n in one.curves if not np.array_equal(one.curves[n], other.curves[n], equal_nan=True)]


@pytest.mark.thorough
def test_portable_code_gives_the_same_bits_on_a_device_and_where_it_goes_on_after_a_failure(tmp_path):
    """Three runs of different size, seed and law in one batch, to beyond failure; one of them stopped in between."""
    code = "import test_device; test_device.in_portable_code()"
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True,
        env=os.environ | {"GRAINLAW_PORTABLE": "1", "PYTHONPATH": str(HERE)},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr


def in_portable_code():
    np.seterr(all="ignore")
    sys.setswitchinterval(1e-3)
    some = small_sample(grains=3, seed=4, width=20 * mm, height=20 * mm, material=YIELDING)
    confined = BiaxialCompression(confinement=2 * MPa, maximum_strain=1e-3, samples=10, loading=FAST)
    cases = [
        (*rock(8 * MPa, 4, 1), crush(8e-3)), (*rock(12 * MPa, 6, 3), crush(8e-3)),
        (some, rock(12 * MPa, 4, 1)[1], attrs.evolve(confined, maximum_strain=2e-3)),
    ]  # fmt: skip
    expected = [gl.simulate(*case, threads=1, progress=False) for case in cases]
    assert expected[0].curves["shear_cracks"][-1] > 0
    there, found = Simulated(), {}

    def work(k):
        found[k] = gl.simulate(*cases[k], device=there, progress=False)

    crew = [threading.Thread(target=work, args=(k,)) for k in range(3)]
    for each in crew:
        each.start()
    for each in crew:
        each.join()
    assert 3 in there.blocks
    for k, run in enumerate(expected):
        assert not differing(run, found[k]), k
    alone = Simulated(threads=2, grains=2)
    assert not differing(expected[0], gl.simulate(*cases[0], device=alone, progress=False))
    assert alone.blocks[0] == 2  # of one team
    failing = Simulated()
    failing.fail_at(7)
    with pytest.raises(gl.Stopped, match="a simulated device failed: RuntimeError: out of memory"):
        gl.simulate(*cases[0], device=failing, checkpoint="run", progress=False)
    again = gl.simulate(*cases[0], device=Simulated(), checkpoint="run", restart=True, progress=False)
    assert not differing(expected[0], again)


@pytest.mark.thorough
def test_temperatures_on_a_device_are_those_of_the_processor():
    """Of one step and of that before it, the same everywhere: what heat does to stored energy needs both."""
    warm = small_sample(3, material=Thermal(material=ROCK, expansion=8e-6))
    heating = Heating(to=60, samples=10, loading=gl.HeatingRate(rate=5e6))
    here, there = (
        gl.simulate(warm, BRITTLE, heating, progress=False, **where).curves for where in ({}, {"device": Simulated()})
    )
    for name in ("step", "temperature", "energy_zones", "energy_zones_thermal"):
        np.testing.assert_allclose(there[name], here[name], rtol=1e-9, atol=1e-9 * np.abs(here[name]).max())


def tall(cohesion):
    return gl.Run(*rock(cohesion * MPa, 4, 1), crush(2e-3))


@pytest.mark.thorough
def test_a_study_runs_on_a_device_and_stops_where_it_fails(tmp_path):
    """What had finished is kept, and goes on where there is no device."""
    there = Simulated()
    assert there.side_by_side == 2
    study = gl.Study(tall, cohesion=[8.0, 9.0, 10.0])
    table = study.run(on=there)
    assert table["status"].tolist() == ["finished"] * 3
    assert max(there.blocks) == 2
    failing = Simulated()
    failing.fail_at(len(there.blocks) - 1)
    with pytest.raises(gl.Stopped, match="a simulated device failed") as stopped:
        study.run(tmp_path / "study", on=failing, workers=1, progress=False)
    assert 0 < len(stopped.value.result) < 3
    again = study.run(tmp_path / "study", workers=1, progress=False)
    np.testing.assert_allclose(again["largest_stress"], table["largest_stress"], rtol=1e-6)


def state_of(specimen, law):
    return State(Model(specimen, law, gl.Detection()))


def test_all_that_the_step_reaches_is_taken_over():
    """No copy calls a function that was compiled for the processor, and every pass of the step has its place."""
    state = state_of(*rock(8 * MPa, 4, 1))
    steps, copies = device.retargeted(
        Block(2).machine(), Components().with_all(state, compile_integrator(gl.integration.CentralDifference()))
    )
    for copy in (steps, *copies.copies.values()):
        names = copy.__code__.co_names
        left = [n for n in names if python_function(copy.__globals__.get(n)) is not copy.__globals__.get(n)]
        assert not left, (copy, left)
    passes = {
        name for name, value in vars(step).items()
        if python_function(value) is not value and "thread" in inspect.signature(python_function(value)).parameters
    }  # fmt: skip
    assert passes == {*device.BY_SHARE, *device.BY_THREAD, "gather_contact_forces", "_sum"}


def test_what_is_declared_constant_does_not_change_within_a_stage(monkeypatch):
    """Such arrays go to a device once: plasticity, heat, mass scaling and contacts keep to it."""
    whole, seen, compared = stepping._run, {}, []

    def constants(rows, name):
        for field, value in zip(rows._fields, rows, strict=True):
            if isinstance(value, tuple):
                yield from constants(value, f"{name}.{field}")
            elif isinstance(value, np.ndarray) and device_table.REGIONS.get(declared(rows.__class__)[field]) is None:
                yield f"{name}.{field}", value

    def watched(state, chunk, do):
        key = (id(state), state.stage, state.time_step)
        for name, part in state.parts.items():
            if name in step.Parts._fields:
                for field, value in constants(part.arrays, name):
                    before = seen.get((key, field))
                    if before is not None and before[0] is part.arrays:
                        assert np.array_equal(before[1], value), (field, state.stage)
                        compared.append(field)
                    seen[key, field] = part.arrays, value.copy()
        return whole(state, chunk, do)

    monkeypatch.setattr(stepping, "_run", watched)
    specimen, law = rock(8 * MPa, 8, 1)
    gl.simulate(specimen, law, crush(8e-3, SLOW), threads=1, mass_scaling=2, progress=False)
    gl.simulate(small_sample(grains=5, material=YIELDING), law, crush(2e-3, SLOW), threads=1, progress=False)
    warm = small_sample(grains=5, material=Thermal(material=ROCK, expansion=8e-6))
    heating = Heating(to=120, samples=10, loading=gl.HeatingRate(rate=1e5))
    gl.simulate(warm, law, heating, threads=1, progress=False)
    assert {"zones.b1", "freedoms.mass", "bonds.half", "materials.b1"} <= set(compared)


def test_forces_of_contacts_are_gathered_at_nodes_in_the_order_of_lists():
    """The same bits, also where several contacts meet and lists of threads have gaps."""
    rng = np.random.default_rng(3)
    node = np.array([rng.choice(7, 4, replace=False) for _ in range(40)], dtype=np.int32).T
    follow = (rng.random(40) < 0.6).astype(np.int8)
    share = np.array([0, 13, 13, 40])
    active, tally = np.zeros(40, dtype=np.int32), np.zeros((3, 8), dtype=np.int64)
    for thread in range(3):
        mine = share[thread] + np.flatnonzero(follow[share[thread] : share[thread + 1]])
        active[share[thread] : share[thread] + len(mine)] = mine
        tally[thread, device.ACTIVE] = len(mine)
    order = np.argsort(node.T.ravel(), kind="stable")
    t = types.SimpleNamespace(
        node=node, follow=follow, share=share, active=active, tally=tally, used=np.arange(1, 8), corner=order,
        used_share=np.array([0, 7, 7, 7]), force_x=rng.normal(size=(3, 40)), force_y=rng.normal(size=(3, 40)),
        first=np.searchsorted(node.T.ravel()[order], np.arange(8)),
    )  # fmt: skip
    forces = rng.normal(size=(2, 9))
    by_list, by_node = (types.SimpleNamespace(force=forces.copy()) for _ in range(2))
    python_function(step.gather_contact_forces)(t, by_list, 0)
    for place in range(7):
        python_function(device.gather_at_node)(t, by_node, place)
    assert np.array_equal(by_list.force, by_node.force)
    assert (by_list.force != forces).sum() == 14


def test_each_array_lies_where_its_declaration_says():
    state = state_of(*rock(8 * MPa, 4, 1))
    there = Simulated()
    table = device_table.DeviceTable(there._driver, state, 3)
    integrator = compile_integrator(gl.integration.CentralDifference())
    numbers = Components().with_all(state, integrator).numbers(state, integrator)
    chunk = step.Chunk(1, 0, 1e-8, np.zeros((1, 3)), np.zeros((1, 3)), integrator.address, 0)
    table.up(chunk, np.append(integrator.numbers, 1e-8), numbers)
    state.nodes.arrays.displacement[:] = 1.0  # here only: what comes down is what the device has
    table.down()
    assert not state.nodes.arrays.displacement.any()
    kinds = {Changing: "changing", Told: "changing"}
    assert kinds.items() <= device_table.REGIONS.items()
    both = [array for array, _ in table._offsets]
    assert sum(each is state.freedoms.arrays.force for each in both) == 1  # the force of nodes is the same array


@pytest.mark.parametrize("number", [-1, 1.5, "0"])
def test_a_device_has_a_number(number):
    with pytest.raises(gl.ParameterError, match=r"number = .* must be a whole number, at least 0"):
        gl.Gpu(number)


def test_without_a_device_one_sentence_says_so():
    with pytest.raises(gl.ParameterError, match=r"pip install grainlaw\[gpu\]|no NVIDIA device answers"):
        gl.Gpu()


def test_what_is_no_device_is_refused():
    with pytest.raises(gl.ParameterError, match=r"simulate: device = 'gpu' is not allowed, it must be a Gpu"):
        gl.simulate(*rock(8 * MPa, 4, 1), crush(1e-3), device="gpu")


installed = pytest.mark.skipif(importlib.util.find_spec("numba_cuda") is None, reason="needs grainlaw[gpu]")


class Driverless(Simulated):
    """A device for which code is compiled, and none that runs it."""

    def __init__(self):
        super().__init__()
        self._driver.capability, self._driver.loaded = (9, 0), lambda code, name: (code, name)
        self._compiled = types.MethodType(device.Gpu._compiled, self)

    check = device.Gpu.check


@installed
@pytest.mark.thorough
def test_the_kernel_is_compiled_for_a_device_and_kept(tmp_path, monkeypatch):
    monkeypatch.setenv("GRAINLAW_CACHE", str(tmp_path))
    launched = []
    monkeypatch.setattr(type(Driverless()._driver), "launch", lambda driver, kernel, *_, **__: launched.append(kernel))
    state = state_of(*rock(8 * MPa, 4, 1))
    integrator = compile_integrator(gl.integration.CentralDifference())
    numbers = np.append(integrator.numbers, 1e-8)
    chunk = step.Chunk(1, 0, 1e-8, np.zeros((1, 3)), np.zeros((1, 3)), integrator.address, 0)
    Driverless().run(state, integrator, chunk, numbers)
    code, name = launched[0]
    assert code[:4] == b"\x7fELF"
    assert name.encode() in code
    from grainlaw.compiler import cuda_private

    monkeypatch.setattr(cuda_private, "compile_kernel", None)  # the second time it is on disk
    Driverless().run(state_of(*rock(8 * MPa, 4, 1)), integrator, chunk, numbers)
    assert launched[1] == (code, name)


@installed
def test_the_key_of_a_kernel_knows_what_stands_there_in_place_of_others(monkeypatch):
    """Materials by their names, not by an address, and one node after the other, which the processor's step has not."""
    monkeypatch.setattr(type(Driverless()._driver), "launch", lambda *_, **__: None)
    integrator = compile_integrator(gl.integration.CentralDifference())
    chunk = step.Chunk(1, 0, 1e-8, np.zeros((1, 3)), np.zeros((1, 3)), integrator.address, 0)

    def key():
        asked = []
        monkeypatch.setattr(device, "code_kept", lambda key, what: asked.append(key) or ({"kernel": ""}, b""))
        Driverless().run(state_of(*rock(8 * MPa, 4, 1)), integrator, chunk, np.append(integrator.numbers, 1e-8))
        return asked[0]

    first = key()
    assert key() == first
    monkeypatch.setattr(material_passes, "find_strain", material_passes.gather_motion)
    assert key() != first


@installed
@pytest.mark.thorough
@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
def test_every_law_compiles_for_a_device(law):
    Driverless()._check(compile_law(law))


@installed
def test_a_law_that_cannot_run_there_is_refused_before_the_run():
    @attrs.frozen(kw_only=True)
    class Named(gl.ContactLaw):
        kn: float = gl.parameter("Pa/m")
        stiffness = property(lambda self: (self.kn, self.kn))

        def traction(self, opening, slip):
            return self.kn * opening * float(len([opening])), self.kn * slip

    specimen, _ = rock(8 * MPa, 4, 1)
    with pytest.raises(gl.CompilationError, match="Named cannot run on a simulated device"):
        gl.simulate(specimen, Named(kn=1e13), crush(1e-3), device=Driverless(), progress=False)


@pytest.mark.parametrize(
    ("command", "owner", "name", "argument"),
    [
        (["test", "uniaxial-compression", *SMALL], "grainlaw.cli.test", "simulate", "device"),
        (["compare", *SMALL[:3], "--laws", "linear"], "grainlaw.cli.compare", "compare_laws", "device"),
        (["study", "FILE", "--quick"], "grainlaw.studies.study.Study", "run", "on"),
    ],
)
def test_a_command_takes_a_device(command, owner, name, argument, tmp_path, monkeypatch):
    there, seen = object(), {}

    def noted(*_, **named):
        seen.update(named)
        raise gl.ParameterError("seen")

    file = study_file(tmp_path, VARIED)
    command = [file if word == "FILE" else word for word in command]
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(f"{owner}.{name}", noted)
    refused = invoke(*command, "--device", "gpu")
    assert refused.exit_code == 2
    assert "Gpu: " in refused.output
    assert not seen
    monkeypatch.setattr("grainlaw.cli.running.Gpu", lambda: there)
    assert "seen" in invoke(*command, "--device", "gpu").output
    assert seen[argument] is there


def test_a_cluster_and_a_device_are_not_both_asked_for(tmp_path):
    given = invoke("study", study_file(tmp_path, VARIED), "--quick", "--on", "tcp://host:1", "--device", "gpu")
    assert given.exit_code == 2
    assert "--on and --device are not allowed together" in given.output
