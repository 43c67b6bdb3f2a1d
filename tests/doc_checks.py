"""What comes out of the code on each page of the documents: numbers that the pages name, or that theory gives."""

import re
import textwrap
from pathlib import Path

import attrs
import numpy as np
import pytest
from scipy.stats import ttest_1samp

import grainlaw as gl
from grainlaw.calibration.targets import AIMS
from grainlaw.geometry import label_agreement
from grainlaw.studies.statistics import Difference

ROOT = Path(__file__).parents[1]
PAGES = {
    file.relative_to(ROOT).as_posix(): file.read_text("utf-8")
    for file in [ROOT / "README.md", *ROOT.glob("docs/*.md"), *ROOT.glob("docs/tables/*.md")]
}


def check_readme(page):
    assert page["pulled"].work[-1] == pytest.approx(50, rel=1e-4)  # J/m2, as the text says
    # Thirty grains across 50 x 125 mm: a modulus between that of the contacts in series and that of the rock.
    assert 60e9 < page["comparison"].summary["linear"]["apparent_modulus"] < 64e9
    assert Path("out/summary.json").exists()
    assert Path("out/CCM/grains.pvd").exists()
    assert page["table"]["status"].tolist() == ["finished"] * 6
    assert page["table"].paired("law")["largest_stress"][0].count == 3  # so few grains need not fail


def check_getting_started(page):
    strength = 29e6 + 1.05e14 * 1e-7 * np.tan(np.radians(54))
    assert page["under_pressure"].shear.max() == pytest.approx(strength, rel=0.03)  # to within one step of slip
    summary, curves = page["result"].summary, page["result"].curves
    first = curves["damaged"] == 0  # the run is still the static solution
    slope = np.polyfit(curves["strain"][first], curves["stress"][first], 1)[0]
    assert page["elastic"].apparent_modulus == pytest.approx(slope, rel=2e-3)
    assert len(page["result"].cracks) == summary["tensile_cracks"] + summary["shear_cracks"] > 0
    named = re.findall(r"`(\w+)`", " ".join(re.findall(r"^\| (`.*?) \|", PAGES["docs/results.md"], re.M)))
    assert {*summary, *curves} <= set(named)  # the tables explain every name


def check_add_a_law(page):
    assert page["pull"].work[-1] == pytest.approx(50, rel=1e-4)
    assert page["lost"].shear == pytest.approx([94.5e6, 0])


def check_workbench(page):
    table = re.search(r"^    CohesiveCrack: .*?(?=\n\n)", PAGES["docs/workbench.md"], re.M | re.S).group()
    assert textwrap.dedent(table) == str(page["numbers"])
    assert page["pulled"].damage[-1] == 1
    path = page["broken"]
    assert path.broken == page["result"].cracks.time[0]
    before = path.unbroken
    assert page["again"].shear[:before] == pytest.approx(path.shear[:before], abs=0.01 * 29e6)  # 1 % of the cohesion
    assert Path("law.png").exists()
    assert Path("probe.png").exists()


def check_measures(page):
    named = set(re.findall(r"`(\w+)`", PAGES["docs/measures.md"]))
    assert {name for name in gl.MEASURES if not {name, f"apparent_{name}"} & named} == set()  # the tables explain all
    properties, grains = page["report"].properties, page["grains"]
    assert properties["crack_initiation_count"] <= page["result"].summary["strength"]
    assert page["lower_half"][1] < 0  # compressed
    assert page["report"].fragments.areas.sum() == pytest.approx(grains.areas.sum())
    assert page["events"].energy.sum() == pytest.approx(0.02 * page["report"].events.energy.sum())  # 20 mm of 1 m
    assert Path("laboratory.png").exists()
    assert page["k"].mode_i == pytest.approx(page["bent"].summary["largest_toughness"], rel=0.1)  # see the page
    core = page["core"].laboratory.properties
    assert [core[name] / 1e6 for name in ("crack_initiation_lateral", "crack_damage")] == pytest.approx([40, 80])
    assert core["tangent_modulus"] == pytest.approx(50e9, rel=1e-4)  # digits of the file


def check_waves(page):
    """The boundary moved by the area of its triangle; Kirsch closes the hole of a coarse plate, to a fifth."""
    moved = gl.simulate(page["block"], page["glued"], page["Shake"]()).summary["moved"]
    assert moved == pytest.approx(0.5e-6, rel=1e-12)
    late, speed = page["late"], np.sqrt(60e9 * 0.75 / (1.25 * 0.5) / 2700)
    there = 1e6 / (2700 * speed) * (1 - 5e-3 / (speed * 20e-6))  # of its tip, over 10 mm on each side
    assert page["through"].summary["peak_velocity_0"] == pytest.approx(there, rel=0.02)
    assert abs(page["through"].curves["velocity_0"][late]).max() < 0.02 * there
    assert abs(page["back"].curves["velocity_0"][late]).max() == pytest.approx(there, rel=0.03)
    struck = page["struck"]
    assert struck.summary["end_difference"] == pytest.approx(
        struck.curves["end_difference"][np.argmax(struck.curves["time"] >= struck.summary["failure_time"])], rel=1e-12
    )
    assert np.isfinite(struck.summary["strength"])
    expected = 2 * 1.25 / 60e9 * 10e-3 * (40e6 + 2 * 20e6)
    assert page["closed"]["closure_y"] == pytest.approx(expected, rel=0.2)


def check_compose_a_test(page):
    """Pulled under pressure along the joints: the specimen fails by the contacts' tension, within their strength."""
    assert page["result"].summary["axial_at_failure"] == pytest.approx(11.4e6, abs=0.1e6)  # of bonds of 13 MPa
    assert page["result"].cracks.tensile.mean() > 0.5
    assert page["result"].curves["axial"][page["result"].curves["stage"] == 0][-1] == pytest.approx(-20e6, rel=0.01)


def check_contacts(page):
    slope, phi = np.radians([30, 20])
    slides = 9.81 * (np.sin(slope) - np.tan(phi) * np.cos(slope))
    result = page["result"]  # its weight comes all at once, so that it is shaken a little
    assert result.summary["largest_speed"] == pytest.approx(slides * result.curves["time"][-1], rel=5e-3)


def check_flutter(page):
    def stored(pressure):  # up to 0.8 um, by hand
        peak = np.e * (29e6 + pressure * np.tan(np.radians(54))) / 9.45e13
        return 9.45e13 * peak**2 * (1 - (1 + 0.8e-6 / peak) * np.exp(-0.8e-6 / peak))

    assert page["made"] == pytest.approx(stored(100e6) - stored(0.0), rel=1e-3)
    left = 9.45e13 * np.exp(-0.8e-6 * 9.45e13 / (np.e * 29e6)) * 0.8e-6**2 / 2
    assert page["kept"] == pytest.approx(stored(0.0) - left, rel=1e-3)
    assert page["held"].flutters
    assert not page["quiet"].flutters


def check_reliability(page):
    alone = gl.simulate(page["rock"], page["law"], page["result"].protocol)
    assert np.array_equal(page["result"].curves["stress"], alone.curves["stress"])
    assert Path("tension/checkpoint.npz").exists()


def check_studies(page):
    table, difference = page["table"], page["difference"]
    change = table["strength"][5:] - table["strength"][:5]
    assert difference.mean == pytest.approx(change.mean())
    assert difference.interval == pytest.approx(tuple(ttest_1samp(change, 0).confidence_interval()))
    pictures = ("strips.png", "pairs.png", "curves.png", "cracks.png", "envelope.png")
    assert all(Path(name).exists() for name in (*pictures, "study.html"))
    failed = np.isfinite(page["pressed"]["strength"])
    line = np.polyfit(page["pressed"]["confinement"][failed], page["pressed"]["strength"][failed], 1)
    assert page["envelope"].mohr_coulomb.slope == pytest.approx(line[0])
    fields = {field.name for field in attrs.fields(Difference)} - {"factor"}
    assert fields <= set(re.findall(r"`(\w+)", PAGES["docs/studies.md"]))  # the tables explain all


def check_textures(page):
    assert page["drawn"].areas[2] == pytest.approx(1e-4)
    assert np.bincount(page["drawn"].parent, page["drawn"].areas) == pytest.approx([3e-4, 1e-4, 4e-4])
    agreement = label_agreement(page["grains"], page["image"], 1e-4)
    assert agreement.share == pytest.approx(0.96, abs=0.01)
    assert abs(agreement.area_errors).max() < 1e-3
    assert page["cells"].is_breakable
    assert page["core"].areas.sum() == pytest.approx(np.pi * 9e-3**2, rel=0.01)  # the disc is a polygon
    assert np.array_equal(page["again"].vertices.round(9), page["grains"].vertices.round(9))
    assert Path("grains.geo").exists()
    found, made = page["found"], page["made"]
    assert found.fractions == pytest.approx(page["shares"], abs=1e-3)
    assert found.clustering == pytest.approx(1.3, rel=0.02)
    assert (found.grains, page["broken"].count > 500) == (120, True)
    assert 35e9 < page["softer"].apparent_modulus < page["elastic"].apparent_modulus < 70e9
    assert page["transgranular"] > 0
    assert set(page["cut"].joints) == {"bedding", "fault"}
    assert Path("texture.png").exists()
    assert made.phase_names == tuple(page["shares"])
    shown = re.search(r"    300 areas.*?(?=\n\n)", PAGES["docs/textures.md"], re.S).group()
    assert textwrap.dedent(shown) == str(page["fit"])
    assert page["fit"].largest_after < 0.02
    assert page["exact"].modulus == pytest.approx(70e9, rel=1e-9)
    assert page["exact"].poisson == pytest.approx(0.25, rel=1e-9)
    assert set(page["solid"].mesh.interface_kind) == {2, 3}
    assert "fault" in page["slotted"].mesh.boundaries
    assert page["graded"].count == 6 * 8


def check_materials(page):
    assert page["report"].passed, page["report"]
    assert -page["pressed"].stress[-1, 1] == pytest.approx(60e6, rel=1e-6)  # twice the strength, as the text says


def check_time(page):
    assert page["report"].passed, page["report"]
    assert page["pulled"].normal[-1] == pytest.approx(1.05e14 * 5e-8 + 1e7 * 1.0)
    assert page["quick"].normal.max() == pytest.approx(15.6e6, rel=1e-3)  # as the text says
    assert page["lasted"] == pytest.approx(4.73e6, abs=2 * 1.2e4)
    assert page["lasted"] == pytest.approx(4.74e6)
    assert np.all(np.diff(page["curve"]["time"]) > 0)
    assert page["result"].summary["failed"]


def check_water(page):
    assert page["wet"].summary["residual_stress"] == pytest.approx(6e6 * np.tan(np.radians(30)), rel=0.01)
    assert 0.8 * 14e6 < page["fractured"]["initiation_pressure"] < 14e6
    assert page["steady"]["injection_pressure"] == pytest.approx(12 * 1e-3 * 1e-5 * 10e-3 / 20e-6**3, rel=0.02)


def check_temperature(page):
    assert page["pressed"] == pytest.approx(-96e9 * 0.013921 / (1 - 2 * 0.08))  # held: -E alpha / (1 - 2 nu)
    assert page["report"].passed, page["report"]
    assert page["heated"].curves["temperature"][-1] == 120
    assert page["heated"].curves["expansion_x"][-1] == pytest.approx(1.08 * 8e-4, rel=5e-3)  # (1 + nu) times as much


def check_conduction(page):
    cooled = page["cooled"]
    assert -60 < cooled["coldest"] < 0
    assert cooled["supplied"] == pytest.approx(cooled["stored"], rel=1e-9)


def check_calibration(page):
    found = page["found"]
    named = set(re.findall(r"`(\w+)`", PAGES["docs/calibration.md"]))
    assert {name for name in AIMS} <= named  # the table explains all
    young, nu = found.stiffness.tested.values()  # of the pilot's tests
    # The lateral strain vibrates by some per cent after the first cracks: docs/strength.md, Damping.
    assert (young, nu) == (pytest.approx(45e9, rel=0.01), pytest.approx(0.24, rel=0.06))
    assert set(found.parameters) == {"kn", "ks", "tensile_strength", "cohesion"}
    strength = next(each for each in found.checks if each.name == "tensile_strength")
    assert 0.7 * 5e6 < strength.measured < 1.3 * 5e6
    assert Path("calibrated/report.html").exists()
    assert Path("calibrated/calibration.json").exists()


def check_coming_from(page):
    modulus, ratio = page["grain"].youngs_modulus, page["grain"].poissons_ratio
    bulk, shear = map(float, re.search(r"bulk (\d\S*) shear (\d\S*)", PAGES["docs/coming-from.md"]).groups())
    assert (modulus / (3 - 6 * ratio), modulus / (2 + 2 * ratio)) == pytest.approx((bulk, shear))
    assert len(page["result"].cracks)


def check_strength(page):
    assert page["result"].summary["strength"] == pytest.approx(181.6e6, rel=0.005)  # as the text says: 181.1 or 182.1


def check_rocks(page):
    curves, (modulus, ratio) = page["result"].curves, (69e9, 0.26)  # what the contacts were calibrated to
    assert curves["stress"][-1] / curves["strain"][-1] == pytest.approx(modulus / (1 - ratio**2), rel=0.04)
    assert page["specimen"].cite == page["rock"].cite


def check_how_do_i(page):
    """What each short answer gives, beside what theory or its own input says."""
    assert page["expected"].expected["ucs"][0] == pytest.approx(120e6, rel=0.02)  # the target that it looks for
    assert page["table"]["status"].tolist() == ["finished"] * 6
    crown = page["tunnel"].moved((0, 10e-3), since="excavate")[1]
    assert -crown == pytest.approx(page["tunnel"].summary["closure_y"] / 2, rel=0.3)  # and as much from below
    assert page["section"].grains.count == 10
    assert page["cut"] == pytest.approx([0, 9e6, 0])
    force = 4e-6 / 40e-3 * 60e9 * 20e-3  # of rock without contacts, which soften it
    assert 0.5 * force < page["pulled"].summary["largest_force"] < 1.1 * force
    share = np.mean(~page["result"].cracks.tensile)
    assert gl.Laboratory(page["result"], page["measures"]).properties["shear_share"] == pytest.approx(share)
    assert f'<td class="number">{100 * share:.3g}</td>' in Path("report.html").read_text("utf-8")
    assert page["torn"].summary["strength"] < page["kept"].summary["strength"]
    assert np.array_equal(page["kept"].curves["stress"], page["again"].curves["stress"])
    assert Path("for-paraview/cracks.pvd").exists()


def check_cheat_sheet(page):
    """Every row of the tables of Python, run one after the other; and what some of them give."""
    rows = re.findall(r"^\| `(.*?)` \|", PAGES["docs/cheat-sheet.md"].split("## TOML")[0], re.M)
    for row in rows:
        exec(compile(row, f"cheat-sheet.md: {row}", "exec"), page)
    assert len(rows) > 20
    assert page["grains"].areas.sum() == pytest.approx(8e-4)
    assert page["weak"].tensile_strength == 5e6
    assert gl.Result.load("run.npz").summary["strength"] == page["result"].summary["strength"]


CHECKS = {
    "docs/how-do-i.md": check_how_do_i, "docs/cheat-sheet.md": check_cheat_sheet,
    "docs/rocks.md": check_rocks,
    "docs/coming-from.md": check_coming_from, "docs/strength.md": check_strength,
    "docs/materials.md": check_materials, "docs/temperature.md": check_temperature,
    "docs/conduction.md": check_conduction,
    "docs/time.md": check_time, "docs/water.md": check_water,
    "docs/calibration.md": check_calibration,
    "docs/textures.md": check_textures, "docs/studies.md": check_studies,
    "docs/reliability.md": check_reliability,
    "docs/flutter.md": check_flutter,
    "docs/contacts.md": check_contacts,
    "docs/compose-a-test.md": check_compose_a_test, "docs/waves.md": check_waves,
    "README.md": check_readme, "docs/getting-started.md": check_getting_started, "docs/add-a-law.md": check_add_a_law,
    "docs/workbench.md": check_workbench, "docs/measures.md": check_measures,
}  # fmt: skip
