"""The command that puts a contact law to the conformance kit."""

from __future__ import annotations

import click

from grainlaw.conformance import check_law
from grainlaw.script import LawReferenceError, find_law


@click.command()
@click.argument("law", metavar="FILE.py:LAW")
def check(*, law: str) -> None:
    """Ask a contact law of your own for every property that makes laws comparable and safe to run.

    LAW is an instance in the file, or a class whose parameters all have defaults. The file is run. The exit code is 1
    if a property fails, 2 if there is no such law.
    """
    try:
        report = check_law(find_law(law))
    except (LawReferenceError, TypeError, ValueError) as error:
        raise click.BadParameter(str(error)) from None
    click.echo(report)
    if not report.passed:
        raise SystemExit(1)
