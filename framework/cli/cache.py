"""The command that looks after compiled code kept on disk."""

from __future__ import annotations

import click

from grainlaw.cli.answers import answer, json_option
from grainlaw.compiler.cache_folder import Folder, NotPrivateError, cache_folder, limit
from grainlaw.fields import ParameterError


@click.command()
@click.option("--clear", is_flag=True, help="Remove all of it; it is compiled again when it is needed.")
@json_option
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
    total = sum(status.st_size for _, status in files)
    size, content = f"{total / 1e6:.1f} MB", {"folder": str(folder.path), "functions": len(files), "bytes": total}
    if clear:
        answer(f"removed {len(files)} functions ({size}) from {folder.path}", **content, removed=True)
        return
    rows = {"folder": str(folder.path), "functions": str(len(files)), "size": size, "limit": f"{most / 1e6:g} MB"}
    width = max(map(len, rows))
    lines = "\n".join(f"{name:<{width}}  {value}" for name, value in rows.items())
    answer(lines, **content, limit=most, used=True)
    try:
        folder.check()
    except NotPrivateError as error:
        answer(f"not used: {error}", used=False, reason=str(error))
