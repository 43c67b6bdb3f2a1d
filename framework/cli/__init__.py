"""The command line."""

from __future__ import annotations

from importlib.metadata import version

import click

from grainlaw.cli.cache import cache
from grainlaw.cli.check import check
from grainlaw.cli.compare import compare
from grainlaw.cli.envelope import envelope
from grainlaw.cli.law import law
from grainlaw.cli.rerun import rerun
from grainlaw.cli.test import test
from grainlaw.cli.verify import verify


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(version("grainlaw"), prog_name="grainlaw")
def main() -> None:
    """Grain-based distinct element simulation of rock fracture, with pluggable contact laws."""


for command in (cache, compare, envelope, law, check, rerun, test, verify):
    main.add_command(command)
