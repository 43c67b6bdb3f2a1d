"""The examples of the documents run, on a small sample, and their numbers are those of theory."""

import sys

import attrs
import numpy as np
import pytest
from support import ROCK, static_solution

import grainlaw as gl
from grainlaw.cli.default_rock import LAWS
from grainlaw.engine.stability import stiffness_matrix
from grainlaw.geometry import Voronoi, rectangle
from grainlaw.laws import PrePeak
from grainlaw.units import mm


@pytest.mark.thorough
def test_compare_laws(example, tmp_path, monkeypatch, capsys):
    study, folder = example("compare_laws"), tmp_path / "new"
    monkeypatch.setattr(sys, "argv", ["compare_laws.py", "--quick", "--out", str(folder)])
    study.main(study.LAWS, "laws")
    for name in ("curves", "cracks"):
        assert (folder / f"{name}.png").stat().st_size > 10_000
    said = capsys.readouterr().out
    assert all(heading in said for heading in ("strength (MPa)", "lost opening (J/m)", "lost slip (J/m)"))
    table = study.study(study.LAWS, quick=True).table(folder)
    assert list(table["law"]) == list(study.LAWS)

    # The modulus is that of a sparse solve of the same grains and springs, without the time loop.
    rock = gl.Specimen(Voronoi(grains=120, seed=1).tessellate(rectangle(20 * mm, 50 * mm)), ROCK)
    kn, ks = study.LAWS["linear"].stiffness
    u, _ = static_solution(rock, kn, ks, 1e-4)
    springs = np.ones((2, len(rock.mesh.interfaces)))
    force = (stiffness_matrix(rock, kn * springs, ks * springs) @ u.ravel()).reshape(-1, 2)
    modulus = -force[rock.mesh.boundaries["top"], 1].sum() / (20 * mm) / 1e-4
    assert table["apparent_modulus"][0] == pytest.approx(modulus, rel=2e-3)
    lost = table["lost_opening"] + table["lost_slip"]
    assert lost[0] == pytest.approx(0, abs=1e-9 * lost[1])  # rounding of the energy that the springs hold


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


def test_texture_study(example, tmp_path):
    """Cases are what their names say; a table goes between its marks."""
    study = example("texture_study")
    for law, bond in study.LAWS.items():
        runs = {texture: study.case(law, texture, 1, "tension", 20) for texture in study.TEXTURES}
        assert runs["even"].law == {...: bond}
        assert runs["minerals"].law["mica", ...].tensile_strength == 6.5e6
        assert runs["breakable"].law["inside"].cohesion == 58e6
        together = runs["all together"]
        assert len(together.law["mica", ...].tensile_strength) > 1
        assert together.specimen.grains.is_breakable
        assert together.specimen.material_of(2).youngs_modulus == 30e9
        assert np.std(together.specimen.grains.areas) > np.std(runs["breakable"].specimen.grains.areas)
    assert study.times(study.LAWS["cohesive-crack"], 2).mode_ii_energy == 60
    page = tmp_path / "page.md"
    page.write_text("a\n<!-- x -->\nold\n<!-- end of x -->\nb\n")
    study.write("x", "new\n", page)
    assert page.read_text() == "a\n<!-- x -->\nnew\n<!-- end of x -->\nb\n"


@pytest.mark.thorough
def test_heated_granite(example):
    """A granite that is heated a little: its minerals press each other, and the sample still bears what it bore."""
    granite = example("heated_granite")
    run = granite.case("brittle", 40, 1, 12)
    heating = attrs.evolve(run.protocol, test=None, loading=gl.HeatingRate(rate=1e5), samples=10)
    result = gl.simulate(run.specimen, run.law, heating, threads=1, frames=2)
    hot = result.curves["temperature"] == 40
    free = [one.expansion.strain(40) * (1 + one.material.poissons_ratio) for one in granite.ROCK.values()]
    assert min(free) < result.curves["expansion_x"][hot][0] < max(free)
    assert result.summary["energy_error"] < 1e-6
