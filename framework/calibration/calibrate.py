"""Contact parameters from laboratory tests: elastic constants by statics, strengths by a search over simulated ones."""

from __future__ import annotations

import functools
import os
import sys
import warnings
from collections.abc import Iterable, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import attrs
import numpy as np

from grainlaw.arguments import checked
from grainlaw.calibration.check import check
from grainlaw.calibration.first_look import FirstLook, first_match, looked_at
from grainlaw.calibration.identifiability import identifiability
from grainlaw.calibration.moduli import Statics, expected_stiffness, meet_moduli, stiffened
from grainlaw.calibration.result import Calibration
from grainlaw.calibration.space import Space, space_of
from grainlaw.calibration.stiffness_search import CONTACTS, GRAINS, STIFF, Stiffness, fit_stiffness, stiffness_names
from grainlaw.calibration.targets import AIMS, Targets, checked_quantities, measured_by, needed_tests
from grainlaw.calibration.trials import (
    PRISM,
    SHAPES,
    USUAL,
    StudySimulator,
    TrialCase,
    by_shape,
    checked_specimens,
    checked_tests,
)
from grainlaw.calibration.waves import Search, Tell
from grainlaw.contact import ContactLaw
from grainlaw.fields import ParameterError, checked_whole_number
from grainlaw.material import Elastic
from grainlaw.messages import enumeration, refusal, users_line
from grainlaw.runs.progress import shown_in
from grainlaw.runs.stopping import Stopped
from grainlaw.short_form import to_digits
from grainlaw.specimen import Specimen
from grainlaw.studies.workers import Whole

FEWEST_SEEDS = 2
FRESH = 10  #: specimens that the answer is tried on, of each shape
ALIKE = 1.25  #: ratio of the sizes of grains of two shapes that are those of one rock
CHAINS = "chains"  #: folder of the store
BEGIN = 40  #: points for each free parameter that a first look offers a search to begin with
LOOKS = 3  #: looks again at most, where the best parameters want other stiffnesses than were taken
SOFT = 5.0  #: normal stiffness to begin with where none is given, times the grains' modulus over their size


@checked
def calibrate(
    targets: Targets, law: Any, free: Mapping[str, Any], specimens: Any, *, store: str | os.PathLike[str],
    tied: Mapping[str, Any] | None = None, elastic: str = CONTACTS, seeds: int = 3, budget: int = 100,
    also: Sequence[str] = (), tests: Mapping[str, Any] | None = None, more: int = 9,
    fresh: int | Mapping[str, int] = FRESH, seed: int = 0, workers: int | None = None, on: Any = None,
    progress: bool = True,
) -> Calibration:  # fmt: skip
    """Find the contact parameters with which a rock has the ``targets``, and how well these determine them.

    ``law`` is a law whose other parameters stay as they are, or a class of which all needed parameters are found.
    ``free`` has the range (low, high) of each parameter that is looked for; ``tied`` those that are another one times a
    number, ``{"mode_ii_energy": ("mode_i_energy", 2)}``. ``specimens`` is a function of the seed that makes a
    rectangular specimen; with tests of other shapes a mapping with "prism", "disc" and "half_disc".

    E and nu are met by statics: with ``elastic="contacts"`` by both stiffnesses of the contacts, with "grains" by the
    modulus of the grains, the stiffnesses in proportion to it, and their ratio. Where the emulator that comes with
    grainlaw knows such rocks, :func:`first_look` shows where the strengths lie, else a pilot of a few points; where
    compression tests there give another E or nu, as contacts crack before half of the peak, statics aim as much beside
    the targets. At most ``budget`` points are tested, each on the same ``seeds`` specimens, two of them on ``more``,
    and the best one on ``fresh`` others, of all shapes or of each, ``{"disc": 40}``, which else has 10. ``also`` names
    quantities that are measured though they are no targets; ``tests`` replaces tests ("compression", "confined",
    "tension", "brazilian", "bending"). All runs are cases of a study in the folder ``store``: the same call goes on
    where it was stopped, and gives the same answer. ``workers`` and ``on`` are those of :meth:`Study.run`.

    Raises :class:`ParameterError` before anything is run for what cannot be, and where so many tests fail that a
    target has no values; :class:`~grainlaw.runs.stopping.Stopped`, which while the ``fresh`` specimens are tested has
    the answer without them in ``result``, and before that None.
    """
    _check_choices(elastic, seeds=(seeds, FEWEST_SEEDS), more=(more, 0), seed=(seed, 0))
    wanted, made = needed_tests(_quantities("calibrate", targets, also)), checked_tests(tests or {})
    shapes = checked_specimens(specimens, (*wanted, *(["compression"] if targets.elastic else [])))
    last = _fresh_seeds(fresh, shapes, seeds + more + 1)
    space = _space(law, free, tied or {}, shapes, targets)
    _check_budget(budget, targets, space)
    _warn_of_few("calibrate", targets, space)
    _warn_of_sizes("calibrate", ones := _one_of_each("calibrate", shapes))
    case = TrialCase(space.law, space.base, space.ties, shapes, made, 1.0)
    names = [name for name in measured_by(wanted, targets) if not AIMS[name].is_elastic]
    first, others = range(1, seeds + 1), range(seeds + 1, seeds + more + 1)
    with ExitStack() as stack:
        bars = stack.enter_context(shown_in(progress, stays=True, speaks=True))
        simulator = StudySimulator(case, space.powers, targets.pressures, store, bars=bars, workers=workers, on=on)
        simulator.weakest = space.weakest
        simulator.plan((names, range(seeds * budget + 2 * more)), *by_shape(names, last))
        stack.enter_context(simulator.whole.file)
        simulator.whole.begin()
        tell = functools.partial(_told, simulator.whole, progress)
        search = Search(
            space, targets.tested, names, simulator, first, budget, seed, others, tell, chains=Path(store) / CHAINS
        )
        search, stiffness, look = _aimed(search, simulator, targets, ones, elastic)
        found = search.run()
        result = Calibration(
            targets=targets, space=search.space, stiffness=stiffness, first_look=look, found=found, seeds=seeds,
            store=os.fspath(store), grains=simulator.case.grains, failures=tuple(simulator.failures),
            cpu=simulator.cpu,
        )  # fmt: skip
        return _answered(result, simulator, last, seed, tell)


def _answered(
    result: Calibration, simulator: StudySimulator, seeds: Mapping[str, range], seed: int, tell: Tell
) -> Calibration:
    """The best parameters, how well they are known, and what they give on fresh ``seeds``, if any are plausible.

    Raises :class:`Stopped` with the answer so far.
    """
    found, space, targets, shapes = result.found, result.space, result.targets, simulator.case.specimens
    if found.posterior is None:
        return result
    best = _rounded(space, found.posterior.best)
    seen = identifiability(found.match, found.posterior, seed)
    result = attrs.evolve(result, identifiability=seen, best=space.mapping(best))
    tell(f"the best parameters on {max(map(len, seeds.values()))} fresh specimens: {space.in_words(best)}")
    simulator.weakest = 1.0  # they have the rock's own strength
    possible = [test for test in SHAPES if SHAPES[test] in shapes and (test != "confined" or targets.confined)]
    simulator.plan(*by_shape(measured_by(possible, targets), seeds))
    try:
        rows = check(found.match, targets, simulator, best, possible, seeds)
    except Stopped as stopped:
        stopped.result = result
        raise
    return attrs.evolve(result, checks=tuple(rows), tried=seeds, failures=tuple(simulator.failures), cpu=simulator.cpu)


def _fresh_seeds(fresh: Any, shapes: Iterable[str], first: int) -> dict[str, range]:
    """Those of the fresh specimens of each shape, from a number of all or by shape. Raises :class:`ParameterError`."""
    given = dict(fresh) if isinstance(fresh, Mapping) else dict.fromkeys(shapes, fresh)
    counts = {shape: given.pop(shape, FRESH) for shape in shapes}
    if given:
        raise refusal("calibrate: fresh", fresh, f"a number, or one for each of {enumeration(counts)}")
    for count in counts.values():
        checked_whole_number("calibrate: fresh", count, at_least=2)
    return {shape: range(first, first + count) for shape, count in counts.items()}


def _told(whole: Whole, aloud: bool, words: str) -> None:
    whole.say(words)
    if aloud:
        print(words, file=sys.stderr, flush=True)


def _check_budget(budget: int, targets: Targets, space: Space) -> None:
    parts = 3 if targets.elastic else 2  # a pilot, the first wave, and as much for the later ones
    each = len(space.groups) + 4
    checked_whole_number("calibrate: budget", budget, at_least=1)
    if budget < parts * each:
        of_each = f"{parts} times {each} points, four and one for each of {', '.join(space.groups)}"
        raise refusal("calibrate: budget", budget, f"at least {parts * each}: {of_each}")


def _warn_of_few(where: str, targets: Targets, space: Space) -> None:
    if len(targets.tested) < len(space.free):
        given, asked = ", ".join(targets.tested), ", ".join(space.names)
        warnings.warn(
            f"{where}: {len(targets.tested)} targets of strength ({given}) for {len(space.free)} free parameters "
            f"({asked}) cannot determine all of them: give more targets, or fix or tie a parameter",
            stacklevel=users_line(),
        )


def _warn_of_sizes(where: str, ones: Mapping[str, Specimen]) -> None:
    if len(ones) < 2:
        return
    sizes = {shape: specimen.grains.mean_size for shape, specimen in ones.items()}
    least, most = min(sizes, key=sizes.__getitem__), max(sizes, key=sizes.__getitem__)
    if sizes[most] > ALIKE * sizes[least]:
        warnings.warn(
            f"{where}: grains of the {most} are {sizes[most] * 1e3:.3g} mm, those of the {least} "
            f"{sizes[least] * 1e3:.3g} mm: a rock has one size, which a grain_size for each gives",
            stacklevel=users_line(),
        )


def _quantities(where: str, targets: Targets, also: Sequence[str]) -> tuple[str, ...]:
    """Targets that take tests to failure, and what is measured beside them. Raises :class:`ParameterError`."""
    if not targets.tested:
        raise ParameterError(f"{where}: targets have no strength: there is nothing that takes a test to failure")
    found = (*targets.tested, *checked_quantities(f"{where}: also", also))
    if {"cohesion", "friction_angle"} & {*found} and not targets.pressures:
        raise ParameterError(f"{where}: cohesion or friction_angle needs confinements: Targets(confinements=[...])")
    return found


def _aimed(
    search: Search, simulator: StudySimulator, targets: Targets, ones: Mapping[str, Specimen], elastic: str
) -> tuple[Search, Stiffness | None, FirstLook | None]:
    """The search among rocks that meet the elastic targets, and to begin where a first look sees the strengths."""
    stiffness = None
    if targets.elastic:
        search.tell(f"elastic constants by statics of {len(search.seeds)} specimens, and a first look")
        statics = _statics(search.space, simulator.case.specimens, len(search.seeds), elastic)
        stiffness = expected_stiffness(search.space, targets, ones, statics, search.seed)
        search = stiffened(search, simulator, stiffness)
    look = looked_at(search.space, targets, ones, stiffness, search.seed)
    known = look if isinstance(look, FirstLook) else None
    if known is not None:
        search.tell(f"{known}")
        if known.posterior is not None:
            count = len(search.space.free) * BEGIN
            search = attrs.evolve(search, begin=known.beginning(count, search.seed))
    if stiffness is not None:
        wanted = {name: target.value for name, target in targets.elastic.items()}
        search, stiffness = meet_moduli(search, simulator, statics, wanted, stiffness)
    if known is not None:
        before = first_match(search.space, targets, ones, stiffness.grains if stiffness else 1.0)
        search = attrs.evolve(search, before=before)
    return search, stiffness, known


@checked
def first_look(
    targets: Targets, law: Any, free: Mapping[str, Any], specimens: Any, *, tied: Mapping[str, Any] | None = None,
    elastic: str = CONTACTS, seeds: int = 3, seed: int = 0,
) -> FirstLook:  # fmt: skip
    """What the targets say of the contact parameters by no test, in seconds; arguments as of :func:`calibrate`.

    By an emulator that comes with grainlaw: Mohr-Coulomb contacts or cohesive cracks between even grains,
    docs/calibration.md. Raises :class:`ParameterError` where it knows nothing of such a rock.
    """
    _check_choices(elastic, seeds=(seeds, FEWEST_SEEDS), seed=(seed, 0))
    shapes = checked_specimens(specimens, needed_tests(_quantities("first_look", targets, ())))
    space, ones, stiffness = _space(law, free, tied or {}, shapes, targets), _one_of_each("first_look", shapes), None
    _warn_of_few("first_look", targets, space)
    _warn_of_sizes("first_look", ones)
    statics = _statics(space, shapes, seeds, elastic) if targets.elastic else None
    if statics is not None:
        stiffness = expected_stiffness(space, targets, ones, statics, seed)
        space = space.evolved(stiffness.parameters)
    found = looked_at(space, targets, ones, stiffness, seed)
    for _ in range(LOOKS):  # the strengths between contacts as stiff as the best parameters want them
        if statics is None or isinstance(found, str) or found.posterior is None or found.meets_moduli:
            break
        stiffness = expected_stiffness(space, targets, ones, statics, seed, found.posterior.best)
        space = space.evolved(stiffness.parameters)
        found = looked_at(space, targets, ones, stiffness, seed)
    if isinstance(found, str):
        raise ParameterError(f"first_look: the emulator that comes with grainlaw does not know this rock: {found}")
    return found


def _one_of_each(where: str, shapes: Mapping[str, Any]) -> dict[str, Specimen]:
    """The first specimen of each shape. Raises :class:`ParameterError` for one that a test of its shape cannot hold."""
    ones = {shape: make(1) for shape, make in shapes.items()}
    for shape, one in ones.items():
        if not isinstance(one, Specimen):
            raise refusal(f"{where}: specimens: {shape}", one, "a function of the seed that returns a Specimen")
    for test, shape in SHAPES.items():
        try:
            if shape in ones:
                USUAL[test].stages(ones[shape])
        except ParameterError as error:
            raise ParameterError(f"{where}: specimens: {shape}: {error}") from None
    return ones


def _check_choices(elastic: str, **numbers: tuple[Any, int]) -> None:
    """Refuse numbers below what each is at least, and another way to meet elastic targets."""
    for name, (value, least) in numbers.items():
        checked_whole_number(f"calibrate: {name}", value, at_least=least)
    if elastic not in (CONTACTS, GRAINS):
        raise refusal("calibrate: elastic", elastic, f"'{CONTACTS}' or '{GRAINS}'")


def _space(law: Any, free: Mapping[str, Any], tied: Mapping[str, Any], shapes: Mapping, targets: Targets) -> Space:
    """Stiffnesses that elastic targets will give begin with a guess."""
    guess: dict[str, float] = {}
    if isinstance(law, type) and issubclass(law, ContactLaw) and attrs.has(law) and targets.elastic:
        needed = [f.name for f in attrs.fields(law) if f.metadata.get("unit") == STIFF and f.default is attrs.NOTHING]
        specimen = shapes[PRISM](1)
        rock = specimen.material_of(int(specimen.grains.phase[0]))
        stiff = SOFT * rock.youngs_modulus / specimen.grains.mean_size if isinstance(rock, Elastic) else 1e14
        guess = {name: stiff for name in needed if name not in free}
    return space_of(law, free, tied, guess)


def _statics(space: Space, shapes: Mapping, seeds: int, elastic: str) -> Statics:
    """What finds stiffnesses from modulus and Poisson's ratio, or one of them. Raises :class:`ParameterError`."""
    law = space.example
    if both := [name for name in stiffness_names(law) if name in space.names]:
        raise ParameterError(f"calibrate: '{both[0]}' is free, but it follows from the elastic targets")
    specimens: list[Specimen] = [shapes[PRISM](seed) for seed in range(1, seeds + 1)]

    def found(aims: Mapping[str, float]) -> Stiffness:
        return fit_stiffness(specimens, law, aims.get("youngs_modulus"), aims.get("poissons_ratio"), elastic)

    return found


def _rounded(space: Space, best: np.ndarray) -> np.ndarray:
    """The best parameters as people write them, if the law takes these too."""
    rounded = np.array([to_digits(value) for value in best])
    return rounded if space.allowed(rounded[None])[0] else best
