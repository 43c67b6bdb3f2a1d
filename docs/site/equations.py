"""Equations as MathML by docutils: every browser shows them, without a script and without the network."""

import re
import unicodedata
from html import escape

from docutils import nodes
from docutils.utils.math import MathError, latex2mathml
from sphinx.util import logging

logger = logging.getLogger(__name__)

TAG = re.compile(r"\\tag\{(\d+)\}")
TEXTTT = re.compile(r"\\texttt\{([^}]*)\}")  #: docutils does not know this one
HALF = re.compile(r"\\([td]?frac)(\d)(\d)")  #: nor a fraction without braces at the end
BOLD = re.compile(r"\\boldsymbol\s*\\(?:var)?([A-Za-z]+)")  #: a letter of Unicode, as docutils has for \\mathbf
ARGUMENT = r"\{(?:[^{}]|\{[^{}]*\})*\}|\\mathbf\s*\w|\\[A-Za-z]+|[A-Za-z]"
ACCENT = re.compile(rf"\\(?:hat|bar|dot|ddot)\s*(?:{ARGUMENT})")


def bold(name):
    size = "CAPITAL" if name[0].isupper() else "SMALL"
    return unicodedata.lookup(f"MATHEMATICAL BOLD ITALIC {size} {name.upper()}")


def mathml(text, block):
    text = HALF.sub(r"\\\1{\2}{\3}", TAG.sub("", text))
    text = TEXTTT.sub(lambda found: rf"\text{{{found[1].replace(chr(92), '')}}}", text)
    text = BOLD.sub(lambda found: bold(found[1]), text)
    text = ACCENT.sub(r"{\g<0>{}}", text)  # or its index is set below it
    text = text.replace("°", r"{}^\circ")
    return latex2mathml.tex2mathml(text.strip(), as_block=block)


def shown(node, block):
    """An equation as MathML; as it is written, with a warning, where docutils cannot read it."""
    try:
        return mathml(node.astext(), block)
    except MathError as error:
        logger.warning("equation not understood: %s: %s", error, node.astext(), location=node)
        return f"<code>{escape(node.astext())}</code>"


def visit_math(translator, node):
    translator.body.append(shown(node, block=False))
    raise nodes.SkipNode


def visit_displaymath(translator, node):
    number = TAG.search(node.astext())
    beside = f'<span class="number">({number[1]})</span>' if number else ""
    translator.body.append(f'<div class="equation">{shown(node, block=True)}{beside}</div>\n')
    raise nodes.SkipNode


def setup(app):
    app.add_html_math_renderer("mathml", (visit_math, None), (visit_displaymath, None))
    app.config.html_math_renderer = "mathml"
    return {"parallel_read_safe": True, "parallel_write_safe": True}
