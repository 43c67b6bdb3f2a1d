"""The command that looks after compiled code kept on disk."""

from __future__ import annotations

import click

from grainlaw.compiler.cache_folder import Folder, NotPrivateError, cache_folder, limit
from grainlaw.fields import ParameterError


@click.command()
@click.option("--clear", is_flag=True, help="Remove all of it; it is compiled again when it is needed.")
def cache(*, clear: bool) -> None:
    """Say where compiled code is kept, how much it is and may be, and clear it.

    GRAINLAW_CACHE names another folder, GRAINLAW_CACHE_LIMIT another limit in megabytes. Above the limit what was not
    used for longest is removed.
    """
    folder = Folder(cache_folder())
    try:
        most = limit()
        files = folder.files()
        if clear:
            folder.clear()
    except ParameterError as error:
        raise click.UsageError(str(error)) from None
    except OSError as error:
        raise click.ClickException(f"cannot clear {folder.path}: {error.strerror or error}") from None
    size = f"{sum(status.st_size for _, status in files) / 1e6:.1f} MB"
    if clear:
        click.echo(f"removed {len(files)} functions ({size}) from {folder.path}")
        return
    rows = {"folder": str(folder.path), "functions": str(len(files)), "size": size, "limit": f"{most / 1e6:g} MB"}
    width = max(map(len, rows))
    click.echo("\n".join(f"{name:<{width}}  {value}" for name, value in rows.items()))
    try:
        folder.check()
    except NotPrivateError as error:
        click.echo(f"not used: {error}")
