"""What a texture is in numbers: sizes and shapes of grains, minerals, directions of edges, and what costs steps."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape
from typing import Any

import attrs
import numpy as np

from grainlaw.arguments import Checked, checked
from grainlaw.geometry.cells.area_cells import circularities
from grainlaw.geometry.cells.dealing import expected_share, like_share, shuffled_share
from grainlaw.geometry.minerals import Minerals
from grainlaw.geometry.sizes import SAMPLE, ByPhase, Sizes
from grainlaw.mesh import build_mesh
from grainlaw.quantity import aligned
from grainlaw.tessellation import Tessellation, Tessellator

BINS = 18  #: of the rose, 10 degrees each
PERCENTILES = (5, 25, 50, 75, 95)
SMALL, THIN = 0.05, 0.2  #: slivers: of the median area of cells; circularity


@attrs.frozen(eq=False)
class Distribution(metaclass=Checked):
    """Of a quantity over grains."""

    mean: float
    cv: float  #: standard deviation over mean
    percentiles: Mapping[int, float]  #: 5, 25, 50, 75 and 95 %


@attrs.frozen(eq=False, kw_only=True)
class Texture(metaclass=Checked):
    """What :func:`texture` finds; prints as a table."""

    grains: int  #: number of grains
    cells: int  #: polygons; more than grains where these can break
    diameters: Distribution  #: m, of circles with the areas of the grains
    phase_diameters: Mapping[str, Distribution]  #: m, the same by phase
    circularity: Distribution  #: 4 pi area / perimeter^2 of the grains: 1 for a circle, 0.907 for a hexagon
    fractions: Mapping[str, float]  #: of the area, by phase
    like_share: float  #: of the length between grains: where both are of one phase
    clustering: float  #: that, over what it is on average; 1 is random (docs/textures.md)
    rose: np.ndarray  #: (18,) m, length between grains by direction, in 10 degrees each from the x axis
    anisotropy: float  #: from 0, as much length in all directions, to 1, all in one
    direction: float  #: rad from the x axis, in [0, pi): that of most length
    joints: Mapping[str, float]  #: m, length of each
    edge: Distribution  #: m, lengths of all edges
    shortest_edge: float  #: m
    step_ratio: float  #: stable time step, over that of zones as they mostly are: what the worst place costs
    step_grain: int  #: cell where that is
    slivers: np.ndarray  #: numbers of cells below 5 % of the median area, or with a circularity below 0.2
    asked: Mapping[str, Any]  #: what the tessellator was asked for, as far as it is known

    def __str__(self) -> str:
        rows = [["grains", f"{self.grains}", self._asked("grains")]]
        rows += [["cells", f"{self.cells}", ""]] if self.cells > self.grains else []
        rows += _rows("diameter (mm)", self.diameters, 1e3, self.asked.get("diameters"))
        for name, found in self.phase_diameters.items():
            wanted = self.asked.get("phase_diameters", {}).get(name)
            rows += _rows(f"{name}: diameter (mm)", found, 1e3, wanted)[:2] if len(self.fractions) > 1 else []
        rows += _rows("circularity", self.circularity, 1.0)
        rows[-3][2] = self._asked("circularity")
        for name, share in self.fractions.items():
            rows.append([f"{name} (%)", f"{share * 100:.2f}", self._asked(name)])
        if len(self.fractions) > 1:
            rows.append(["boundary between like grains (%)", f"{self.like_share * 100:.1f}", ""])
            rows.append(["clustering", f"{self.clustering:.3f}", self._asked("clustering")])
        rows.append(["anisotropy of edges", f"{self.anisotropy:.3f}", ""])
        rows.append(["direction of most length (deg)", f"{np.degrees(self.direction):.0f}", ""])
        rows += [[f"joints: {name} (m)", f"{length:.4g}", ""] for name, length in self.joints.items()]
        rows.append(["shortest edge (mm)", f"{self.shortest_edge * 1e3:.4g}", ""])
        rows.append(["  of the median edge", f"{self.shortest_edge / self.edge.percentiles[50]:.3f}", ""])
        rows.append(["time step, of what most zones allow", f"{self.step_ratio:.3f}", f"at cell {self.step_grain}"])
        rows.append(["slivers", f"{len(self.slivers)}", ", ".join(map(str, self.slivers[:5]))])
        return aligned([["", "found", "asked"], *rows])

    @property
    def _facts(self) -> dict[str, str]:
        facts = {"grains": self.grains, "cells": self.cells, "slivers": len(self.slivers)}
        phases = {"phases": ", ".join(self.fractions)} if len(self.fractions) > 1 else {}
        return {name: str(count) for name, count in facts.items()} | phases

    def _html(self) -> str:
        return f"<pre>{escape(str(self))}</pre>"

    def _asked(self, name: str) -> str:
        value = self.asked.get(name)
        if value is None:
            return ""
        return f"{value * 100:.2f}" if name in self.fractions else f"{value:g}"


def _rows(name: str, found: Distribution, factor: float, asked: Distribution | None = None) -> list[list[str]]:
    both = [found] if asked is None else [found, asked]
    spread = [", ".join(f"{value * factor:.3g}" for value in each.percentiles.values()) for each in both]
    rows = [
        [f"{name}: mean", *(f"{each.mean * factor:.4g}" for each in both)],
        ["  coefficient of variation", *(f"{each.cv:.3f}" for each in both)],
        ["  5, 25, 50, 75, 95 %", *spread],
    ]
    return [[*row, ""][:3] for row in rows]


@checked
def texture(grains: Tessellation, asked: Tessellator | None = None) -> Texture:
    """The texture of grains in numbers, beside what a tessellator was ``asked`` for if it is given.

    Cells of one grain count as one. ``clustering`` is over the mean of grains that change places with their minerals,
    for these may be larger than others; of ``Minerals`` without ``sizes``, where it is given, over the mean of minerals
    that change places, as they were dealt (some per cent apart). The time step is that of deformable zones without
    contacts, to a fifth, from the stiffness and the mass of each node alone: it does not depend on the material
    (docs/textures.md).
    """
    edges = grains.edges
    numbers, grain = np.unique(grains.parent, return_inverse=True)
    grain = grain.ravel()
    inner = edges.right >= 0
    outline = ~inner | (grain[edges.left] != grain[edges.right])
    between = inner & outline
    areas = np.bincount(grain, grains.areas)
    perimeters = np.bincount(grain[edges.left[outline]], edges.length[outline], len(numbers))
    perimeters += np.bincount(grain[edges.right[between]], edges.length[between], len(numbers))
    phase = grains.phase[np.unique(grain, return_index=True)[1]]
    pairs = grain[np.column_stack([edges.left, edges.right])[between]]
    lengths = edges.length[between]
    share = like_share(phase, pairs, lengths)
    average = expected_share(phase) if _is_dealt(asked) else shuffled_share(phase, pairs, lengths)
    along = (grains.vertices[edges.end] - grains.vertices[edges.start])[between]
    rose, anisotropy, direction = _directions(along)
    step_ratio, step_grain = build_mesh(grains).worst_step
    diameters, names = 2 * np.sqrt(areas / np.pi), {k: grains.phase_name(k) for k in np.unique(phase).tolist()}
    parts = np.bincount(grains.phase, grains.areas) / areas.sum()
    return Texture(
        grains=len(numbers), cells=grains.count,
        diameters=_distribution(diameters),
        phase_diameters={name: _distribution(diameters[phase == k]) for k, name in names.items()},
        circularity=_distribution(4 * np.pi * areas / perimeters**2),
        fractions={name: float(parts[k]) for k, name in names.items()},
        like_share=share, clustering=share / (average or np.nan),
        rose=rose, anisotropy=anisotropy, direction=direction,
        joints={name: float(edges.length[edges.kind == k].sum()) for k, name in enumerate(grains.joints, 2)},
        edge=_distribution(edges.length), shortest_edge=float(edges.length.min()),
        step_ratio=step_ratio, step_grain=step_grain, slivers=_slivers(grains), asked=_wishes(asked, areas),
    )  # fmt: skip


def _distribution(values: np.ndarray) -> Distribution:
    percentiles = np.percentile(values, PERCENTILES).tolist()
    return Distribution(
        float(values.mean()), float(values.std() / values.mean()), dict(zip(PERCENTILES, percentiles, strict=True))
    )


def _directions(along: np.ndarray) -> tuple[np.ndarray, float, float]:
    """Length by direction; and the mean axis, angles doubled as in Mardia and Jupp 2000, doi:10.1002/9780470316979."""
    length, angle = np.hypot(*along.T), np.arctan2(along[:, 1], along[:, 0]) % np.pi
    if not len(length):
        return np.zeros(BINS), 0.0, 0.0
    rose = np.histogram(angle, BINS, (0, np.pi), weights=length)[0]
    mean = (length * np.exp(2j * angle)).sum() / length.sum()
    return rose, float(abs(mean)), float(np.angle(mean) / 2 % np.pi)


def _slivers(grains: Tessellation) -> np.ndarray:
    small = grains.areas < SMALL * np.median(grains.areas)
    return np.flatnonzero(small | (circularities(grains) < THIN))


def _is_dealt(tessellator: Any) -> bool:
    """Whether phases were dealt to grains whatever their sizes."""
    while tessellator is not None and not isinstance(tessellator, Minerals):
        tessellator = getattr(tessellator, "tessellator", None)
    return tessellator is not None and tessellator.sizes is None


def _wishes(tessellator: Any, areas: np.ndarray) -> dict[str, Any]:
    """What a tessellator, and those in it, were asked for; diameters for grains of the mean of the areas (g,) m2."""
    found: dict[str, Any] = {}
    while tessellator is not None:
        fractions = getattr(tessellator, "fractions", {})
        wishes = {**fractions, **_size_wishes(tessellator, fractions, float(areas.mean()))}
        for name in ("grains", "clustering", "circularity"):
            if isinstance(getattr(tessellator, name, None), (int, float)):
                wishes[name] = getattr(tessellator, name)
        found = {**wishes, **found}
        tessellator = getattr(tessellator, "tessellator", None)
    return found


def _size_wishes(tessellator: Any, fractions: Mapping[str, float], mean: float) -> dict[str, Any]:
    """Distributions of the diameters (m), from many draws, of grains with this mean area (m2)."""
    random, sizes = np.random.default_rng(0), getattr(tessellator, "sizes", None)
    if getattr(tessellator, "areas", None) is not None:
        sizes, phase, drawn = None, np.zeros(0), np.array(tessellator.areas)
    elif isinstance(sizes, ByPhase):
        phase, drawn = sizes.draw(fractions, SAMPLE, random)
    elif isinstance(sizes, Sizes):
        phase, drawn = np.zeros(0), sizes.draw(SAMPLE, random)
    else:
        return {}
    diameters = 2 * np.sqrt(drawn * (mean / drawn.mean()) / np.pi)
    by_phase = {name: _distribution(diameters[phase == k]) for k, name in enumerate(fractions)} if len(phase) else {}
    return {"diameters": _distribution(diameters)} | ({"phase_diameters": by_phase} if by_phase else {})
