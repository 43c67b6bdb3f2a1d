"""Colours that people with any colour vision tell apart, and lines that differ where a page is printed grey."""

from typing import Any

#: Okabe and Ito 2008, Color universal design, https://jfly.uni-koeln.de/color/
BLACK, ORANGE, SKY, GREEN = "#000000", "#E69F00", "#56B4E9", "#009E73"
BLUE, VERMILLION, PURPLE = "#0072B2", "#D55E00", "#CC79A7"
COLORS = (BLUE, VERMILLION, GREEN, PURPLE, ORANGE, SKY, BLACK)
STYLES: tuple[Any, ...] = ("-", "--", "-.", ":", (0, (9, 2)), (0, (5, 1.5, 1, 1.5, 1, 1.5)))
MARKERS = ("o", "s", "^", "D", "v", "P")


def color(k: int) -> str:
    """The colour of curve number ``k``."""
    return COLORS[k % len(COLORS)]


def style(k: int) -> Any:
    """The line style of curve number ``k``."""
    return STYLES[k % len(STYLES)]


def marker(k: int) -> str:
    """The marker of curve number ``k``."""
    return MARKERS[k % len(MARKERS)]
