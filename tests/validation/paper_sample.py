"""The specimen of the paper, which most studies test."""

from collections.abc import Hashable, Mapping, Sequence
from typing import Any

import numpy as np
from study_tables import each

import grainlaw as gl
from grainlaw.cli.default_rock import ROCK, SAMPLE
from grainlaw.geometry import Voronoi, rectangle
from grainlaw.runs.parallel import Run, simulate_all
from grainlaw.units import MPa

SEEDS = (1, 2, 3)


def sample(seed: int, relaxation: int = 3, **options: Any) -> gl.Specimen:
    width, height, grains = SAMPLE
    tessellator = Voronoi(grains=grains, seed=seed, relaxation=relaxation)
    return gl.Specimen(tessellator.tessellate(rectangle(width, height)), ROCK, **options)


def summaries(runs: Mapping[Hashable, Run], **options: Any) -> dict[Hashable, dict[str, Any]]:
    """Summaries of runs; of those only that came to their end."""
    return {key: result.summary for key, result in simulate_all(runs, frames=1, **options).results.items()}


#: headings of :func:`strength`
STRENGTH = ("peak (MPa)", "mean", "strain at peak (%)", "tensile + shear")


def strength(summaries: Sequence[Mapping[str, Any]]) -> tuple[str, ...]:
    """Cells of a row: peaks of several samples, their mean, the strains there, and the cracks by mode."""
    peaks = [one["strength"] / MPa for one in summaries]
    return (
        each(peaks, ".1f"),
        f"{np.mean(peaks):.1f}",
        each((one["failure_strain"] * 100 for one in summaries), ".3f"),
        each(f"{one['tensile_cracks']} + {one['shear_cracks']}" for one in summaries),
    )
