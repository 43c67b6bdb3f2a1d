"""The command that finds the strength of a rock over confinement."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import attrs
import click

from grainlaw.cli.answers import answer, json_option
from grainlaw.cli.default_rock import LAWS, QUICK, ROCK, SAMPLE, law_with_files
from grainlaw.cli.law_copy import copied
from grainlaw.cli.running import contents, numbers_of, portable_option, refusing, seeds_of, threads_option
from grainlaw.cli.study import ending
from grainlaw.compiler.cache import is_portable
from grainlaw.engine.thread_count import AUTO, Threads
from grainlaw.fields import ParameterError
from grainlaw.geometry import Voronoi, rectangle
from grainlaw.loading import Adaptive, Constant, Loading
from grainlaw.protocols import BiaxialCompression
from grainlaw.runs.parallel import Run
from grainlaw.runs.record import described, recorded
from grainlaw.specimen import Specimen
from grainlaw.strength import Until
from grainlaw.studies.envelope import StrengthEnvelope
from grainlaw.studies.store import Store
from grainlaw.studies.study import Study
from grainlaw.units import MPa


@attrs.frozen(eq=False)
class EnvelopeCase:
    """The compression of a sample of the rock under a confinement (Pa)."""

    width: float
    height: float
    grains: int
    law: Any
    loading: Loading
    maximum_strain: float

    def tessellator(self, seed: int) -> Voronoi:
        return Voronoi(grains=self.grains, seed=seed)

    def test(self, confinement: float) -> BiaxialCompression:
        return BiaxialCompression(
            confinement=confinement, loading=self.loading, maximum_strain=self.maximum_strain, until=Until.FAILURE
        )

    def __call__(self, seed: int, confinement: float) -> Run:
        grains = self.tessellator(seed).tessellate(rectangle(self.width, self.height))
        return Run(Specimen(grains, ROCK), self.law, self.test(confinement))


@click.command()
@click.option("--law", default="cohesive-crack", show_default=True, help=f"One of {', '.join(LAWS)}, or FILE.py:LAW.")
@click.option("--confinement", default="0,1,2,3,4", show_default=True, help="Confinements in MPa, with commas between.")
@click.option("--seeds", default="1", show_default=True, help="Seeds of the grains, with commas between.")
@click.option("--grains", type=int, help=f"Number of Voronoi grains.  [default: {SAMPLE[2]}]")
@click.option("--speed", type=float, help="Constant platen speed in m/s.  [default: as fast as is accurate]")
@click.option("--max-strain", type=float, default=0.01, show_default=True, help="Axial strain at which to end.")
@click.option(
    "--out", type=click.Path(path_type=Path), default="out", show_default=True,
    help="Folder of the study, new or of this command.",
)  # fmt: skip
@threads_option("Tests at a time, one thread each.")
@portable_option
@click.option("--quick", is_flag=True, help=f"A small specimen: {QUICK[2]} grains in 20 x 50 mm.")
@json_option
def envelope(
    *, law: str, confinement: str, seeds: str, grains: int | None, speed: float | None, max_strain: float, out: Path,
    threads: Threads, quick: bool,
) -> None:  # fmt: skip
    """Compress a rock specimen under several confinements, and fit Mohr-Coulomb and Hoek-Brown to the strengths.

    Writes envelope.png and summary.json: confinement, strength, cohesion, friction_angle (degrees), ucs, slope, and
    their 95 % intervals. The specimen and the parameters are those of a published study (docs/validation.md).

    The folder holds a study: what is finished is kept, and the same call goes on. A call with other options adds its
    tests, and writes its own envelope.png and summary.json in the place of the last.
    """
    width, height, count = QUICK if quick else SAMPLE
    pressures = [value * MPa for value in numbers_of("confinement", confinement)]
    numbers = seeds_of(seeds)
    with refusing():
        chosen, files = law_with_files(law)
        loading = Adaptive() if speed is None else Constant(speed=speed)
        case = EnvelopeCase(width, height, count if grains is None else grains, chosen, loading, max_strain)
        tests, tessellators = [case.test(p) for p in pressures], [case.tessellator(seed) for seed in numbers]
        if len(tests) < 2:
            raise ParameterError(f"--confinement = {confinement} is not allowed, it must name at least two")
        study = Study(case, seed=numbers, confinement=pressures)
        Store(out, about={"factors": ["seed", "confinement"]})  # refuses another folder before it writes there
    arguments = {
        "law": law, "confinement": confinement, "seeds": seeds, "grains": case.grains, "speed": speed,
        "max_strain": max_strain, "threads": threads, "quick": quick, "portable": is_portable(),
    }  # fmt: skip
    parameters = {
        "region": {"width": width, "height": height},
        "tessellator": described(tessellators[0]),
        "material": described(ROCK),
        "protocol": described(max(tests, key=lambda test: test.confinement)),
        "law": described(chosen),
    }
    about: dict[str, Any] = {"command": {"name": "envelope", "arguments": arguments}, "parameters": parameters}
    with ending(study, out):
        arguments["law"], about["law_files"] = copied(law, files, out)
        with recorded(out, about):
            table = study.run(out, workers=None if threads == AUTO else threads)
        found = StrengthEnvelope(table)
        found.write(out, {"seeds": numbers, "parameters": parameters})
        answer(found, folder=str(out), **found.summary)
        click.echo(f"\n{contents(out)}")
    if table.failed:
        raise click.ClickException(f"{len(table.failed)} of {len(table)} tests failed")
