"""Materials on the command line, in configurations, and in what a run leaves."""

import tomllib

import meshio
import numpy as np
import pytest
from command_line import invoke
from every_material import MOHR
from support import STIFF, small_sample

import grainlaw as gl
from grainlaw.cli.configuration import configured
from grainlaw.laws import Linear
from grainlaw.materials import MohrCoulombPlastic, TransverselyIsotropic
from grainlaw.results.frames import packed, take_frame, unpacked
from grainlaw.results.vtk import VtkSeries

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


def test_a_material_is_shown_with_its_curves(tmp_path):
    result = invoke("material", "transversely-isotropic", "--out", tmp_path)
    assert result.exit_code == 0, result.output
    assert "TransverselyIsotropic conforms" in result.output
    assert (tmp_path / "material_transversely-isotropic.png").stat().st_size > 10_000
    assert (tmp_path / "material_transversely-isotropic.json").exists()


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
    given = {"rock": {"type": "drucker-prager", "youngs_modulus": 60e9}}
    with pytest.raises(gl.ParameterError, match=r"rock.poissons_ratio .1. is missing: DruckerPrager needs it"):
        configured("uniaxial-compression", given, quick=True)


def test_plastic_strain_is_in_frames_and_files(tmp_path):
    state = gl.State(small_sample(material=MOHR), Linear(**STIFF))
    state.materials.arrays.memory[-1, :] = np.arange(len(state.mesh.zones))
    frame = take_frame(state)
    assert np.array_equal(unpacked(packed(frame)).zones["plastic_strain"], np.arange(len(state.mesh.zones)))
    VtkSeries(tmp_path, state.specimen, state.bonds.ends).write(frame)
    found = meshio.read(tmp_path / "grains_0000.vtu").cell_data["plastic_strain"][0]
    assert np.array_equal(found, np.arange(len(state.mesh.zones)))


def test_pictures_show_the_strength_in_compression():
    """Of a material that bears far more than in tension: 2 c cos(phi) / (1 - sin(phi)) without confinement."""
    curves = gl.plot_material(MOHR).axes[0].lines
    angle = np.radians(MOHR.friction_angle)
    strength = 2 * MOHR.cohesion * np.cos(angle) / (1 - np.sin(angle))
    assert max(curves[0].get_ydata()) == pytest.approx(strength / 1e6, rel=0.02)
