"""The specimen of the paper under its tests: laws, seeds, confinements and dampings as the cases of a study."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, cast

import attrs

from grainlaw.cli.default_rock import LAWS, QUICK, ROCK, SAMPLE
from grainlaw.contact import ContactLaw
from grainlaw.geometry import Voronoi, rectangle
from grainlaw.integration import CentralDifference, LocalDamping, MassDamping
from grainlaw.laws import CohesiveCrack, PrePeak, Residual, SofteningLength
from grainlaw.protocols import BiaxialCompression, UniaxialCompression
from grainlaw.runs.parallel import Run
from grainlaw.specimen import Specimen
from grainlaw.studies.study import Study
from grainlaw.units import MPa

PRINTED, CONSISTENT, STRAIGHT, BRITTLE, ELASTIC = (
    "cohesive crack, as printed", "cohesive crack", "cohesive crack, linear pre-peak", "Mohr-Coulomb", "linear",
)  # fmt: skip
AS_PRINTED: dict[str, Any] = {
    "pre_peak": PrePeak.AS_PRINTED, "softening_length": SofteningLength.CLOSED_FORM, "residual": Residual.AS_PRINTED,
}  # fmt: skip
_CRACK = cast(CohesiveCrack, LAWS["cohesive-crack"])
RULES: dict[str, ContactLaw] = {
    PRINTED: attrs.evolve(_CRACK, **AS_PRINTED),
    CONSISTENT: _CRACK,
    STRAIGHT: attrs.evolve(_CRACK, pre_peak=PrePeak.LINEAR),
    BRITTLE: LAWS["mohr-coulomb"],
    ELASTIC: LAWS["linear"],
}
BREAKING = (PRINTED, CONSISTENT, BRITTLE)  #: the laws of Figs. 8 and 9
LOCAL = "local 0.8"
DAMPINGS = {
    LOCAL: CentralDifference(damping=LocalDamping()),  # as in UDEC
    "mass 1e5 1/s": CentralDifference(damping=MassDamping(coefficient=1e5)),
    "mass 3e4 1/s": CentralDifference(damping=MassDamping(coefficient=3e4)),
    "mass 1e4 1/s": CentralDifference(damping=MassDamping(coefficient=1e4)),
}
LEAST = "mass 3e4 1/s"  #: of those that are always tried
CONFINEMENTS = (0.0, 1 * MPa, 2 * MPa, 3 * MPa, 4 * MPa)
SEEDS = (1, 2, 3)


def specimen(seed: int, size: tuple[float, float, int] = SAMPLE) -> Specimen:
    """The rock of the paper, or a piece of it: width, height (m), grains."""
    width, height, grains = size
    return Specimen(Voronoi(grains=grains, seed=seed).tessellate(rectangle(width, height)), ROCK)


@attrs.frozen(eq=False)
class PaperCase:
    """One compression of the specimen."""

    quick: bool

    def __call__(self, law: str, damping: str, confinement: float, seed: int) -> Run:
        test = BiaxialCompression(confinement=confinement) if confinement else UniaxialCompression()
        size = QUICK if self.quick else SAMPLE
        return Run(specimen(seed, size), RULES[law], test, integrator=DAMPINGS[damping])


def study(quick: bool, full: bool) -> Study:
    """All compressions of the page.

    Under a confinement the paper's own law as printed is on all seeds, the others on the first one unless ``full``,
    with which all dampings are tried as well.
    """
    cases = list(dict.fromkeys(tuple(case.items()) for case in _cases(full)))
    return Study(PaperCase(quick), cases=[dict(case) for case in cases])


def _cases(full: bool) -> Iterator[dict[str, Any]]:
    for law in BREAKING:
        for confinement in CONFINEMENTS:
            for seed in SEEDS if full or law == PRINTED or not confinement else SEEDS[:1]:
                yield {"law": law, "damping": LOCAL, "confinement": confinement, "seed": seed}
    yield {"law": ELASTIC, "damping": LOCAL, "confinement": 0.0, "seed": SEEDS[0]}
    for law in (PRINTED, CONSISTENT, STRAIGHT, BRITTLE) if full else (PRINTED, CONSISTENT):
        for damping in DAMPINGS if full else (LOCAL, LEAST):
            yield {"law": law, "damping": damping, "confinement": 0.0, "seed": SEEDS[0]}
