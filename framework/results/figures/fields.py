"""A field on the deformed specimen: displacements, stresses and what else a frame has, with arrows and minerals."""

from __future__ import annotations

from typing import Any

import attrs
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection

from grainlaw.arguments import checked
from grainlaw.columns import quantity_of
from grainlaw.drawing.figure import Figure, LengthUnit, given_or_new, height_of, to_scale
from grainlaw.drawing.palette import BLACK, VERMILLION
from grainlaw.fields import checked_vector
from grainlaw.messages import refusal, spelled
from grainlaw.quantity import Quantity
from grainlaw.results.figures.cracks import count_below, draw_deformed, how_far, round_below, unit_of
from grainlaw.results.frames import Frame
from grainlaw.results.result import Result
from grainlaw.results.vtk import principal

ALIKE = 1e-6  #: of the largest value: by less values do not differ
MANY = 1e-3  #: m, from which displacements are shown in mm
MOST_ARROWS = 24  #: along the longer side of a specimen
ONE_SIGN, BOTH_SIGNS = "cividis", "RdBu_r"
OF_NODES = ("displacement", "velocity")
STRESSES = ("stress_1", "stress_2", "stress_xx", "stress_yy", "stress_xy")
OF_GRAINS = (*STRESSES, "rotation")
NODAL = tuple(name + end for name in OF_NODES for end in ("", "_x", "_y"))


@checked
def plot_field(
    result: Result, field: str, *, frame: int = -1, since: str | None = None, vectors: bool = False,
    phases: bool = False, limits: tuple[float, float] | None = None, ax: Any = None,
) -> Figure:  # fmt: skip
    """Draw a field in colours on the deformed specimen, at one frame, counted from the end if negative.

    ``field`` is of nodes: "displacement" or "velocity", their sizes, and "displacement_x" and so on; of grains:
    "stress_1" and "stress_2", the larger and the smaller principal stress, "stress_xx", "stress_yy", "stress_xy",
    tension positive, and "rotation", counter-clockwise; of zones or contact points: what is in ``Frame.zones`` and
    ``Frame.bonds``. What is of contact points is drawn as lines, other fields have broken contact points in black.

    ``since`` names a stage: displacements, stresses and rotations count from the last frame before it; principal
    stresses are then those of the change. ``vectors`` adds arrows of the displacement or the velocity, or crosses along
    the principal stresses, orange where they pull and black where they press. ``phases`` shows where minerals meet, and
    under contact points the minerals. ``limits`` are the ends of the colours (SI), so that pictures can be compared.
    Draws into the axes ``ax`` of matplotlib, if they are given. Returns the figure.
    Raises ParameterError.
    """
    moment = result.frame("plot_field", frame)
    allowed = [*NODAL, *OF_GRAINS, *(name for name, row in moment.zones.items() if row.ndim == 1), *moment.bonds]
    if field not in allowed:
        raise refusal("plot_field: field", field, ", ".join(allowed))
    if vectors and field not in (*NODAL, *STRESSES):
        raise refusal("plot_field: vectors", vectors, f"False for {field}: displacement, velocity and stress have them")
    if since is not None and field not in (*NODAL[:3], *OF_GRAINS):
        raise refusal("plot_field: since", since, f"None for {field}: displacement, stress and rotation have it")
    width, height = np.ptp(result.specimen.grains.vertices, axis=0)
    figure, axes = given_or_new(
        "plot_field", ax, (min(10.0, 6.5 * width / height + 2.4), height_of(width, height, 1.8, 7.0))
    )
    begin, look, unit = result.frame_before("plot_field", since), _quantity(field), unit_of(result)
    displacement = moment.displacement - (begin.displacement if begin else 0.0)
    stress = moment.stress - (begin.stress if begin else 0.0)
    moving = moment.velocity if field.startswith("velocity") else displacement
    far = moving if field in NODAL else moment.bonds.get(field, np.zeros(0))
    if look.unit == "µm" and np.nanmax(np.abs(far), initial=0.0) >= MANY:
        look = attrs.evolve(look, unit="mm", factor=1e3)
    if field in NODAL:
        drawn = _draw_nodes(axes, result, moment, unit, _part(field, moving) * look.factor, phases)
    elif field in moment.bonds:
        drawn = _draw_bonds(axes, result, moment, unit, moment.bonds[field] * look.factor, phases)
        if axes.get_legend_handles_labels()[1]:
            count_below(axes)
    else:
        values = moment.zones[field] if field in moment.zones else _of_grains(result, field, displacement, stress)
        drawn = _draw_zones(axes, result, moment, unit, values * look.factor, phases)
    if limits is not None:
        low, high = _ends(limits)
        drawn.set(cmap=BOTH_SIGNS if low < 0 < high else ONE_SIGN, clim=(low * look.factor, high * look.factor))
    if vectors and field in NODAL:
        _arrows(axes, result, moment, unit, moving, look)
    elif vectors:
        _crosses(axes, result, moment, unit, stress)
    to_scale(axes, unit)
    words = f"{look.words} since {since}" if since else look.words
    figure.colorbar(drawn, ax=axes, label=attrs.evolve(look, words=words).heading, shrink=0.7)
    room = 26 if vectors and field in NODAL else None  # points, for the key of the arrows
    axes.set_title(", ".join(filter(None, (moment.stage, how_far(result, frame)))), pad=room)
    return figure


def _ends(limits: Any) -> tuple[float, float]:
    low, high = checked_vector("plot_field: limits", limits, "SI", ("low", "high"))
    if not low < high:
        raise refusal("plot_field: limits", limits, "two numbers, the lower one first")
    return low, high


def _quantity(field: str) -> Quantity:
    """Words and unit of a field, also of one component."""
    whole, _, axis = field.rpartition("_")
    if whole in OF_NODES:
        return attrs.evolve(quantity_of(whole), name=field, words=f"{whole} along {axis}")
    if field in STRESSES:
        return Quantity(field, "MPa", words=f"{spelled(field)}, tension positive")
    return quantity_of(field)


def _part(field: str, vector: np.ndarray) -> np.ndarray:
    """(i,) the size of vectors (i, 2), or one component."""
    return np.hypot(*vector.T) if field in OF_NODES else vector[:, "xy".index(field[-1])]


def _of_grains(result: Result, field: str, displacement: np.ndarray, stress: np.ndarray) -> np.ndarray:
    """(z,) what is of grains, at their zones."""
    if field == "rotation":
        values = result.specimen.grain_rotations(result.mesh.nodes + displacement)
    else:
        values = dict(zip(STRESSES, (*principal(stress), *stress.T), strict=True))[field]
    return values[result.mesh.zone_grain]


def _draw_nodes(axes: Axes, result: Result, moment: Frame, unit: LengthUnit, values: np.ndarray, phases: bool) -> Any:
    place = (result.mesh.nodes + moment.displacement) * unit.factor
    drawn = axes.tripcolor(*place.T, result.mesh.zones, values, shading="gouraud", **_colors(values))
    lines = draw_deformed(axes, result, moment, unit, fills={"facecolor": "none", "edgecolor": "none"})
    _draw_edges(axes, result, moment, lines, phases)
    return drawn


def _draw_zones(axes: Axes, result: Result, moment: Frame, unit: LengthUnit, values: np.ndarray, phases: bool) -> Any:
    lines = draw_deformed(axes, result, moment, unit, fills={"array": values, "edgecolor": "face", **_colors(values)})
    drawn = axes.collections[-2]  # below the rims
    _draw_edges(axes, result, moment, lines, phases)
    return drawn


def _draw_bonds(axes: Axes, result: Result, moment: Frame, unit: LengthUnit, values: np.ndarray, phases: bool) -> Any:
    lines, there = draw_deformed(axes, result, moment, unit, phases=phases), np.isfinite(values)
    return axes.add_collection(
        LineCollection(list(lines[there]), array=values[there], linewidths=2.0, **_colors(values[there]))
    )


def _draw_edges(axes: Axes, result: Result, moment: Frame, lines: np.ndarray, phases: bool) -> None:
    """Broken contact points, and those between two minerals as dots."""
    if phases:
        grain = result.mesh.node_grain[result.interfaces[:, [0, 2]]]
        met = np.tile(np.ptp(result.specimen.grains.phase[grain], axis=1) > 0, 2)
        axes.add_collection(LineCollection(list(lines[met]), colors=BLACK, linewidths=0.9, linestyles=":"))
    broken = ~np.isnan(moment.bonds["broken_time"])
    axes.add_collection(LineCollection(list(lines[broken]), colors=BLACK, linewidths=0.8))


def _colors(values: np.ndarray) -> dict[str, Any]:
    """Colours by value: even about zero where there are both signs; one that is alike everywhere in the middle."""
    most = float(np.abs(values).max(initial=0.0))
    if values.min(initial=0.0) < 0 < values.max(initial=0.0):
        return {"cmap": BOTH_SIGNS, "clim": (-most, most)}
    known = values[np.isfinite(values)]
    if len(known) and np.ptp(known) <= ALIKE * most:
        room = 0.05 * most or 1.0
        return {"cmap": ONE_SIGN, "clim": (float(known.min()) - room * (most > 0), float(known.max()) + room)}
    return {"cmap": ONE_SIGN}


def _chosen(place: np.ndarray) -> tuple[np.ndarray, float]:
    """Numbers of grains that are far enough from each other for arrows, and how far that is, in the unit of place."""
    spacing = float(np.ptp(place, axis=0).max()) / MOST_ARROWS
    return np.unique(np.floor(place / spacing).astype(int), axis=0, return_index=True)[1], spacing


def _arrows(axes: Axes, result: Result, moment: Frame, unit: LengthUnit, moving: np.ndarray, look: Quantity) -> None:
    """Means of the grains as arrows, the longest as long as they are apart."""
    places = (result.mesh.nodes + moment.displacement) * unit.factor
    place, moved = map(result.specimen.grain_means, (places, moving))
    at, spacing = _chosen(place)
    sizes = np.hypot(*moved[at].T)
    most = float(sizes.max(initial=0.0)) or 1.0
    arrows = axes.quiver(
        *place[at].T,
        *moved[at].T,
        angles="xy",
        scale_units="xy",
        scale=most / (1.5 * spacing),
        width=0.004,
        color="white",
        edgecolor="black",
        linewidth=0.7,
    )
    length = round_below(most)
    axes.quiverkey(arrows, 0.9, 1.02, length, look.with_unit(length), labelpos="W", coordinates="axes")


def _crosses(axes: Axes, result: Result, moment: Frame, unit: LengthUnit, stress: np.ndarray) -> None:
    """Both principal stresses of grains as lines along their directions, the longest as long as they are apart."""
    place = result.specimen.grain_means((result.mesh.nodes + moment.displacement) * unit.factor)
    at, spacing = _chosen(place)
    angle = np.arctan2(2 * stress[at, 2], stress[at, 0] - stress[at, 1]) / 2  # of the larger one
    both = [values[at] for values in principal(stress)]
    most = float(np.max(np.abs(both), initial=0.0)) or 1.0
    for values, turn in zip(both, (0.0, np.pi / 2), strict=True):
        along = np.column_stack([np.cos(angle + turn), np.sin(angle + turn)])
        half = 0.7 * spacing * (np.abs(values) / most)[:, None] * along
        lines = np.stack([place[at] - half, place[at] + half], axis=1)
        colors = np.where(values > 0, VERMILLION, BLACK)
        axes.add_collection(LineCollection(list(lines), colors=list(colors), linewidths=1.1))
