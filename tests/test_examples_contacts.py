"""Bodies in motion: FreeMotion and JointSets against theory, and the examples of contact with their numbers."""

import re
import sys
from functools import partial

import numpy as np
import pytest
import pyvista
from bodies import GRAVITY, RIGID, SOFT, box
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad
from support import STRONG, state_of
from tiling import assert_sides_complete, assert_tiles

import grainlaw as gl
from grainlaw.fields import ParameterError
from grainlaw.geometry import JointSet, JointSets, moved, polygon, rectangle, together
from grainlaw.laws import Friction, MohrCoulomb
from grainlaw.protocols import FreeMotion

LAW = Friction(kn=1e9, ks=1e9, friction_angle=30)
materials = pytest.mark.parametrize("material", [RIGID, SOFT], ids=["rigid", "elastic"])


# --- free motion -----------------------------------------------------------------------------------------------------


@materials
def test_a_thrown_body_flies_along_a_parabola(material):
    specimen = gl.Specimen(together(box(9, 1, 0, -9), box(1, 1), box(1, 2, 5)), material)
    motion = FreeMotion(duration=0.3, fixed=[0], velocity={1: (2, 1)}, tracked=[1])
    result = gl.simulate(specimen, LAW, motion)
    curves, t, dt = result.curves, result.curves["time"], result.summary["time_step"]
    assert curves["x_1"] == pytest.approx(0.5 + 2 * t, abs=1e-12)
    # Velocities live half a step from places, so that a start is late by half a step.
    late = 1.01 * GRAVITY * dt * t[-1] / 2
    assert curves["y_1"] == pytest.approx(0.5 + t - GRAVITY * t**2 / 2, abs=late)
    assert curves["centre_y"] == pytest.approx((0.5 + 2 * 1 + t) / 3 - GRAVITY * t**2 / 2, abs=late)
    assert curves["rotation_1"] == pytest.approx(0, abs=1e-12)
    assert result.summary["largest_speed"] == pytest.approx(GRAVITY * 0.3, rel=0.01)  # of the one that only falls
    assert result.summary["centre_moved_x"] == pytest.approx(2 * t[-1] / 3, rel=1e-9)


@materials
def test_a_collision_keeps_the_motion_of_the_centre_of_mass(material):
    specimen = gl.Specimen(together(box(1, 1), box(1, 2, 1.01, 0.3)), material)
    motion = FreeMotion(duration=0.1, gravity=(0, 0), velocity={0: (1, 0.2)}, tracked=[0, 1])
    curves = gl.simulate(specimen, LAW, motion).curves
    t = curves["time"]
    assert curves["centre_x"] == pytest.approx((0.5 + 2 * 1.51 + t) / 3, rel=1e-10)
    assert curves["centre_y"] == pytest.approx((0.5 + 2 * 1.3 + 0.2 * t) / 3, rel=1e-10)
    assert curves["x_1"][-1] > 1.51 + 0.02  # it was hit
    assert abs(curves["rotation_1"][-1]) > 1e-3


@pytest.mark.thorough
@materials
@pytest.mark.parametrize("height", [0.0, 0.5])
def test_a_collision_keeps_the_energy_with_the_step_unless_another_is_given(material, height):
    """Face on face, the hardest: all of it closes at once."""
    specimen = gl.Specimen(together(box(1, 1), box(1, 1, 1.3, height)), material)
    law = Friction(kn=1e9, ks=1e9, friction_angle=0)
    curves = gl.simulate(specimen, law, FreeMotion(duration=0.6, gravity=(0, 0), velocity={0: (1, 0.2)})).curves
    energy = curves["energy_kinetic"] + curves["energy_zones"]
    assert energy.min() < 0.9 * energy[0]  # they met
    assert energy[-1] == pytest.approx(energy[0], rel=1e-3)


@given(angle=st.floats(-3.1, 3.1), stretch=st.floats(0.9, 1.1), x=st.floats(-5, 5))
def test_rotation_of_a_grain_that_deforms(angle, stretch, x):
    state = state_of(gl.Specimen(moved(box(1, 2), turn=20), SOFT), LAW)
    turn = np.array([(np.cos(angle), -np.sin(angle)), (np.sin(angle), np.cos(angle))])
    nodes = state.mesh.nodes
    state.nodes.arrays.displacement[:] = (nodes @ (stretch * turn).T + (x, -x) - nodes).T
    assert state.rotation(0) == pytest.approx(angle, abs=1e-12)


def test_what_is_thrown_waits_while_the_others_settle():
    specimen = gl.Specimen(together(box(9, 1, 0, -1), box(1, 1, 3), box(1, 1, 6, 4)), RIGID)
    motion = FreeMotion(duration=0.05, settle=0.4, fixed=[0], velocity={2: (1, 0)}, tracked=[1, 2])
    curves = gl.simulate(specimen, LAW, motion).curves
    settled = curves["stage"] == 0
    assert curves["y_2"][settled] == pytest.approx(4.5, abs=1e-12)
    # The other has sunk by its weight over the stiffness of its side.
    assert 0.5 - curves["y_1"][settled][-1] == pytest.approx(2600 * GRAVITY / 1e9, rel=1e-6)
    assert curves["x_2"][-1] == pytest.approx(6.5 + curves["time"][-1] - curves["time"][settled][-1], rel=1e-9)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"duration": 0}, "duration = 0 s is not allowed"),
        ({"fixed": 3}, "fixed = 3 is not allowed, it must be a list of grain numbers"),
        ({"tracked": ["a"]}, "tracked = .* is not allowed, it must be a list of grain numbers"),
        ({"velocity": {0: 3}}, "velocity = .* m/s is not allowed, it must give grain numbers two finite numbers"),
        ({"velocity": {0: (np.inf, 0)}}, "velocity = .* is not allowed"),
        ({"velocity": {7: (1, 0)}}, "velocity = 7 is not allowed, grains are numbered from 0 to 0"),
        ({"gravity": (0, np.nan)}, "gravity = .* is not allowed, it must be two finite numbers"),
    ],
)
def test_what_free_motion_refuses(changes, said):
    with pytest.raises(ParameterError, match=said):
        FreeMotion(**({"duration": 1.0} | changes)).stages(gl.Specimen(box(1, 1), RIGID))


# --- joint sets ------------------------------------------------------------------------------------------------------

REGIONS = {
    "rectangle": rectangle(5, 3),
    "slope": polygon([(0, 0), (4, 0), (4, 1), (2, 1), (1, 3), (0, 3)]),
    "hole": polygon([(0, 0), (4, 0), (4, 4), (0, 4)], holes={"hole": [(1, 1), (3, 1.2), (2.5, 3)]}),
}
#: In tenths of a degree and centimetres: joints that all but coincide with a side are refused as no tiling.
places = st.integers(-900, 900).map(lambda cm: cm / 100)
joints = st.builds(
    JointSet, dip=st.integers(-899, 900).map(lambda dip: dip / 10), through=st.tuples(places, places),
    spacing=st.integers(20, 200).map(lambda cm: cm / 100),
)  # fmt: skip


@pytest.mark.thorough
@pytest.mark.parametrize("region", REGIONS.values(), ids=REGIONS)
@settings(max_examples=40)
@given(sets=st.lists(joints, min_size=1, max_size=3))
def test_joints_tile_a_region(region, sets):
    made = JointSets(sets=sets).tessellate(region)
    made.check()
    assert_tiles(made)
    assert_sides_complete(made)


@settings(max_examples=40)
@given(sets=st.lists(joints, min_size=1, max_size=3))
def test_every_edge_inside_lies_on_a_joint(sets):
    made = JointSets(sets=sets, merge=0).tessellate(REGIONS["rectangle"])
    inner = made.edges.right >= 0
    ends = made.vertices[np.stack([made.edges.start, made.edges.end], axis=1)[inner]]
    on = np.zeros(len(ends), dtype=bool)
    for each in sets:
        dip = np.radians(each.dip)
        number = ((ends - each.through) @ (-np.sin(dip), np.cos(dip))) / each.spacing
        on |= (abs(number - np.round(number)) < 1e-7).all(axis=1) & (abs(np.diff(number)[:, 0]) < 1e-7)
    assert on.all()


def test_joints_at_right_angles_give_bricks():
    made = JointSets(sets=[JointSet(dip=0, spacing=0.5), JointSet(dip=90, spacing=1)]).tessellate(REGIONS["rectangle"])
    assert made.count == 30
    assert made.areas == pytest.approx(0.5)


@pytest.mark.parametrize("sets", [[], [3], "dip", None])
def test_what_joint_sets_refuse(sets):
    with pytest.raises(ParameterError, match=r"sets = .* is not allowed, it must be a list of at least one JointSet"):
        JointSets(sets=sets)


def test_too_many_joints_are_refused():
    with pytest.raises(ParameterError, match="spacing = 1e-07 m is not allowed"):
        JointSets(sets=[JointSet(dip=0, spacing=1e-7)]).tessellate(REGIONS["rectangle"])


# --- examples --------------------------------------------------------------------------------------------------------


def moments(series):
    """Files of a series for ParaView."""
    return [series.parent / file for file in re.findall(r'file="([^"]*)"', series.read_text("utf-8"))]


@pytest.fixture
def main(example, monkeypatch, tmp_path):
    """Runs an example with ``--quick``; returns its module and what each call of its ``run`` gave."""

    def call(name, *options):
        study, runs = example(name), []
        original = study.run

        def run(*arguments, **settings):
            runs.append(original(*arguments, **settings))
            return runs[-1]

        monkeypatch.setattr(study, "run", run)
        monkeypatch.setattr(sys, "argv", [f"{name}.py", "--quick", *options, "--out", str(tmp_path)])
        study.main()
        monkeypatch.setattr(study, "run", original)
        result = runs[-1] if isinstance(runs[-1], gl.Result) else runs[-1][0]
        series = {file.stem: moments(file) for file in (tmp_path / name).glob("*.pvd")}
        assert set(series) == {"grains", "contacts", *(["cracks"] if len(result.interfaces) else [])}
        for kind, files in series.items():
            assert len(files) == len(result.frames), kind
            assert pyvista.read(files[-1]).n_cells > 0
        assert (tmp_path / f"{name}.png").stat().st_size > 10_000
        return study, runs

    return call


@pytest.mark.thorough
def test_incline(main):
    study, (result,) = main("incline")
    assert study.ACCELERATION == pytest.approx(1.812815, abs=1e-6)
    acceleration, rotation, way = study.measured(result)
    assert acceleration == pytest.approx(1.812815, rel=1e-4)
    assert rotation > 5  # downhill
    assert way < 1e-9


@pytest.mark.thorough
def test_rocking_block(main):
    study, runs = main("rocking_block")
    alpha, start, p = np.arctan(0.5), np.arctan(0.5) / 2, np.sqrt(3 * GRAVITY / (2 * np.sqrt(5)))
    assert pytest.approx(np.arccosh(2) / p) == study.HOUSNER

    def slowness(s):  # of the angle start - s^2, from the block's energy
        return 2 * s / (p * np.sqrt(2 * (np.cos(alpha - start) - np.cos(alpha - start + s**2))))

    exact = quad(slowness, 0, np.sqrt(start))[0]
    _, impacts = study.theory(np.linspace(0, 0.7, 10), 0.7)
    assert impacts[0] == pytest.approx(exact, rel=1e-7)
    late = []
    for result, angle in (study.run(0.7, 0.0, 1e9), runs[0]):
        late.append(study.passages(result.curves["time"], angle)[0] / exact - 1)
    assert 0 < late[1] < 2e-3
    assert late[1] < 0.2 * late[0]  # the corner sinks in by the root of the stiffness
    swings = [-angle.min() for _, angle in runs]
    assert start > swings[0] > swings[1] > swings[2] > 0  # dashpots take more


@pytest.mark.thorough
def test_brick_wall(main):
    study, (result,) = main("brick_wall")
    settled = result.curves["time"][result.curves["stage"] == 0][-1]
    assert study.on_the_floor(result, settled) == pytest.approx(2000 * GRAVITY * 0.48 * 0.32, rel=1e-6)
    assert result.summary["largest_speed"] >= 20
    assert result.curves["mean_speed"][-1] > 0.5
    assert result.summary["energy_error"] < 1e-3


@pytest.mark.thorough
def test_jointed_slope(main):
    study, runs = main("jointed_slope")
    for friction, (result, way, found) in zip(study.FRICTION, runs, strict=True):
        dip, phi = np.radians(35), np.radians(friction)
        if friction < 35:
            assert found == pytest.approx(GRAVITY * (np.sin(dip) - np.tan(phi) * np.cos(dip)), rel=1e-3)
            assert way > 0.01
        else:
            assert way < 1e-9
        assert result.summary["energy_error"] < 1e-4


@pytest.mark.thorough
@pytest.mark.parametrize("confinement", [0, 4])
def test_crushed_sample(example, main, monkeypatch, confinement):
    study = example("crushed_sample")
    monkeypatch.setattr(study, "QUICK", (40, 12e-3, 30e-3))
    monkeypatch.setattr(study, "run", partial(study.run, strain=0.02, law=MohrCoulomb(**STRONG)))
    _, ((result, watcher),) = main("crushed_sample", f"--confinement={confinement}")
    curves = result.curves
    assert curves["strain"][-1] > 0.01  # it ends where no piece touches a platen
    assert result.summary["energy_error"] < 1e-3
    assert watcher.handed_over > 0
    assert 0 < watcher.deepest < 0.1 * np.sqrt(result.specimen.grains.areas.min())
    assert study.imbalance(curves) < 0.1
    assert study.residual(curves) < 0.1 * result.summary["strength"]  # of few pieces, which the last digits choose
    # A plane on which pieces slide carries at least what Rankine's does, with the friction of broken contacts.
    assert study.residual(curves) > study.rankine(confinement * 1e6, STRONG["residual_friction_angle"])


def test_rankine(example):
    study = example("crushed_sample")
    assert study.rankine(2e6, 30) == pytest.approx(6e6)
    assert study.mobilised(6e6, 2e6) == pytest.approx(30)


def test_pictures_of_moments_show_the_grains(example):
    moments = example("moments")
    result = gl.simulate(gl.Specimen(box(1, 1), RIGID), LAW, FreeMotion(duration=0.1))
    (outline,) = moments.outlines(result, result.frames[0])
    assert outline[:, 0] == pytest.approx([0, 1, 1, 0])
    figure = moments.moments(result, [0, 0.05, 0.1], ["0.5"], columns=2)
    assert len(figure.axes) == 4
