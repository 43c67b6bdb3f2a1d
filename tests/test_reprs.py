"""What a component prints by itself, in a notebook and under ``help``: short, and never an error."""

import functools
import inspect
import pickle
import types

import attrs
import cloudpickle
import numpy as np
import pytest
from support import BRITTLE, HILLERBORG, PULL, ROCK, STIFF, STRONG, offenders, small_sample

import grainlaw as gl
from grainlaw import geometry, laws
from grainlaw.arguments import Checked
from grainlaw.engine.model import Model
from grainlaw.messages import refusal, short
from grainlaw.runs.elastic_properties import ElasticProperties
from grainlaw.runs.identity import digest
from grainlaw.runs.record import described, described_run
from grainlaw.short_form import MOST, MOST_OF_LAW, _listed, _other
from grainlaw.workbench.conformance import Entry, Report

PACKAGES = (gl, *(getattr(gl, name) for name in gl.MODULES))
EXPORTED = sorted(
    {each for package in PACKAGES for name in package.__all__ if isinstance(each := getattr(package, name), Checked)},
    key=lambda each: each.__name__,
)


@pytest.fixture(scope="module")
def result():
    return gl.simulate(small_sample(), BRITTLE, PULL)


def test_a_long_list_that_is_no_numbers_has_a_hash():
    @attrs.frozen
    class Named:
        words: tuple = ()

    one, other = (described(Named(words=tuple(f"{k}{end}" for k in range(101))))["words"] for end in "ab")
    assert one["count"] == 101
    assert one["sha256"] != other["sha256"]


def unmade(kind):
    """An instance whose fields were never set, as a constructor leaves it that has refused its values."""
    return kind.__new__(kind)


def filled(kind, content):
    """An instance with the same thing in every field."""
    made = unmade(kind)
    for field in attrs.fields(kind):
        object.__setattr__(made, field.name, content)
    return made


def page(thing):
    """Its table in a notebook, which a browser can read."""
    text = thing._repr_html_()
    assert text.count("<table>") == text.count("</table>")
    return text


#: what prints as a line or a table of its own, which is made of its content
OWN = (gl.Study, ElasticProperties)


@pytest.mark.thorough
def test_no_component_prints_a_page_whatever_it_holds():
    def rule(kind):
        things = [unmade(kind)]
        if attrs.has(kind):
            contents = np.arange(1e5), ["grain"] * 10_000, {k: "grain" for k in range(10_000)}, "grain " * 10_000, None
            things += [filled(kind, content) for content in contents]
        most = MOST_OF_LAW if getattr(kind, "takes_arrays", False) else MOST
        for thing in things:
            assert len(repr(thing)) <= most
            assert kind.__name__ in repr(thing)
            assert len(page(thing)) < 30_000

    assert not offenders(rule, [kind for kind in EXPORTED if not inspect.isabstract(kind) and kind not in OWN])


def test_a_law_prints_the_parameters_that_are_not_defaults_with_their_units():
    assert repr(laws.Linear(**STIFF)) == "Linear(kn=105 TPa/m, ks=94.5 TPa/m)"
    assert repr(HILLERBORG) == "Hillerborg(kn=105 TPa/m, ks=94.5 TPa/m, strength=13 MPa, energy=50 J/m2)"
    law = laws.MunjizaJoint(**STRONG, mode_i_energy=10, mode_ii_energy=50, softening=laws.ExponentialSoftening(rate=4))
    assert "softening=ExponentialSoftening(rate=4)" in repr(law)
    assert "unloading" not in repr(law)
    assert "<tr><th>unloading</th><td>Unloading." in page(law)


def test_a_law_that_differs_from_contact_to_contact_prints_the_range():
    law = laws.Linear(kn=np.linspace(1e14, 2e14, 1000), ks=1e14)
    assert repr(law) == "Linear(kn=1000 numbers from 100 TPa/m to 200 TPa/m, ks=100 TPa/m)"


def test_parts_are_listed_as_far_as_there_is_room_for_them():
    """To the last letter; what is left out is told."""
    assert _listed("(", ["abc", "defg"], ")", 11) == "(abc, defg)"
    assert _listed("(", ["abc", "defg"], ")", 10) == "(abc, ...)"
    assert _listed("(", ["abc", "defg"], ")", 9) == "(...)"
    assert _listed("(", [], ")", 2) == "()"


def test_a_mapping_shows_its_entries_each_in_its_short_form():
    assert (
        _other({"a": 0.5, "b": {1: laws.Linear(**STIFF)}})
        == "{'a': 0.5, 'b': {1: Linear(kn=105 TPa/m, ks=94.5 TPa/m)}}"
    )
    assert _other({k: 2.0 for k in range(8)}) == "{0: 2, 1: 2, 2: 2, 3: 2, 4: 2, 5: 2, ... 8 in all}"


def test_a_class_keeps_a_form_of_its_own():
    class Own(laws.Softening):
        def __repr__(self):
            return "mine"

        def remaining(self, damage):
            return 1 - damage

    @attrs.frozen
    class Derived(Own):
        rate: float = 1.0

    assert repr(Own()) == repr(Derived()) == "mine"


def test_a_result_prints_what_is_to_be_known_first(result):
    words = f"Result(law: MohrCoulomb, test: UniaxialTension, grains: 40, strength (MPa): {'{:.2f}'}"
    assert repr(result).startswith(words.format(result.summary["strength"] / 1e6))
    assert f"shear cracks: {sum(~result.cracks.tensile)}, samples: {len(result.curves['time'])}" in repr(result)
    assert repr(result.cracks).startswith(f"Cracks(cracks: {len(result.cracks)}, tensile: ")
    assert repr(result.specimen).startswith("Specimen(grains: 40, size: 20 mm x 40 mm, grain size: ")
    assert "<th>steps</th>" in page(result)
    for thing in (result, result.specimen, result.specimen.grains, result.laboratory, result.frames[-1]):
        assert len(repr(thing)) <= MOST


def test_a_result_that_was_made_too_fast_says_so(result):
    fast = attrs.evolve(result, summary={**result.summary, "kinetic_ratio": 0.5})
    (doubt,) = [words for words in fast.doubts if "the test was not quasi-static" in words]
    for thing in (fast, fast.laboratory):
        assert f"doubt: {doubt}" in str(thing).splitlines()
    assert doubt in page(fast)
    assert str(attrs.evolve(result, curves={})) == repr(attrs.evolve(result, curves={}))


def test_a_comparison_prints_its_laws_and_those_that_failed(result):
    comparison = gl.Comparison({"<one>": result}, {"other": ValueError("a < b")})
    assert repr(comparison).startswith("Comparison(laws: 2, failed: other, <one>: ")
    assert "&lt;one&gt;" in page(comparison)
    assert "a &lt; b" in page(comparison)
    many = gl.Comparison({f"law number {k}": result for k in range(100)})
    assert len(repr(many)) <= MOST


def test_what_was_stopped_or_has_nothing_prints_too(result):
    empty = attrs.evolve(result, curves={}, summary={}, cracks=result.cracks[:0], frames=[])
    for thing in (empty, gl.Comparison({"law": empty}), gl.Comparison({}), empty.laboratory, empty.cracks):
        assert repr(thing).startswith(f"{type(thing).__name__}(")
        assert "(...)" not in repr(thing)
        page(thing)


def test_a_report_prints_its_verdict():
    report = Report("Mine", (Entry("energy", False, "made"), Entry("memory", True)))
    assert repr(report) == "Report(law: Mine, verdict: fails energy, properties: 2)"
    assert "<th>energy</th><td>fails</td><td>made</td>" in page(report)


def test_errors_quote_components_in_the_short_form(result):
    assert len(str(refusal("Stage: until", result, "a list of conditions"))) < 200
    assert short(BRITTLE, 60) == "MohrCoulomb(kn=105 TPa/m, ks=94.5 TPa/m, ...)"
    with pytest.raises(gl.ParameterError) as refused:
        gl.simulate(result, BRITTLE, PULL)
    assert len(str(refused.value)) < 300


def test_keys_and_fingerprints_see_what_is_not_printed(monkeypatch):
    """Two components that print alike are told apart, and a form of another kind changes no key."""
    many = np.linspace(1e14, 2e14, 1000)
    other = many.copy()
    other[500] *= 1 + 1e-12
    one, two = (laws.Linear(kn=kn, ks=1e14) for kn in (many, other))
    assert repr(one) == repr(two)
    assert digest(one) != digest(two)
    specimen = small_sample(grains=4)
    key = described_run(Model(specimen, one), PULL, {})["key"]
    assert key != described_run(Model(specimen, two), PULL, {})["key"]
    before = digest(one, ROCK, PULL)
    for kind in EXPORTED:
        monkeypatch.setattr(kind, "__repr__", lambda self: "something")
    assert described_run(Model(specimen, one), PULL, {})["key"] == key
    assert digest(one, ROCK, PULL) == before


def test_keys_see_what_a_function_is_made_of():
    """What a partial function holds, what a wrapped one wraps, and whose method it is."""
    powers = [functools.partial(pow, 2, mod=mod) for mod in (3, 5, 5)]
    one, other, same = map(digest, powers)
    assert one != other == same
    cached = [functools.cache(each) for each in powers]
    one, other, same = map(digest, cached)
    assert one != other == same
    stronger = attrs.evolve(BRITTLE, cohesion=30e6)
    assert digest(BRITTLE.traction) == digest(attrs.evolve(BRITTLE).traction) != digest(stronger.traction)


def test_keys_see_components_inside_mappings_and_sets():
    @attrs.frozen
    class Held:
        values: object

        def __repr__(self):
            return "Held()"

    def key(content):
        return described_run(Model(small_sample(grains=4), BRITTLE), PULL, {"observers": content})["key"]

    for wrapped in (
        lambda each: {"a": each},
        lambda each: [each],
        lambda each: {"a": {"b": each}},
        lambda each: {each},
    ):
        assert key(wrapped(Held(1.0))) == key(wrapped(Held(1.0)))
        assert key(wrapped(Held(1.0))) != key(wrapped(Held(2.0)))
    long = np.arange(5000.0)
    assert key({"a": long}) != key({"a": np.where(long == 2500, 0, long)})


# --- help ------------------------------------------------------------------------------------------------------------


def test_help_shows_unit_bound_default_and_meaning_of_each_parameter():
    lines = inspect.getdoc(laws.CohesiveCrack).splitlines()
    assert lines[0] == "Tension and shear soften together by one damage over their fracture energies, friction remains."
    rows = {line.split()[0]: " ".join(line.split()[1:]) for line in lines if line}
    assert rows["kn"] == "Pa/m above 0 normal stiffness"
    assert rows["friction_angle"] == "deg at least 0 and below 90 phi, of the intact contact"
    assert rows["pre_peak"] == "PrePeak EXPONENTIAL, AS_PRINTED, LINEAR EXPONENTIAL how a traction rises to its peak"
    assert rows["softening"] == "Softening EvansMarathe() shape of the softening branches"


def test_the_signature_shows_unit_and_bound():
    parameters = inspect.signature(laws.CohesiveCrack).parameters
    assert "float, 'Pa, at least 0'" in str(parameters["cohesion"])
    assert "int, 'at least 0'" in str(inspect.signature(geometry.Voronoi).parameters["seed"])
    assert str(parameters["closure"]) == "closure: 'Closure' = LinearClosure()"


def test_every_component_has_a_row_for_each_parameter():
    def rule(kind):
        rows = [line.split()[0] for line in inspect.getdoc(kind).splitlines() if line.strip()]
        for name in inspect.signature(kind).parameters:
            assert name in rows

    assert not offenders(rule, [kind for kind in EXPORTED if attrs.has(kind)])


def test_a_law_written_in_a_notebook_has_the_meanings_too(monkeypatch):
    import linecache

    source = (
        "import attrs, grainlaw as gl\n"
        "@attrs.frozen(kw_only=True)\n"
        "class Cell(gl.ContactLaw):\n"
        "    kn: float = gl.parameter('Pa/m')  #: of the cell\n"
        "    stiffness = property(lambda self: (self.kn, self.kn))\n"
        "    def traction(self, opening, slip):\n"
        "        return self.kn * opening, self.kn * slip\n"
    )
    monkeypatch.setitem(linecache.cache, "<cell 1>", (len(source), None, source.splitlines(True), "<cell 1>"))
    module = types.ModuleType("cell")  # without a file, as the module of a notebook
    monkeypatch.setitem(__import__("sys").modules, "cell", module)
    exec(compile(source, "<cell 1>", "exec"), vars(module))
    assert "of the cell" in module.Cell.__doc__


def test_a_class_keeps_its_docstring_in_another_process():
    @attrs.frozen
    class Local(laws.Softening):
        """Mine."""

        def remaining(self, damage):
            return 1 - damage

    again = pickle.loads(cloudpickle.dumps(Local))
    assert again.__doc__ == Local.__doc__
    assert vars(again)["__doc__"] == "Mine."


@pytest.mark.parametrize("package", PACKAGES)
def test_a_notebook_offers_public_names_only(package):
    modules = {name for name in dir(package) if isinstance(getattr(package, name), types.ModuleType)}
    assert set(package.__all__) <= set(dir(package))
    assert modules <= {*gl.MODULES, "units"}
    assert set(dir(package)) - set(package.__all__) - modules <= {"__version__"}
