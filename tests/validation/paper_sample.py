"""The specimen of the paper, which most studies test."""

from collections.abc import Hashable, Mapping
from typing import Any

import grainlaw as gl
from grainlaw.cli.table1 import ROCK, SAMPLE
from grainlaw.geometry import Voronoi, rectangle
from grainlaw.runs.parallel import Run, simulate_all

SEEDS = (1, 2, 3)


def sample(seed: int, relaxation: int = 3, **options: Any) -> gl.Specimen:
    width, height, grains = SAMPLE
    tessellator = Voronoi(grains=grains, seed=seed, relaxation=relaxation)
    return gl.Specimen(tessellator.tessellate(rectangle(width, height)), ROCK, **options)


def summaries(runs: Mapping[Hashable, Run], **options: Any) -> dict[Hashable, dict[str, Any]]:
    """Summaries of runs; of those only that came to their end."""
    return {key: result.summary for key, result in simulate_all(runs, frames=1, **options).results.items()}
