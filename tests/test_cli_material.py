"""Materials on the command line, in configurations, and in what a run leaves."""

import importlib
import json
import tomllib

import numpy as np
import pytest
import pyvista
from command_line import SMALL, invoke
from every_material import MOHR
from support import ROCK, STIFF, small_sample, state_of

import grainlaw as gl
from grainlaw.cli.configuration import configured
from grainlaw.cli.sections import read_file
from grainlaw.laws import Linear
from grainlaw.materials import ALBITE, QUARTZ, ConstantExpansion, MohrCoulombPlastic, Thermal, TransverselyIsotropic
from grainlaw.protocols import Heating
from grainlaw.results.frames import packed, take_frame, unpacked
from grainlaw.results.vtk import VtkSeries, VtkWriter
from grainlaw.workbench import material_figure
from grainlaw.workbench.conformance import Entry, Report

SCHIST = """
[sample]
minerals = {quartz = 0.7, mica = 0.3}
[rock]
type = "transversely-isotropic"
youngs_modulus = "60 GPa"
youngs_modulus_across = "30 GPa"
poissons_ratio = 0.2
poissons_ratio_across = 0.15
shear_modulus_across = "14 GPa"
density = 2750
[rocks]
mica = {foliation_angle = 30}
quartz = {type = "mohr-coulomb-plastic", youngs_modulus = "80 GPa", poissons_ratio = 0.1, density = 2650, \
tensile_strength = "20 MPa", cohesion = "60 MPa", friction_angle = 50}
"""


@pytest.mark.thorough
def test_a_material_is_shown_with_its_curves(tmp_path):
    result = invoke("material", "transversely-isotropic", "--out", tmp_path)
    assert result.exit_code == 0, result.output
    assert "TransverselyIsotropic conforms" in result.output
    assert (tmp_path / "material_transversely-isotropic.png").stat().st_size > 10_000
    assert (tmp_path / "material_transversely-isotropic.json").exists()


@pytest.mark.parametrize("passed", [True, False])
def test_a_material_that_fails_a_property_ends_with_1(passed, tmp_path, monkeypatch):
    command = importlib.import_module("grainlaw.cli.material")
    monkeypatch.setattr(command, "check_material", lambda material: Report("Mine", (Entry("energy", passed),)))
    monkeypatch.setattr(material_figure, "plot_material", lambda material: None)
    monkeypatch.setattr(command, "write_picture", lambda *given: f"written of {given[2]}")
    done = invoke("material", "drucker-prager", "--out", tmp_path)
    assert done.exit_code == (not passed)
    assert done.output.endswith("written of drucker-prager\n")


def test_an_unknown_material_is_refused(tmp_path):
    result = invoke("material", "druker-prager", "--out", tmp_path)
    assert result.exit_code == 2
    assert "did you mean 'drucker-prager'?" in " ".join(result.output.split())


def test_a_configuration_has_materials_by_mineral():
    chosen = configured("uniaxial-compression", tomllib.loads(SCHIST), quick=True)
    material = chosen.specimen.material
    assert isinstance(material["mica"], TransverselyIsotropic)
    assert (material["mica"].foliation_angle, material["mica"].youngs_modulus_across) == (30, 30e9)
    assert isinstance(material["quartz"], MohrCoulombPlastic)
    again = configured("uniaxial-compression", chosen.sections, quick=True)
    assert again.specimen.material == material


def test_a_missing_constant_is_told():
    given = {"type": "drucker-prager", "youngs_modulus": 60e9, "density": 2700, "cohesion": 1e7, "friction_angle": 30}
    with pytest.raises(gl.ParameterError, match=r"rock.poissons_ratio .1. is missing: DruckerPrager needs it"):
        configured("uniaxial-compression", {"rock": given}, quick=True)
    words = r"rock.poissons_ratio .1., rock.density .kg/m3. are missing: DruckerPrager needs them"
    with pytest.raises(gl.ParameterError, match=words):
        configured("uniaxial-compression", {"rock": {n: v for n, v in given.items() if n != "density"}}, quick=True)


@pytest.mark.thorough
def test_plastic_strain_is_in_frames_and_files(tmp_path):
    state = state_of(small_sample(material=MOHR), Linear(**STIFF))
    state.materials.arrays.memory[-1, :] = np.arange(len(state.mesh.zones))
    frame = take_frame(state)
    assert np.array_equal(
        unpacked(packed(frame), frame.nodes).zones["plastic_strain"], np.arange(len(state.mesh.zones))
    )
    VtkSeries(tmp_path, state.specimen, state.bonds.ends).write(frame)
    found = pyvista.read(tmp_path / "grains_0000.vtu").cell_data["plastic_strain"]
    assert np.array_equal(found, np.arange(len(state.mesh.zones)))


def test_the_temperature_is_in_files(tmp_path):
    warm = small_sample(4, material=Thermal(material=ROCK, expansion=8e-6))
    heating = Heating(to=120, samples=10, loading=gl.HeatingRate(rate=1e5))
    gl.simulate(warm, Linear(**STIFF), heating, observers=[VtkWriter(tmp_path, count=2)])
    last = pyvista.read(sorted(tmp_path.glob("grains_*.vtu"))[-1])
    assert np.all(last.cell_data["temperature"] == 120)


@pytest.mark.thorough
def test_pictures_show_the_strength_in_compression():
    """Of a material that bears far more than in tension: 2 c cos(phi) / (1 - sin(phi)) without confinement."""
    curves = gl.plot_material(MOHR).axes[0].lines
    angle = np.radians(MOHR.friction_angle)
    strength = 2 * MOHR.cohesion * np.cos(angle) / (1 - np.sin(angle))
    assert max(curves[0].get_ydata()) == pytest.approx(strength / 1e6, rel=0.02)


# --- materials and tables by name ------------------------------------------------------------------------------------

MINE = """
import attrs
import grainlaw as gl
from parts import LAME

@attrs.frozen(kw_only=True)
class Mine(gl.Material):
    shear: float = gl.parameter("Pa")
    density: float = 2700.0
    stiffness = property(lambda self: ((LAME + 2 * self.shear, LAME, 0), (LAME, LAME + 2 * self.shear, 0),
                                       (0, 0, self.shear)))

    def stress(self, exx, eyy, exy):
        volume = LAME * (exx + eyy)
        return volume + 2 * self.shear * exx, volume + 2 * self.shear * eyy, 2 * self.shear * exy

    def energy(self, exx, eyy, exy):
        return LAME / 2 * (exx + eyy) ** 2 + self.shear * (exx**2 + eyy**2 + 2 * exy**2)

rock = Mine(shear=24e9)
"""


@pytest.mark.thorough
def test_a_material_of_a_file_runs_from_a_configuration_and_is_copied_beside_it(tmp_path):
    (tmp_path / "mine.py").write_text(MINE)
    (tmp_path / "parts.py").write_text("LAME = 24e9\n")
    (tmp_path / "run.toml").write_text('[rock]\ntype = "mine.py:rock"\nshear = "20 GPa"\n')
    out = tmp_path / "out"
    done = invoke("test", "uniaxial-tension", *SMALL, "--config", tmp_path / "run.toml", "--out", out)
    assert done.exit_code == 0, done.output
    made = tomllib.loads((out / "config.toml").read_text())["rock"]
    assert (made["type"], made["shear"]) == ("material_files/mine.py:rock", "20 GPa")
    assert (out / "material_files" / "mine.py").read_text() == MINE
    record = json.loads((out / "run.json").read_text())
    assert [one["copy"] for one in record["material_files"]] == ["material_files/mine.py", "material_files/parts.py"]
    (tmp_path / "parts.py").unlink()
    again = configured("uniaxial-tension", read_file(out / "config.toml"))
    assert again.specimen.material.stiffness[2][2] == 20e9


@pytest.mark.parametrize(
    ("section", "message"),
    [
        ({"rock": {"type": "none.py:rock"}}, r"rock.type: there is no file none.py"),
        ({"rocks": {"mica": {"type": "mine.py:rock"}}}, r"rocks.mica.type = 'mine.py:rock' is not allowed"),
        ({"rock": {"type": "thermal", "expansion": "quarz", "material": "elastic"}}, r"rock.expansion: .*quartz"),
    ],
)
def test_wrong_names_of_materials_and_tables_are_refused(section, message):
    with pytest.raises(gl.ParameterError, match=message):
        configured("uniaxial-compression", section, quick=True)


def test_a_class_that_cannot_be_made_is_called_a_material(tmp_path):
    (tmp_path / "mine.py").write_text(MINE)
    (tmp_path / "parts.py").write_text("LAME = 24e9\n")
    with pytest.raises(gl.ParameterError, match=r"rock.type: the material Mine needs shear: .* material = Mine\(shear"):
        configured("uniaxial-compression", {"rock": {"type": f"{tmp_path / 'mine.py'}:Mine"}}, quick=True)


def test_minerals_expand_by_tables_of_their_names():
    elastic = {"type": "elastic", "youngs_modulus": "60 GPa", "poissons_ratio": 0.25, "density": 2650}
    given = {
        "sample": {"minerals": {"quartz": 0.4, "feldspar": 0.6}},
        "rock": {"type": "thermal", "expansion": "albite", "material": elastic},
        "rocks": {"quartz": {"expansion": "quartz"}, "feldspar": {"expansion": "9e-6 1/K"}},
    }
    made = configured("heating", given | {"test": {"to": "100 degC"}}, quick=True)
    rock = made.specimen.material
    assert (rock["quartz"].expansion, rock[...].expansion) == (QUARTZ, ALBITE)
    assert rock["feldspar"].expansion == ConstantExpansion(9e-6)
    assert (made.sections["rock"]["expansion"], made.sections["rocks"]["quartz"]["expansion"]) == ("albite", "quartz")
    assert configured("heating", made.sections, quick=True).specimen.material == rock
