"""The command line."""

from __future__ import annotations

import os
import signal
import sys
import traceback
import warnings
from importlib.metadata import version
from pathlib import Path
from typing import Any

import click

from grainlaw.cli.cache import cache
from grainlaw.cli.calibrate import calibrate
from grainlaw.cli.check import check
from grainlaw.cli.compare import compare
from grainlaw.cli.elastic import elastic
from grainlaw.cli.envelope import envelope
from grainlaw.cli.law import law
from grainlaw.cli.material import material
from grainlaw.cli.rerun import rerun
from grainlaw.cli.study import study
from grainlaw.cli.test import test


class _Commands(click.Group):
    """Commands that end in words, and tell warnings in one line."""

    def invoke(self, context: click.Context) -> Any:
        os.environ["MPLBACKEND"] = "agg"  # commands draw into files; matplotlib refuses unknown names
        with warnings.catch_warnings():
            warnings.showwarning = _tell  # type: ignore[assignment]
            try:
                return super().invoke(context)
            except (click.ClickException, click.exceptions.Exit, click.Abort):
                raise
            except KeyboardInterrupt:  # where no command has said more
                click.echo("\nstopped; go on with the same command", err=True)
                sys.exit(128 + signal.SIGINT)
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


for command in (cache, calibrate, compare, elastic, envelope, law, material, check, rerun, study, test):
    main.add_command(command)
