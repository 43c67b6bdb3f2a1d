"""The command that checks a contact law: its properties, and flutter of a small specimen with it."""

from __future__ import annotations

import attrs
import click
import numpy as np

from grainlaw.cli.answers import answer, json_option
from grainlaw.cli.default_rock import law_or_file
from grainlaw.conditions import StageError
from grainlaw.contact import ContactLaw
from grainlaw.engine.stepping import InstabilityError
from grainlaw.geometry import Voronoi, rectangle
from grainlaw.material import Elastic
from grainlaw.runs.flutter import hold
from grainlaw.specimen import Specimen
from grainlaw.workbench.conformance import check_law
from grainlaw.workbench.driver import alone
from grainlaw.workbench.scale import is_bonded, measure

GRAINS, SLENDERNESS = 120, 2.5
STIFF, SOFT = 1000, 5.25  #: Young's modulus over the stress held, and kn times the grain size over it: as in granite


@click.command()
@click.argument("law", metavar="FILE.py:LAW")
@json_option
def check(*, law: str) -> None:
    """Ask a contact law of your own for every property that makes laws comparable and safe to run.

    LAW is an instance in the file, or a class whose parameters all have defaults, or the name of a law of grainlaw. The
    file is run. In the end a specimen of 120 grains is held under twice the law's strength without damping: if its
    kinetic energy grows, it flutters. The exit code is 1 if a property fails, or if the law flutters and does not
    declare that it makes energy; 2 if there is no such law.
    """
    try:
        found = law_or_file(law)
        report = check_law(found)
    except (TypeError, ValueError) as error:
        raise click.BadParameter(str(error)) from None
    answer(report, passed=report.passed, **attrs.asdict(report))
    flutters = _held(found) if report.passed else False
    if not report.passed or (flutters and "energy" not in found.exceptions):
        raise SystemExit(1)


def _held(law: ContactLaw) -> bool:
    """Hold a small specimen whose grains suit the law, print the result, and return whether it flutters."""
    contact = alone(law)
    with np.errstate(all="ignore"):
        scale = measure(contact)
        bonded = is_bonded(contact, scale.tension)
    stress = scale.pressures[-1]
    size = SOFT * STIFF * stress / float(law.stiffness[0])
    grains = Voronoi(grains=GRAINS, seed=1)
    width = size * (GRAINS / SLENDERNESS) ** 0.5
    rock = Elastic(youngs_modulus=STIFF * stress, poissons_ratio=0.25, density=3000)
    specimen = Specimen(grains.tessellate(rectangle(width, SLENDERNESS * width)), rock)
    for share in (1, 0.5, 0.25):
        try:
            flutter = hold(specimen, law, share * stress, confined=not bonded)
        except StageError:  # it fails before: hold it under less
            continue
        except InstabilityError as error:
            answer(f"  a specimen of {GRAINS} grains: {error}", unstable=str(error))
            return False
        words = f"  a specimen of {GRAINS} grains of {size:.3g} m {flutter}"
        answer(words, flutters=bool(flutter.flutters), rate=flutter.rate)
        return flutter.flutters
    click.echo(f"  a specimen of {GRAINS} grains fails under {share * stress * 1e-6:.3g} MPa: it was not held")
    return False
