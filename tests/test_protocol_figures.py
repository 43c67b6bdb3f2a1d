"""Every test shows its own quantities: axes with words and units, and rows that can exist."""

import re

import attrs
import numpy as np
import pytest
from support import state_of
from test_words_and_units import NEEDED

import grainlaw as gl
from grainlaw.cli.configuration import configured
from grainlaw.cli.setups import SETUPS
from grainlaw.columns import AGED, COLDEST, ENERGIES, ENERGY, EVERY_TEST, HEAT_TIME, HOTTEST, JUMPS, STAGE, panels_of
from grainlaw.geometry import Bricks, rectangle
from grainlaw.laws import Linear
from grainlaw.protocols import FreeMotion
from grainlaw.results.figures.curves import plot_report_curves
from grainlaw.results.result import _cracks

#: what the usual picture of each test says at its axes, as the field does
SAYS = {
    "uniaxial-compression": ("axial strain (%)", "axial stress (MPa)"),
    "uniaxial-tension": ("axial strain (%)", "axial stress (MPa)"),
    "biaxial-compression": ("axial strain (%)", "axial stress (MPa)"),
    "brazilian": ("approach over diameter (%)", "tensile stress (MPa)"),
    "creep": ("time passed in jumps (s)", "axial strain (%)"),
    "cyclic": ("axial strain (%)", "axial stress (MPa)"),
    "heating": ("temperature (°C)", "expansion (%)"),
    "saturated": ("axial strain (%)", "axial stress (MPa)"),
    "three-point-bending": ("deflection (µm)", "force (kN/m)"),
    "semi-circular-bend": ("deflection (µm)", "force (kN/m)"),
    "direct-shear": ("displacement (µm)", "shear stress (MPa)"),
    "joint-tension": ("opening (µm)", "normal traction (MPa)"),
    "excavation": ("time (ms)", "change of the size of the opening (mm)"),
    "hydraulic-fracturing": ("injected (mm2)", "injection pressure (MPa)"),
    "split-hopkinson": ("axial strain (%)", "axial stress (MPa)"),
    "thermal-shock": ("time of heat (s)", "temperature of nodes (°C)"),
    "plane-wave": ("time (µs)", "normal stress, tension positive (MPa)"),
}
#: numbers and shares of the whole
WITHOUT_UNIT = {"broken contact points", "contact points that the fluid presses", "wet", "fatigue", "stability"}


def result_of(specimen, law, protocol):
    """Of a run of which all curves rise, without one: what pictures are drawn of."""
    stages = protocol.stages(specimen)
    state = state_of(specimen, law)
    state.begin(stages[0])
    rising = np.linspace(0.0, 1.0, 40)
    every = [*(each.name for each in EVERY_TEST), *(ENERGY + kind for kind in ENERGIES), *protocol.measure(state)]
    if any(stage.of(gl.loads.Conduction) for stage in stages):
        every += [HEAT_TIME, COLDEST, HOTTEST]
    if any(stage.ageing for stage in stages):
        every += [AGED, JUMPS]
    curves = {name: rising * 1e-3 for name in every}
    curves[STAGE] = (len(stages) - 1.0) * (rising > 0.1)
    return gl.Result(specimen, law, protocol, curves, {}, _cracks(state), [], state.bonds.ends)


@pytest.fixture(scope="module", params=SETUPS)
def tested(request):
    chosen = configured(request.param, NEEDED.get(request.param, {}), quick=True)
    return request.param, result_of(chosen.specimen, chosen.law, chosen.protocol)


def labels(figure):
    return [(axes.get_xlabel(), axes.get_ylabel()) for axes in figure.axes]


def test_the_usual_picture_of_every_test_has_its_own_words_and_units(tested):
    name, result = tested
    assert labels(result.plot()) == [SAYS[name], ("x (mm)", "y (mm)")]
    assert labels(gl.plot_curves(result)) == [SAYS[name]]
    many = gl.Comparison(results={"one": result, "other": result}, failed={})
    assert [each for each in labels(many.plot()) if each[0]] == [(SAYS[name][0], "broken contact points")]
    assert many.plot().axes[0].get_ylabel() == SAYS[name][1]


def test_a_report_shows_each_panel_once(tested):
    shown = [up for _, up in labels(plot_report_curves({"law": tested[1]}))]
    assert shown.count("broken contact points") == 1


def test_every_axis_of_every_report_has_a_unit(tested):
    for across, up in labels(plot_report_curves({"law": tested[1]})):
        for label in (across, up):
            assert label in WITHOUT_UNIT or re.search(r"\([^ ]+\)$", label), label


def test_every_panel_is_recorded_and_has_one_unit(tested):
    """Those of a part of the specimen that this one lacks are left out."""
    result = tested[1]
    declared = list(result.protocol.panels)
    assert declared
    assert list(panels_of(result.curves, declared)) == declared
    for panel in declared:
        assert len({result.quantity(column).unit for column in panel.columns}) == 1
        assert len(panel.columns) == 1 or panel.words


def test_bodies_in_motion_show_speeds_and_the_grains_that_are_tracked():
    grains = Bricks(rows=2, columns=1).tessellate(rectangle(0.02, 0.02))
    rock = gl.Specimen(grains, gl.Elastic(youngs_modulus=60e9, poissons_ratio=0.25, density=2700))
    result = result_of(rock, Linear(kn=1e14, ks=1e14), FreeMotion(duration=1e-4, tracked=[1]))
    assert labels(result.plot())[0] == ("time (s)", "speed (m/s)")
    found = [up for _, up in labels(plot_report_curves({"law": result}))]
    assert found[:5] == [
        "speed (m/s)", "place of the centre of mass (m)", "place along x (m)", "place along y (m)",
        "rotation, counter-clockwise (rad)",
    ]  # fmt: skip


def test_a_gauge_is_no_principal_stress(tested):
    """``stress_1`` of a wave is that of gauge 1; of a frame it is the larger principal stress."""
    name, result = tested
    if name == "plane-wave":
        assert result.quantity("stress_1").heading == "stress at gauge 1 (MPa)"
        legend = result.plot().axes[0].get_legend()
        assert [text.get_text() for text in legend.get_texts()] == ["stress at gauge 0", "stress at gauge 1"]


def test_values_are_drawn_in_the_unit_that_the_axis_says(tested):
    """All curves rise to 1e-3 in SI."""
    name, result = tested
    factors = {
        "%": 100,
        "MPa": 1e-6,
        "s": 1,
        "°C": 1,
        "µm": 1e6,
        "kN/m": 1e-3,
        "ms": 1e3,
        "mm": 1e3,
        "mm2": 1e6,
        "µs": 1e6,
    }
    axes, units = result.plot().axes[0], [re.search(r"\((.+)\)$", label)[1] for label in SAYS[name]]
    x, y = axes.lines[0].get_data()
    assert (x[-1], y[-1]) == pytest.approx([1e-3 * factors[unit] for unit in units])


@pytest.mark.parametrize("wrong", ["force", [], [1], 7])
def test_a_panel_needs_names_of_columns(wrong):
    with pytest.raises(gl.ParameterError, match=r"columns = .* is not allowed"):
        gl.Panel("deflection", wrong)


def test_the_stages_of_a_test_stand_at_its_times(tested):
    """By hand: the second stage begins after the fourth of 40 samples."""
    name, result = tested
    if name == "excavation":
        axes = attrs.evolve(result, stages=["stress", "excavate"]).plot().axes[0]
        assert [text.get_text() for text in axes.texts] == ["stress", "excavate"]
        assert [line.get_xdata()[0] for line in axes.lines[-2:]] == pytest.approx([0, 3 / 39], abs=1e-12)
        brief = result.curves | {"stage": 1.0 * (result.curves["step"] > 0)}  # the first lasts no time
        axes = attrs.evolve(result, curves=brief, stages=["stress", "excavate"]).plot().axes[0]
        assert [text.get_text() for text in axes.texts] == ["excavate"]
