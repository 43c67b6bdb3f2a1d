"""Label maps: images in which every pixel has the number of its grain, row 0 at the top."""

from __future__ import annotations

import os
import warnings
from collections.abc import Sequence
from functools import cached_property
from typing import Any

import attrs
import numpy as np
from scipy.ndimage import distance_transform_edt

from grainlaw.fields import ParameterError
from grainlaw.geometry.region import rectangle
from grainlaw.messages import refusal, short
from grainlaw.polygon import cross, linked
from grainlaw.region import Region
from grainlaw.tessellation import Tessellation

GREY = (255, 65535)  #: whole numbers that 1.0 stands for in a PNG of 8 and 16 bits
ROUNDS = 20  #: of specks given away that lie on other specks


@attrs.frozen(eq=False)
class LabelMap:
    """Labels (rows, columns), each of one part; index letter ``n``: of the labels."""

    image: np.ndarray  #: (rows, columns)
    pixel: float  #: m

    @cached_property
    def labels(self) -> np.ndarray:
        """(n,) in rising order."""
        return np.unique(self.image)

    @cached_property
    def number(self) -> np.ndarray:
        """(rows, columns) place of the label of each pixel in ``labels``."""
        return np.searchsorted(self.labels, self.image)

    @property
    def region(self) -> Region:
        """Rectangle, its lower left corner at the origin."""
        rows, columns = self.image.shape
        return rectangle(columns * self.pixel, rows * self.pixel)

    @cached_property
    def areas(self) -> np.ndarray:
        """(n,) m2."""
        return np.bincount(self.number.ravel()) * self.pixel**2

    @cached_property
    def centroids(self) -> np.ndarray:
        """(n, 2) m."""
        row, column = np.indices(self.image.shape).reshape(2, -1)
        sums = [np.bincount(self.number.ravel(), way) for way in (column, row)]
        column, row = sums / np.bincount(self.number.ravel())
        return np.column_stack([column + 0.5, self.image.shape[0] - row - 0.5]) * self.pixel

    def drawn(self, grains: Tessellation) -> np.ndarray:
        """(rows, columns) grain at the middle of each pixel; -1 for none."""
        rows, columns = self.image.shape
        found = np.full(self.image.shape, -1)
        points = grains.vertices / self.pixel  # pixels from the lower left corner
        for g, (a, b) in enumerate(zip(grains.first[:-1], grains.first[1:], strict=True)):
            corners = points[grains.corners[a:b]]
            (left, low), (right, high) = np.floor(corners.min(axis=0)), np.ceil(corners.max(axis=0))
            x = np.arange(max(left, 0), min(right, columns)) + 0.5
            y = np.arange(max(low, 0), min(high, rows)) + 0.5
            middles = np.stack(np.meshgrid(x, y), axis=-1)
            along = np.roll(corners, -1, axis=0) - corners
            inside = np.ones(middles.shape[:2], dtype=bool)
            for corner, edge in zip(corners, along, strict=True):
                inside &= cross(edge, middles - corner) >= -1e-9
            at = np.argwhere(inside)
            found[rows - 1 - (at[:, 0] + int(max(low, 0))), at[:, 1] + int(max(left, 0))] = g
        return found


def label_map(where: str, image: Any, pixel: float, *, speck: int, fill: bool) -> LabelMap:
    """Labels checked: numbers from 1, or 0 that ``fill`` gives to the nearest; parts of a label of at most ``speck``
    pixels given to the labels round them.

    Raises ParameterError, with label and place, for other parts and for 0.
    """
    image = _whole(where, image)
    made = LabelMap(image, pixel)
    if image.min() < 0 or not image.any():
        at = np.unravel_index(image.argmin(), image.shape)
        raise ParameterError(f"{where}: the label {image.min()} {_at(made, *at)} is not allowed, labels are from 1")
    if image.min() == 0:
        if not fill:
            at = np.unravel_index(image.argmin(), image.shape)
            raise ParameterError(
                f"{where}: the label 0 {_at(made, *at)} is background, {(image == 0).sum()} pixels in all "
                "(fill=True gives each to the nearest grain)"
            )
        image = image[tuple(distance_transform_edt(image == 0, return_distances=False, return_indices=True))]
    return _of_one_part_each(where, LabelMap(image, pixel), speck)


def _whole(where: str, image: Any) -> np.ndarray:
    if isinstance(image, (str, os.PathLike)):
        image = _read(where, image)
    values = np.asarray(image)
    if values.ndim != 2 or not values.size or values.dtype == bool or not np.issubdtype(values.dtype, np.number):
        raise refusal(f"{where}: image", image, "whole numbers in rows and columns, one for each pixel")
    if np.iscomplexobj(values) or not np.isfinite(values).all() or (values != np.round(values)).any():
        raise refusal(f"{where}: image", image, "whole numbers in rows and columns, one for each pixel")
    return values.astype(np.int64)


def _read(where: str, file: str | os.PathLike[str]) -> np.ndarray:
    """An array of numpy, or a grey image."""
    try:
        if os.fspath(file).endswith(".npy"):
            return np.load(file, allow_pickle=False)
        from matplotlib.image import imread  # here, for it takes long to load

        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of what stands beside the pixels
            values = imread(os.fspath(file))
    except Exception as error:  # readers of pictures and of headers have errors of their own
        raise ParameterError(f"{where}: {os.fspath(file)} cannot be read as an image: {short(str(error))}") from None
    if values.ndim == 3 and (values[..., :3] == values[..., :1]).all():
        values = values[..., 0]
    if values.ndim != 2:
        raise ParameterError(f"{where}: {os.fspath(file)} has colours, it must be grey with a number for each grain")
    if np.issubdtype(values.dtype, np.floating):  # a PNG, from 0 to 1
        scaled = [values.astype(float) * white for white in GREY]
        values = np.round(scaled[0] if abs(scaled[0] - np.round(scaled[0])).max() < 1e-3 else scaled[1])
    return values


def _at(made: LabelMap, row: Any, column: Any) -> str:
    x, y = (column + 0.5) * made.pixel, (made.image.shape[0] - row - 0.5) * made.pixel
    return f"at row {row}, column {column} ({x:.6g}, {y:.6g}) m"


def _parts(image: np.ndarray) -> np.ndarray:
    """(rows, columns) number of the part of each pixel: equal labels hang together over the sides of pixels."""
    pixel = np.arange(image.size).reshape(image.shape)
    one, other = _beside(pixel)
    same = image.ravel()[one] == image.ravel()[other]
    return linked(image.size, one[same], other[same]).reshape(image.shape)


def _beside(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Values of all pixels and of those to the right of and below them."""
    one = np.concatenate([values[:, :-1].ravel(), values[:-1].ravel()])
    return one, np.concatenate([values[:, 1:].ravel(), values[1:].ravel()])


def _of_one_part_each(where: str, made: LabelMap, speck: int) -> LabelMap:
    for _ in range(ROUNDS):
        parts = _parts(made.image)
        sizes = np.bincount(parts.ravel())
        label = np.zeros(len(sizes), dtype=np.int64)
        label[parts.ravel()] = made.image.ravel()
        order = np.lexsort((-sizes, label))  # the largest part of each label first
        further = order[1:][np.diff(label[order]) == 0]
        if not len(further):
            return made
        large = further[sizes[further] > speck]
        if len(large):
            _refuse_part(where, made, parts, int(large[0]), sizes)
        made = attrs.evolve(made, image=_given_away(made.image, parts, further))
    raise ParameterError(f"{where}: image has too many parts of labels of at most {speck} pixels that lie side by side")


def _refuse_part(where: str, made: LabelMap, parts: np.ndarray, part: int, sizes: np.ndarray) -> None:
    row, column = np.argwhere(parts == part)[0].tolist()
    label = made.image[row, column]
    mine = made.image == label
    touching = []
    for one, other in ((np.s_[:-1, :-1], np.s_[1:, 1:]), (np.s_[:-1, 1:], np.s_[1:, :-1])):
        meet = mine[one] & mine[other] & (parts[one] != parts[other])
        meet &= (parts[one] == part) | (parts[other] == part)
        touching += np.argwhere(meet).tolist()
    if touching:
        row, column = touching[0]
        said = f"has parts that touch at a corner only, {_at(made, row, column)}"
    else:
        said = f"has a part of {sizes[part]} pixels apart from its largest, {_at(made, row, column)}"
    raise ParameterError(f"{where}: the label {label} {said}")


def _given_away(image: np.ndarray, parts: np.ndarray, chosen: Sequence[int] | np.ndarray) -> np.ndarray:
    """With chosen parts of the label that most sides of their pixels touch."""
    one, other = _beside(parts)
    here, there = np.concatenate([one, other]), np.concatenate([other, one])
    a, b = _beside(image)
    beyond = np.concatenate([b, a])
    out = np.isin(here, chosen) & (here != there)
    pairs, times = np.unique(np.column_stack([here[out], beyond[out]]), axis=0, return_counts=True)
    order = np.lexsort((pairs[:, 1], -times, pairs[:, 0]))
    part, first = np.unique(pairs[order, 0], return_index=True)
    new = np.full(parts.max() + 1, -1)
    new[part] = pairs[order[first], 1]
    return np.where(new[parts] >= 0, new[parts], image)
