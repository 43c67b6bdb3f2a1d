"""Grains from label maps: images in which every pixel has the number of its grain."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any

import attrs
import numpy as np
from scipy.spatial import cKDTree

from grainlaw.arguments import Checked, checked
from grainlaw.fields import ParameterError, checked_number, checked_whole_number
from grainlaw.geometry.cells.area_cells import grains_of
from grainlaw.geometry.cells.area_fit import cells_at
from grainlaw.geometry.cells.label_map import LabelMap, label_map
from grainlaw.geometry.cells.sides import is_convex
from grainlaw.geometry.polygons import phases_of
from grainlaw.geometry.voronoi import Voronoi
from grainlaw.polygon import linked
from grainlaw.region import Region
from grainlaw.tessellation import Tessellation, TilingError

SPECK = 4  #: pixels
SAME = 1e-3  #: of the size of the smallest grain: nearer centroids are one


@checked
def from_labels(
    image: Any, pixel: float, phases: Mapping[int, Any] | None = None, *, cell_size: float | None = None,
    merge: float = 0.25, seed: int = 1, speck: int = SPECK, fill: bool = False, region: Region | None = None,
    corner: Any = None,
) -> Tessellation:  # fmt: skip
    """Grains from a label map: whole numbers from 1 in rows and columns, row 0 at the top, or a file of them.

    A file is an array of numpy (.npy) or a grey image. ``pixel`` is the size of a pixel in m, ``phases`` has a number
    or a name for each label. ``parent`` has the label of every grain.

    Without ``cell_size`` each label becomes one convex grain: a cell of a power diagram, with the area of its label
    and, as nearly as such cells can, its centroid; edges shorter than ``merge`` times the size of a grain vanish. With
    a ``cell_size`` (m, the root of the mean area) the rectangle is filled with Voronoi cells, from ``seed``, and each
    has the label of most of its pixels: grains of any shape, which can break. :func:`label_agreement` tells how well
    either agrees with the image.

    Parts of a label of at most ``speck`` pixels apart from its largest become part of what is round them; ``fill``
    gives pixels of the label 0 to the nearest label. What lies outside a ``region`` is cut off, background or not: the
    specimen in the picture may have any outline, a convex one without ``cell_size``. The image lies with its middle at
    that of the region's box, or with its lower left ``corner`` at a place (m).

    Raises :class:`~grainlaw.fields.ParameterError`, with label and place, for larger parts, labels that touch at a
    corner only, 0 and negative labels, for a grain too small to get a cell, and for a region that is not in the image.
    """
    where = "from_labels"
    pixel = checked_number(f"{where}: pixel", pixel, "m", above=0)
    merge = checked_number(f"{where}: merge", merge, at_least=0)
    speck = checked_whole_number(f"{where}: speck", speck, at_least=0)
    made = label_map(where, image, pixel, speck=speck, fill=fill, region=region, corner=corner)
    if isinstance(image, (str, os.PathLike)) and len(made.labels) < 2:
        raise ParameterError(
            f"{where}: every pixel of {os.fspath(image)} has the label {made.labels[0]}, a file must have two at least"
        )
    if region is not None and cell_size is None and not is_convex(region):
        raise ParameterError(f"{where}: region is not convex, for which grains are made of cells: give a cell_size")
    phase, names = _phases(where, made, phases)
    if cell_size is None:
        grains, owner = _power_cells(where, made, merge)
    else:
        cell_size = checked_number(f"{where}: cell_size", cell_size, "m", above=0)
        grains = Voronoi(grain_size=cell_size, seed=seed, merge=merge).tessellate(made.region)
        owner = _owners(where, made, grains)
    options: dict[str, Any] = {} if phase is None else {"phase": phase[owner], "phase_names": names}
    return attrs.evolve(grains, parent=made.labels[owner], **options)


def _phases(where: str, made: LabelMap, phases: Mapping[int, Any] | None) -> tuple[np.ndarray | None, tuple[str, ...]]:
    if phases is None:
        return None, ()
    missing = [label for label in made.labels.tolist() if label not in phases]
    if missing:
        raise ParameterError(f"{where}: phases has no entry for the label {missing[0]}")
    return phases_of(where, [phases[label] for label in made.labels.tolist()], len(made.labels))


def _power_cells(where: str, made: LabelMap, merge: float) -> tuple[Tessellation, np.ndarray]:
    """Convex grains, and which label each of them is."""
    near = cKDTree(made.centroids).query_pairs(SAME * float(np.sqrt(made.areas.min())))
    if near:
        (one, other), (x, y) = (made.labels[list(min(near))], made.centroids[min(near)[0]])
        raise ParameterError(
            f"{where}: the labels {one} and {other} have the same centroid ({x:.6g}, {y:.6g}) m, one lies round the "
            "other: they cannot both be convex, cell_size makes grains of cells"
        )
    try:
        fit = grains_of(
            cells_at(made.region, made.areas, made.centroids), made.areas, np.arange(len(made.areas)), merge
        )
    except TilingError as error:
        raise ParameterError(f"{where}: {error}; cell_size makes grains of cells") from None
    return fit.tessellation, fit.owner


def _owners(where: str, made: LabelMap, grains: Tessellation) -> np.ndarray:
    """(g,) which label each cell belongs to: that of most of its pixels, each label in one part."""
    at = made.drawn(grains).ravel()
    found, times = np.unique((at * len(made.labels) + made.number.ravel())[at >= 0], return_counts=True)
    cell, label = np.divmod(found, len(made.labels))
    order = np.lexsort((label, -times, cell))
    seen, first = np.unique(cell[order], return_index=True)
    column, row = ((grains.centroids - made.corner) / made.pixel).astype(int).T
    owner = made.number[made.image.shape[0] - 1 - row, column]  # of a cell smaller than a pixel
    owner[seen] = label[order[first]]
    owner = _in_one_part_each(grains, owner)
    missing = np.setdiff1d(np.arange(len(made.labels)), owner)
    if len(missing):
        x, y = made.centroids[missing[0]]
        raise ParameterError(
            f"{where}: the label {made.labels[missing[0]]} at ({x:.6g}, {y:.6g}) m gets no cell, "
            "cell_size must be smaller"
        )
    return owner


def _in_one_part_each(grains: Tessellation, owner: np.ndarray) -> np.ndarray:
    """With cells apart from the largest part of their label given to the label with the most edge in common."""
    edges = grains.edges
    inner = edges.right >= 0
    left, right, length = edges.left[inner], edges.right[inner], edges.length[inner]
    while True:
        same = owner[left] == owner[right]
        part = linked(grains.count, left[same], right[same])
        sizes = np.bincount(part, grains.areas)
        label = np.zeros(len(sizes), dtype=np.int64)
        label[part] = owner
        order = np.lexsort((-sizes, label))
        apart = np.zeros(len(sizes), dtype=bool)
        apart[order[1:][np.diff(label[order]) == 0]] = True
        if not apart.any():
            return owner
        one, other = np.concatenate([part[left], part[right]]), np.concatenate([part[right], part[left]])
        rim = apart[one] & ~apart[other]  # one that touches no large part waits for the next round
        pairs, which = np.unique(np.column_stack([one[rim], label[other[rim]]]), axis=0, return_inverse=True)
        touched = np.bincount(which, np.tile(length, 2)[rim])
        for at in np.argsort(touched, kind="stable"):  # the longest last
            label[pairs[at, 0]] = pairs[at, 1]
        owner = label[part]


@attrs.frozen(eq=False)
class LabelAgreement(metaclass=Checked):
    """How well grains agree with a label map; index letter ``n``: of the labels, in rising order."""

    labels: np.ndarray  #: (n,)
    share: float  #: of the pixels that lie in the grain of their label
    shares: np.ndarray  #: (n,) the same of the pixels of each label
    area_errors: np.ndarray  #: (n,) area of the grain over that of the label, less 1

    def __str__(self) -> str:
        worst = int(self.shares.argmin())
        return (
            f"{len(self.labels)} labels, {self.share:.2%} of the pixels agree\n"
            f"the least, {self.shares[worst]:.2%}, of the label {self.labels[worst]}\n"
            f"error of the areas: largest {abs(self.area_errors).max():.2%}, "
            f"rms {np.sqrt((self.area_errors**2).mean()):.2%}"
        )


@checked
def label_agreement(
    grains: Tessellation, image: Any, pixel: float, *, speck: int = SPECK, fill: bool = False,
    region: Region | None = None, corner: Any = None,
) -> LabelAgreement:  # fmt: skip
    """How well the grains of :func:`from_labels` agree with their label map; arguments as there.

    Raises :class:`~grainlaw.fields.ParameterError`.
    """
    where = "label_agreement"
    pixel = checked_number(f"{where}: pixel", pixel, "m", above=0)
    speck = checked_whole_number(f"{where}: speck", speck, at_least=0)
    made = label_map(where, image, pixel, speck=speck, fill=fill, region=region, corner=corner)
    if abs(grains.region.bounds - made.region.bounds).max() > pixel / 2:
        width, height = made.region.bounds[1] - made.region.bounds[0]
        raise ParameterError(
            f"{where}: grains fill another region than the image, {width:g} m x {height:g} m; "
            "give region and corner as to from_labels"
        )
    at = made.drawn(grains)
    agree = ((at >= 0) & (grains.parent[at] == made.image))[made.inside]
    areas = [grains.areas[grains.parent == label].sum() for label in made.labels]
    return LabelAgreement(
        made.labels,
        float(agree.mean()),
        np.bincount(made.number[made.inside], agree) / made.counts,
        np.array(areas) / made.areas - 1,
    )
