"""Grains that share nodes along edges that are tied: one body, without springs, exact in the moduli of its grains."""

import math

import attrs
import numpy as np
import pytest
import scipy
from command_line import invoke
from support import BRITTLE, ROCK, small_sample

import grainlaw as gl
from grainlaw.compiler.batch import compile_integrator
from grainlaw.engine.ledger import energies
from grainlaw.engine.model import Model
from grainlaw.engine.stability import stiffness_matrix
from grainlaw.engine.stable_step import StableStep
from grainlaw.engine.state import State
from grainlaw.engine.stepping import advance
from grainlaw.geometry import Breakable, Bricks, Voronoi, VoronoiCells, rectangle
from grainlaw.laws import Linear
from grainlaw.protocols import UniaxialCompression, UniaxialTension
from grainlaw.runs.record import described_run
from grainlaw.units import mm

UNDAMPED = gl.integration.CentralDifference(damping=gl.integration.Undamped())
GLUE = Linear(kn=2e14, ks=1e14)
BLOCK = Voronoi(grain_size=3 * mm, seed=2).tessellate(rectangle(20 * mm, 20 * mm))


def test_a_tied_specimen_has_the_moduli_of_its_grains_to_rounding():
    """Plane strain; bonded grains are softer by what their bonds give."""
    found = gl.elastic_properties(gl.Specimen(BLOCK, ROCK, tied=...), GLUE)
    assert found.modulus == pytest.approx(ROCK.youngs_modulus, rel=1e-10)
    assert found.poisson == pytest.approx(ROCK.poissons_ratio, rel=1e-10)
    assert gl.elastic_properties(gl.Specimen(BLOCK, ROCK), GLUE).modulus < 0.95 * ROCK.youngs_modulus
    test = UniaxialCompression(maximum_strain=1e-4, samples=20)
    run = gl.simulate(gl.Specimen(BLOCK, ROCK, tied=...), GLUE, test, progress=False)
    assert run.summary["modulus"] == pytest.approx(ROCK.youngs_modulus, rel=1e-8)
    assert run.summary["energy_error"] < 1e-9


def test_the_step_follows_from_the_highest_frequency_of_what_is_tied():
    """From all eigenvalues of stiffness and masses that are summed at each point, assembled here."""
    specimen = gl.Specimen(BLOCK, ROCK, tied=["between"])
    mesh, state = specimen.mesh, State(Model(specimen, GLUE))
    places, point = np.unique(np.round(mesh.nodes, 12), axis=0, return_inverse=True)
    assert len(places) == len(mesh.first_of_point)
    which = (2 * point.ravel()[:, None] + [0, 1]).ravel()
    carry = np.zeros((len(which), 2 * len(places)))
    carry[np.arange(len(which)), which] = 1
    none = np.zeros((2, 2, len(mesh.interfaces)))
    stiffness = carry.T @ stiffness_matrix(specimen, *none).toarray() @ carry
    mass = carry.T @ np.repeat(specimen.node_masses, 2)
    highest = math.sqrt(scipy.linalg.eigh(stiffness / np.sqrt(np.outer(mass, mass)), eigvals_only=True)[-1])
    assert StableStep(state).frequency == pytest.approx(highest, rel=2e-3)


def bar(columns, **how):
    cells = Bricks(rows=1, columns=columns).tessellate(rectangle(400 * mm, 400 * mm / columns))
    return gl.Specimen(cells, ROCK, **how)


def lowest_frequency(specimen):
    """1/s, of waves along a bar with free ends between smooth walls."""
    state = State(Model(specimen, GLUE))
    stiffness, mass = StableStep(state).stiffness(), state.grains.flat(state.freedoms.arrays.mass)
    along = np.arange(0, len(mass), 2)
    across = np.setdiff1d(np.arange(1, len(mass), 2), 2 * state.grains.of_nodes(rim_of(specimen)) + 1)
    free = np.sort(np.concatenate([along, across]))
    root = 1 / np.sqrt(mass[free])
    values = scipy.linalg.eigvalsh(stiffness.toarray()[np.ix_(free, free)] * np.outer(root, root))
    return math.sqrt(values[1])  # the first is a motion as a whole


def rim_of(specimen):
    return np.union1d(*(specimen.mesh.boundaries[name] for name in ("top", "bottom")))


def test_waves_in_tied_cells_have_the_speed_of_the_rock():
    """Standing P waves, of second order in the length of the cells; bonds make them slower on every mesh."""
    ratio = ROCK.poissons_ratio
    modulus = ROCK.youngs_modulus * (1 - ratio) / ((1 + ratio) * (1 - 2 * ratio))
    exact = math.pi * math.sqrt(modulus / ROCK.density) / 0.4
    errors = [abs(lowest_frequency(bar(columns, tied=...)) / exact - 1) for columns in (6, 12, 24)]
    assert errors[2] < 1e-3
    assert errors[0] / errors[1] == pytest.approx(4, rel=0.1)
    assert errors[1] / errors[2] == pytest.approx(4, rel=0.1)
    assert lowest_frequency(bar(24)) < 0.99 * exact


@pytest.mark.thorough
def test_bits_do_not_depend_on_threads_and_cracks_go_round_what_is_tied(tmp_path):
    """Cells of grains that cannot break: all cracks are between grains, and energy is balanced."""
    cells = Breakable(Voronoi(grains=25, seed=3), VoronoiCells(count=4), seed=3)
    specimen = gl.Specimen(cells.tessellate(rectangle(20 * mm, 40 * mm)), ROCK, tied=["inside"])
    test = UniaxialCompression(maximum_strain=6e-3, samples=60)
    runs = [
        gl.simulate(specimen, BRITTLE, test, threads=threads, checkpoint=tmp_path / str(threads), progress=False)
        for threads in (1, 2, 3)
    ]
    for name in runs[0].curves:
        for other in runs[1:]:
            assert np.array_equal(runs[0].curves[name], other.curves[name], equal_nan=True), name
    assert runs[0].curves["shear_cracks"][-1] + runs[0].curves["tensile_cracks"][-1] > 20
    assert runs[0].summary["energy_error"] < 1e-4
    of = gl.fragments(runs[0]).of_grain
    parent = specimen.grains.parent
    assert all(len(np.unique(of[parent == grain])) == 1 for grain in np.unique(parent))
    ends = runs[0].frames[-1].displacement[specimen.mesh.ties]
    assert np.array_equal(ends[:, :2], ends[:, 2:])


def test_a_tied_body_in_flight_keeps_momentum_spin_and_energy():
    specimen = small_sample(grains=12, tied=["between"])
    mesh, state = specimen.mesh, State(Model(specimen, GLUE))
    x, y = (mesh.nodes - np.average(mesh.nodes, axis=0, weights=specimen.node_masses)).T
    thrown = np.stack([2 - 300 * y, 1 + 300 * x]) + np.random.default_rng(1).normal(size=(2, len(x)))
    f, coasting = state.freedoms.arrays, compile_integrator(UNDAMPED)
    f.velocity[:] = state.grains.field(thrown, state.freedoms, mesh.nodes)
    state.time_step = 0.1 * StableStep(state).step(UNDAMPED)

    def motion():
        place = state.positions[mesh.first_of_point].T
        linear = (f.mass * f.velocity).sum(axis=1)
        return linear, float((f.mass[0] * (place[0] * f.velocity[1] - place[1] * f.velocity[0])).sum())

    advance(state, coasting, 1)
    energy = sum(v for k, v in energies(state).items() if k != "external")
    linear, angular = motion()
    advance(state, coasting, 20_000)
    after, spin = motion()
    assert np.abs(after - linear).max() < 1e-12 * f.mass.sum()
    assert spin == pytest.approx(angular, rel=1e-4)
    assert sum(v for k, v in energies(state).items() if k != "external") == pytest.approx(energy, rel=5e-3)
    assert state.rotation(0) > 0.05
    ends = state.positions[mesh.ties]
    assert np.array_equal(ends[:, :2], ends[:, 2:])


def test_a_result_keeps_what_is_tied_and_another_key(tmp_path):
    specimen = small_sample(grains=12, tied=[(0, 0)])
    test = UniaxialCompression(maximum_strain=1e-4, samples=10)
    run = gl.simulate(specimen, GLUE, test, progress=False)
    run.save(tmp_path / "run.npz")
    again = gl.Result.load(tmp_path / "run.npz").specimen
    assert again.tied == ((0, 0),)
    assert np.array_equal(again.mesh.ties, specimen.mesh.ties)
    keys = {described_run(Model(s, GLUE), test, {})["key"] for s in (specimen, small_sample(grains=12))}
    assert len(keys) == 2


@pytest.mark.thorough
def test_a_file_says_what_is_tied(tmp_path):
    given = ["--quick", "--grains", 20, "--set", "test.maximum_strain=0.0002", "--out", tmp_path / "out"]
    done = invoke("test", "uniaxial-compression", *given, "--set", 'sample.tied=["between"]')
    assert done.exit_code == 0, done.output
    assert 'tied = ["between"]' in (tmp_path / "out" / "config.toml").read_text()
    wrong = invoke("test", "uniaxial-compression", "--quick", "--set", 'sample.tied=["a/b/c"]')
    assert wrong.exit_code == 2
    assert "sample.tied: the key 'a/b/c' is not allowed" in wrong.output


@pytest.mark.parametrize(
    ("tied", "words"),
    [
        (["seam"], "Specimen: tied: 'seam' names what the grains do not have"),
        ([("quartz", "mica")], "Specimen: tied: .'quartz', 'mica'. names what the grains do not have"),
        ([3], "Specimen: tied: the key 3 is not allowed"),
    ],
)
def test_what_is_no_kind_of_edge_is_refused(tied, words):
    with pytest.raises(gl.ParameterError, match=words):
        gl.Specimen(BLOCK, ROCK, tied=tied)


def test_rigid_grains_are_not_tied():
    with pytest.raises(gl.ParameterError, match="tied is not allowed with rigid grains"):
        gl.Specimen(BLOCK, gl.Rigid(density=2700), tied=...)


def test_a_tip_that_is_tied_together_is_as_sharp_as_a_whole_one():
    """What contacts know of the angle of a corner: of 60 degrees, cut in two, that of both halves."""
    half = math.tan(math.radians(30))
    corners = np.array([[0, 0], [1, -half], [1, 0], [1, half]])
    region = gl.Region(corners[[0, 1, 3]], ("low", "back", "high"))
    halves = gl.Tessellation(region, corners, [0, 1, 2, 0, 2, 3], [0, 3, 6])
    state = State(Model(gl.Specimen(halves, ROCK, tied=...), GLUE, gl.Detection()))
    tip = np.flatnonzero(~state.mesh.nodes.any(axis=1))
    assert len(tip) == 2
    assert state.contacts._cotangent[tip] == pytest.approx(1 / math.tan(math.radians(60)), rel=1e-12)


def slotted(**how):
    """Bricks with a slit across the middle of their width."""
    cells = Bricks(rows=8, columns=8).tessellate(rectangle(20 * mm, 20 * mm))
    pairs = np.stack([cells.edges.start, cells.edges.end], axis=1)
    x, y = cells.vertices[pairs].transpose(2, 0, 1)
    on = (abs(y - 10 * mm) < 1e-9) & (abs(x - 10 * mm) < 5.1 * mm)
    return gl.Specimen(attrs.evolve(cells, joints={"slot": pairs[on.all(axis=1)]}), ROCK, tied=..., **how)


@pytest.mark.thorough
def test_a_slit_opens_freely_and_bears_when_its_faces_meet():
    stiff = Linear(kn=2e15, ks=1e15)

    def modulus(test, specimen):
        return gl.simulate(specimen, stiff, test, progress=False).summary["modulus"]

    pressed, pulled = UniaxialCompression(maximum_strain=1e-4), UniaxialTension(maximum_strain=1e-5)
    assert modulus(pressed, slotted(slits=["slot"])) == pytest.approx(ROCK.youngs_modulus, rel=0.02)
    assert modulus(pulled, slotted()) == pytest.approx(ROCK.youngs_modulus, rel=1e-6)
    assert modulus(pulled, slotted(slits=["slot"])) < 0.9 * ROCK.youngs_modulus


def test_a_slit_is_a_boundary_with_two_faces():
    mesh = slotted(slits="slot", refinement=1).mesh
    edges = mesh.nodes[mesh.boundary_edges["slot"]]
    along = edges[:, 1, 0] - edges[:, 0, 0]
    assert len(along) == 2 * 4 * 2
    assert along[along > 0].sum() == pytest.approx(10 * mm)  # the grain is on the left: that above the slit
    assert along.sum() == pytest.approx(0, abs=1e-15)
    assert not len(mesh.interfaces)


@pytest.mark.parametrize("slits", [["seam"], "seam", [3], ["slot", "slot"]])
def test_what_is_no_joint_is_no_slit(slits):
    with pytest.raises(gl.ParameterError, match=r"Specimen: slits = .*names of joints"):
        slotted(slits=slits)


def test_bricks_have_sizes_in_proportion():
    grains = Bricks(rows=[1, 3], columns=(2, 1, 1)).tessellate(rectangle(8, 4))
    assert grains.areas == pytest.approx([4, 2, 2, 12, 6, 6])
    assert np.array_equal(np.unique(grains.vertices[:, 0]), [0, 4, 6, 8])
    same = Bricks(rows=(0.5, 0.5), columns=3).tessellate(rectangle(0.3, 0.2))
    assert same.vertices == pytest.approx(Bricks(rows=2, columns=3).tessellate(rectangle(0.3, 0.2)).vertices)


@pytest.mark.parametrize("rows", [[], [1, 0], [1, -2], [1, "a"], 0, 1.5, [math.nan]])
def test_what_is_no_row_of_bricks_is_refused(rows):
    with pytest.raises(gl.ParameterError, match="Bricks: rows = "):
        Bricks(rows=rows)
