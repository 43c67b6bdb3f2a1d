"""Membranes on the present rim: closed lines, no resultant on a piece that is loose, work in the ledger."""

import numpy as np
import pytest
from support import ROCK, STIFF, STRONG, advance, impose, small_sample, state_of
from test_restart import same

import grainlaw as gl
from grainlaw.engine.parts.pressures import membrane
from grainlaw.geometry import Bricks, rectangle
from grainlaw.laws import CohesiveCrack, Linear
from grainlaw.protocols import BiaxialCompression
from grainlaw.units import MPa, mm

PRESSURE = 10 * MPa
SIDE = 10 * mm
COHESIVE = CohesiveCrack(**STRONG, mode_i_energy=150, mode_ii_energy=300)
ENDS = [gl.loads.Drive(boundary=name, axis=1, speed=0.0) for name in ("top", "bottom")]
SIDES = [gl.loads.Pressure(boundary=side, pressure=PRESSURE) for side in ("left", "right")]


def squares(columns, rows):
    """Corners (i, 2) of unit squares side by side, each with four of its own, and their grains."""
    corner = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], dtype=float)
    grid = np.array([(i, j) for j in range(rows) for i in range(columns)], dtype=float)
    return (grid[:, None] + corner).reshape(-1, 2), np.repeat(np.arange(len(grid)), 4)


def area(place, line):
    """m2 that closed lines (n, 2) enclose, with the inside on their left."""
    (x, y), (u, v) = place[line[:, 0]].T, place[line[:, 1]].T
    return float(np.sum(x * v - u * y)) / 2


def line_round(place, grain, gap, platens=None):
    return membrane(place, grain, np.zeros((len(place), 1), dtype=bool) if platens is None else platens, gap)


def test_a_membrane_lies_round_the_grains_and_spans_narrow_gaps():
    place, grain = squares(4, 3)
    assert area(place, line_round(place, grain, 0.9)) == pytest.approx(12)
    slit = place + np.where(grain[:, None] % 4 >= 2, (0.5, 0.0), (0.0, 0.0))
    assert area(slit, line_round(slit, grain, 0.9)) == pytest.approx(12 + 3 * 0.5)


def test_a_membrane_enters_a_notch_that_is_wide_enough():
    place, grain = squares(5, 3)
    notch = ~np.isin(grain, [11, 12, 13])  # three of the upper row
    place, grain = place[notch], grain[notch]
    assert area(place, line_round(place, grain, 0.9)) == pytest.approx(12)
    assert area(place, line_round(place, grain, 3.1)) == pytest.approx(15)


def test_a_membrane_goes_round_a_piece_that_has_flown_away():
    place, grain = squares(3, 3)
    place = place + np.where(grain[:, None] == 5, (4.0, 1.0), (0.0, 0.0))
    line = line_round(place, grain, 0.9)
    loose = grain[line[:, 0]] == 5
    assert area(place, line[loose]) == pytest.approx(1)
    assert area(place, line[~loose]) == pytest.approx(8)
    assert np.array_equal(np.sort(line[:, 0]), np.sort(line[:, 1]))  # closed


def test_a_membrane_ends_at_platens_and_does_not_enter_between_them():
    """Two columns whose gap is open at both platens only."""
    place, grain = squares(4, 3)
    place = place + np.where(grain[:, None] % 4 >= 2, (3.0, 0.0), (0.0, 0.0))
    ends = np.stack([place[:, 1] == 0, place[:, 1] == 3], axis=1)
    line = line_round(place, grain, 0.9, ends)
    vector = place[line[:, 1]] - place[line[:, 0]]
    assert np.all(vector[:, 0] == 0)
    assert np.abs(vector[:, 1]).sum() == 6


def confined(displacement):
    """A sheet of 5 x 5 square grains between platens, under pressure; its forces (i, 2) N after a displacement."""
    sheet = Bricks(rows=5, columns=5).tessellate(rectangle(5 * SIDE, 5 * SIDE))
    state = state_of(gl.Specimen(sheet, ROCK), Linear(**STIFF))
    impose(state, [*ENDS, *SIDES])
    place, grain = state.mesh.nodes, state.mesh.node_grain
    moved = displacement(place, grain)
    state.nodes.arrays.displacement[:] = moved.T
    forces = []
    for pressures in (SIDES, []):
        impose(state, [*ENDS, *pressures])
        state.let_membranes_follow()
        advance(state)
        forces.append(state.nodes.arrays.force.T.copy())
    return place + moved, grain, forces[0] - forces[1]


def resultant(force, chosen):
    return np.abs(force[chosen].sum(axis=0)).max() / (PRESSURE * SIDE)


def test_a_side_whose_grains_have_turned_has_no_resultant():
    """The grains of the left side turn by 30 degrees: their edges alone would push the sheet to the left."""

    def turn(place, grain):
        centre = (np.stack([grain % 5, grain // 5], axis=1) + 0.5) * SIDE
        angle = np.radians(np.where(grain % 5 == 0, 30, 0))[:, None]
        x, y = (place - centre).T[:, :, None]
        return (
            np.hstack([np.cos(angle) * x - np.sin(angle) * y, np.sin(angle) * x + np.cos(angle) * y]) + centre - place
        )

    _, _, force = confined(turn)
    assert resultant(force, slice(None)) < 1e-9
    assert np.abs(force).max() > 0.1 * PRESSURE * SIDE


def test_a_piece_that_has_flown_away_feels_no_pressure_and_uncovers_the_grain_behind_it():
    gone = 14  # in the middle of the right side
    _, grain, force = confined(lambda place, grain: np.where(grain[:, None] == gone, (4 * SIDE, 0.0), (0.0, 0.0)))
    assert resultant(force, grain == gone) < 1e-9
    assert force[grain == gone - 1, 0].sum() == pytest.approx(-PRESSURE * SIDE, rel=1e-3)
    assert resultant(force, grain != gone) < 1e-9


def test_pieces_that_fly_to_both_sides_uncover_the_grains_behind_them():
    """Each as far as the sheet is wide: the other way they would lie in each other's places, and cover them."""
    fly = lambda place, grain: np.stack([4 * SIDE * ((grain == 14).astype(float) - (grain == 10)), 0 * grain], axis=1)  # noqa: E731
    _, grain, force = confined(fly)
    assert force[grain == 13, 0].sum() == pytest.approx(-PRESSURE * SIDE, rel=1e-3)
    assert force[grain == 11, 0].sum() == pytest.approx(PRESSURE * SIDE, rel=1e-3)


def test_where_the_rim_is_whole_pressure_acts_on_its_edges():
    _, grain, force = confined(lambda place, grain: 1e-3 * place)
    assert force[grain % 5 == 4, 0].sum() == pytest.approx(-PRESSURE * 5 * SIDE * 1.001, rel=1e-12)
    assert np.abs(force[(grain % 5 > 0) & (grain % 5 < 4)]).max() == 0


@pytest.fixture(scope="module")
def crushed():
    """A sample crushed under a membrane, with 1, 2 and 3 threads; whether each membrane was laid anew."""
    test = BiaxialCompression(
        confinement=5 * MPa, maximum_strain=0.03, stop_fraction=0, samples=150, loading=gl.Constant(speed=0.5),
        integrator=gl.integration.CentralDifference(damping=gl.integration.LocalDamping(), beside_loading=False),
    )  # fmt: skip
    return [gl.simulate(small_sample(), COHESIVE, test, threads=threads) for threads in (1, 2, 3)]


@pytest.mark.alone
def test_a_crushed_sample_closes_its_ledger_with_the_same_bits(crushed):
    for other in crushed[1:]:
        same(crushed[0], other)
    assert crushed[0].summary["energy_error"] < 1e-5
