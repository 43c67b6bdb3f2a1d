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

from grainlaw.fields import ParameterError, checked_vector
from grainlaw.geometry.region import rectangle
from grainlaw.messages import refusal, short
from grainlaw.polygon import cross, linked
from grainlaw.region import Region
from grainlaw.tessellation import Tessellation

GREY = (255, 65535)  #: whole numbers that 1.0 stands for in a PNG of 8 and 16 bits
CUT = np.iinfo(np.int64).min  #: in the place of the label of a pixel outside the region
ROUNDS = 20  #: of specks given away that lie on other specks


@attrs.frozen(eq=False)
class LabelMap:
    """Labels (rows, columns), each of one part; index letter ``n``: of the labels.

    Pixels whose middle lies outside the region are cut off: they have the label ``CUT``.
    """

    image: np.ndarray  #: (rows, columns)
    pixel: float  #: m
    corner: np.ndarray = attrs.field(factory=lambda: np.zeros(2))  #: (2,) m, the lower left one
    cut: Region | None = None  #: of the pixels that count; the rectangle of the image, if not given

    @cached_property
    def inside(self) -> np.ndarray:
        """(rows, columns) whether a pixel counts."""
        return self.image != CUT

    @cached_property
    def labels(self) -> np.ndarray:
        """(n,) in rising order."""
        return np.unique(self.image[self.inside])

    @cached_property
    def number(self) -> np.ndarray:
        """(rows, columns) place of the label of each pixel in ``labels``; of one that is cut off the nearest."""
        image = self.image
        if not self.inside.all():
            image = _nearest(image, CUT)
        return np.searchsorted(self.labels, image)

    @property
    def region(self) -> Region:
        """That of the pixels that count, or the rectangle of the image, its lower left corner at the origin."""
        rows, columns = self.image.shape
        return rectangle(columns * self.pixel, rows * self.pixel) if self.cut is None else self.cut

    @cached_property
    def counts(self) -> np.ndarray:
        """(n,) pixels of each label."""
        return np.bincount(self.number[self.inside])

    @cached_property
    def areas(self) -> np.ndarray:
        """(n,) m2; of a region each has the share of its pixels, so that they add up to that of the region."""
        one = self.pixel**2 if self.cut is None else self.cut.area / self.counts.sum()
        return self.counts * one

    @cached_property
    def centroids(self) -> np.ndarray:
        """(n, 2) m."""
        row, column = np.nonzero(self.inside)
        column, row = (np.bincount(self.number[self.inside], way) / self.counts for way in (column, row))
        return np.column_stack([column + 0.5, self.image.shape[0] - row - 0.5]) * self.pixel + self.corner

    def drawn(self, grains: Tessellation) -> np.ndarray:
        """(rows, columns) grain at the middle of each pixel; -1 for none."""
        rows, columns = self.image.shape
        found = np.full(self.image.shape, -1)
        points = (grains.vertices - self.corner) / self.pixel  # pixels from the lower left corner
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


def label_map(
    where: str, image: Any, pixel: float, *, speck: int, fill: bool, region: Region | None = None, corner: Any = None
) -> LabelMap:
    """Labels checked: numbers from 1, or 0 that ``fill`` gives to the nearest; parts of a label of at most ``speck``
    pixels given to the labels round them. What lies outside a ``region`` is cut off; its ``corner`` is that of the
    image, with which both have their middle at one place if it is not given.

    Raises ParameterError, with label and place, for other parts and for 0.
    """
    image = _whole(where, image)
    made = LabelMap(image, pixel)
    if region is None and corner is not None:
        raise ParameterError(f"{where}: corner is of no use without a region, in whose coordinates it is")
    if region is not None:
        made = _within(where, made, region, corner)
    outside, image = made.image == CUT, made.image
    image = np.where(outside, image.max(), image)  # neither a label nor background
    if image.min() < 0 or not image.any():
        at = np.unravel_index(image.argmin(), image.shape)
        raise ParameterError(f"{where}: the label {image.min()} {_at(made, *at)} is not allowed, labels are from 1")
    if image.min() == 0:
        if not fill:
            at = np.unravel_index(image.argmin(), image.shape)
            words = "; region=... cuts it off" if region is None else " of the region"
            raise ParameterError(
                f"{where}: the label 0 {_at(made, *at)} is background, {(image == 0).sum()} pixels in all{words}"
                " (fill=True gives each to the nearest grain)"
            )
        image = _nearest(np.where(outside, 0, image), 0)
    return _of_one_part_each(where, attrs.evolve(made, image=np.where(outside, CUT, image)), speck)


def _within(where: str, made: LabelMap, region: Region, corner: Any) -> LabelMap:
    """With the pixels cut off whose middle lies outside a region."""
    rows, columns = made.image.shape
    size = np.array([columns, rows]) * made.pixel
    low, high = region.bounds
    place = (low + high - size) / 2 if corner is None else checked_vector(f"{where}: corner", corner)
    place = np.array(place)
    beyond = float(max((place - low).max(), (high - place - size).max()))
    if beyond > made.pixel / 2:
        raise ParameterError(
            f"{where}: region reaches {beyond:.4g} m beyond the image, which is {size[0]:.6g} m x {size[1]:.6g} m"
        )
    x, y = (np.arange(columns) + 0.5) * made.pixel, (rows - np.arange(rows) - 0.5) * made.pixel
    inside = region.contains(np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2) + place).reshape(rows, columns)
    if not inside.any():
        raise ParameterError(f"{where}: no pixel has its middle inside the region, pixel must be smaller")
    return LabelMap(np.where(inside, made.image, CUT), made.pixel, place, region)


def _nearest(image: np.ndarray, hidden: int) -> np.ndarray:
    """With each pixel of a label as the nearest of the others."""
    return image[tuple(distance_transform_edt(image == hidden, return_distances=False, return_indices=True))]


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
    return f"at row {row}, column {column} ({x + made.corner[0]:.6g}, {y + made.corner[1]:.6g}) m"


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
        further = order[1:][(np.diff(label[order]) == 0) & (label[order[1:]] != CUT)]
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
    out = np.isin(here, chosen) & (here != there) & (beyond != CUT)
    pairs, times = np.unique(np.column_stack([here[out], beyond[out]]), axis=0, return_counts=True)
    order = np.lexsort((pairs[:, 1], -times, pairs[:, 0]))
    part, first = np.unique(pairs[order, 0], return_index=True)
    new = np.zeros(parts.max() + 1, dtype=np.int64)
    new[chosen] = CUT  # what touches nothing else at the rim of a region
    new[part] = pairs[order[first], 1]
    return np.where(new[parts] != 0, new[parts], image)
