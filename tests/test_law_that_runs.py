"""The law that runs is the law as written: in every way of writing one, before and after every edit."""

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from law_sources import CHANGES, KN, KS, LOADERS, PLACES, STANDARD_NAMES, piece, source

from grainlaw.compiler import batch

POINTS = [(3e-7, 2e-7), (-1e-7, -5e-7)]


@pytest.fixture(scope="module")
def cache(tmp_path_factory):
    """A cache of machine code that is empty at first, and shared: the same law made in another way is found in it."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("GRAINLAW_CACHE", str(tmp_path_factory.mktemp("cache")))
        patch.setattr(batch, "_done", {})
        yield


def answers(law):
    """Tractions interpreted and compiled."""
    respond = batch.compile_law(law).respond
    return [law.traction(*point) for point in POINTS], [respond(*point) for point in POINTS]


def assert_is_as_written(loader, folder, normal, shear):
    """``normal`` and ``shear`` are places with their changes: what is expected follows from the factors alone."""
    (place, change), (other, other_change) = normal, shear
    cells, files = source(piece(place, change, "_n"), piece(other, other_change, "_s"))
    for name, text in files.items():
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_text(text)
    expected = [(change.factor * KN * opening, other_change.factor * KS * slip) for opening, slip in POINTS]
    interpreted, compiled = answers(LOADERS[loader](cells, folder))
    for point in range(len(POINTS)):
        assert interpreted[point] == pytest.approx(expected[point], rel=1e-12)
        assert compiled[point] == pytest.approx(expected[point], rel=1e-12)


def assert_edits_are_followed(loader, folder, place, other):
    """Before an edit, after it and undone, with what this process has compiled; and as a new one finds it on disk."""
    first, second, third = CHANGES[:3]
    for change in (first, second, first):
        assert_is_as_written(loader, folder, (place, change), (other, third))
    batch._done.clear()
    assert_is_as_written(loader, folder, (place, second), (other, third))


@pytest.mark.thorough
@pytest.mark.parametrize("place", PLACES)
def test_an_edit_is_followed_wherever_it_is(cache, tmp_path, place):
    assert_edits_are_followed("mine.py", tmp_path, place, "in the method")


@pytest.mark.thorough
@pytest.mark.parametrize("loader", LOADERS)
def test_an_edit_is_followed_however_the_law_is_made(cache, tmp_path, loader):
    """Files named like modules of Python among them; the law calls a helper in another file."""
    assert_edits_are_followed(loader, tmp_path, "in the method", "module")


def test_a_law_in_a_file_named_math_has_the_functions_of_math(cache, tmp_path):
    """Python's module in C lies in a folder of its own; the law's file does not hide it."""
    by_name = {change.text: change for change in CHANGES}
    place, root = "in the method", by_name["math.sqrt(0.25) * x - x"]
    assert_is_as_written("math.py", tmp_path, (place, root), (place, by_name["x * 0.25"]))


def test_enough_names_are_pythons():
    assert len(STANDARD_NAMES) >= 20


places = st.tuples(st.sampled_from(PLACES), st.sampled_from(CHANGES))


@st.composite
def histories(draw):
    """A law of two places made in some way, and what each edit makes of it."""
    loader, normal, shear = draw(st.sampled_from(sorted(LOADERS))), draw(places), draw(places)
    versions = [(normal, shear)]
    for slot, change, is_moved in draw(
        st.lists(st.tuples(st.integers(0, 1), st.sampled_from(CHANGES), st.booleans()), min_size=1, max_size=3)
    ):
        version = list(versions[-1])
        version[slot] = (draw(st.sampled_from(PLACES)) if is_moved else version[slot][0], change)
        versions.append(tuple(version))
    return loader, [*versions, versions[0]], draw(st.booleans())


def follow(history, folder):
    loader, versions, is_cold = history
    for normal, shear in versions:
        if is_cold:
            batch._done.clear()
        assert_is_as_written(loader, folder, normal, shear)


CALM = {"suppress_health_check": list(HealthCheck), "database": None}


@pytest.mark.thorough
@settings(max_examples=6, derandomize=True, **CALM)
@given(history=histories())
def test_the_compiled_law_is_the_interpreted_one(cache, tmp_path_factory, history):
    follow(history, tmp_path_factory.mktemp("law"))


@pytest.mark.slow
@settings(max_examples=400, **CALM)
@given(history=histories())
def test_the_compiled_law_is_the_interpreted_one_at_length(cache, tmp_path_factory, history):
    follow(history, tmp_path_factory.mktemp("law"))
