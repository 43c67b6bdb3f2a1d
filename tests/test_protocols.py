"""Every protocol on elastic specimens: the analytic answer, and forces in balance."""

import attrs
import numpy as np
import pytest
from support import ROCK, STIFF, STRONG, small_sample

import grainlaw as gl
from grainlaw import protocols
from grainlaw.geometry import Bricks, rectangle
from grainlaw.laws import BandisClosure, CohesiveCrack, Linear, MohrCoulomb
from grainlaw.protocols import (
    BiaxialCompression,
    Brazilian,
    Creep,
    Cyclic,
    DirectShear,
    Excavation,
    FreeMotion,
    Heating,
    HydraulicFracturing,
    JointTension,
    Moving,
    PlaneWave,
    Platens,
    Saturated,
    SemiCircularBend,
    SplitHopkinson,
    ThermalShock,
    ThreePointBending,
    UniaxialCompression,
    UniaxialTension,
)

COMPRESSION = UniaxialCompression(maximum_strain=2e-4, samples=50, loading=gl.Constant(speed=0.02))
TENSION = UniaxialTension(maximum_strain=2e-4, samples=50, loading=gl.Constant(speed=0.02))
BIAXIAL = BiaxialCompression(confinement=5e6, maximum_strain=2e-4, samples=50, loading=gl.Constant(speed=0.02))
PROTOCOLS = [COMPRESSION, TENSION, BIAXIAL]
#: These have no modulus: test_joint.py compares the first two with the law itself, test_examples_contacts.py FreeMotion
#: with bodies that fall and slide, test_creep.py Creep, test_temperature.py Heating, test_waves.py PlaneWave,
#: test_split_hopkinson.py SplitHopkinson,
#: test_excavation.py Excavation, test_fluids.py Saturated, test_injection.py HydraulicFracturing,
#: test_thermal_shock.py ThermalShock,
#: test_laboratory_tests.py has the others.
OTHERS = {
    DirectShear, JointTension, FreeMotion, Brazilian, Creep, Cyclic, Excavation, Heating, HydraulicFracturing,
    PlaneWave, Saturated, SemiCircularBend, SplitHopkinson, ThermalShock, ThreePointBending,
}  # fmt: skip


def test_list_holds_every_exported_protocol():
    exported = {c for name in protocols.__all__ if isinstance(c := getattr(protocols, name), type)}
    assert {c for c in exported if issubclass(c, gl.LoadingProtocol)} == {type(p) for p in PROTOCOLS} | OTHERS


def one_block(width=10e-3, height=20e-3, material=ROCK, refinement=0):
    grain = Bricks(rows=1, columns=1).tessellate(rectangle(width, height))
    return gl.Specimen(grain, material, refinement=refinement)


@pytest.mark.thorough
@pytest.mark.parametrize("moving", Moving)
@pytest.mark.parametrize("ramp", [0.0, 2e-5])
@pytest.mark.parametrize("protocol", PROTOCOLS, ids=lambda p: type(p).__name__)
def test_a_block_has_its_modulus(protocol, ramp, moving):
    result = gl.simulate(
        one_block(), Linear(**STIFF), attrs.evolve(protocol, moving=moving, loading=gl.Constant(speed=0.02, ramp=ramp))
    )
    found = result.summary
    assert found["apparent_modulus"] == pytest.approx(60e9 / (1 - 0.25**2), rel=4e-3)
    assert found["apparent_poisson"] == pytest.approx(0.25 / 0.75, abs=2e-3)
    assert found["modulus"] == pytest.approx(60e9, rel=4e-3)
    assert found["poisson"] == pytest.approx(0.25, abs=2e-3)
    assert found["imbalance"] < 0.02
    assert found["energy_error"] < 0.005
    curves = result.curves
    assert curves["stress_window"][-1] == pytest.approx(curves["stress"][-1], rel=0.03)  # its mean lags half a sample
    assert curves["strain_points"][-1] == pytest.approx(curves["strain"][-1], rel=0.03)
    assert np.all(curves["stress"][1:] > 0)


def test_plane_stress_needs_no_conversion():
    rock = gl.Elastic(youngs_modulus=60e9, poissons_ratio=0.25, density=3100, plane=gl.Plane.STRESS)
    found = gl.simulate(one_block(material=rock), Linear(**STIFF), COMPRESSION).summary
    assert found["modulus"] == found["apparent_modulus"] == pytest.approx(60e9, rel=2e-3)
    assert found["poisson"] == found["apparent_poisson"] == pytest.approx(0.25, abs=2e-3)


def test_rough_platens_confine_a_flat_block():
    """A block much wider than high between rough platens: the modulus of confined compression."""
    test = attrs.evolve(COMPRESSION, platens=Platens.ROUGH, loading=gl.Constant(speed=0.02, ramp=1e-5))
    specimen = one_block(width=100e-3, height=2e-3, refinement=3)
    found = gl.simulate(specimen, Linear(**STIFF), test).curves
    confined = 60e9 * 0.75 / (1.25 * 0.5)
    assert found["stress_window"][-1] / found["strain_points"][-1] == pytest.approx(confined, rel=0.01)


@pytest.mark.thorough
@pytest.mark.parametrize("grains", [1, 7, 40])
@pytest.mark.parametrize("protocol", PROTOCOLS, ids=lambda p: type(p).__name__)
def test_voronoi_samples_balance(grains, protocol):
    found = gl.simulate(small_sample(grains), Linear(**STIFF), protocol).summary
    assert found["imbalance"] < 0.02
    assert found["energy_error"] < 0.005
    assert found["kinetic_ratio"] < 0.02


@pytest.mark.thorough
def test_tension_breaks_at_the_strength_of_the_weakest_section():
    """Bricks in a row: every joint carries the same stress, so the specimen has the joints' strength."""
    specimen = gl.Specimen(Bricks(rows=4, columns=1).tessellate(rectangle(5e-3, 20e-3)), ROCK)
    law = MohrCoulomb(**STRONG)
    result = gl.simulate(specimen, law, UniaxialTension(maximum_strain=1e-3, loading=gl.Constant(speed=0.01)))
    assert result.summary["strength"] == pytest.approx(13e6, rel=0.01)
    assert len(result.cracks) >= 2
    assert result.cracks.tensile.all()
    assert np.sin(result.cracks.orientation) == pytest.approx(0, abs=0.01)
    assert np.all(np.diff(result.cracks.time) >= 0)
    assert result.curves["stress"][-1] <= 0.1 * 13e6


@pytest.mark.thorough
def test_stops_at_the_fraction_of_the_peak_or_at_the_strain():
    law = MohrCoulomb(**STRONG)
    drop = gl.simulate(small_sample(40), law, UniaxialCompression(stop_fraction=0.7, samples=400))
    assert drop.curves["stress"][-1] <= 0.7 * drop.summary["largest_stress"]
    assert np.all(drop.curves["stress"][:-1] > 0.7 * np.maximum.accumulate(drop.curves["stress"])[:-1])
    limit = gl.simulate(small_sample(40), Linear(**STIFF), COMPRESSION)
    assert limit.curves["strain_points"][-1] == pytest.approx(2e-4, rel=0.03)


@pytest.mark.thorough
def test_the_step_follows_a_closure_that_stiffens():
    """Bandis: at a tenth of the maximum closure left, the joint is a hundred times stiffer; the run stays stable."""
    cohesive = {"mode_i_energy": 150, "mode_ii_energy": 300}
    law = CohesiveCrack(**STRONG | {"kn": 1e13, "ks": 1e13}, **cohesive, closure=BandisClosure(maximum_closure=1e-6))
    specimen = gl.Specimen(Bricks(rows=4, columns=1).tessellate(rectangle(5e-3, 20e-3)), ROCK)
    result = gl.simulate(
        specimen, law, UniaxialCompression(maximum_strain=1.5e-3, samples=200, loading=gl.Constant(speed=0.02))
    )
    assert result.summary["energy_error"] < 0.005
    stress = result.curves["stress"][-1]
    closure = 1e-6 * stress / (1e13 * 1e-6 + stress)
    expected = stress * (1 - 0.25**2) / 60e9 + 3 * closure / 20e-3  # blocks and three joints in series
    assert result.curves["strain"][-1] == pytest.approx(expected, rel=0.01)
    linear = gl.simulate(specimen, Linear(kn=1e13, ks=1e13), COMPRESSION).summary["time_step"]
    assert result.summary["time_step"] < linear


@pytest.mark.thorough
def test_loading_slower_changes_little():
    """Halving the speed moves the stress at a strain by less than the certificate promises."""
    fast, slow = (
        gl.simulate(
            small_sample(40),
            Linear(**STIFF),
            UniaxialCompression(maximum_strain=5e-4, samples=50, loading=gl.Constant(speed=v)),
        )
        for v in (0.05, 0.025)
    )
    at = 4e-4
    stresses = [np.interp(at, r.curves["strain"], r.curves["stress"]) for r in (fast, slow)]
    assert stresses[0] == pytest.approx(stresses[1], rel=5e-3)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"maximum_strain": 0.0}, "maximum_strain = 0"),
        ({"stop_fraction": 1.5}, "stop_fraction = 1.5"),
    ],
)
def test_bad_values_are_refused(change, words):
    with pytest.raises(gl.ParameterError, match=words):
        UniaxialCompression(**change)
