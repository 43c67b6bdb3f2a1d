"""The command that runs any test of a specimen under any law."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import attrs
import click

from grainlaw.cli import running
from grainlaw.cli.answers import answer, json_option
from grainlaw.cli.configuration import CONFIG, Configuration, configured, template, write_config
from grainlaw.cli.law_copy import copied_files
from grainlaw.cli.sections import gathered
from grainlaw.cli.setups import SETUPS
from grainlaw.compiler.cache import is_portable
from grainlaw.conditions import StageError
from grainlaw.engine.device import Gpu
from grainlaw.engine.stepping import InstabilityError
from grainlaw.engine.thread_count import Threads
from grainlaw.observation import Observer
from grainlaw.quantity import aligned
from grainlaw.results.certificate import texts, warnings_of
from grainlaw.results.files import RESULT
from grainlaw.results.paraview import write_script
from grainlaw.results.probe import Probe
from grainlaw.results.result import Result
from grainlaw.results.tables import write_json
from grainlaw.results.vtk import VtkWriter
from grainlaw.runs.certify import limit_of, slower
from grainlaw.runs.claim import ANIMATION, CERTIFICATE, INTERACTIVE, Claim
from grainlaw.runs.progress import Progress, RunBar
from grainlaw.runs.record import versions
from grainlaw.runs.run_folder import checkpoint_of
from grainlaw.runs.simulation import simulate

FOLLOWED = 20  #: contact points that break first, whose paths an interactive page has


@click.command(
    help=f"""Run a laboratory test of a rock specimen under a contact law, and report it.

NAME is one of {", ".join(SETUPS)}, or FILE.py:TEST, a test of your own. Every parameter can be given: in a TOML file
with the sections [sample], [rock], [law], [test] and [numerics], or one by one, as in --set law.cohesion="30 MPa"
(docs/configuration.md). Others are those of a published study.

Writes report.html, summary.json, curves.csv, cracks.csv, result.npz for gl.Result.load, grains.pvd and cracks.pvd for
ParaView and show_in_paraview.py, which opens them there, run.json, the record of what was run and with what, and
config.toml, which runs the same test again. A test that is stopped goes on with --restart. The exit code is 2 for
what is refused before the test, 1 for a test that could not end; what it recorded is written all the same."""
)
@click.argument("name", metavar="NAME", shell_complete=running.completed(SETUPS))
@running.model_options
@running.folder_options
@running.threads_option("Threads in the model.", default=None)
@running.device_option
@running.portable_option
@click.option("--certify", is_flag=True, help="Test again at half the speed: what the strength tends to.")
@click.option("--interactive", is_flag=True, help="Write interactive.html too, to click through (grainlaw[report]).")
@click.option("--animate", is_flag=True, help="Write cracks.gif too: how the cracks grow.")
@click.option("--quick", is_flag=True, help="A small specimen.")
@json_option
@click.option("--template", "shows", is_flag=True, help="Print the configuration with all parameters; run nothing.")
def test(
    *, name: str, given: running.GivenOptions, out: Path, restart: bool, overwrite: bool, threads: Threads | None,
    device: str | None, quick: bool, certify: bool, interactive: bool, animate: bool, shows: bool,
) -> None:  # fmt: skip
    options = {**given.options, ("numerics", "threads"): threads}
    with running.refusing():
        sections = gathered(given.config, options, given.assignments)
        if shows:
            click.echo(template(name, sections, quick), nl=False)
            return
        chosen = configured(name, sections, quick)
        chosen.check()
        does_steps = running.device_of(device)
        if certify:
            slower(chosen.protocol)
        if interactive:
            from grainlaw.results.figures.interactive import require_bokeh, write_interactive  # loads matplotlib

            require_bokeh()
    arguments = {"name": name, "config": CONFIG, "portable": is_portable()}
    with running.writing_to(out, restart, overwrite, {"command": {"name": "test", "arguments": arguments}}) as claim:
        if restart:
            checkpoint_of(claim.path, chosen.key)  # refuses another run before files of this one are replaced
        sections, copies = copied_files(chosen, chosen.sections, claim.path)
        claim.about.update(configuration=chosen.sections, **copies)
        there = arguments["name"] = sections["test"]["type"]
        write_config(claim.path / CONFIG, there, sections)
        name = there.rpartition(":")[2]
        probe = Probe(first=FOLLOWED) if interactive else None
        result, reason = _run(name, chosen, does_steps, claim, [] if probe is None else [probe])
        record = {**{key: chosen.sections[key] for key in ("sample", "numerics")}, "versions": versions()}
        write_script(claim.path, [[(name, "", result)]])
        asked = {INTERACTIVE: interactive, ANIMATION: animate}
        beside = [*(name for name, is_asked in asked.items() if is_asked), *running.linked(claim.path)]
        result.write_report(claim.path / "report.html", record=record, incomplete=reason, files=beside)
        result.save(claim.path / RESULT)
        if interactive:
            write_interactive(result, claim.path / INTERACTIVE, probe=probe)
        if animate:
            result.animate(claim.path / ANIMATION)
        doubted = list(warnings_of({name: result}))
        answer(
            aligned(texts(result, result.summary).items()),
            test=name,
            folder=str(claim.path),
            properties=result.summary,
            doubts=doubted,
            cite=list(dict.fromkeys(result.specimen.cite)),
        )
        running.tell_works(result.specimen.cite)
        if certify and not reason:
            _certify(name, result, chosen, does_steps, claim)
        for words in doubted:
            click.echo(f"Warning: {words}", err=True)
        running.finished(claim)
    if reason:
        raise click.ClickException(reason)


def _run(
    name: str, chosen: Configuration, device: Gpu | None, claim: Claim, observers: Sequence[Observer]
) -> tuple[Result, str]:
    """The result, and why the test could not end, if it could not."""
    numerics = chosen.numerics
    writer = VtkWriter(claim.path, numerics.frames, zones=numerics.zones)
    with Progress(stays=True, speaks=True) as progress:
        try:
            result = simulate(
                chosen.specimen, chosen.law, chosen.protocol, threads=numerics.threads, frames=numerics.frames,
                **numerics.step_options, device=device, checkpoint=claim,
                observers=[RunBar(progress.bar(name)), writer, *observers], progress=False,
            )  # fmt: skip
        except (StageError, InstabilityError) as error:
            return error.result, str(error)
    return result, ""


def _certify(name: str, result: Result, chosen: Configuration, device: Gpu | None, claim: Claim) -> None:
    """Answer the quasi-static limit, and write it to certificate.json."""
    numerics = chosen.numerics
    with Progress(stays=True, speaks=True) as progress:
        other = simulate(
            chosen.specimen, chosen.law, slower(chosen.protocol), threads=numerics.threads, **numerics.step_options,
            device=device, observers=[RunBar(progress.bar(f"{name}, half the speed"))], progress=False,
        )  # fmt: skip
    found = limit_of(result, other)
    content = attrs.asdict(found) | {"limit": found.limit, "error": found.error}
    write_json(claim.path / CERTIFICATE, content)
    answer(f"\n{found}", certificate=content)
