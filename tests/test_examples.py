"""The examples of the documents run, on a small sample, and their numbers are those of theory."""

import json
import sys

import numpy as np
import pytest
from support import ROCK, static_solution

import grainlaw as gl
from grainlaw.cli.table1 import LAWS
from grainlaw.engine.stability import stiffness_matrix
from grainlaw.geometry import Bricks, Voronoi, rectangle
from grainlaw.laws import CamachoOrtiz, MohrCoulomb, PrePeak
from grainlaw.protocols import DirectShear, UniaxialTension
from grainlaw.units import mm


def test_compare_laws(example, tmp_path, monkeypatch, capsys):
    study = example("compare_laws")
    monkeypatch.setattr(sys, "argv", ["compare_laws.py", "--quick", "--out", str(tmp_path / "new")])
    study.study(study.LAWS, "laws")
    (numbers,) = json.loads((tmp_path / "new" / "laws.json").read_text("utf-8"))
    assert (tmp_path / "new" / "laws.png").stat().st_size > 10_000
    lines = capsys.readouterr().out.splitlines()
    assert [line.split(" | ")[0].strip("| ") for line in lines[2:]] == list(study.LAWS)

    # The modulus is that of a sparse solve of the same grains and springs, without the time loop.
    rock = gl.Specimen(Voronoi(grains=120, seed=1).tessellate(rectangle(20 * mm, 50 * mm)), ROCK)
    kn, ks = study.LAWS["linear"].stiffness
    u, _ = static_solution(rock, kn, ks, 1e-4)
    springs = np.ones((2, len(rock.mesh.interfaces)))
    force = (stiffness_matrix(rock, kn * springs, ks * springs) @ u.ravel()).reshape(-1, 2)
    modulus = -force[rock.mesh.boundaries["top"], 1].sum() / (20 * mm) / 1e-4
    assert numbers["linear"]["apparent_modulus"] == pytest.approx(modulus, rel=2e-3)
    assert numbers["linear"]["lost_opening"] == numbers["linear"]["lost_slip"] == 0


def test_the_study_is_of_the_laws_of_the_command_line(example):
    for name, law in example("compare_laws").LAWS.items():
        if "54" not in name:
            assert law == LAWS[name.lower().replace(" ", "-")]


def test_variants_are_what_their_names_say(example):
    variants = example("take_apart").VARIANTS
    assert len(variants) == 9
    for name, law in variants.items():
        shape, energy, angles = name.split(", ")
        assert law.pre_peak == PrePeak[shape.upper()]
        assert (law.mode_i_energy, law.mode_ii_energy) == pytest.approx({"G": (150, 300), "G/10": (15, 30)}[energy])
        expected = {"54 deg": (54, 5), "0 deg": (0, 0), "54 then 0 deg": (54, 0)}[angles]
        assert (law.friction_angle, law.residual_friction_angle) == expected


KEPT = {"kn": 1.05e14, "ks": 9.45e13, "tensile_strength": 13e6, "cohesion": 29e6}
SOFT = CamachoOrtiz(**KEPT, residual_friction_angle=30, mode_i_energy=150, mode_ii_energy=300)
BRITTLE = MohrCoulomb(**KEPT, friction_angle=54, residual_friction_angle=20)


@pytest.fixture
def joint():
    """Two flat blocks."""
    return gl.Specimen(Bricks(rows=2, columns=1).tessellate(rectangle(20 * mm, 4 * mm)), ROCK)


@pytest.mark.parametrize("stop", [0.5, 0.0])
def test_dissipation_of_a_joint_that_opens(example, joint, stop):
    watcher = example("dissipation").Dissipation()
    test = UniaxialTension(maximum_strain=1e-2, stop_fraction=stop)
    gl.simulate(joint, SOFT, test, observers=[watcher], frames=1)
    opening, slip = watcher.lost(*SOFT.stiffness)
    # Broken, the whole triangle; half way down, the triangle between the two ways to the origin.
    peak, last = SOFT.peak_opening, SOFT.breaking_opening
    expected = 13e6 * (last if stop == 0 else (peak + last) / 2 - peak / 2) / 2
    assert opening / (20 * mm) == pytest.approx(expected, rel=0.01)
    assert slip == pytest.approx(0, abs=1e-6 * opening)


def slid(watcher, joint, law, way, speed=0.01):
    """Slip (m) and what is lost in it (J/m2), sheared under 10 MPa."""
    test = DirectShear(normal_stress=10e6, maximum_slip=way, loading=gl.Constant(speed=speed))
    gl.simulate(joint, law, test, observers=[watcher], frames=1)
    opening, slip = watcher.lost(*law.stiffness)
    assert opening == pytest.approx(0, abs=1e-3 * slip)
    return abs(watcher.state.slip.mean()), slip / (20 * mm)


def test_dissipation_of_a_brittle_joint_that_slides(example, joint):
    """Mean of four speeds: in which phase it breaks decides how far the blocks ring, up to 2 % of friction more."""
    watcher = example("dissipation").Dissipation
    slip, lost = np.mean(
        [slid(watcher(), joint, BRITTLE, 40e-6, speed) for speed in (0.0025, 0.01, 0.025, 0.05)], axis=0
    )
    # Charged to its strength, then friction over the rest of the way, whose spring is still charged.
    strength, friction = 29e6 + 10e6 * np.tan(np.radians(54)), 10e6 * np.tan(np.radians(20))
    spring = friction**2 / (2 * BRITTLE.ks)
    assert lost == pytest.approx(
        strength**2 / (2 * BRITTLE.ks) + friction * (slip - strength / BRITTLE.ks) - spring, rel=0.01
    )


def test_dissipation_of_a_joint_that_softens_as_it_slides(example, joint):
    slip, lost = slid(example("dissipation").Dissipation(), joint, SOFT, 12e-6)
    peak, last = SOFT.peak_slip, SOFT.breaking_slip
    damage = (slip - peak) / (last - peak)
    assert 0.2 < damage < 0.8
    # The triangle between the two ways to the origin, and friction that has grown with the damage.
    friction = damage * 10e6 * np.tan(np.radians(30))
    expected = 29e6 * (slip - (1 - damage) * peak) / 2 + friction * (slip - peak) / 2 - friction**2 / (2 * SOFT.ks)
    assert lost == pytest.approx(expected, rel=0.01)
