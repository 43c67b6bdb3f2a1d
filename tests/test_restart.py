"""A run that is stopped at any moment goes on from its checkpoint with the same bits as one that never stopped."""

import json
import shutil
import signal

import attrs
import numpy as np
import pytest
from bodies import RIGID, box, turned
from support import STRONG, small_sample
from test_determinism import PAIRS, SOFT, several_minerals, varied

import grainlaw as gl
from grainlaw.geometry import Bricks, rectangle, together
from grainlaw.integration import DynamicRelaxation, KineticRelaxation
from grainlaw.laws import BandisClosure, CohesiveCrack, Friction, MunjizaJoint, StaticFatigue
from grainlaw.protocols import (
    BiaxialCompression,
    Creep,
    Cyclic,
    DirectShear,
    FreeMotion,
    PlaneWave,
    Saturated,
    SplitHopkinson,
    UniaxialCompression,
    UniaxialTension,
)
from grainlaw.results.vtk import VtkWriter
from grainlaw.runs import checkpoint, run_folder, stepper, stopping
from grainlaw.runs.stopping import Stop, Stopped
from grainlaw.units import MPa, mm

WEAK = CohesiveCrack(**STRONG, mode_i_energy=1.5, mode_ii_energy=3)
CRUSH = UniaxialCompression(loading=gl.Constant(speed=1.0), maximum_strain=0.01, samples=40, stop_fraction=0)
PULL = UniaxialTension(loading=gl.Constant(speed=0.3), maximum_strain=5e-4, samples=25, stop_fraction=0)
BLOCKS = gl.Specimen(Bricks(rows=2, columns=1).tessellate(rectangle(20 * mm, 4 * mm)), SOFT)
PILE = gl.Specimen(
    together(
        box(4, 1, -2, -1, "floor"), *(turned(0.5, 0.5, 20 * k, (0.3 * k, 0.28 + 0.6 * k), f"b{k}") for k in range(3))
    ),
    RIGID,
)
SHEAR = DirectShear(
    normal_stress=5 * MPa,
    loading=gl.Constant(speed=0.1),
    normal_stiffness=1e11,
    maximum_slip=20e-6,
    resolution=4e-7,
    reverse_to=0,
)
JOINT = MunjizaJoint(**STRONG, mode_i_energy=20, mode_ii_energy=40, closure=BandisClosure(maximum_closure=5e-6))
SOUND = attrs.evolve(WEAK, tensile_strength=10 * MPa, friction_angle=25)
AGEING = StaticFatigue(law=SOUND, rate=1.0)

#: specimen, law, test, options; what each is for
CASES = {
    "contacts after failure": (small_sample(), WEAK, CRUSH, {}),
    "rigid grains": (small_sample(material=gl.Rigid(density=3100)), WEAK, PULL, {}),
    "adaptive relaxation": (small_sample(), WEAK, PULL, {"integrator": DynamicRelaxation()}),
    "pressure": (
        small_sample(), WEAK,
        BiaxialCompression(confinement=2 * MPa, loading=gl.Constant(speed=0.5), maximum_strain=0.003, samples=30), {},
    ),
    "servo": (BLOCKS, JOINT, SHEAR, {}),
    "adaptive loading": (small_sample(), WEAK, attrs.evolve(CRUSH, loading=gl.Adaptive(rate=0.01)), {}),
    "gravity, contacts, halts": (
        PILE, Friction(kn=1e9, ks=1e9, friction_angle=30),
        FreeMotion(duration=0.3, settle=0.2, gravity=(0.0, -9.81), fixed=[0], samples=30), {},
    ),
    "a closure that stiffens": (small_sample(), JOINT, CRUSH, {"detection": gl.Detection(damping=0.2)}),
    "kinetic relaxation, scaled masses": (
        small_sample(), WEAK, PULL,
        {"mass_scaling": 3, "integrator": DynamicRelaxation(relaxation=KineticRelaxation())},
    ),
    "several stages": (small_sample(), WEAK, Cyclic(test=PULL, levels=(1e-4, 2e-4)), {}),
    "minerals": (several_minerals({0: small_sample().material, 1: SOFT}), PAIRS, PULL, {}),
    "random strength": (small_sample(), varied(small_sample()), PULL, {}),
    "a fluid": (small_sample(12), WEAK, Saturated(test=PULL, pressure=5 * MPa), {}),
    "waves that leave": (
        small_sample(12), WEAK,
        PlaneWave(stress=[(0, 0), (5e-6, -60e6), (8e-6, 40e6)], quiet=("left", "right"), duration=2e-5, samples=20), {},
    ),
    "ends of bars": (
        small_sample(12), WEAK, SplitHopkinson(wave=gl.pulse(-60e6, rise=5e-6), duration=2e-5, samples=20), {},
    ),
    "jumps of time": (small_sample(12), AGEING, Creep(load=75 * MPa, duration=1.0, largest_growth=0.2), {}),
}  # fmt: skip
LONG = ("contacts after failure", "servo", "gravity, contacts, halts", "a closure that stiffens")


def same(one, other):
    """The same bits in all that a result holds."""
    assert one.curves.keys() == other.curves.keys()
    for name, values in one.curves.items():
        assert np.array_equal(values, other.curves[name], equal_nan=True), name
    for name in ("position", "mode", "time", "opening", "slip", "spent"):
        assert np.array_equal(getattr(one.cracks, name), getattr(other.cracks, name), equal_nan=True), name
    assert [frame.time for frame in one.frames] == [frame.time for frame in other.frames]
    for mine, its in zip(one.frames, other.frames, strict=True):
        assert np.array_equal(mine.velocity, its.velocity)
        for kind in ("bonds", "contacts"):
            rows, others = getattr(mine, kind), getattr(its, kind)
            assert rows.keys() == others.keys()
            assert all(np.array_equal(row, others[name], equal_nan=True) for name, row in rows.items())
    differ = {name for name, value in one.summary.items() if repr(value) != repr(other.summary[name])}
    assert differ <= {"seconds"}


class Calls:
    """Counts calls of the compiled step, and asks to stop at one of them."""

    def __init__(self, monkeypatch, stop=None, at=None):
        self.count, self.stop, self.at, self.advance = 0, stop, at, stepper.advance
        monkeypatch.setattr(stepper, "advance", self)

    def __call__(self, *arguments, **options):
        self.count += 1
        if self.count == self.at:
            self.stop.ask("enough")
        self.advance(*arguments, **options)


@pytest.mark.parametrize("case", [pytest.param(c, marks=pytest.mark.slow) if c in LONG else c for c in CASES])
@pytest.mark.alone
def test_a_stopped_run_goes_on_with_the_same_bits(case, tmp_path, monkeypatch):
    specimen, law, protocol, options = CASES[case]
    with monkeypatch.context() as patch:
        calls = Calls(patch)
        whole = gl.simulate(specimen, law, protocol, **options)
    for k, at in enumerate(np.random.default_rng(len(case)).integers(2, calls.count, 3).tolist()):
        stop = Stop()
        with monkeypatch.context() as patch:
            Calls(patch, stop, at)
            with pytest.raises(Stopped, match="enough") as stopped:
                gl.simulate(specimen, law, protocol, **options, checkpoint=tmp_path, stop=stop, overwrite=True)
        assert len(stopped.value.result.curves.get("time", ())) < len(whole.curves["time"])
        options_now = options | {"threads": 1 + k % 2}
        same(whole, gl.simulate(specimen, law, protocol, **options_now, checkpoint=tmp_path, restart=True))


@pytest.mark.parametrize(
    ("name", "said"),
    [("SIGINT", "interrupted from the keyboard"), ("SIGTERM", "stopped by the signal SIGTERM")],
)
def test_a_signal_stops_and_the_second_ends_at_once(name, said, monkeypatch):
    number = getattr(signal, name)
    monkeypatch.setattr(stopping, "_DEFAULTS", (signal.getsignal(number),))
    before, stop = signal.getsignal(number), Stop()
    with stop.by_signals() as asked:
        assert asked is stop
        stop.check()
        signal.raise_signal(number)
        assert (stop.reason, stop.signal) == (said, number)
        for again in (stop.check, lambda: signal.raise_signal(number)):
            with pytest.raises(Stopped, match=said) as stopped:
                again()
            assert stopped.value.signal == number
    assert signal.getsignal(number) == before


@pytest.mark.alone
def test_a_run_that_is_stopped_again_and_again_comes_to_the_same_end(tmp_path, monkeypatch):
    specimen, law, protocol, _ = CASES["contacts after failure"]
    whole = gl.simulate(specimen, law, protocol)
    for _ in range(100):
        stop = Stop()
        with monkeypatch.context() as patch:
            Calls(patch, stop, 12)
            try:
                result = gl.simulate(specimen, law, protocol, checkpoint=tmp_path, restart=True, stop=stop)
                break
            except Stopped:
                pass
    same(whole, result)


@pytest.mark.alone
def test_a_checkpoint_in_the_course_of_a_run_is_as_good_as_one_at_its_stop(tmp_path, monkeypatch):
    """As after a kill: files of moments after the checkpoint are there."""
    specimen, law, protocol, _ = CASES["contacts after failure"]

    def go(folder, **options):
        watchers = [gl.Probe(points=[3], first=2), VtkWriter(folder, 5)]
        result = gl.simulate(specimen, law, protocol, checkpoint=folder, every=0, observers=watchers, **options)
        return result, watchers

    whole, (probe, _) = go(tmp_path / "whole")
    killed = tmp_path / "killed"
    with monkeypatch.context() as patch:
        calls, keep = Calls(patch, None, None), run_folder.RunFolder.checkpoint

        def only_early(folder, moment, curves, observers):
            if len(curves["time"]) <= 25:
                keep(folder, moment, curves, observers)

        patch.setattr(run_folder.RunFolder, "checkpoint", only_early)
        go(killed)
    assert calls.count > 25
    again, (probe_again, _) = go(killed, restart=True)
    same(whole, again)
    for path, its in zip(probe.paths, probe_again.paths, strict=True):
        assert path.point == its.point
        assert np.array_equal(path.normal, its.normal)
        assert np.array_equal(path.position, its.position)
    for file in sorted(path.name for path in (tmp_path / "whole").iterdir()):
        if file.endswith((".csv", ".pvd", ".vtu")):
            assert (killed / file).read_bytes() == (tmp_path / "whole" / file).read_bytes(), file


@pytest.mark.thorough
def test_a_finished_run_is_not_run_again(tmp_path, monkeypatch):
    specimen, law, protocol, _ = CASES["rigid grains"]
    whole = gl.simulate(specimen, law, protocol, checkpoint=tmp_path)
    calls, written = Calls(monkeypatch), (tmp_path / "checkpoint.npz").stat()
    same(whole, gl.simulate(specimen, law, protocol, checkpoint=tmp_path, restart=True))
    assert calls.count == 0
    now = (tmp_path / "checkpoint.npz").stat()
    assert (now.st_ino, now.st_mtime_ns) == (written.st_ino, written.st_mtime_ns)


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("other", "words"),
    [
        ({"law": JOINT}, "belongs to another run"),
        ({"specimen": small_sample(seed=2)}, "belongs to another run"),
        ({"protocol": UniaxialTension(loading=gl.Constant(speed=0.2))}, "belongs to another run"),
        ({"mass_scaling": 2}, "belongs to another run"),
        ({"observers": [gl.Probe(points=[1])]}, "observers must be those of the run before"),
    ],
)
def test_another_run_does_not_go_on_from_a_checkpoint(other, words, tmp_path):
    run = {"specimen": small_sample(), "law": WEAK, "protocol": PULL}
    gl.simulate(**run, checkpoint=tmp_path)
    with pytest.raises(gl.ParameterError, match=words):
        gl.simulate(**run | other, checkpoint=tmp_path, restart=True)


@pytest.mark.thorough
@pytest.mark.parametrize("damage", ["cut", "empty", "text"])
def test_a_damaged_checkpoint_is_refused(damage, tmp_path):
    run = {"specimen": small_sample(), "law": WEAK, "protocol": PULL}
    gl.simulate(**run, checkpoint=tmp_path)
    file = tmp_path / "checkpoint.npz"
    whole = file.read_bytes()
    file.write_bytes({"cut": whole[: len(whole) // 2], "empty": b"", "text": b"no file of arrays"}[damage])
    with pytest.raises(gl.ParameterError, match="is no checkpoint that can be read"):
        gl.simulate(**run, checkpoint=tmp_path, restart=True)


def arrays_of(file):
    with np.load(file) as stored:
        return {name: stored[name] for name in stored.files}


@pytest.mark.thorough
def test_a_checkpoint_whose_numbers_were_changed_is_refused(tmp_path):
    run = {"specimen": small_sample(), "law": WEAK, "protocol": PULL}
    gl.simulate(**run, checkpoint=tmp_path)
    file = tmp_path / "checkpoint.npz"
    arrays = arrays_of(file)
    for name in ("state/nodes/displacement", "curves/stress", "about", "checksum"):
        row = arrays[name]
        changed = np.array(f"{row} ") if row.dtype.kind == "U" else row * 1.001
        np.savez(file, **{**arrays, name: changed})
        with pytest.raises(gl.ParameterError, match="was changed after it was written"):
            gl.simulate(**run, checkpoint=tmp_path, restart=True)
    np.savez(file, **arrays)
    gl.simulate(**run, checkpoint=tmp_path, restart=True)  # as it was written


@pytest.mark.thorough
def test_a_checkpoint_that_somebody_has_made_corrupts_no_memory(tmp_path):
    """With a checksum of its own: what has another form is refused before a byte of it is used."""
    run = {"specimen": small_sample(), "law": WEAK, "protocol": PULL}
    gl.simulate(**run, checkpoint=tmp_path)
    file = tmp_path / "checkpoint.npz"
    arrays = arrays_of(file)
    text = str(arrays.pop("about"))
    arrays.pop("checksum")
    velocity = "state/freedoms/velocity"
    numbers = json.loads(text)
    numbers["numbers"]["counters"]["stage"] = 7
    for name, row, about in (
        (velocity, arrays[velocity][:, :3], text),
        (velocity, arrays[velocity].astype(np.float32), text),
        ("state/freedoms/other", np.zeros(3), text),
        ("state/nothing/other", np.zeros(3), text),
        (velocity, None, text),
        ("curves/stress", arrays["curves/stress"][:3], text),
        (velocity, arrays[velocity], json.dumps(numbers)),
    ):
        made = {k: v for k, v in {**arrays, name: row}.items() if v is not None}
        np.savez(file, **made, about=np.array(about), checksum=np.array(checkpoint._checksum(about, made)))
        with pytest.raises(gl.ParameterError, match="the checkpoint does not fit this run"):
            gl.simulate(**run, checkpoint=tmp_path, restart=True)


@pytest.fixture(scope="module")
def crushed():
    """A state with contacts in all states, and its saved arrays."""
    seen = []

    class Enough(Exception):
        """There are contacts: how many there are in the end depends on the processor."""

    class Keep(gl.Observer):
        def observe(self, state, curves, stage, progress):
            seen[:] = [state]
            if len(state.contacts) > 20:
                raise Enough

    with pytest.raises(Enough):
        gl.simulate(
            small_sample(30, seed=2), WEAK, attrs.evolve(CRUSH, maximum_strain=0.05), observers=[Keep()], frames=1
        )
    return seen[0]


def test_every_array_of_a_checkpoint_is_held_to_its_form(crushed):
    state = crushed
    state.check_saved(state.save())
    wrong = []
    for part, rows in state.save().items():
        for name, row in rows.items():
            for how, changed in (
                ("cut", row[..., :-1]), ("longer", np.append(row, row)),
                ("kind", row.astype(np.complex64)), ("absent", None),
            ):  # fmt: skip
                if how in ("cut", "longer") and (not row.size or name == "softest"):
                    continue
                made = {name: each for name, each in state.save().items()}
                made[part] = {k: v for k, v in {**rows, name: changed}.items() if v is not None}
                try:
                    state.check_saved(made)
                except ValueError:
                    continue
                wrong.append((part, name, how))
    assert wrong == []


@pytest.mark.parametrize("name", ["node", "active", "used", "pairs", "listed", "keys", "state"])
@pytest.mark.parametrize("number", [-1, 10**6])
def test_no_contact_names_what_is_not_there(crushed, name, number):
    state = crushed
    saved = state.save()
    row = saved["contacts"][name]
    row.flat[len(row.flat) // 2] = min(number, 100) if row.dtype == np.int8 else number
    with pytest.raises(ValueError, match="contacts: "):
        state.check_saved(saved)


@pytest.mark.thorough
@pytest.mark.parametrize("share", [0.0, 0.1, 0.5, 0.99, None])
def test_a_frame_that_is_cut_is_named_and_left_out(share, tmp_path):
    run = {"specimen": small_sample(20), "law": WEAK, "protocol": PULL}
    whole = gl.simulate(**run, checkpoint=tmp_path, frames=4, time_step_factor=0.9)
    file = tmp_path / "frames" / "0001.npz"
    content = file.read_bytes()
    assert len(whole.frames) > 2
    file.unlink() if share is None else file.write_bytes(content[: int(share * len(content))])
    with pytest.warns(gl.OutputWarning, match="0001.npz"):
        again = gl.simulate(**run, checkpoint=tmp_path, frames=4, time_step_factor=0.9, restart=True)
    times = [frame.time for frame in whole.frames]
    assert [frame.time for frame in again.frames] == [times[0], *times[2:]]


@pytest.mark.thorough
def test_a_restart_without_a_checkpoint_begins(tmp_path):
    run = {"specimen": small_sample(), "law": WEAK, "protocol": PULL}
    same(gl.simulate(**run), gl.simulate(**run, checkpoint=tmp_path / "new", restart=True))
    shutil.rmtree(tmp_path / "new")
