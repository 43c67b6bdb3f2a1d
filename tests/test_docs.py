"""What the documents show is run: code blocks, commands, links, equation numbers, docstring examples."""

import inspect
import re
import shlex
import textwrap
from pathlib import Path

import attrs
import click
import numpy as np
import pytest
from scipy.stats import ttest_1samp

import grainlaw as gl
from grainlaw.cli import main
from grainlaw.geometry import rectangle

ROOT = Path(__file__).parents[1]
PAGES = {
    file.relative_to(ROOT).as_posix(): file.read_text("utf-8") for file in [ROOT / "README.md", *ROOT.glob("docs/*.md")]
}
TEXTS = PAGES | {name: (ROOT / name).read_text("utf-8") for name in ("CONTRIBUTING.md", "CHANGELOG.md")}

#: What is made smaller so that a page runs in seconds; nothing else is changed.
SMALLER = {
    "README.md": {"grains=755": "grains=30"},
    "docs/getting-started.md": {"grains=755": "grains=30", "grain_size=5 * mm": "grain_size=20 * mm"},
}


def check_readme(page):
    assert page["pulled"].work[-1] == pytest.approx(50, rel=1e-4)  # J/m2, as the text says
    # Thirty grains across 50 x 125 mm: a modulus between that of the contacts in series and that of the rock.
    assert 60e9 < page["comparison"].summary["linear"]["apparent_modulus"] < 64e9
    assert Path("out/summary.json").exists()
    assert Path("out/CCM/grains.pvd").exists()


def check_getting_started(page):
    strength = 29e6 + 1.05e14 * 1e-7 * np.tan(np.radians(54))
    assert page["under_pressure"].shear.max() == pytest.approx(strength, rel=0.03)  # to within one step of slip
    summary, curves = page["result"].summary, page["result"].curves
    first = curves["damaged"] == 0  # the run is still the static solution
    slope = np.polyfit(curves["strain"][first], curves["stress"][first], 1)[0]
    assert page["elastic"].apparent_modulus == pytest.approx(slope, rel=2e-3)
    assert len(page["result"].cracks) == summary["tensile_cracks"] + summary["shear_cracks"] > 0
    named = re.findall(r"`(\w+)`", " ".join(re.findall(r"^\| (`.*?) \|", PAGES["docs/getting-started.md"], re.M)))
    assert {*summary, *curves} <= set(named)  # the tables explain every name


def check_add_a_law(page):
    assert page["pull"].work[-1] == pytest.approx(50, rel=1e-4)
    assert page["lost"].shear == pytest.approx([94.5e6, 0])
    assert page["steep"].length == pytest.approx(4)
    assert page["waves"].summary["energy_error"] < 1e-6


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
    assert properties["crack_initiation_count"] <= page["result"].summary["peak_stress"]
    assert page["lower_half"][1] < 0  # compressed
    assert page["stress"].shape == (len(page["result"].frames), 3)
    assert page["report"].fragments.areas.sum() == pytest.approx(grains.areas.sum())
    assert page["events"].energy.sum() == pytest.approx(0.02 * page["report"].events.energy.sum())  # 20 mm of 1 m
    assert Path("laboratory.png").exists()
    ratio = properties["crack_initiation_count"] / page["result"].summary["peak_stress"]
    assert page["laboratory"].properties["initiation_ratio"] == pytest.approx(ratio)
    assert f'<td class="number">{100 * ratio:.4g}</td>' in Path("report.html").read_text("utf-8")


def check_compose_a_test(page):
    """Pulled under pressure along the joints: the specimen fails by the contacts' tension, within their strength."""
    assert 0 < page["result"].summary["axial_at_failure"] < 13e6
    assert page["result"].cracks.tensile.mean() > 0.5
    assert page["result"].curves["axial"][page["result"].curves["stage"] == 0][-1] == pytest.approx(-20e6, rel=0.01)


def check_contacts(page):
    slope, phi = np.radians([30, 20])
    slides = 9.81 * (np.sin(slope) - np.tan(phi) * np.cos(slope))
    result = page["result"]  # its weight comes all at once, so that it is shaken a little
    assert result.summary["largest_speed"] == pytest.approx(slides * result.curves["time"][-1], rel=5e-3)
    assert any(len(frame.contacts["length"]) for frame in page["crushed"].frames)
    assert "soft" in page


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
    change = table["peak_stress"][5:] - table["peak_stress"][:5]
    assert difference.mean == pytest.approx(change.mean())
    assert difference.interval == pytest.approx(tuple(ttest_1samp(change, 0).confidence_interval()))
    pictures = ("strips.png", "pairs.png", "curves.png", "cracks.png", "envelope.png")
    assert all(Path(name).exists() for name in (*pictures, "study.html"))
    line = np.polyfit(page["pressed"]["confinement"], page["pressed"]["peak_stress"], 1)
    assert page["envelope"].mohr_coulomb.slope == pytest.approx(line[0])
    fields = {field.name for field in attrs.fields(gl.Difference)} - {"factor"}
    assert fields <= set(re.findall(r"`(\w+)", PAGES["docs/studies.md"]))  # the tables explain all


CHECKS = {
    "docs/studies.md": check_studies,
    "docs/reliability.md": check_reliability,
    "docs/flutter.md": check_flutter,
    "docs/contacts.md": check_contacts,
    "docs/compose-a-test.md": check_compose_a_test,
    "README.md": check_readme, "docs/getting-started.md": check_getting_started, "docs/add-a-law.md": check_add_a_law,
    "docs/workbench.md": check_workbench, "docs/measures.md": check_measures,
}  # fmt: skip


def blocks(text, *languages):
    """Content of the fenced blocks of some languages."""
    fenced = re.findall(r"^```(\w*)\n(.*?)^```", text, re.M | re.S)
    return [content for language, content in fenced if language in languages]


def test_every_page_with_code_has_a_number_to_check():
    assert set(CHECKS) == {name for name, text in PAGES.items() if blocks(text, "python")}
    assert set(SMALLER) <= set(PAGES)


@pytest.mark.parametrize("name", CHECKS)
def test_python_blocks_run(name, tmp_path, monkeypatch):
    text = PAGES[name]
    for shown, run in SMALLER.get(name, {}).items():
        assert shown in text
        text = text.replace(shown, run)
    monkeypatch.chdir(tmp_path)
    page = {"__name__": "page"}
    for number, block in enumerate(blocks(text, "python")):
        exec(compile(block, f"{name}, block {number}", "exec"), page)
    CHECKS[name](page)


def commands(text):
    """Argument lists of the grainlaw commands that a text shows in shell blocks, in indented ones and in line."""
    shown = [line for block in blocks(text, "sh", "bash", "console") for line in block.splitlines()]
    shown += re.findall(r"`([^`\n]*)`", text) + re.findall(r"^    (grainlaw .*)$", text, re.M)
    for line in shown:
        for part in re.split(r"&&|[;|]", line):
            if re.match(r"\s*(\S*/)?grainlaw\b", part):
                yield shlex.split(part, comments=True)[1:]


def parse(words):
    """Parse a command line without running it. Raises click.UsageError."""
    try:
        with main.make_context("grainlaw", list(words)) as context:
            name, command, rest = main.resolve_command(context, list(words))
            inner = command.make_context(name, rest, parent=context)
            if isinstance(command, click.Group):  # the commands of grainlaw study
                name, command, rest = command.resolve_command(inner, [*inner._protected_args, *inner.args])
                command.make_context(name, rest, parent=inner)
    except click.exceptions.Exit:  # --help and --version end here
        pass


SHOWN = {name: [words for words in commands(text) if words] for name, text in TEXTS.items()}
SHOWN = {name: lines for name, lines in SHOWN.items() if lines}


@pytest.mark.parametrize("name", SHOWN)
def test_commands_exist(name):
    for words in SHOWN[name]:
        parse(words)


def test_commands_are_found():
    assert {"README.md", "docs/getting-started.md", "docs/workbench.md", "docs/add-a-law.md"} <= set(SHOWN)


def test_an_invented_option_is_found():
    assert ["compare", "--quick"] in list(commands("```sh\n.venv/bin/grainlaw compare --quick  # small\n```"))
    with pytest.raises(click.UsageError):
        parse(["compare", "--velocity", "1"])
    with pytest.raises(click.UsageError):
        parse(["study", "granite.toml", "--velocity", "1"])


def test_options_of_the_table_are_those_of_the_command():
    listed = set(re.findall(r"^\| `(--[\w-]+)`", PAGES["docs/getting-started.md"], re.M))
    options = {name for option in main.commands["compare"].params for name in option.opts}
    assert listed == options


def anchors(text):
    """Anchors of the headings, as they are rendered."""
    text = re.sub(r"^```.*?^```", "", text, flags=re.M | re.S)
    titles = re.findall(r"^#+ (.+)$", text, re.M)
    return {re.sub(r"[^\w\- ]", "", title.lower()).strip().replace(" ", "-") for title in titles}


def links(text):
    """Files and headings that a text leads to, on this machine."""
    targets = re.findall(r"\]\(([^)\s]+)\)", text) + re.findall(r'src="([^"]+)"', text)
    return [target for target in targets if not re.match(r"https?:", target)]


def test_links_are_found():
    assert links('[a](b.md#c) and [d](https://e.org) <img src="f.png">') == ["b.md#c", "f.png"]
    assert len(links(TEXTS["README.md"])) > 5


@pytest.mark.parametrize("name", [name for name, text in TEXTS.items() if links(text)])
def test_links_resolve(name):
    for target in links(TEXTS[name]):
        file, _, anchor = target.partition("#")
        path = (ROOT / name).parent / file if file else ROOT / name
        assert path.exists(), target
        assert not anchor or anchor in anchors(path.read_text("utf-8")), target


def cited(text):
    """Equation numbers a text cites as Eq. (1), Eqs. (2, 3), Eqs. (2) to (5)."""
    found = re.findall(r"\bEqs?\. ((?:\([\d, ]+\)(?: to | and )?)+)", text)
    return {int(number) for group in found for number in re.findall(r"\d+", group)}


def test_cited_equations_exist():
    theory = PAGES["docs/theory.md"]
    numbers = [int(number) for number in re.findall(r"\\tag\{(\d+)\}", theory)]
    assert numbers == list(range(1, len(numbers) + 1))
    engine = {path: cited(path.read_text("utf-8")) for path in ROOT.glob("framework/**/*.py")}
    assert set().union(*engine.values()) >= {5, 8, 12}
    pages = {name: cited(text) for name, text in PAGES.items()}
    assert {place: found - set(numbers) for place, found in (engine | pages).items() if found - set(numbers)} == {}


def docstring_example(interface):
    """The class in the docstring of an interface."""
    code = re.search(r"::\n\n(.*?)(?=\n\S|\Z)", inspect.getdoc(interface), re.S).group(1)
    scope = {"gl": gl, "attrs": attrs, "np": np, "__name__": "example"}
    exec(textwrap.dedent(code), scope)
    return scope[re.search(r"class (\w+)", code).group(1)]


def test_docstring_examples_work_together():
    law = docstring_example(gl.ContactLaw)(kn=1e14, ks=1e14, strength=13e6, energy=50)
    assert gl.trace(law, np.linspace(0, 1e-5, 1001), 0).work[-1] == pytest.approx(50, rel=1e-4)
    bricks = docstring_example(gl.Tessellator)().tessellate(rectangle(20e-3, 40e-3))
    bricks.check()
    interfaces = (gl.Integrator, gl.LoadingProtocol, gl.Observer, gl.Measure)
    free, pull, fastest, damped = (docstring_example(interface)() for interface in interfaces)

    @attrs.frozen(kw_only=True)
    class FreePull(gl.LoadingProtocol):
        def stages(self, specimen):
            return [attrs.evolve(stage, integrator=free) for stage in pull.stages(specimen)]

        def measure(self, state):
            return pull.measure(state)

        def summary(self, curves, specimen):
            return pull.summary(curves, specimen)

    rock = gl.Specimen(bricks, gl.Elastic(youngs_modulus=60e9, poissons_ratio=0.25, density=3100))
    result = gl.simulate(rock, law, FreePull(), observers=[fastest])
    # Four rows in series, three joints across, no strain held back at the sides; waves pass to and fro.
    modulus = 1 / ((1 - 0.25**2) / 60e9 + 3 / (1e14 * 40e-3))
    assert result.curves["force"].mean() == pytest.approx(0.5e-4 * modulus * 20e-3, rel=0.1)
    assert fastest.speed >= pull.speed
    assert gl.Laboratory(result, [damped]).properties == {"damped_share": 0}  # nothing damps the toy integrator
