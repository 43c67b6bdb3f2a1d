"""What a command answers: words for people, or with ``--json`` one document on the output stream for programs."""

from __future__ import annotations

import contextlib
import json
import sys
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import click

JSON = "--json"
ASKED, CONTENT = "grainlaw.json", "grainlaw.answer"  #: in the context of a command


def json_option(command: Callable[..., Any]) -> Callable[..., Any]:
    """The option ``--json`` of a command that gives its answer to :func:`answer`."""
    words = "Print one JSON document in SI units, and nothing else, on the output stream."
    return click.option(JSON, is_flag=True, expose_value=False, help=words)(command)


def is_asked(context: click.Context) -> bool:
    """Whether a document is asked for."""
    return bool(context.meta.get(ASKED))


def answer(words: object, **content: Any) -> None:
    """Print the words, or keep the content (SI) for the document; several are one document."""
    context = click.get_current_context()
    if is_asked(context):
        context.meta[CONTENT] = {**context.meta.get(CONTENT, {}), **content}
    else:
        click.echo(words)


@contextlib.contextmanager
def answering(context: click.Context, words: list[str]) -> Iterator[None]:
    """Print the document at the end, however that is, where the ``words`` of a command ask for it.

    All else that a command prints then goes to the error stream. What is refused or fails is an ``error`` of the
    document; the exit code is as without.
    """
    if JSON not in words:
        yield
        return
    context.meta[ASKED], output = True, sys.stdout
    content: dict[str, Any] = {}
    try:
        with contextlib.redirect_stdout(sys.stderr):
            yield
    except click.exceptions.Exit:
        raise
    except click.ClickException as error:
        content["error"] = error.format_message()
        raise
    except SystemExit as error:
        if isinstance(error.code, int) and error.code > 128:
            content["error"] = "stopped"
        raise
    finally:
        if found := {**context.meta.get(CONTENT, {}), **content}:
            print(document(found), file=output, flush=True)


def document(content: Mapping[str, Any]) -> str:
    """As JSON, null for what is not a finite number."""
    from grainlaw.results.files import for_json, without_nan  # loads numpy, which the list of commands does without

    return json.dumps(without_nan(content), indent=2, allow_nan=False, default=for_json)
