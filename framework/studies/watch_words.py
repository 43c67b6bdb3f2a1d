"""What is to be seen of a folder, in words, as a table, as curves on a terminal and as a page."""

from __future__ import annotations

from collections.abc import Iterator
from datetime import datetime
from pathlib import Path
from typing import Any

from grainlaw.columns import quantity_of
from grainlaw.messages import cut
from grainlaw.results.figures.pages import write_page
from grainlaw.runs.estimate import in_words
from grainlaw.studies.watched import ANSWER, FAILED, FINISHED, RUNNING, UNKNOWN, Part, Watched

MOST_CURVES = 6
COLORS = ("cyan", "yellow", "magenta", "green", "red", "blue")  #: of curves on a terminal
PAGE = "watch.html"
NAMED = 80  #: characters of a name below a picture
RENEWED = 3  #: s after which a browser loads the page anew


def head(seen: Watched) -> str:
    """How far all of it is, in a line."""
    what = "tests" if seen.kind == "calibration" else "cases" if seen.kind == "study" else "runs"
    most = "at most " if seen.kind == "calibration" else ""
    parts = [f"{seen.kind} {seen.state}"]
    if seen.total > 1 or seen.kind in ("study", "calibration"):
        parts.append(f"{seen.done} of {most}{seen.total} {what}" if seen.total else f"{seen.done} {what} kept")
    if seen.state == RUNNING:
        parts.append(f"{100 * seen.share:.0f} %")
    if seen.kind == "calibration" and seen.state == FINISHED:
        parts.append(f"the answer is in {Path(seen.folder, ANSWER)}")
    if seen.left:
        parts.append(f"{most and 'at most '}about {in_words(seen.left)} left")
    return ", ".join(parts)


def reason(seen: Watched) -> str:
    """Why it does not go on, and how to go on; empty while it does."""
    again = f"Go on with: {seen.again}" if seen.again else ""
    return ". ".join(words for words in (seen.reason, again) if words)


HEADS = ("", "state", "share", "at", "left", "cracks")


def rows(seen: Watched) -> Iterator[list[str]]:
    """Of each run or case what :data:`HEADS` say."""
    for part in seen.parts:
        is_going = part.state in (RUNNING, UNKNOWN)
        share = f"{100 * part.share:.0f} %" if is_going or (part.share and part.state != FINISHED) else ""
        left = in_words(part.left) if part.left else ""
        where = part.reason if part.state == FAILED else part.where
        yield [part.name, part.state, share, where, left, "" if part.cracks is None else str(part.cracks)]


def drawn(seen: Watched) -> list[Part]:
    """The runs whose curves are drawn: those that go on before others, of one pair of columns."""
    having = [part for part in seen.parts if len(part.columns) == 2 and len(part.rows) > 1]
    having.sort(key=lambda part: part.state != RUNNING)
    return [part for part in having if part.columns == having[0].columns][:MOST_CURVES]


def as_characters(seen: Watched, width: int, height: int, *, colored: bool) -> str:
    """Curves drawn with characters; empty where there are none."""
    from plotille import Figure

    parts = drawn(seen)
    if not parts:
        return ""
    figure = Figure()
    figure.width, figure.height, figure.color_mode, figure.with_colors = width, height, "names", colored
    figure.origin = False
    figure.register_label_formatter(float, lambda value, chars, **_: f"{value:.3g}".rjust(chars))
    looks = [quantity_of(name) for name in parts[0].columns]
    # plotille sets its labels in parentheses
    figure.x_label, figure.y_label = (", ".join(filter(None, (look.words, look.unit_shown))) for look in looks)
    across, up = (sum((list(_shown(part)[k]) for part in parts), [0.0]) for k in (0, 1))
    figure.set_x_limits(min(across), max(across) or 1.0)
    figure.set_y_limits(min(up), max(up) or 1.0)
    for part, color in zip(parts, COLORS, strict=False):
        figure.plot(*_shown(part), lc=color if colored else None, label=part.name)
    return str(figure.show(legend=colored and len(parts) > 1))


def write_watch_page(seen: Watched, file: Path, *, goes_on: bool) -> None:
    """Write the page, which a browser loads anew as long as it ``goes_on``. Raises OSError."""
    write_page(
        file, "studies/watch.html", title=f"{seen.kind.capitalize()} in {seen.folder}", head=head(seen),
        share=seen.share, reason=reason(seen), said=seen.said, curves=_figure(seen), rows=list(rows(seen)), heads=HEADS,
        renews=RENEWED if goes_on else 0, now=f"{datetime.now():%Y-%m-%d %H:%M:%S}",
    )  # fmt: skip


def _shown(part: Part) -> tuple[list[float], list[float]]:
    looks = [quantity_of(name) for name in part.columns]
    x, y = ([row[k] * look.factor for row in part.rows] for k, look in enumerate(looks))
    return x, y


def _figure(seen: Watched) -> Any:
    from grainlaw.drawing.figure import given_or_new
    from grainlaw.drawing.palette import color, style

    parts = drawn(seen)
    if not parts:
        return None
    figure, axes = given_or_new("watch", None, (7, 4))
    for k, part in enumerate(parts):
        axes.plot(*_shown(part), color=color(k), linestyle=style(k), label=cut(part.name, NAMED))
    across, up = (quantity_of(name).heading for name in parts[0].columns)
    axes.set(xlabel=across, ylabel=up)
    if len(parts) > 1:
        figure.legend(loc="outside lower center", frameon=False, fontsize="small")
    return figure
