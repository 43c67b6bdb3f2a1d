"""The command that shows from another terminal how far something is."""

from __future__ import annotations

import contextlib
import math
import shutil
import time
from pathlib import Path

import click

from grainlaw.cli.answers import answer, is_asked, json_option
from grainlaw.cli.running import refusing
from grainlaw.fields import ParameterError
from grainlaw.messages import cut
from grainlaw.quantity import aligned
from grainlaw.results.files import warn
from grainlaw.studies.watch_words import HEADS, PAGE, RENEWED, as_characters, head, reason, rows, write_watch_page
from grainlaw.studies.watched import Watched, watched

EVERY = 1.0  #: s between looks
SELDOM = 30.0  #: s between lines into a pipe or a file
NARROWEST, WIDEST = 30, 100  #: characters along an axis
FEWEST, MOST = 6, 16  #: lines of curves
BESIDE = 34  #: characters beside curves: numbers, words of the axis
AROUND = 8  #: lines above and below them and the table


@click.command()
@click.argument("folder", metavar="FOLDER", type=click.Path(path_type=Path))
@click.option("--once", is_flag=True, help="Show it once and end.")
@click.option("--page", is_flag=True, help=f"Keep a page {PAGE} in FOLDER up to date too, which a browser loads anew.")
@json_option
@click.pass_context
def watch(context: click.Context, *, folder: Path, once: bool, page: bool) -> None:
    """Show what a run, a comparison, a study or a calibration that goes on in FOLDER has done so far.

    How far it is and the time left, state, readings and cracks of each run or case, and the curves as far as they are;
    renewed every second until it ends, or until Ctrl-C; into a pipe a line every half minute. What writes to FOLDER is
    not disturbed. With --json the state is printed once. The exit code is 1 for what has died or was stopped, or has
    failed.
    """
    with refusing():
        seen = watched(folder)
    if once or is_asked(context):
        if page:
            _Page(folder).write(seen, at_once=True)
    else:
        seen = _watching(folder, seen, _Page(folder) if page else None)
    answer(_words(seen, *_size()), **seen.content)
    if seen.is_over and seen.reason:
        context.exit(1)


def _watching(folder: Path, seen: Watched, page: _Page | None) -> Watched:
    """Show it until it is over, or until Ctrl-C; the last that was seen."""
    from rich.console import Console, Group  # rich takes long to load
    from rich.live import Live
    from rich.progress_bar import ProgressBar
    from rich.text import Text

    console = Console()
    colored, told = console.color_system is not None, -math.inf
    with contextlib.suppress(KeyboardInterrupt), Live(console=console, auto_refresh=False, transient=True) as live:
        while True:
            words = Text.from_ansi(_words(seen, console.width, console.height, colored=colored))
            live.update(Group(ProgressBar(1.0, seen.share, width=40), words), refresh=True)
            if page is not None:
                page.write(seen)
            if seen.is_over:
                break
            if not console.is_terminal and time.monotonic() - told >= SELDOM:
                told = time.monotonic()
                click.echo(head(seen))
            time.sleep(EVERY)
            try:
                seen = watched(folder)
            except ParameterError as error:  # a run that is replaced has no files for a moment
                if not folder.is_dir():
                    raise click.ClickException(str(error)) from None
    if page is not None:
        page.write(seen, at_once=True)
    return seen


class _Page:
    """The page in the folder; a browser is told to load it anew as long as this command writes it."""

    def __init__(self, folder: Path) -> None:
        self.file, self.written = folder / PAGE, 0.0

    def write(self, seen: Watched, *, at_once: bool = False) -> None:
        if not at_once and time.monotonic() - self.written < RENEWED:
            return
        self.written = time.monotonic()
        try:
            write_watch_page(seen, self.file, goes_on=not at_once)
        except OSError as error:
            warn(f"{self.file} cannot be written: {error}")


def _size() -> tuple[int, int]:
    size = shutil.get_terminal_size()
    return size.columns, size.lines


def _table(lines: list[list[str]], width: int) -> list[str]:
    """Lines of a table that fits: what is cut are the names of cases."""
    others = aligned([["", *rest] for _, *rest in lines]).splitlines()
    room = max(width - max(map(len, others)), NARROWEST)
    return aligned([[cut(name, room), *rest] for name, *rest in lines]).splitlines()


def _words(seen: Watched, width: int, height: int, *, colored: bool = False) -> str:
    """All that is seen, as lines of a terminal."""
    table = _table([[*HEADS], *rows(seen)], width) if seen.parts else []
    lines = min(max(height - len(table) - AROUND, FEWEST), MOST)
    curves = as_characters(seen, max(min(width - BESIDE, WIDEST), NARROWEST), lines, colored=colored)
    parts = [head(seen), reason(seen), *seen.said, "\n".join(table), curves]
    return "\n".join(part for part in parts if part)
