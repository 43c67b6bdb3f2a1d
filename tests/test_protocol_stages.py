"""What the stages of every protocol impose, how they are sampled and until when, by hand."""

import math
from types import SimpleNamespace

import attrs
import numpy as np
import pytest
from support import ROCK

import grainlaw as gl
from grainlaw.conditions import AtRest, Fails, FailsTo, FallsTo, Lasts, Reaches
from grainlaw.geometry import (
    Bricks,
    Voronoi,
    between_platens,
    disc,
    notched_beam,
    plate_with_hole,
    rectangle,
    shear_box,
)
from grainlaw.integration import CentralDifference, LocalDamping, Undamped
from grainlaw.loads import Drive, Fixed, FluidPressure, Gravity, Heat, Hold, Pressure, Quiet, Traction
from grainlaw.materials import Thermal
from grainlaw.protocols import (
    BiaxialCompression,
    Brazilian,
    Creep,
    Cyclic,
    DirectShear,
    Excavation,
    FreeMotion,
    Heating,
    Held,
    JointTension,
    Moving,
    PlaneWave,
    Platens,
    Saturated,
    ThreePointBending,
    UniaxialCompression,
    UniaxialTension,
    Wave,
)
from grainlaw.protocols.creep import Bears, Collapses
from grainlaw.protocols.uniaxial import IntactAtRest
from grainlaw.stage import Outlasts

STEEL = gl.Elastic(youngs_modulus=200e9, poissons_ratio=0.3, density=7850)
BLOCKS = gl.Specimen(Bricks(rows=2).tessellate(rectangle(4e-3, 8e-3)), ROCK)
BETWEEN = gl.Specimen(between_platens(BLOCKS.grains, 1e-3, overhang=2e-3), {0: ROCK, 1: STEEL})  # 8 mm wide
RIGID = gl.Specimen(between_platens(BLOCKS.grains, 1e-3, rigid=True), {0: ROCK, 1: STEEL})
SLOW = gl.Constant(speed=0.5, ramp=1e-4)
RISES = {"loading": SLOW, "samples": 40}
#: a way of 160 um in 40 samples; while the speed rises over 50 um, 25 um are lost: 7 samples; 800 samples in all
WAY = {"loading": SLOW, "interval": 4e-6, "expected": 47, "pieces": 20}


def drive(boundary, axis, speed, **more):
    return Drive(boundary=boundary, axis=axis, speed=speed, **more)


def held(axis, *boundaries):
    return [drive(name, axis, 0.0) for name in boundaries]


def same(found, expected):
    """Stages are equal but for rounding."""
    assert [stage.name for stage in found] == [stage.name for stage in expected]
    for one, other in zip(found, expected, strict=True):
        assert one.interval == pytest.approx(other.interval, rel=1e-12)
        assert attrs.evolve(one, interval=1) == attrs.evolve(other, interval=1)


def test_platens_approach_or_part():
    press = UniaxialCompression(maximum_strain=0.02, platens=Platens.ROUGH, **RISES)
    until = [Reaches("strain", 0.02), FallsTo("stress", 0.5)]
    across = held(0, "top", "bottom")
    both = attrs.evolve(press, moving=Moving.BOTH)
    stage = gl.Stage(name="compression", loads=[drive("top", 1, -1.0), *held(1, "bottom"), *across], until=until, **WAY)
    same(press.stages(BLOCKS), [stage])
    same(both.stages(BLOCKS), [attrs.evolve(stage, loads=[drive("top", 1, -0.5), drive("bottom", 1, 0.5), *across])])
    same(attrs.evolve(press, platens=Platens.SMOOTH).stages(BETWEEN), [stage])  # bodies may not slide away
    end = [Reaches("strain", 0.02), Fails("stress", "strain")]
    same(attrs.evolve(press, until=gl.Until.FAILURE).stages(BLOCKS), [attrs.evolve(stage, until=end)])
    pull = UniaxialTension(maximum_strain=0.02, stop_fraction=0, **RISES)
    parts = attrs.evolve(stage, name="tension", until=until[:1], loads=[drive("top", 1, 0.5), drive("bottom", 1, -0.5)])
    same(pull.stages(BLOCKS), [parts])
    with pytest.raises(gl.ParameterError, match="UniaxialTension: the specimen has platens of its own"):
        pull.stages(BETWEEN)
    (fine,) = attrs.evolve(press, samples=2000, loading=gl.Constant(speed=0.5)).stages(BLOCKS)
    assert (fine.pieces, fine.expected, fine.most_samples) == (1, 2000, 40_000)


@pytest.mark.parametrize("specimen", [BLOCKS, BETWEEN, RIGID], ids=["alone", "between platens", "rigid platens"])
def test_ends_must_be_flat_and_those_of_platens_too_unless_they_are_rigid(specimen):
    mesh = specimen.mesh
    UniaxialCompression().stages(specimen)
    flat = [name for name in ("top", "rock_top", "platen_top", "bottom") if name in mesh.boundaries]
    for name in flat if specimen is not RIGID else ["rock_top"]:
        nodes = mesh.nodes.copy()
        nodes[mesh.boundaries[name][0], 1] += 1e-6
        bent = SimpleNamespace(grains=specimen.grains, mesh=attrs.evolve(mesh, nodes=nodes))
        with pytest.raises(gl.ParameterError, match=f"UniaxialCompression: the {name} of the specimen is not flat"):
            UniaxialCompression().stages(bent)


@pytest.mark.parametrize(("specimen", "share"), [(BLOCKS, 1.0), (BETWEEN, 0.5)])
def test_a_confinement_comes_before_the_axial_load(specimen, share):
    """On wider platens, which may not slide away, it is a smaller stress."""
    test = BiaxialCompression(confinement=3e6, confining_ramp=1e-4, maximum_strain=0.02, **RISES)
    bodies = ["top", "bottom"] if specimen is BETWEEN else []

    def sides(ramp):
        return [Pressure(boundary=side, pressure=3e6, ramp=ramp) for side in ("left", "right")]

    confine = gl.Stage(
        name="confine", interval=5e-6, static=True, sample_limit=10_000, until=[IntactAtRest(AtRest(1e-4), 3e6)],
        loads=[
            Hold(boundary="top", axis=1, stress=-3e6 * share, ramp=1e-4), *held(1, "bottom"), *held(0, *bodies),
            *sides(1e-4),
        ],
    )  # fmt: skip
    axial = gl.Stage(
        name="axial", **WAY, until=[Reaches("strain", 0.02), FallsTo("deviator", 0.5)],
        loads=[drive("top", 1, -1.0), *held(1, "bottom"), *held(0, *bodies), *sides(0.0)],
    )  # fmt: skip
    same(test.stages(specimen), [confine, axial])
    same(attrs.evolve(test, confinement=0).stages(specimen), [attrs.evolve(axial, loads=axial.loads[:-2])])


def test_a_specimen_that_breaks_under_its_confinement_ends_the_test():
    """A hundredth of its bonds may."""
    condition = IntactAtRest(AtRest(1e-4), 3e6)
    still = {name: np.full(3, 1e-5) for name in ("time", "unbalanced", "motion")}
    assert condition.progress(still | {"broken_bonds": np.array([0.0, 0.5, 0.009])}) == 1
    with pytest.raises(gl.StageError, match=r"1.1% of the bonded contact points broke under the confinement of 3 MPa"):
        condition.progress(still | {"broken_bonds": np.array([0.0, 0.0, 0.011])})


def test_a_disc_is_pressed_between_its_jaws():
    """Its flat ends are 20 mm times the cosine of 10 degrees apart."""
    specimen = gl.Specimen(Voronoi(grains=20, seed=1).tessellate(disc(20e-3)), ROCK)
    way = 0.01 * 20e-3 * np.cos(np.radians(10)) / 40
    lost = int(np.ceil(25e-6 / way))
    stage = gl.Stage(
        name="split", loading=SLOW, interval=way, expected=40 + lost, pieces=20,
        loads=[drive("top", 1, -1.0), *held(1, "bottom"), *held(0, "top", "bottom")],
        until=[Reaches("strain", 0.01), FailsTo("stress", 0.9)],
    )  # fmt: skip
    test = Brazilian(maximum_strain=0.01, **RISES)
    same(test.stages(specimen), [stage])
    smooth = attrs.evolve(test, jaws=Platens.SMOOTH)
    same(smooth.stages(specimen), [attrs.evolve(stage, loads=stage.loads[:2])])


@pytest.mark.parametrize(("region", "says"), [(rectangle(20e-3, 20e-3), "1.41 to 1.41"), (rectangle(20e-3, 19e-3), "")])
def test_what_is_not_round_is_no_disc(region, says):
    specimen = gl.Specimen(Voronoi(grains=12, seed=1).tessellate(region), ROCK)
    with pytest.raises(gl.ParameterError, match=f"no disc: its rim is {says}"):
        Brazilian().stages(specimen)


def test_a_beam_is_bent_on_rollers():
    region = notched_beam(length=0.1, height=0.02, span=0.08, notch_depth=0.005, notch_width=0.002, bearing=0.004)
    specimen = gl.Specimen(Voronoi(grains=40, seed=1).tessellate(region), ROCK)
    stage = gl.Stage(
        name="bend", **{**WAY, "pieces": 500}, until=[Reaches("deflection", 160e-6), FailsTo("force", 0.05)],
        loads=[
            drive("load", 1, -1.0, roller=True), drive("load", 0, 0.0, roller=True),
            *(drive(name, 1, 0.0, roller=True) for name in ("support_left", "support_right")),
        ],
    )  # fmt: skip
    same(ThreePointBending(maximum_deflection=160e-6, **RISES).stages(specimen), [stage])


def test_a_joint_is_sheared_and_sheared_back():
    """100 um in samples of 4 um, and three quarters of them back; 7 samples are lost while the speed rises."""
    test = DirectShear(
        normal_stress=3e6, normal_stiffness=2e10, loading=SLOW, ramp=2e-5, maximum_slip=100e-6, reverse_to=0.25,
        resolution=4e-6,
    )  # fmt: skip
    lower = held(0, "bottom") + held(1, "bottom")
    press = gl.Stage(
        name="press", interval=2e-5, until=[AtRest(1e-4)], sample_limit=200,
        loads=[Hold(boundary="top", axis=1, stress=-3e6, ramp=2e-5), drive("top", 0, 0.0), *lower],
    )  # fmt: skip
    spring = Hold(boundary="top", axis=1, stress=-3e6, stiffness=2e10)
    shear = gl.Stage(
        name="shear", loading=SLOW, interval=4e-6, expected=25 + 7, until=[Reaches("displacement", 100e-6)],
        loads=[spring, drive("top", 0, 1.0), *lower],
    )  # fmt: skip
    back = attrs.evolve(
        shear, name="reverse", expected=19 + 7, until=[FallsTo("displacement", 0.25)],
        loads=[spring, drive("top", 0, -1.0), *lower],
    )  # fmt: skip
    same(test.stages(BLOCKS), [press, shear, back])
    same(attrs.evolve(test, reverse_to=1).stages(BLOCKS), [press, shear])
    free = attrs.evolve(test, normal_stress=0).stages(BLOCKS)[0]
    assert free.until == [Reaches("time", 2e-5)]  # nothing has to come to rest
    short = attrs.evolve(test, maximum_slip=1e-6, loading=gl.Constant(speed=0.5)).stages(BLOCKS)
    assert [stage.expected for stage in short[1:]] == [1, 1]


def test_a_shear_box_holds_the_sides_of_both_halves():
    specimen = gl.Specimen(Voronoi(grains=20, seed=1).tessellate(shear_box(30e-3, 8e-3, 4e-3)), ROCK)
    _press, shear = DirectShear(normal_stress=3e6).stages(specimen)
    upper = [drive(name, 0, 1.0) for name in ("top", "left_upper", "right_upper")]
    lower = held(0, "bottom", "left_lower", "right_lower")
    assert shear.of(Drive) == [*upper, *lower, *held(1, "bottom")]


def test_a_joint_is_pulled_and_closed():
    test = JointTension(loading=SLOW, unload_at=40e-6, maximum_opening=90e-6, closing_pressure=5e6, resolution=4e-6)
    ways = {
        "pull": (1.0, Reaches("opening", 40e-6), Reaches("broken", 1.0)),
        "unload": (-1.0, FallsTo("normal", 0.0), FallsTo("opening", 0.0)),
        "reload": (1.0, Reaches("broken", 1.0), Reaches("opening", 90e-6)),
        "close": (-1.0, Reaches("pressure", 5e6)),
        "pull again": (1.0, Reaches("opening", 40e-6)),
    }
    stages = [
        gl.Stage(
            name=name, loading=SLOW, interval=4e-6, expected=10 + 7, until=tuple(until),
            loads=[drive("top", 1, speed), *held(1, "bottom"), *held(0, "bottom", "top")],
        )
        for name, (speed, *until) in ways.items()
    ]  # fmt: skip
    same(test.stages(BLOCKS), stages)
    assert attrs.evolve(test, unload_at=1e-6, loading=gl.Constant(speed=1)).stages(BLOCKS)[0].expected == 1
    with pytest.raises(gl.ParameterError, match="unload_at = 9e-05 is not allowed, it must be below maximum_opening"):
        JointTension(unload_at=90e-6, maximum_opening=90e-6)


@pytest.mark.parametrize(
    "grains", [Bricks(rows=1, columns=2), Bricks(rows=1), Bricks(rows=3)], ids=["beside", "one", "three"]
)
def test_a_joint_is_that_of_two_blocks_one_on_the_other(grains):
    specimen = gl.Specimen(grains.tessellate(rectangle(4e-3, 8e-3)), ROCK)
    for test in (JointTension(), DirectShear(normal_stress=1e6)):
        with pytest.raises(gl.ParameterError, match="it must have two, one on the other"):
            test.stages(specimen)


@pytest.mark.parametrize(("specimen", "share"), [(BLOCKS, 1.0), (BETWEEN, 0.5)])
def test_a_load_is_held_while_time_passes(specimen, share):
    test = Creep(load=40e6, duration=1e6, confinement=3e6, ramp=1e-4, failure_strain=2e-3, largest_growth=0.1)
    bodies = ["top", "bottom"] if specimen is BETWEEN else []
    ageing = gl.Ageing(duration=1e6, largest_growth=0.1, ratio=1e-4)

    def stage(name, start, end, ramp, side_ramp, until, **more):
        return gl.Stage(
            name=name, interval=1e-5, sample_limit=100_000, until=until, **more,
            loads=[
                Hold(boundary="top", axis=1, stress=-end * share, start=-start * share, ramp=ramp),
                *held(1, "bottom"), *held(0, *bodies),
                *(Pressure(boundary=side, pressure=3e6, ramp=side_ramp) for side in ("left", "right")),
            ],
        )  # fmt: skip

    rest = AtRest(1e-4)
    expected = [
        stage("confine", 0.0, 3e6, 1e-4, 1e-4, [Bears(rest, 3e6, 4e-3)], static=True),
        stage("load", 3e6, 40e6, 1e-4, 0.0, [Bears(rest, 40e6, 4e-3)]),
        stage("creep", 40e6, 40e6, 0.0, 0.0, [Collapses(2e-3)], ageing=ageing),
    ]
    same(test.stages(specimen), expected)
    assert test.stages(specimen)[-1].ends == [Collapses(2e-3), Outlasts(ageing)]
    alone = attrs.evolve(test, confinement=0.0).stages(specimen)
    assert [one.name for one in alone] == ["load", "creep"]
    assert all(not one.of(Pressure) for one in alone)


def test_a_test_is_unloaded_at_each_level():
    press = UniaxialCompression(maximum_strain=0.02, moving=Moving.BOTH, **RISES)
    (main,) = press.stages(BLOCKS)
    back = [drive("top", 1, 0.5), drive("bottom", 1, -0.5)]
    unload = attrs.evolve(main, loads=back, until=[FallsTo("stress", 0.2)])
    expected = []
    for number, level in ((1, 1e-3), (2, 2e-3)):
        load = attrs.evolve(main, name=f"load {number}", until=[Reaches("strain", level)], ends_test=main.until)
        expected += [load, attrs.evolve(unload, name=f"unload {number}")]
    same(Cyclic(test=press, levels=(1e-3, 2e-3), unload_to=0.2).stages(BLOCKS), [*expected, main])


def test_the_forces_on_the_rim_of_an_opening_are_let_go():
    specimen = gl.Specimen(Voronoi(grains=60, seed=1).tessellate(plate_with_hole(0.1, 0.1, 0.02)), ROCK)
    stress, sides = (-2e6, -3e6, 1e6), ("bottom", "right", "top", "left")
    whole = [name for name in specimen.mesh.boundaries if name != "hole"]
    assert set(whole) == set(sides)
    slowly = 6 * 0.1 / math.sqrt(ROCK.youngs_modulus / (2 + 2 * ROCK.poissons_ratio) / ROCK.density)
    limit = 20 * math.ceil(20 * slowly / 2e-5)  # twenty times the slow release, however fast this one is
    more = {"until": [AtRest(1e-4)], "interval": 1e-6, "sample_limit": limit}
    full = gl.Stage(
        name="stress", **more, static=True,
        loads=[Traction(boundary=name, stress=stress, ramp=2e-5) for name in (*whole, "hole")],
    )  # fmt: skip
    rim = Traction(boundary="hole", stress=stress, factor=0.0, start=1.0, ramp=2e-5)
    excavate = gl.Stage(
        name="excavate", **more, expected=40,
        loads=[*(Traction(boundary=name, stress=stress) for name in whole), rim],
    )  # fmt: skip
    same(Excavation(xx=-2e6, yy=-3e6, xy=1e6, release=2e-5, samples=20).stages(specimen), [full, excavate])


def test_bodies_settle_before_they_are_thrown():
    test = FreeMotion(
        duration=0.1, settle=0.04, gravity=(1, -2), fixed=[0], velocity={1: (3, 4)}, samples=20
    )  # fmt: skip
    settle, move = test.stages(BLOCKS)
    assert (settle.name, settle.interval, move.name, move.interval) == ("settle", 0.002, "move", 0.005)
    assert settle.loads == [Gravity(acceleration=(1, -2)), Fixed(grains=[0, 1])]
    assert list(move.loads[:2]) == [Gravity(acceleration=(1, -2)), Fixed(grains=[0])]
    upper = BLOCKS.mesh.node_grain == 1
    assert move.loads[2].velocity.tolist() == np.outer(upper, [3.0, 4.0]).tolist()
    assert (settle.until, move.until) == ([Lasts(0.04)], [Lasts(0.1)])
    assert [type(stage.integrator.damping) for stage in (settle, move)] == [
        LocalDamping,
        Undamped,
    ]
    assert [stage.name for stage in attrs.evolve(test, settle=0).stages(BLOCKS)] == ["move"]


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("hold", "loads"),
    [
        (Held.BOTTOM, [*held(1, "bottom"), drive("bottom", 0, 0.0, roller=True)]),
        (Held.ENDS, [*held(1, "bottom", "top"), drive("bottom", 0, 0.0, roller=True)]),
        (Held.ALL, [*held(1, "bottom", "top"), *held(0, "left", "right")]),
    ],
)
def test_a_specimen_is_heated_and_cooled(hold, loads):
    rate = gl.HeatingRate(rate=1e4)
    more = {"loading": rate, "expected": 40, "sample_limit": 4000}
    expected = [
        gl.Stage(name="heat to 100 °C", loads=[*loads, Heat(to=100)], interval=2.0, **more),
        gl.Stage(name="cool to -20 °C", loads=[*loads, Heat(to=-20)], interval=3.0, **more),
    ]
    warm = gl.Specimen(BLOCKS.grains, Thermal(material=ROCK, expansion=8e-6))
    same(Heating(to=(100, -20), held=hold, loading=rate, samples=40).stages(warm), expected)
    round_ = gl.Specimen(Voronoi(grains=20, seed=1).tessellate(disc(20e-3)), warm.material_of(0))
    if hold is not Held.ALL:
        stages = Heating(to=100, held=hold, test=Brazilian(), loading=rate).stages(round_)
        assert [stage.name for stage in stages] == [
            "heat to 100 °C",
            "rest",
            *[s.name for s in Brazilian().stages(round_)],
        ]
        assert list(stages[1].loads) == list(stages[0].loads)[:-1]  # all but the heat
        passage = 20e-3 / round_.shear_wave_speed
        assert stages[1].until[1].duration == pytest.approx(20 * passage, rel=5e-3)
    for test in (None, *[Brazilian()] * (hold is Held.ALL)):
        with pytest.raises(gl.ParameterError, match="Heating: the specimen has no boundary named left or right"):
            Heating(to=100, held=hold, test=test).stages(round_)


@pytest.mark.parametrize(
    ("wave", "axis", "stress"), [(Wave.P, 0, (1.0, 0, 0)), (Wave.S, 1, (0, 0, 1.0)), (Wave.BAR, 0, (1.0, 0, 0))]
)
def test_a_wave_enters_at_the_left_end(wave, axis, stress):
    """Across it the upper and lower sides are held, but for a bar."""
    sides = [] if wave is Wave.BAR else held(1 - axis, "top", "bottom")
    more = {"name": "wave", "until": [Reaches("time", 2e-5)], "interval": 1e-6, "expected": 20}
    quiet = Quiet(boundary="right")
    undamped = {"integrator": CentralDifference(damping=Undamped())}
    pushed = gl.Stage(loads=[*sides, Traction(boundary="left", stress=stress, factor=5e6), quiet], **more, **undamped)
    test = PlaneWave(duration=2e-5, stress=5e6, wave=wave, samples=20)
    same(test.stages(BLOCKS), [pushed])
    moved = PlaneWave(duration=2e-5, velocity=0.1, wave=wave, samples=20)
    same(moved.stages(BLOCKS), [attrs.evolve(pushed, loads=[*sides, drive("left", axis, 0.1), quiet])])
    for place in (-1e-6, 4.1e-3):
        with pytest.raises(gl.ParameterError, match=r"is not in the specimen, 0 to 0.004 m"):
            attrs.evolve(test, gauges=[1e-3, place]).stages(BLOCKS)
    assert attrs.evolve(test, gauges=[0.0, 4e-3]).stages(BLOCKS)


@pytest.mark.parametrize("ramp", [3e-5, 2e-4])
def test_a_fluid_comes_before_a_test_or_with_its_confinement(ramp):
    """What the test drives is held by no force meanwhile; the fluid presses the sides, and is in the cracks behind."""
    press = UniaxialCompression(maximum_strain=0.02, **RISES)
    (main,) = press.stages(BLOCKS)

    def fluids(time, cracks_only):
        return [FluidPressure(boundary=name, pressure=2e6, ramp=time, cracks_only=cracks_only)
                for name in ("left", "right")]  # fmt: skip

    saturate = gl.Stage(
        name="saturate", interval=ramp / 20, sample_limit=10_000, static=True, until=[AtRest(1e-4)],
        loads=[Hold(boundary="top", axis=1, stress=0.0), *held(1, "bottom"), *fluids(ramp, False)],
    )  # fmt: skip
    wet = attrs.evolve(main, loads=[*main.loads, *fluids(0.0, False)])
    same(Saturated(test=press, pressure=2e6, ramp=ramp).stages(BLOCKS), [saturate, wet])
    confined = BiaxialCompression(confinement=3e6, confining_ramp=1e-4, maximum_strain=0.02, **RISES)
    confine, axial = confined.stages(BLOCKS)
    expected = [
        attrs.evolve(confine, loads=[*confine.loads, *fluids(1e-4, True)]),
        attrs.evolve(axial, loads=[*axial.loads, *fluids(0.0, True)]),
    ]
    same(Saturated(test=confined, pressure=2e6, ramp=ramp).stages(BLOCKS), expected)


@pytest.mark.parametrize("first", ["rests", "moves"])
def test_a_fluid_comes_before_a_test_that_does_not_begin_with_stresses_alone(first):
    """Whose first stage imposes nothing, or moves an end while it confines the specimen."""
    (main,) = UniaxialCompression(maximum_strain=0.02, **RISES).stages(BLOCKS)
    loads = held(1, "top", "bottom")
    if first == "moves":
        sides = [Pressure(boundary=name, pressure=1e6, ramp=1e-5) for name in ("left", "right")]
        loads = [drive("top", 1, -0.1), *held(1, "bottom"), *sides]
    begin = gl.Stage(name="begin", loads=loads, until=[Reaches("time", 1e-5)], interval=1e-6)

    class Composed(gl.LoadingProtocol):
        def stages(self, specimen):
            return [begin, main]

        def measure(self, state):
            return {}

        def summary(self, curves, specimen):
            return {}

    stages = Saturated(test=Composed(), pressure=2e6).stages(BLOCKS)
    assert [stage.name for stage in stages] == ["saturate", "begin", main.name]
    assert [fluid.ramp for fluid in stages[1].of(FluidPressure)] == [0.0, 0.0]
