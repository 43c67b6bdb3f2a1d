"""Directives of the reference: public names with their parameters, and indices of all parameters and measures."""

import functools
import importlib
import inspect
import re
from pathlib import Path

import attrs
from docutils import nodes
from docutils.statemachine import StringList
from sphinx.util.docutils import SphinxDirective

import grainlaw
from grainlaw.arguments import Checked
from grainlaw.declared import parameters_of

REFERENCE = Path(__file__).parents[1] / "reference"
DIRECTIVE = re.compile(r"\.\. public:: (\S+)\n\n((?:   .+\n?)+)")


@functools.cache
def public():
    """Each name that the reference describes with its module, in full: ``grainlaw.laws.Linear``."""
    found = [each for page in sorted(REFERENCE.glob("*.rst")) for each in DIRECTIVE.findall(page.read_text("utf-8"))]
    return [f"{module}.{name}" for module, names in found for name in names.split()]


def components():
    """Public classes that declare parameters, by their full names."""
    for name in public():
        each = getattr(importlib.import_module(name.rpartition(".")[0]), name.rpartition(".")[2])
        if isinstance(each, Checked) and parameters_of(each):
            yield name, each


def table(heads, rows, widths):
    """Lines of a table."""
    yield from (".. list-table::", "   :header-rows: 1", f"   :widths: {widths}", "")
    for row in (heads, *rows):
        for k, cell in enumerate(row):
            yield f"   {'* -' if k == 0 else '  -'} {cell}".rstrip()


def escaped(text):
    """A text that reStructuredText takes as it is, but for what stands between double backticks."""
    parts = text.split("``")
    parts[::2] = [re.sub(r"([\\*`|_])", r"\\\1", part) for part in parts[::2]]
    return "``".join(parts)


class Written(SphinxDirective):
    """A directive that stands for lines of reStructuredText."""

    def run(self):
        self.env.note_dependency(__file__)
        holder = nodes.container()
        self.state.nested_parse(StringList(list(self.lines()), self.name), self.content_offset, holder)
        return holder.children


class Public(Written):
    """``.. public:: grainlaw.laws`` and a list of names below it: each with all that ``help`` says of it."""

    required_arguments = 1
    has_content = True

    def lines(self):
        module = importlib.import_module(self.arguments[0])
        for name in " ".join(self.content).split():
            each = getattr(module, name)
            full = f"{module.__name__}.{name}"
            if inspect.isclass(each):
                yield f".. auto{'exception' if issubclass(each, BaseException) else 'class'}:: {full}"
                yield "   :members:"
                if attrs.has(each) and isinstance(each, Checked):  # the table has them
                    yield f"   :exclude-members: {', '.join(field.name for field in attrs.fields(each))}"
            elif callable(each):
                yield f".. autofunction:: {full}"
            else:
                yield from (f".. py:data:: {full}", "", f"   {type(each).__name__}")
            yield ""


class ParameterIndex(Written):
    """Every parameter of every public class."""

    def lines(self):
        rows = []
        for full, each in components():
            for name, unit, allowed, _default, meaning in parameters_of(each):
                unit, allowed, meaning = (escaped(text) for text in (unit, allowed, meaning))
                rows.append((f"``{name}``", unit, allowed, meaning, f":class:`~{full}`"))
        rows.sort(key=lambda row: (row[0].lower(), row[4]))
        yield from table(("parameter", "unit or kind", "allowed", "meaning", "of"), rows, "18 12 18 38 14")


class MeasureIndex(Written):
    """Every standard measure."""

    def lines(self):
        rows = [
            (f"``{name}``", escaped(each.meaning), each.unit, escaped(each.source), ", ".join(each.needs))
            for name, each in sorted(grainlaw.MEASURES.items())
        ]
        yield from table(("measure", "meaning", "unit", "source", "columns it needs"), rows, "22 34 8 18 18")


class Made:
    """Stands for a default that is made anew for each component."""

    def __repr__(self):
        return "..."


def default_of(parameter):
    return Made() if parameter.default is attrs.NOTHING else parameter.default


def names_only(app, what, name, each, options, signature, result):
    """The arguments of a component without unit and bound, which the table below has."""
    if what == "class" and isinstance(each, Checked) and parameters_of(each):
        plain = inspect.signature(each)
        parts = [p.replace(annotation=p.empty, default=default_of(p)) for p in plain.parameters.values()]
        return str(plain.replace(parameters=parts)), None
    return None


def by_public_name(app, env, node, content):
    """Where a type is described: it is imported under another name than the module in which it is written."""
    last = node["reftarget"].rpartition(".")[2]
    for full in public():
        if full.rpartition(".")[2] == last:
            domain = env.get_domain("py")
            kind = node["reftype"]
            return domain.resolve_xref(env, node["refdoc"], app.builder, kind, full, node, content)
    return None


def setup(app):
    app.add_directive("public", Public)
    app.add_directive("parameter-index", ParameterIndex)
    app.add_directive("measure-index", MeasureIndex)
    app.connect("autodoc-process-signature", names_only)
    app.connect("missing-reference", by_public_name)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
