"""What the commands that run tests share: options, a folder, and how a command ends."""

from __future__ import annotations

import functools
import math
import os
import re
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any, NoReturn

import attrs
import click
from click.shell_completion import CompletionItem

from grainlaw.cli.default_rock import LAWS, NAMES
from grainlaw.compiler.batch import CompilationError
from grainlaw.compiler.cache import compile_portably
from grainlaw.conditions import StageError
from grainlaw.engine.device import Gpu
from grainlaw.engine.stepping import InstabilityError
from grainlaw.engine.thread_count import AUTO, Threads, checked_threads
from grainlaw.fields import ParameterError
from grainlaw.runs.claim import Claim, claimed, tidy
from grainlaw.runs.stopping import Stopped

#: What the user gave is at fault; and all that ends a command with its own words.
REFUSALS = (ParameterError, CompilationError)
FAILURES = (ParameterError, OSError, CompilationError, InstabilityError, StageError, MemoryError)


def completed(names: Iterable[str], *, or_file: bool = True) -> Any:
    """How the shell completes what is one of some names, or a file."""

    def begin(_context: Any, _parameter: Any, begun: str) -> list[CompletionItem]:
        found = [CompletionItem(name) for name in names if name.startswith(begun)]
        return found or [CompletionItem(begun, type="file")] * or_file

    return begin


def threads_option(words: str, default: str | None = AUTO) -> Callable[..., Any]:
    """The option ``--threads``, a number or auto."""
    words = f"{words}  [default: {AUTO}]"
    return click.option("--threads", metavar="NUMBER", default=default, callback=_threads, help=words)


def _threads(_context: Any, _option: Any, value: str | None) -> Threads | None:
    if value is None:
        return None
    try:
        return checked_threads("--threads", int(value) if re.fullmatch(r"[+-]?\d{1,9}", value) else value)
    except ParameterError as error:
        raise click.UsageError(str(error)) from None


def device_option(command: Any) -> Any:
    """The option ``--device``."""
    words = "Let a GPU, the first of this computer, do the steps (grainlaw[gpu])."
    return click.option("--device", type=click.Choice(["gpu"]), help=words)(command)


def device_of(given: str | None) -> Gpu | None:
    """What the option ``--device`` asks for. Raises :class:`ParameterError` where there is none."""
    return None if given is None else Gpu()


def seeds_of(text: str) -> list[int]:
    """The seeds of the option ``--seeds``. Raises click.BadParameter."""
    numbers = numbers_of("seeds", text)
    if not all(number.is_integer() for number in numbers):
        raise click.BadParameter(f"--seeds = {text} is not allowed, it must be whole numbers with commas between")
    return [int(number) for number in numbers]


def numbers_of(name: str, text: str) -> list[float]:
    """The numbers of a list with commas, each once. Raises click.BadParameter."""
    try:
        numbers = [float(part) for part in text.split(",")]
    except ValueError:
        raise click.BadParameter(f"--{name} = {text} is not allowed, it must be numbers with commas between") from None
    if not all(map(math.isfinite, numbers)) or len(set(numbers)) < len(numbers):
        raise click.BadParameter(f"--{name} = {text} is not allowed, it must be finite numbers, each once")
    return numbers


@contextmanager
def refusing() -> Iterator[None]:
    """End a command in one line: with exit code 2 for what is refused, 1 where memory or a file fails."""
    try:
        yield
    except REFUSALS as error:
        raise click.UsageError(str(error)) from None
    except BrokenPipeError:
        raise  # click ends in silence where nobody reads on, as behind "| head"
    except FAILURES as error:
        raise click.ClickException(str(error)) from None


def portable_option(command: Callable[..., None]) -> Callable[..., None]:
    """The option ``--portable``, which takes effect before the command runs."""

    @click.option("--portable", is_flag=True, help="The same bits on every processor, for some more time.")
    @functools.wraps(command)
    def run(*, portable: bool, **options: Any) -> None:
        if portable:
            with refusing():
                compile_portably()
        command(**options)

    return run


@attrs.frozen
class GivenOptions:
    """What a command was given of specimen and law: a file, and single parameters that count more than the file."""

    config: Path | None
    options: dict[tuple[str, str], Any]  #: by section and name, None where nothing was given
    assignments: tuple[str, ...]


def model_options(command: Callable[..., None]) -> Callable[..., None]:
    """The options that say which specimen and law; the command gets them as ``given``."""

    @click.option(
        "--rock",
        metavar="NAME",
        shell_complete=completed(NAMES),
        help=f"Rock of a paper: {', '.join(NAMES)}, or FILE.toml.",
    )
    @click.option(
        "--law",
        shell_complete=completed(LAWS),
        help="Name of a law, or FILE.py:LAW.  [default: cohesive-crack, or that of the rock]",
    )
    @click.option("--grains", type=int, help="Number of grains.")
    @click.option("--seed", type=int, help="Seed of the grains.")
    @click.option("--config", type=click.Path(path_type=Path, dir_okay=False), help="TOML file with parameters.")
    @click.option("--set", "assignments", metavar="KEY=VALUE", multiple=True, help="One parameter; can be repeated.")
    @functools.wraps(command)
    def run(
        *, rock: str | None, law: str | None, grains: int | None, seed: int | None, config: Path | None,
        assignments: tuple[str, ...], **options: Any,
    ) -> None:  # fmt: skip
        single = {("rock", "type"): rock, ("law", "type"): law, ("sample", "grains"): grains, ("sample", "seed"): seed}
        command(given=GivenOptions(config, single, assignments), **options)

    return run


def folder_options(command: Callable[..., None]) -> Callable[..., None]:
    """The options that say where a command writes."""
    for option in (
        click.option("--overwrite", is_flag=True, help="Replace the run that the folder holds."),
        click.option("--restart", is_flag=True, help="Go on with the run that the folder holds, if it holds one."),
        click.option(
            "--out", type=click.Path(path_type=Path), default="out", show_default=True, help="Folder to write to."
        ),
    ):
        command = option(command)
    return command


@contextmanager
def writing_to(out: Path, restart: bool, overwrite: bool, about: Mapping[str, Any]) -> Iterator[Claim]:
    """The folder of a command. Errors become one line, and a command that is stopped says what is there."""
    with ExitStack() as stack:
        with refusing():
            claim = stack.enter_context(claimed(out, restart=restart, overwrite=overwrite, about=about))
        try:
            yield claim
        except Stopped as stopped:
            again = f"go on with the same command and --restart --out {os.fspath(out)}"
            end_stopped(stopped, contents(claim.path, claim.others), again)
        except BrokenPipeError:
            raise  # as in refusing
        except FAILURES as error:
            raise click.ClickException(f"{error}\n{contents(claim.path, claim.others)}") from None


def end_stopped(stopped: Stopped, there: str, again: str) -> NoReturn:
    """End a command that was stopped: what is there, and how to go on."""
    click.echo(f"\n{stopped}; {there}\n{again}", err=True)
    sys.exit(128 + stopped.signal)


def finished(claim: Claim) -> None:
    """Remove what only a restart needs, and say what is there."""
    for folder in (claim.path, *claim.path.iterdir()):
        tidy(folder)
    click.echo(f"\n{contents(claim.path, claim.others)}")


def tell_works(works: Iterable[str]) -> None:
    """Say what to cite, each work once."""
    for work in dict.fromkeys(works):
        click.echo(f"to cite: {work}")


def contents(folder: Path, of_before: Sequence[str] = ()) -> str:
    """The files of a folder in a few words: a series of pictures once, what an earlier call wrote by itself."""
    names = sorted(file.name for file in folder.iterdir() if file.suffix != ".vtu" and not file.name.startswith("."))
    shown_too = [f"{n}{os.sep}" if (folder / n).is_dir() else n for n in names if n not in of_before]
    old = f"; of before: {', '.join(of_before)}" if of_before else ""
    return f"written to {os.fspath(folder)}{os.sep}: {', '.join(shown_too) or 'nothing'}{old}"


LINKED = (".json", ".csv", ".toml", ".pvd", ".py")


def linked(folder: Path) -> list[str]:
    """The data files of a folder and of the folders of its runs, as a page in the folder links them."""
    here = sorted(file.name for file in folder.iterdir() if file.suffix in LINKED and not file.name.startswith("."))
    runs = sorted(file.parent.name for file in folder.glob("*/curves.csv"))
    inside = [f"{run}/{name}" for run in runs for name in ("curves.csv", "cracks.csv", "grains.pvd", "cracks.pvd")]
    return [*here, *(name for name in inside if (folder / name).exists())]
