"""Lengths, orientations and acoustic events of cracks made by hand."""

from types import SimpleNamespace

import numpy as np
import pytest

import grainlaw as gl
from grainlaw.engine.parts.breaks import Breaks
from grainlaw.geometry import Bricks, rectangle
from grainlaw.laws import Linear
from grainlaw.protocols import UniaxialTension
from grainlaw.results import acoustic
from grainlaw.results.acoustic import clustered
from grainlaw.results.result import Cracks


def cracks_of(count, **columns):
    """Cracks with the columns given, the others zero, 1 m long."""
    plain = {name: np.zeros(count) for name in ("orientation", "mode", "time", "opening", "slip", "spent")}
    plain |= {"position": np.zeros((count, 2)), "grains": np.zeros((count, 2), int), "length": np.ones(count)}
    return Cracks(**(plain | {name: np.array(values, float) for name, values in columns.items()}))


def test_lengths_by_mode_over_time():
    cracks = cracks_of(4, time=[1, 2, 2, 3], mode=[0, 0.49, 0.5, 1], length=[1, 2, 4, 8])
    tensile, shear = gl.crack_lengths(cracks, np.array([0.5, 1, 2.5, 3]))
    assert tensile.tolist() == [0, 1, 3, 3]
    assert shear.tolist() == [0, 0, 4, 12]
    assert str(cracks_of(3, mode=[0, 0.6, 1])) == "Cracks(cracks: 3, tensile: 1, shear: 2)"


def test_rose_is_weighted_by_length():
    cracks = cracks_of(4, orientation=np.radians([5, 95, 99, 175]), length=[1, 2, 4, 8], mode=[0, 0, 1, 0])
    rose = gl.crack_rose(cracks)
    assert rose.edges == pytest.approx(np.radians(np.arange(0, 181, 10)))
    assert np.flatnonzero(rose.tensile).tolist() == [0, 9, 17]
    assert rose.tensile[[0, 9, 17]].tolist() == [1, 2, 8]
    assert rose.shear.tolist() == [0] * 9 + [4] + [0] * 8
    assert gl.crack_rose(cracks, bins=2).tensile.tolist() == [1, 10]
    with pytest.raises(gl.ParameterError, match="bins = 0 is not allowed"):
        gl.crack_rose(cracks, bins=0)


def test_failure_plane_is_a_mean_of_axes():
    plane = gl.failure_plane(cracks_of(2, orientation=np.radians([10, 178])))  # 10 and -2
    assert np.degrees(plane.angle) == pytest.approx(4)
    assert plane.strength == pytest.approx(np.cos(np.radians(12)))
    crossed = gl.failure_plane(cracks_of(2, orientation=np.radians([60, 150]), length=[3, 1]))
    assert np.degrees(crossed.angle) == pytest.approx(60)
    assert crossed.strength == pytest.approx(0.5)  # (3 - 1) / 4
    assert gl.failure_plane(cracks_of(2, orientation=np.radians([30, 120]))).strength == pytest.approx(0)
    none = gl.failure_plane(cracks_of(0))
    assert np.isnan([none.angle, none.strength]).all()


#: a chain a, b, c; d where a was, but later; e at the time of a, but far
BREAKS = {
    "position": [(0, 0), (50e-3, 0), (1e-3, 0), (2e-3, 0), (0, 0)], "time": [0, 0, 0.5e-6, 1e-6, 10e-6],
    "spent": [10, 100, 20, 10, 5], "length": [1e-3, 2e-3, 1e-3, 1e-3, 1e-3], "mode": [0, 1, 1, 0, 0],
}  # fmt: skip


def test_what_springs_still_hold_is_not_spent_on_a_break():
    """By hand: 6 of 20 and 8 of 30 J/m2 in springs of 1 and 2 Pa/m; of the third point more than was done on it."""
    breaks = Breaks(4, passage=0.0)
    bonds = SimpleNamespace(
        stiffness=np.array([[1.0] * 4, [2.0] * 4]), work=np.array([[15, 20, 1, 99], [5, 10, 1, 99]])
    )
    traction = np.array([[2, 0, 3, 0], [4, np.sqrt(32), 0, 0]])  # 2 + 4, 8, 4.5 J/m2
    broken = np.array([True, True, True, False])
    breaks.note(broken, bonds, 0.5, np.array([0.1, 0.2, 0.3, 0.4]), traction)
    assert breaks.books.work == pytest.approx([14, 22, 0, np.nan], nan_ok=True)
    assert breaks.books.time == pytest.approx([0.5, 0.5, 0.5, np.nan], nan_ok=True)
    assert breaks.books.mode == pytest.approx([0.1, 0.2, 0.3, np.nan], nan_ok=True)


def test_breaks_near_in_space_and_time_are_one_event():
    events = clustered(cracks_of(5, **BREAKS), distance=1.5e-3, duration=0.6e-6, thickness=2.0)
    assert events.time.tolist() == [0, 0, 10e-6]
    assert events.breaks.tolist() == [3, 1, 1]
    assert events.energy == pytest.approx([80e-3, 400e-3, 10e-3])
    assert events.tensile == pytest.approx([0.5, 0, 1])
    assert events.position == pytest.approx(np.array([(1e-3, 0), (50e-3, 0), (0, 0)]))
    assert clustered(cracks_of(5, **BREAKS), 0.9e-3, 1e-6).breaks.tolist() == [1, 1, 1, 1, 1]
    assert clustered(cracks_of(5, **BREAKS), 1.5e-3, 0.4e-6).breaks.tolist() == [1, 1, 1, 1, 1]
    assert clustered(cracks_of(5, **BREAKS), 1.5e-3, 9.6e-6).breaks.tolist() == [4, 1]
    assert 0.4 - 0.1 > 0.3  # but by rounding alone
    assert clustered(cracks_of(2, time=[0.1, 0.4]), 1.0, 0.3).breaks.tolist() == [2]
    assert len(clustered(cracks_of(0), 1, 1)) == 0
    silent = clustered(cracks_of(2, position=[(0, 0), (2e-3, 0)]), 3e-3, 0)
    assert silent.position == pytest.approx(np.array([(1e-3, 0)]))


def test_events_reach_as_far_as_a_shear_wave_goes_unless_told(monkeypatch):
    """Bricks of 2 x 8 mm: twice the root of their area is 8 mm, which a wave of sqrt(G/rho) passes in 2.86 us."""
    asked = []
    monkeypatch.setattr(acoustic, "clustered", lambda *given: asked.append(given))
    rock = gl.Elastic(youngs_modulus=50e9, poissons_ratio=0.25, density=2560)  # 2795 m/s
    grains = Bricks(rows=1, columns=2).tessellate(rectangle(4e-3, 8e-3))
    made = gl.simulate(
        gl.Specimen(grains, rock), Linear(kn=1e13, ks=1e13), UniaxialTension(maximum_strain=1e-7, samples=10),
        frames=1, progress=False,
    )  # fmt: skip
    gl.acoustic_events(made)
    gl.acoustic_events(made, distance=1e-3, duration=1e-6, thickness=2.0)
    (cracks, distance, duration, thickness, *_), other = asked
    assert (len(cracks), thickness, other[1:4]) == (0, 1.0, (1e-3, 1e-6, 2.0))
    assert distance == pytest.approx(8e-3)
    assert duration == pytest.approx(8e-3 / np.sqrt(20e9 / 2560))
    assert other[6] == asked[0][6] == duration  # waves need as long to leave a break, whatever is asked


def events_of(magnitudes):
    """Each of one break by itself."""
    energy = 10 ** (4.8 + 1.5 * np.array(magnitudes, float))
    return clustered(cracks_of(len(energy), time=np.arange(len(energy)), spent=energy), 0.0, 0.0)


def test_magnitude_and_b_value():
    assert events_of([0, -3]).energy == pytest.approx([10**4.8, 10**0.3])
    events = events_of(np.linspace(-4, -3, 11))
    assert events.magnitude == pytest.approx(np.linspace(-4, -3, 11))
    b, error = events.b_value()
    assert b == pytest.approx(0.4342944819 / 0.5)  # the mean lies 0.5 above the least
    assert error == pytest.approx(b / np.sqrt(11))
    assert events.b_value(completeness=-3.95)[0] == pytest.approx(0.4342944819 / 0.5)  # ten from -3.9, mean -3.45
    assert np.isnan(events.b_value(completeness=-3.85)).all()  # nine
    assert np.isnan(events_of([-3] * 20).b_value()).all()
    assert np.isnan(events_of([]).b_value()).all()
    silent = clustered(cracks_of(1), 0.0, 0.0)
    assert np.isnan(silent.magnitude).all()
