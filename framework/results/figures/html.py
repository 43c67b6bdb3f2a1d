"""Pages of HTML without scripts: text, tables and figures in one file."""

from __future__ import annotations

import base64
import io
from collections.abc import Iterable, Sequence
from html import escape
from typing import TYPE_CHECKING
from urllib.parse import quote

if TYPE_CHECKING:
    from grainlaw.drawing.figure import Figure

STYLE = """
body { font: 15px/1.45 system-ui, sans-serif; color: #1c1c1c; max-width: 62rem; margin: 2rem auto; padding: 0 1.5rem; }
h1 { font-size: 1.6rem; margin-bottom: 0.2rem; } h2 { font-size: 1.15rem; margin: 2rem 0 0.5rem; }
h3 { font-size: 1rem; margin: 1.2rem 0 0.3rem; } p { margin: 0.4rem 0; }
table { border-collapse: collapse; margin: 0.4rem 0 1rem; } caption { text-align: left; font-weight: 600; }
th, td { padding: 0.15rem 1.2rem 0.15rem 0; text-align: left; vertical-align: top; border-bottom: 1px solid #ddd; }
td.number { text-align: right; font-variant-numeric: tabular-nums; white-space: nowrap; }
.pass, .fail { white-space: nowrap; color: #1a6b2c; } .fail { color: #b3261e; font-weight: 600; }
.warning { border-left: 4px solid #b3261e; background: #fbeeed; padding: 0.5rem 0.8rem; margin: 0.8rem 0; }
.side { display: flex; flex-wrap: wrap; column-gap: 3rem; } figure { margin: 0.5rem 0 1rem; } img { max-width: 100%; }
figcaption { color: #555; } h2, h3, caption { break-after: avoid; } tr, figure { break-inside: avoid; }
.scroll { overflow-x: auto; } .files a { margin-right: 1rem; }
figure input { position: absolute; opacity: 0; } figure input:focus-visible + img { outline: 2px solid #0072b2; }
figure label { cursor: zoom-in; }
figure input:checked + img { position: fixed; inset: 0; z-index: 1; width: 100%; height: 100%; object-fit: contain;
  background: white; cursor: zoom-out; }
@media (max-width: 45rem) {
  body { font-size: 14px; margin: 1rem auto; padding: 0 0.8rem; } h1 { font-size: 1.3rem; }
  th, td { padding-right: 0.7rem; } tbody th { min-width: 9rem; }
  figure label { display: block; overflow-x: auto; } figure img { max-width: none; width: 50rem; }
  figure input:checked + img { width: 100%; max-width: 100%; }
}
@media print {
  body { max-width: none; margin: 0; padding: 0; font-size: 9pt; } .files, figure input { display: none; }
  .scroll { overflow: visible; } td.number { white-space: normal; } th, td { padding-right: 0.6rem; }
  figure img { max-width: 100%; max-height: 22cm; } a { color: inherit; text-decoration: none; }
}
"""


class Cell(str):
    """Text of a table cell, with the name of its style."""

    style: str

    def __new__(cls, text: str, style: str) -> Cell:
        cell = super().__new__(cls, text)
        cell.style = style
        return cell


def page(title: str, parts: Iterable[str]) -> str:
    """A whole page."""
    body = "\n".join(parts)
    return (
        f'<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta name="viewport" content="width=device-width, initial-scale=1">\n<title>{escape(title)}</title>\n'
        f"<style>{STYLE}</style>\n</head>\n<body>\n{body}\n</body>\n</html>\n"
    )


def text(tag: str, content: str, style: str = "") -> str:
    """A paragraph or a heading."""
    return f"<{tag}{_style(style)}>{escape(content)}</{tag}>"


def side_by_side(parts: Iterable[str]) -> str:
    return '<div class="side">\n' + "\n".join(f"<div>{part}</div>" for part in parts) + "\n</div>"


def table(rows: Iterable[Sequence[str]], heads: Sequence[str] = (), caption: str = "") -> str:
    """A table; the first cell of each row is its heading, numbers are :class:`Cell` of style number."""
    lines = [f"<caption>{escape(caption)}</caption>"] if caption else []
    if heads:
        cells = "".join(f'<th scope="col">{escape(head)}</th>' for head in heads)
        lines.append(f"<thead><tr>{cells}</tr></thead>")
    lines.append("<tbody>")
    for first, *rest in rows:
        cells = "".join(f"<td{_style(getattr(cell, 'style', ''))}>{escape(cell)}</td>" for cell in rest)
        lines.append(f'<tr><th scope="row">{escape(first)}</th>{cells}</tr>')
    return '<div class="scroll"><table>\n' + "\n".join([*lines, "</tbody>"]) + "\n</table></div>"


def numbers(rows: Iterable[Sequence[str]], heads: Sequence[str] = (), caption: str = "") -> str:
    """A table of numbers; the first cell of each row is its heading."""
    return table(([first, *(Cell(cell, "number") for cell in rest)] for first, *rest in rows), heads, caption)


def picture(figure: Figure, caption: str) -> str:
    """A figure, embedded in the page; a click shows it as large as the window."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=120)
    data = base64.b64encode(buffer.getvalue()).decode("ascii")
    image = f'<img alt="{escape(caption)}" src="data:image/png;base64,{data}">'
    large = f'<label title="enlarge"><input type="checkbox" aria-label="enlarge: {escape(caption)}">{image}</label>'
    return f"<figure>\n{large}\n<figcaption>{escape(caption)}</figcaption>\n</figure>"


def links(files: Iterable[str]) -> str:
    """Links to files in the folder of the page."""
    return '<p class="files">' + "\n".join(f'<a href="{quote(file)}">{escape(file)}</a>' for file in files) + "</p>"


def _style(name: str) -> str:
    return f' class="{name}"' if name else ""
