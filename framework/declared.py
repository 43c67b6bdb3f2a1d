"""What a component declares of its parameters, as the text and the signature that ``help`` shows.

Read when it is asked for: the meanings are the comments beside the fields, and a file takes milliseconds to read.
"""

from __future__ import annotations

import ast
import enum
import functools
import inspect
import linecache
import re
import sys
import types
import typing
from typing import Any

import attrs

HEADS = ("parameter", "unit or kind", "allowed", "default", "meaning")
COMMENT = re.compile(r"#:\s*(.+?)\s*$")  #: of a field, at the end of its line
DYNAMIC = "<dynamic-code>"  #: the file of code that cloudpickle has brought from another process, since version 3.1.3
ABOVE = re.compile(r"^\s*#:\s*(.+?)\s*$")  #: or alone on the line above it


def signature_of(kind: type, plain: inspect.Signature) -> inspect.Signature:
    """The signature with the unit and the bound of each number: ``kn: Annotated[float, 'Pa/m, above 0']``."""
    fields = _fields(kind)
    return plain.replace(
        parameters=[
            each.replace(annotation=_annotation(fields[each.name])) if each.name in fields else each
            for each in plain.parameters.values()
        ]
    )


def text_of(kind: type, own: str | None) -> str | None:
    """A docstring with a table of the parameters at its end."""
    rows = parameters_of(kind)
    if not rows:
        return own
    columns = [k for k in range(len(HEADS)) if k == 0 or any(row[k] for row in rows)]
    return "\n\n".join([*([inspect.cleandoc(own)] if own else []), _table([HEADS, *rows], columns)]) + "\n"


def units_of(kind: type) -> dict[str, str]:
    """The units of the parameters of a class that have one, by name."""
    return {field.name: field.metadata["unit"] for field in attrs.fields(kind) if "unit" in field.metadata}


def parameters_of(kind: type) -> list[tuple[str, ...]]:
    """For each parameter its name, unit or kind, what is allowed, its default and its meaning, in words."""
    meanings = _meanings(kind)
    return [
        (name, _unit_or_kind(field), _allowed(field), _default(field), meanings.get(field.name, ""))
        for name, field in _fields(kind).items()
    ]


def _table(rows: list[tuple[str, ...]], columns: list[int]) -> str:
    widths = {k: max(len(row[k]) for row in rows) for k in columns}
    rule = "  ".join("=" * widths[k] for k in columns)
    lines = ["  ".join(row[k].ljust(widths[k]) for k in columns).rstrip() for row in rows]
    return "\n".join([rule, lines[0], rule, *lines[1:], rule])


def _fields(kind: type) -> dict[str, Any]:
    """Fields that are given when a component is made, by the name of the argument."""
    return {field.alias: field for field in attrs.fields(kind) if field.init} if attrs.has(kind) else {}


def _annotation(field: Any) -> Any:
    words = ", ".join(word for word in (field.metadata.get("unit", ""), _allowed(field)) if word)
    plain = inspect.Parameter.empty if field.type is None else field.type
    if words and str(plain) in ("float", "int", str(float), str(int)):
        return typing.Annotated[int if "int" in str(plain) else float, words]
    return plain


def _unit_or_kind(field: Any) -> str:
    unit = field.metadata.get("unit")
    if unit is not None:
        return "number" if unit == "1" else str(unit)
    return getattr(field.type, "__name__", str(field.type)) if field.type is not None else ""


def _allowed(field: Any) -> str:
    """The bounds in words, or the members of an enumeration."""
    if isinstance(field.default, enum.Enum) and field.default is not attrs.NOTHING:  # which is a member itself
        return ", ".join(type(field.default).__members__)
    words = str(field.metadata.get("bounds", ""))
    for common in ("a finite number and ", "a number and "):
        words = words.removeprefix(common)
    return words


def _default(field: Any) -> str:
    default = field.default
    if default is attrs.NOTHING or isinstance(default, attrs.Factory):  # type: ignore[arg-type]
        return ""
    text = default.name if isinstance(default, enum.Enum) else " ".join(repr(default).split())
    return text if len(text) <= 60 else f"{type(default).__name__}(...)"


@functools.cache
def _meanings(kind: type) -> dict[str, str]:
    """The comments ``#: ...`` beside the fields, by name; those of a base where the field is the base's."""
    found: dict[str, str] = {}
    for owner in reversed(kind.__mro__):
        if attrs.has(owner):
            found |= _comments(owner)
    return found


def _comments(kind: type) -> dict[str, str]:
    _, lines, node = written(kind)
    found = {}
    for each in node.body if node else ():
        if isinstance(each, ast.AnnAssign) and isinstance(each.target, ast.Name):
            for line in {each.lineno, each.end_lineno or each.lineno}:
                if comment := COMMENT.search(lines[line - 1]):
                    found[each.target.id] = comment[1]
            if each.target.id not in found and (above := ABOVE.match(lines[each.lineno - 2])):
                found[each.target.id] = above[1]
    return found


def file_of(kind: type) -> str:
    """Where a class is written: the file of its methods, in a notebook the name of their cell, or of its module.

    The module comes last: that of a law's file need not be loaded.
    """
    methods = [inspect.unwrap(each) for each in vars(kind).values() if isinstance(each, types.FunctionType)]
    files = [file_of_function(method) for method in methods if method.__module__ == kind.__module__]
    own = [file for file in files if not file.startswith("<attrs")]
    written = [file for file in own if file != DYNAMIC] or own
    return written[0] if written else str(getattr(sys.modules.get(kind.__module__), "__file__", None) or "")


def file_of_function(function: types.FunctionType) -> str:
    """Where a function is written; of one that has come back from another process the file of its module, if known."""
    file = function.__code__.co_filename
    return file if file != DYNAMIC else str(function.__globals__.get("__file__") or DYNAMIC)


def written(kind: type) -> tuple[str, list[str], ast.ClassDef | None]:
    """File of a class, its lines, and where in them the class is defined; None where that cannot be read."""
    file = file_of(kind)
    lines = linecache.getlines(file)
    try:
        tree = ast.parse("".join(lines))
    except (SyntaxError, ValueError):  # edited since it was loaded
        return file, lines, None
    found = [node for node in ast.walk(tree) if isinstance(node, ast.ClassDef) and node.name == kind.__name__]
    return file, lines, found[-1] if found else None
