"""The commands, each loaded when it is asked for, and how they end."""

from __future__ import annotations

import os
import sys
import traceback
import warnings
from importlib import import_module
from importlib.metadata import version
from pathlib import Path
from typing import Any

import click

from grainlaw.cli import INTERRUPTED, STOPPED
from grainlaw.cli.answers import answering

#: what each does, as the list of commands says it
COMMANDS = {
    "cache": "Say where compiled code is kept, how much it is and may be, and clear it.",
    "calibrate": "Find the contact parameters of a rock from its laboratory strengths.",
    "check": "Ask a contact law of your own for every property that makes laws comparable.",
    "compare": "Compress samples of a rock to failure under several contact laws.",
    "elastic": "Find modulus, Poisson's ratio and stiffness tensor of a rock.",
    "envelope": "Compress a rock specimen under several confinements, and fit envelopes.",
    "law": "Show a contact law: strengths, displacements at failure and work, and curves.",
    "material": "Show a material of grains: what the conformance kit finds, and its curves.",
    "rerun": "Repeat the run that FOLDER holds, and say what differs from it.",
    "schema": "Print the JSON schema of TOML files, by which editors complete and check them.",
    "study": "Run many cases of a test, and keep them as one table.",
    "test": "Run a laboratory test of a rock specimen under a contact law, and report it.",
    "watch": "Show what a run, a study or a calibration that goes on has done so far.",
}
WORDS = "grainlaw.words"  #: in the context: all that was typed


class _Commands(click.Group):
    """Commands that end in words, and tell warnings in one line."""

    def list_commands(self, context: click.Context) -> list[str]:
        return list(COMMANDS)

    def get_command(self, context: click.Context, name: str) -> click.Command | None:
        if name not in COMMANDS:
            return None
        return getattr(import_module(f"grainlaw.cli.{name}"), name)

    def resolve_command(self, context: click.Context, words: list[str]) -> Any:
        if words and words[0] not in COMMANDS and not words[0].startswith("-"):
            from grainlaw.messages import nearest  # loads numpy, which the list of commands does without

            near = nearest(words[0], COMMANDS)
            context.fail(f"there is no command '{words[0]}'{near} (commands: {', '.join(COMMANDS)})")
        return super().resolve_command(context, words)

    def format_commands(self, context: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Commands"):
            formatter.write_dl(list(COMMANDS.items()))

    def parse_args(self, context: click.Context, args: list[str]) -> list[str]:
        context.meta[WORDS] = list(args)
        return super().parse_args(context, args)

    def invoke(self, context: click.Context) -> Any:
        os.environ["MPLBACKEND"] = "agg"  # commands draw into files; matplotlib refuses unknown names
        with answering(context, context.meta[WORDS]), warnings.catch_warnings():
            warnings.showwarning = _tell  # type: ignore[assignment]
            try:
                return super().invoke(context)
            except (click.ClickException, click.exceptions.Exit, click.Abort, BrokenPipeError):
                raise  # of the last, click makes a silent end
            except KeyboardInterrupt:  # where no command has said more
                click.echo(STOPPED, err=True)
                sys.exit(INTERRUPTED)
            except Exception as error:
                if os.environ.get("GRAINLAW_TRACEBACK"):
                    raise
                raise click.ClickException(_fault(error)) from None


def _tell(message: Warning | str, *_: Any) -> None:
    click.echo(f"Warning: {message}", err=True)


def _fault(error: Exception) -> str:
    """One line on what nobody has thought of."""
    place = traceback.extract_tb(error.__traceback__)[-1]
    words = " ".join(str(error).split())[:300]
    where = f"{Path(place.filename).name}:{place.lineno}"
    return f"a fault of grainlaw ({type(error).__name__} at {where}: {words}); GRAINLAW_TRACEBACK=1 shows all of it"


@click.group(cls=_Commands, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(version("grainlaw"), prog_name="grainlaw")
def main() -> None:
    """Grain-based distinct element simulation of rock fracture, with pluggable contact laws."""
