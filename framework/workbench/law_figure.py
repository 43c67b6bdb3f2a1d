"""Pictures of a contact law: its answers to pull, shear, mixed paths and closure, and its strength."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import attrs
import numpy as np
from matplotlib.axes import Axes

from grainlaw.arguments import checked
from grainlaw.contact import ContactLaw
from grainlaw.drawing.figure import Figure, given_or_new
from grainlaw.drawing.palette import BLUE, COLORS, GREEN, ORANGE, PURPLE, SKY, VERMILLION, style
from grainlaw.workbench.characteristics import Characteristics, Envelope, characteristics, envelope
from grainlaw.workbench.driver import Contact, Trace, alone
from grainlaw.workbench.paths import straight
from grainlaw.workbench.scale import REACH, find_closure
from grainlaw.workbench.shear_box import pulled, sheared

Curve = tuple[np.ndarray, np.ndarray, str, str]  #: displacement (m), traction (Pa), colour, name
MPA, UM = 1e-6, 1e6
SHADES = (BLUE, VERMILLION, GREEN, ORANGE)  #: of growing pressure
MIXED = (VERMILLION, ORANGE, PURPLE, SKY, BLUE)  #: from pull to shear


@attrs.frozen
class Reach:
    """How far (m) each mode is driven: its peak, and where it has broken."""

    peak: float
    end: float


def reach(peak: float, breaking: float) -> Reach:
    """Of a mode's peak and break, either of which may be nan."""
    if np.isnan(peak):
        return Reach(REACH, REACH)
    return Reach(peak, max(breaking, 2 * peak) if np.isfinite(breaking) else 4 * peak)


def along(corners: Sequence[float], steps: int = 400) -> np.ndarray:
    """Displacements through ``corners``, dense where a leg begins and ends."""
    fine = np.geomspace(1e-4, 0.5, steps // 2)
    shares = np.unique(np.concatenate([[0.0], fine, np.linspace(0, 1, steps), 1 - fine]))
    return straight(np.array(corners), shares[:-1])


def pull_and_release(contact: Contact, to: Reach) -> Trace:
    """Pulled to the break, and released three times: once before the peak, twice after it."""
    first, half = to.peak + 0.1 * (to.end - to.peak), to.peak + 0.35 * (to.end - to.peak)
    return pulled(contact, along([0, 0.8 * to.peak, 0, first, 0, half, 0, 1.15 * to.end]))


def shear_and_reverse(contact: Contact, normal: float, to: Reach) -> Trace:
    """Sheared under a normal traction (Pa) that is held; reversed once after the peak, and once after the break."""
    half = to.peak + 0.25 * (to.end - to.peak)
    return sheared(contact, normal, along([0, half, 0, 1.2 * to.end, 0.6 * to.end]))


def ratios(opening: Reach, slip: Reach) -> list[float]:
    """Ratios of slip to opening of mixed paths: 0, three that suit the law, and infinity."""
    exact = slip.end / opening.end
    middle = min((a * 10.0**e for a in (1, 2, 5) for e in range(-9, 10)), key=lambda x: abs(np.log(x / exact)))
    return [0.0, middle / 4, middle, 4 * middle, np.inf]


def mixed(contact: Contact, ratio: float, opening: Reach, slip: Reach) -> Trace:
    """Opened and slipped at once, until one of the two is far beyond its end."""
    o, s = (0.0, 1.0) if np.isinf(ratio) else (1.0, ratio)
    far = 2 * min(end / share for end, share in ((opening.end, o), (slip.end, s)) if share)
    u = along([0, far])
    return contact.trace(np.stack([o * u, s * u], axis=1).tolist())


@checked
def plot_law(law: ContactLaw) -> Figure:
    """Draw what a law answers: pull and release, closure, shear under pressure, mixed paths, and its strength.

    Ranges follow the law's own peaks and breaks. Pressures are held while the contact slips. Raises ParameterError for
    what is no law, and for one whose numbers differ from contact to contact.
    """
    contact, found = alone(law), characteristics(law)
    opening = reach(found.tension.displacement, found.tension.breaking)
    slips = [reach(mode.displacement, mode.breaking) for mode in found.shear]
    figure = Figure(figsize=(13.5, 8.2), layout="constrained")
    (pull, closure, strength), (shear, normal, tangential) = figure.subplots(2, 3)
    with np.errstate(all="ignore"):
        draw_pull(pull, pull_and_release(contact, opening), opening)
        draw_shear(shear, contact, found, slips)
        draw_closure(closure, contact, found)
        draw_envelope(strength, envelope(law))
        draw_mixed(normal, tangential, contact, opening, slips[0])
    figure.suptitle(found.name)
    return figure


def draw_trace(trace: Trace, ax: Any) -> Figure:
    """Both modes of one path; see :meth:`Trace.plot`."""
    figure, axes = given_or_new("Trace.plot", ax, (6.4, 4.4))
    pull = (trace.opening, trace.normal, "normal traction over opening")
    for k, (moved, traction, name) in enumerate((pull, (trace.slip, trace.shear, "shear over slip"))):
        if np.ptp(moved) > 0:
            axes.plot(moved * UM, traction * MPA, color=SHADES[k], linestyle=style(k), linewidth=1.5, label=name)
    axes.set(xlabel="opening (normal) and slip (shear) (µm)", ylabel="traction (MPa), tension positive")
    axes.axhline(0, color="0.6", linewidth=0.8)
    axes.grid(alpha=0.25)
    axes.legend(frameon=False)
    return figure


def draw_pull(axes: Axes, run: Trace, to: Reach) -> None:
    """Normal traction over opening."""
    curves = [(run.opening, run.normal, SHADES[0], "")]
    _draw(axes, curves, "opening (µm)", "normal traction (MPa)", "pull, release, pull on", to)


def draw_shear(axes: Axes, contact: Contact, found: Characteristics, to: Sequence[Reach]) -> None:
    """Shear traction over slip, under each pressure."""
    curves = []
    for mode, each, color in zip(found.shear, to, SHADES, strict=True):
        run = shear_and_reverse(contact, -mode.pressure, each)
        curves.append((run.slip, run.shear, color, f"{mode.pressure * MPA:.4g}"))
    furthest = max(to, key=lambda each: each.end)
    zoom = Reach(max(each.peak for each in to), furthest.end)
    _draw(axes, curves, "slip (µm)", "shear traction (MPa)", "shear under held pressure, reversed", zoom)
    axes.legend(title="pressure (MPa)", ncols=4, loc="upper center", bbox_to_anchor=(0.5, -0.14), frameon=False)


def draw_mixed(normal: Axes, tangential: Axes, contact: Contact, opening: Reach, slip: Reach) -> None:
    """Both tractions along straight paths."""
    runs = [(ratio, mixed(contact, ratio, opening, slip)) for ratio in ratios(opening, slip)]
    names = ["pull only" if r == 0 else "slip only" if np.isinf(r) else f"{r:g}" for r, _ in runs]
    rows = list(zip(runs, MIXED, names, strict=True))
    pulls = [_upto(opening, run.opening, run.normal, color, name) for (r, run), color, name in rows if np.isfinite(r)]
    shears = [_upto(slip, run.slip, run.shear, color, name) for (r, run), color, name in rows if r]
    _draw(normal, pulls, "opening (µm)", "normal traction (MPa)", "opening and slip together: normal", opening)
    _draw(tangential, shears, "slip (µm)", "shear traction (MPa)", "opening and slip together: shear", slip)
    for axes in (normal, tangential):
        axes.legend(title="slip / opening", ncols=4, loc="upper center", bbox_to_anchor=(0.5, -0.14), frameon=False)


def _upto(to: Reach, u: np.ndarray, traction: np.ndarray, color: str, name: str) -> Curve:
    """A curve as far as one mode is shown."""
    shown = u <= 1.15 * to.end
    return u[shown], traction[shown], color, name


def draw_closure(axes: Axes, contact: Contact, found: Characteristics) -> None:
    """Pressure over closure."""
    closure = np.linspace(0, find_closure(contact, 2 * found.shear[-1].pressure), 300)
    pressed = contact.run([(-c, 0.0) for c in closure.tolist()])[:, 0]
    _draw(axes, [(closure, -pressed, SHADES[0], "")], "closure (µm)", "pressure (MPa)", "closure", None)


def draw_envelope(axes: Axes, strength: Envelope) -> None:
    """Shear strength over pressure, tension to the left."""
    axes.set(xlabel="pressure (MPa), tension below 0", ylabel="shear traction (MPa)", title="strength")
    axes.grid(alpha=0.25)
    if not len(strength.normal):
        axes.text(0.5, 0.5, "no strength in shear:\nit never yields", ha="center", transform=axes.transAxes)
        axes.set(xticks=[], yticks=[])
        return
    pressure, peak = -strength.normal * MPA, strength.peak * MPA
    if pressure[0] < 0:  # the tension cut-off
        pressure, peak = np.concatenate([pressure[:1], pressure]), np.concatenate([[0.0], peak])
    axes.plot(pressure, peak, color=SHADES[0], label="peak")
    axes.plot(-strength.normal * MPA, strength.residual * MPA, "--", color=MIXED[0], label="after long slip")
    axes.axvline(0, color="0.6", linewidth=0.8)
    axes.set_ylim(bottom=0)
    axes.legend(frameon=False)


def _draw(axes: Axes, curves: Sequence[Curve], x: str, y: str, title: str, zoom: Reach | None) -> None:
    """Curves in um and MPa, with the surroundings of the peak in a corner that is free."""
    axes.set(xlabel=x, ylabel=y, title=title)
    axes.grid(alpha=0.25)
    axes.axhline(0, color="0.6", linewidth=0.8)
    places = [axes]
    if zoom and zoom.end > 8 * zoom.peak and _is_free(curves):
        inset = axes.inset_axes((0.46, 0.5, 0.52, 0.47))
        inset.set_xlim(0, 3 * zoom.peak * UM)
        inset.tick_params(labelsize="x-small")
        inset.grid(alpha=0.25)
        places.append(inset)
    for place in places:
        for u, traction, paint, name in curves:
            place.plot(
                u * UM, traction * MPA, color=paint, linestyle=style(COLORS.index(paint)), linewidth=1.3, label=name
            )
    if not any(np.nanmax(np.abs(traction), initial=0.0) > 0 for _, traction, *_ in curves):
        axes.set(ylim=(-1, 1), yticks=[0])
        axes.text(0.5, 0.55, "nothing is held", ha="center", transform=axes.transAxes)


def _is_free(curves: Sequence[Curve]) -> bool:
    """Whether the upper right corner is empty."""
    far, top = (max(float(np.nanmax(curve[at], initial=0.0)) for curve in curves) for at in (0, 1))
    return all(np.nanmax(t[u > 0.45 * far], initial=0.0) < 0.48 * top for u, t, *_ in curves)
