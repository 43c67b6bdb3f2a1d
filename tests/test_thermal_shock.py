"""A thermal shock: what is cooled is torn, from the temperature on at which a face has the strength of its contacts."""

import attrs
import numpy as np
import pytest
from support import small_sample

import grainlaw as gl
from grainlaw.geometry import Bricks, rectangle
from grainlaw.laws import MohrCoulomb
from grainlaw.materials import Thermal
from grainlaw.protocols import ThermalShock

E, NU, ALPHA = 60e9, 0.25, 8e-6
ROCK = Thermal(
    material=gl.Elastic(youngs_modulus=E, poissons_ratio=NU, density=2650), expansion=ALPHA, conductivity=3.0,
    heat_capacity=800.0,
)  # fmt: skip
STRENGTH = 10e6
WEAK = MohrCoulomb(kn=1e15, ks=1e15, tensile_strength=STRENGTH, cohesion=40e6, friction_angle=30)
#: of a face that comes to another temperature at once: E alpha dT / (1 - nu) in plane strain
BREAKS = STRENGTH * (1 - NU) / (E * ALPHA)


def strip():
    grains = Bricks(rows=10, columns=20).tessellate(rectangle(20e-3, 10e-3))
    return gl.Specimen(grains, ROCK, refinement=1)


def shocked(by, **options):
    test = ThermalShock(hot=20, bath=20 - by, duration=1.0, speedup=1e4, samples=50, boundaries=("bottom", "top"))
    return gl.simulate(strip(), WEAK, attrs.evolve(test, **options), threads=1, frames=2, progress=False)


@pytest.mark.thorough
def test_a_strip_is_torn_where_its_face_comes_to_the_strength():
    """No contact breaks at 0.9 of E alpha dT / (1 - nu) = strength; at 1.5, with zones of 0.25 mm, some do."""
    slow = shocked(0.9 * BREAKS, speedup=2.5e3).summary
    assert slow["shock_cracks"] == 0
    assert slow["shock_kinetic_ratio"] < 1e-3
    found = shocked(1.5 * BREAKS)
    assert found.summary["shock_cracks"] > 0
    assert found.summary["energy_error"] < 1e-6
    assert 0 < found.summary["first_crack_time"] < 1.0
    broken = found.cracks.position[:, 1]
    assert np.minimum(broken, 10e-3 - broken).min() < 1e-3  # of the first row
    assert found.curves["heat_supplied"] == pytest.approx(found.curves["heat_stored"], rel=1e-8, abs=1e-8)


@pytest.mark.thorough
def test_a_bath_cools_more_slowly_than_a_face_that_has_its_temperature():
    """A Biot number of a half: the face has far less than the whole stress."""
    assert shocked(1.5 * BREAKS, coefficient=0.5 * 3.0 / 10e-3).summary["shock_cracks"] == 0


@pytest.mark.thorough
def test_a_hot_specimen_is_warmed_without_a_crack_before_it_is_quenched():
    specimen = small_sample(30, material=ROCK, width=20e-3, height=20e-3)
    test = ThermalShock(hot=120, duration=2.0, speedup=2e4, samples=40)
    result = gl.simulate(specimen, WEAK, test, threads=1, frames=4, progress=False)
    warm = result.curves["stage"] == 0
    assert result.curves["temperature"][warm][-1] == 120
    assert (result.curves["tensile_cracks"] + result.curves["shear_cracks"])[warm][-1] == 0
    assert result.summary["shock_cracks"] > 10
    assert result.curves["coldest"][-1] == 20
    assert result.curves["hottest"][~warm][0] == pytest.approx(120, abs=0.1)  # zones of 4 mm


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: ThermalShock(hot=20, duration=1.0), "bath = 20 °C is not allowed"),
        (lambda: ThermalShock(hot=-300, duration=1.0), "hot = -300"),
        (lambda: ThermalShock(hot=60, duration=0), "duration = 0"),
        (lambda: ThermalShock(hot=60, duration=1, boundaries="top"), "a list of names of boundaries"),
        (lambda: ThermalShock(hot=60, duration=1, boundaries=("top", "top")), "each once"),
        (lambda: ThermalShock(hot=60, duration=1, boundaries=("rim",)).stages(strip()), "rim"),
        (
            lambda: gl.simulate(small_sample(4), WEAK, ThermalShock(hot=60, duration=1.0)),
            "no material of the specimen depends on the temperature",
        ),
    ],
)
def test_what_makes_no_shock_is_refused(make, words):
    with pytest.raises(gl.ParameterError, match=words):
        make()


def test_all_boundaries_are_cooled_unless_some_are_named():
    for named, cooled in [((), {"bottom", "left", "right", "top"}), (("left",), {"left"})]:
        shock = ThermalShock(hot=60, duration=1.0, boundaries=named).stages(strip())[-1]
        assert {load.boundary for load in shock.of(gl.loads.FixedTemperature)} == cooled


def test_the_summary_by_hand():
    """Three samples before the shock, four from it on; two contact points broke before."""
    test = ThermalShock(hot=60, duration=1.0)
    curves = {name: np.zeros(7) for name in ("energy_zones", "energy_contacts_normal", "energy_contacts_shear")}
    curves |= {
        "stage": np.array([0, 0, 0, 1, 1, 1, 1]), "tensile_cracks": np.array([0, 1, 2, 2, 2, 5, 6.0]),
        "shear_cracks": np.zeros(7), "heat_time": np.array([np.nan] * 3 + [0.1, 0.2, 0.3, 0.4]),
        "coldest": np.full(7, 20.0), "energy_kinetic": np.array([1, 1, 1, 1, 1, 1, 1e-3]),
        "vibration": np.array([9, 9, 9, 0.1, 0.5, 0, 1e-3]),
    }  # fmt: skip
    curves["energy_zones"] = np.array([4, 4, 4, 4, 4, 4, 1e-3])  # of the last nothing is stored
    assert test.summary(curves, None) == {"shock_cracks": 4, "first_crack_time": 0.3, "shock_kinetic_ratio": 0.1}
    none = {name: row[:3] for name, row in curves.items() if name != "coldest"}
    assert test.summary(none, None)["shock_cracks"] == 0
