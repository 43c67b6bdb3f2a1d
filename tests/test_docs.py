"""What the documents show is run: code blocks, commands, links, equation numbers, docstring examples."""

import inspect
import re
import shlex
import textwrap

import attrs
import click
import numpy as np
import pytest
from doc_checks import CHECKS, PAGES, ROOT

import grainlaw as gl
from grainlaw.cli.commands import main
from grainlaw.geometry import rectangle

TEXTS = PAGES | {name: (ROOT / name).read_text("utf-8") for name in ("CONTRIBUTING.md", "CHANGELOG.md")}

#: What is made smaller so that a page runs in seconds; nothing else is changed.
SMALLER = {
    "README.md": {"grains=755": "grains=30"},
    "docs/getting-started.md": {"grains=755": "grains=30", "grain_size=5 * mm": "grain_size=20 * mm"},
}


def blocks(text, *languages):
    """Content of the fenced blocks of some languages."""
    fenced = re.findall(r"^```(\w*)\n(.*?)^```", text, re.M | re.S)
    return [content for language, content in fenced if language in languages]


def test_every_page_with_code_has_a_number_to_check():
    assert set(CHECKS) == {name for name, text in PAGES.items() if blocks(text, "python")}
    assert set(SMALLER) <= set(PAGES)


#: what a newcomer reads first; the others take longer
FIRST = ("README.md", "docs/getting-started.md")


@pytest.mark.parametrize("name", [n if n in FIRST else pytest.param(n, marks=pytest.mark.thorough) for n in CHECKS])
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


def test_options_of_the_table_are_those_of_the_commands():
    table = PAGES["docs/cheat-sheet.md"].split("### Options")[1]
    listed = re.findall(r"`(--[\w-]+)`", " ".join(re.findall(r"^\| (`--.*?) \|", table, re.M)))
    options = {name for command in ("compare", "test") for each in main.get_command(None, command).params
               for name in each.opts if name.startswith("--")}  # fmt: skip
    assert sorted(listed) == sorted(options)


def test_the_messages_of_the_faq_are_those_of_the_code():
    """The fixed words, between dots, of each message that the page quotes in bold stand in the source."""
    files = [
        file for folder in ("framework", "laws", "geometry", "protocols") for file in ROOT.glob(f"{folder}/**/*.py")
    ]
    source = re.sub(r'"\s*\n?\s*f?"', "", "\n".join(file.read_text("utf-8") for file in files))
    entries = re.findall(r"^- \*\*(.*?)\*\*", PAGES["docs/faq.md"], re.M)
    assert 12 <= len(entries) <= 20
    messages = [message for entry in entries for message in re.findall(r"`(.*?)`", entry) if " " in message]
    assert len(messages) >= 12
    words = {part.strip() for message in messages for part in message.split("...") if part.strip()}
    assert {part for part in words if part not in source} == set()


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
    interfaces = (gl.integration.Integrator, gl.LoadingProtocol, gl.Observer, gl.Measure)
    free, pull, fastest, damped = (docstring_example(interface)() for interface in interfaces)

    @attrs.frozen(kw_only=True)
    class FreePull(gl.LoadingProtocol):
        def stages(self, specimen):
            return [attrs.evolve(stage, integrator=free) for stage in pull.stages(specimen)]

        def measure(self, state):
            return pull.measure(state)

        def summary(self, curves, specimen):
            return pull.summary(curves, specimen)

    normal, across, shear = gl.Elastic(youngs_modulus=60e9, poissons_ratio=0.25, density=3100).constants
    rock = gl.Specimen(bricks, docstring_example(gl.Material)(c11=normal, c12=across, c44=shear, density=3100))
    result = gl.simulate(rock, law, FreePull(), observers=[fastest])
    # Four rows in series, three joints across, no strain held back at the sides; waves pass to and fro.
    modulus = 1 / ((1 - 0.25**2) / 60e9 + 3 / (1e14 * 40e-3))
    assert result.curves["force"].mean() == pytest.approx(0.5e-4 * modulus * 20e-3, rel=0.1)
    assert fastest.speed >= pull.speed
    assert gl.Laboratory(result, [damped]).properties == {"damped_share": 0}  # nothing damps the toy integrator
