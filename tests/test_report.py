"""The laboratory report: a page that stands alone, holds all numbers, and says what did not hold."""

import base64
import re
import struct
from html.parser import HTMLParser
from pathlib import Path
from types import SimpleNamespace

import attrs
import numpy as np
import pytest
from support import ROCK, STIFF, STRONG, small_sample

import grainlaw as gl
from grainlaw import protocols
from grainlaw.columns import panels_of, quantity_of
from grainlaw.geometry import Bricks, Hexagonal, disc, rectangle
from grainlaw.laws import BandisClosure, CohesiveCrack, Linear, MohrCoulomb, StaticFatigue
from grainlaw.protocols import DirectShear, PlaneWave, UniaxialCompression
from grainlaw.quantity import three_digits
from grainlaw.results.archive import in_words
from grainlaw.results.figures import report
from grainlaw.results.figures.report import LIMITS, _components, _rows, write_report
from grainlaw.results.standard_measures import thresholds
from grainlaw.units import mm

LAW = CohesiveCrack(**STRONG, mode_i_energy=150, mode_ii_energy=300, closure=BandisClosure(maximum_closure=5e-6))
SHORT = UniaxialCompression(loading=gl.Constant(speed=0.2), maximum_strain=0.0005, samples=20)
EMPTY = {"img", "meta", "input"}


class Page(HTMLParser):
    """Text of the cells of each row, by the row's heading; fails where tags do not balance."""

    def __init__(self, file):
        super().__init__()
        self.open, self.tags, self.rows, self.images, self.text = [], set(), {}, [], ""
        self.source = Path(file).read_text("utf-8")
        self.feed(self.source)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag, attributes):
        self.tags.add(tag)
        if tag == "img":
            self.images.append(dict(attributes)["src"])
        if tag not in EMPTY:
            self.open.append(tag)
        if tag == "tr":
            self.row = []
        if tag in ("td", "th"):
            self.row.append("")

    def handle_endtag(self, tag):
        assert self.open.pop() == tag
        if tag == "tr" and "thead" not in self.open:
            self.rows.setdefault(self.row[0], []).append(self.row[1:])

    def handle_data(self, data):
        self.text += data
        if self.open and self.open[-1] in ("td", "th"):
            self.row[-1] += data


@pytest.fixture(scope="module")
def result():
    return gl.simulate(small_sample(), LAW, SHORT)


@pytest.fixture(scope="module")
def page(result, tmp_path_factory):
    record = {"seed": 7, "sample": {"type": "Voronoi", "size <&>": "20 mm"}, "versions": {"numba": "1.2.3"}}
    file = tmp_path_factory.mktemp("page") / "report.html"
    result.write_report(file, title="Block 7 <granite>", record=record)
    return Page(file)


def test_the_page_stands_alone(page):
    assert not page.tags & {"script", "link", "iframe", "object"}
    assert not re.search(r"(src|href)=\"(?!data:)", page.source)
    assert "url(" not in page.source
    assert "@media print" in page.source
    for image in page.images:
        kind, data = image.split(",")
        assert kind == "data:image/png;base64"
        content = base64.b64decode(data, validate=True)
        assert content[:8] == b"\x89PNG\r\n\x1a\n"
        width, height = struct.unpack(">II", content[16:24])
        assert min(width, height) > 200
    assert len(page.images) == 2  # curves, and the specimen; nothing has broken


def test_titles_and_records_are_text_not_tags(page):
    assert "Block 7 <granite>" in page.text
    assert page.rows["size <&>"] == [["20 mm"]]
    assert page.rows["seed"][0] == ["7"]
    assert page.rows["numba"] == [["1.2.3"]]


def test_properties_have_units(page, result):
    assert page.rows["strength (MPa)"] == [[f"> {result.summary['largest_stress'] / 1e6:.3g}"]]  # it had not failed
    assert "> stands before the largest stress of a specimen that had not failed." in page.text
    assert page.rows["strain at failure (%)"] == [["-"]]
    assert page.rows["E (GPa)"] == [[f"{result.summary['modulus'] / 1e9:.3g}"]]
    named = {quantity_of(name).heading for name in result.summary}
    assert named <= set(page.rows)


@pytest.mark.thorough
def test_what_cannot_fail_has_no_row_of_a_strength(result, tmp_path):
    """A linear law: nothing warns, no strength is missing, and moduli are there."""
    attrs.evolve(result, law=Linear(**STIFF)).write_report(tmp_path / "report.html")
    page = Page(tmp_path / "report.html")
    assert not {"strength (MPa)", "strain at failure (%)"} & set(page.rows)
    assert {"largest stress (MPa)", "E (GPa)"} <= set(page.rows)
    assert "had not failed" not in page.text


@pytest.mark.thorough
def test_of_several_samples_what_is_of_one_says_so(result, tmp_path):
    samples = {"law": {7: result, 8: result}}
    write_report({"law": result}, tmp_path / "report.html", samples=samples)
    page = Page(tmp_path / "report.html")
    assert "Mean curves" not in page.text
    for heading in ("Properties", "Certificate", "Curves", "Cracks", "Laboratory measures"):
        assert f"{heading} of seed 7" in page.text


def test_parameters_have_units_and_parts_their_own(page):
    assert ["13 MPa"] in page.rows["tensile_strength"]
    assert ["BandisClosure"] in page.rows["closure"]
    assert page.rows["closure.maximum_closure"] == [["5 um"]]
    assert page.rows["youngs_modulus"] == [["60 GPa"]]
    assert page.rows["loading.speed"] == [["200 mm/s"]]
    assert page.rows["integrator.damping.fraction"] == [["0.8"]]


@attrs.frozen
class Part:
    speed: float = attrs.field(default=2e-3, metadata={"unit": "m/s"})
    none: None = None
    empty: tuple = ()
    pair: tuple = (1, 2)
    plane: gl.Plane = gl.Plane.STRAIN
    words: str = "words"
    times: np.ndarray = attrs.field(factory=lambda: np.array([1.0, 2.0]))
    inner: gl.integration.LocalDamping = gl.integration.LocalDamping(fraction=0.5)
    own: int = attrs.field(default=7, init=False)


def test_rows_of_a_component_by_hand():
    assert _rows(Part()) == [
        ["speed", "2 mm/s"], ["none", "-"], ["empty", "-"], ["pair", "1, 2"], ["plane", "strain"], ["words", "words"],
        ["times", "array([1., 2.])"], ["inner", "LocalDamping"], ["inner.fraction", "0.5"],
    ]  # fmt: skip


def test_what_was_tested_by_hand():
    """A disc about the origin, of some hexagons."""
    specimen = gl.Specimen(Hexagonal(grain_size=8 * mm).tessellate(disc(40 * mm)), ROCK, contact_points=gl.EndPoints())
    one = SimpleNamespace(specimen=specimen, mesh=specimen.mesh, protocol=SHORT)
    laws = {"MohrCoulomb": MohrCoulomb(**STRONG), "mine": Linear(**STIFF)}
    laws["aged"] = StaticFatigue(law=laws["MohrCoulomb"], rate=1e-6)
    laws["StaticFatigue of MohrCoulomb"] = laws["aged"]
    laws["pairs"] = {("quartz", "mica"): laws["MohrCoulomb"], ...: laws["mine"]}
    parts = dict(_components({name: SimpleNamespace(**vars(one), law=law) for name, law in laws.items()}))
    assert list(parts) == [
        "Specimen", "Elastic grains", "MohrCoulomb", "mine (Linear)",
        "aged (StaticFatigue of MohrCoulomb)", "StaticFatigue of MohrCoulomb",
        "pairs (MohrCoulomb) between quartz and mica", "pairs (Linear) elsewhere", "Uniaxial compression",
    ]  # fmt: skip
    alone = SimpleNamespace(**vars(one), law=laws["pairs"])  # of one run its name is not said again
    assert list(dict(_components({"MohrCoulomb, Linear": alone})))[2:4] == [
        "MohrCoulomb between quartz and mica", "Linear elsewhere",
    ]  # fmt: skip
    rows = dict(parts["Specimen"])
    sizes = [float(rows[name].removesuffix(" mm")) for name in ("width", "height", "mean grain size")]
    assert sizes == pytest.approx([40, 40, 40 * np.sqrt(np.pi / 4 / specimen.grains.count)], rel=0.02)
    assert rows["contact points"] == str(2 * len(specimen.mesh.interfaces))
    assert (rows["kind of contact points"], rows["refinement"]) == ("EndPoints", "0")
    assert dict(parts["mine (Linear)"])["kn"] == "105 TPa/m"


def test_a_load_that_changes_with_time_is_one_entry():
    rows = _rows(PlaneWave())
    assert [row for row in rows if row[0].startswith("stress")] == [
        ["stress", "0 Pa at 0 s, -1 MPa at 5 us, 0 Pa at 10 us"]
    ]
    times = np.linspace(0, 1e-3, 1001)
    many = gl.TimeSeries(times, np.sin(4e3 * np.pi * times) * 2e6)
    assert many.in_words("Pa") == "1001 points, -2 MPa to 2 MPa, at 0 s to 1 ms"


def test_laboratory_measures_that_exist_have_units_and_sources(page, result):
    modulus = result.laboratory.properties["secant_modulus"]
    assert page.rows["E_s50, secant up to 50 % of the peak (GPa)"] == [[f"{modulus / 1e9:.3g}", "ISRM (1979, 1999)"]]
    assert page.rows["fragments"] == [["1", ""]]
    assert len(result.cracks) == 0
    assert not [row for row in page.rows if row.startswith(("CI,", "CD,", "b-value"))]


@pytest.fixture(scope="module")
def broken():
    """A peak, cracks, and a way after it."""
    return gl.simulate(small_sample(20), MohrCoulomb(**STRONG), attrs.evolve(SHORT, maximum_strain=0.01, samples=100))


@pytest.mark.thorough
def test_rounding_is_no_energy_and_has_no_row_of_digits(tmp_path):
    result = gl.simulate(small_sample(20), Linear(**STIFF), SHORT)
    result.write_report(tmp_path / "report.html")
    page = Page(tmp_path / "report.html")
    for row in ("energy lost by contacts in opening (J/m)", "energy lost by contacts that have not broken (J/m)"):
        assert page.rows[row] == [["0", ""]]
    assert "nothing to draw of cracks" in page.text
    assert 0 < np.abs(result.laboratory.energy_lost).max() < 1e-9  # what the rows would have shown
    for panel in ("growth", "lost", "moments"):
        assert result.laboratory.plot(panel).axes[0].get_ylim()[0] == 0


@pytest.mark.thorough
def test_a_peak_that_was_passed_is_no_bound(broken, tmp_path):
    broken.write_report(tmp_path / "report.html")
    page = Page(tmp_path / "report.html")
    assert page.rows["strength (MPa)"] == [[f"{broken.summary['strength'] / 1e6:.3g}"]]
    assert len(page.images) == 3
    ratio = broken.laboratory.properties["crack_initiation_count"] / broken.summary["strength"]
    assert 0 < ratio <= 1
    assert page.rows["CI/UCS, 1 % of the cracks at the peak"][0][0] == f"{ratio:.3g}"


def test_curves_are_readable_before_the_peak(result):
    """Where lateral strains grow a hundredfold after the peak, the axis fits those before."""
    from grainlaw.results.figures.curves import plot_report_curves

    strain = np.linspace(0, 0.01, 101)
    stress = np.where(strain <= 0.005, strain, 0.005 - 0.5 * (strain - 0.005)) * 50e9
    lateral = np.where(strain <= 0.005, 0.3 * strain, 0.0015 + 20 * (strain - 0.005))
    curves = {name: np.zeros(101) for name in result.curves} | {
        "strain": strain, "stress": stress, "lateral_strain": lateral, "volumetric_strain": lateral - strain,
        "tensile_cracks": np.where(strain <= 0.005, strain > 0.002, 1000.0), "damaged": 1.0 * (strain > 0.002),
    }  # fmt: skip

    def drawn(**changed):
        summary = result.summary | {"strength": 250e6}
        return plot_report_curves({"law": attrs.evolve(result, curves=curves | changed, summary=summary)}).axes

    upper, panel, cracks, *_ = drawn()
    assert panel.get_ylim() == pytest.approx((-0.35, 0.15 + 0.6 * 0.5))  # %, of -0.35 to 0.15; the largest is 10
    assert panel.get_title() == "up to the strength; then to 10.2 %"
    assert not cracks.get_title()
    marks = [line.get_xydata()[0] for line in upper.lines if line.get_marker() == "o"]
    assert marks == [pytest.approx((0.5, 250))]  # the largest load is the strength
    assert "o" not in [line.get_marker() for line in drawn(damaged=0 * strain)[0].lines]  # nothing has failed
    whole = plot_report_curves({"law": result}).axes
    assert not whole[1].get_title()
    assert len(whole[0].lines) == 1
    symmetric = drawn(volumetric_strain=-lateral)[1]
    assert symmetric.get_ylim() == pytest.approx((-0.15 - 0.1 * 0.3, 0.15 + 0.6 * 0.3))
    for times, cut in ((2.9, False), (3.1, True)):  # of the range before
        lateral = np.where(strain <= 0.005, 0.3 * strain, 0.0015 + (times - 1) * (strain - 0.005))
        assert bool(drawn(lateral_strain=lateral, volumetric_strain=0 * strain - 0.0035)[1].get_title()) == cut


@pytest.mark.thorough
def test_files_beside_the_page_are_linked(result, tmp_path):
    result.write_report(tmp_path / "report.html", files=["curves.csv", "a law/grains <1>.pvd"])
    page = Page(tmp_path / "report.html")
    assert re.findall(r'href="([^"]*)"', page.source) == ["curves.csv", "a%20law/grains%20%3C1%3E.pvd"]
    assert "a law/grains <1>.pvd" in page.text


def test_three_digits():
    texts = [three_digits(value) for value in (0.054321, 55.31, 166.2, 15083, 8.599e-8, 0, -1234.6, 2.5e12)]
    assert texts == ["0.0543", "55.3", "166", "15083", "8.6e-08", "0", "-1235", "2.5e+12"]


def test_a_test_that_ends_before_failure_says_so(page):
    assert "the specimen had not failed when the test ended" in page.text


@pytest.mark.thorough
@pytest.mark.parametrize(("share", "verdict"), [(1.0, "pass"), (1.01, "FAIL")])
def test_the_certificate_passes_at_its_limits_and_fails_above(result, share, verdict, tmp_path):
    summary = result.summary | {name: limit * share for name, (limit, _) in LIMITS.items()}
    attrs.evolve(result, summary=summary).write_report(tmp_path / "report.html")
    page = Page(tmp_path / "report.html")
    for name, (_, cure) in LIMITS.items():
        assert page.rows[quantity_of(name).heading][0][1].split()[1] == verdict
        assert (cure in page.text) == (verdict == "FAIL")


def test_the_limits_are_those_of_the_documents():
    theory = (Path(__file__).parents[1] / "docs" / "theory.md").read_text("utf-8")
    stated = {name: float(limit) for name, limit in re.findall(r"^\| `(\w+)` \|.*\| at most ([\d.]+) \|", theory, re.M)}
    assert stated == {name: limit for name, (limit, _) in LIMITS.items()}


@pytest.mark.thorough
def test_an_incomplete_test_is_marked_with_the_reason(result, page, tmp_path):
    assert "Incomplete" not in page.text
    result.write_report(tmp_path / "report.html", incomplete="the run became unstable at step 7")
    assert "Incomplete: the run became unstable at step 7" in Page(tmp_path / "report.html").text


def test_a_run_that_recorded_nothing_has_a_report(result, tmp_path, monkeypatch):
    """With the cracks of its last frame."""
    drawn, draw = [], report.side_by_side
    monkeypatch.setattr(
        report, "side_by_side", lambda results, frame=-1: drawn.append((results, frame)) or draw(results, frame)
    )
    summary = {"steps": 0, "energy_error": 2 * LIMITS["energy_error"][0], "energy_made": LIMITS["energy_made"][0]}
    nothing = attrs.evolve(result, curves={}, summary=summary | {"imbalance": np.nan})
    nothing.write_report(tmp_path / "report.html", incomplete="unstable at once")
    assert [(list(results.values()), frame) for results, frame in drawn] == [([nothing], -1)]
    page = Page(tmp_path / "report.html")
    assert page.rows["steps"] == [["0"]]
    assert f"is above its limit; {LIMITS['energy_error'][1]}" in page.text
    verdicts = [page.rows[quantity_of(name).heading][0][1] for name in ("energy_error", "energy_made", "imbalance")]
    assert [verdict.split()[-1] for verdict in verdicts] == ["FAIL", "pass", "FAIL"]
    assert verdicts[2].startswith("cannot be computed")
    assert "of a specimen that had not failed" not in page.text  # it has no strength to fail at


def test_a_page_has_the_title_given_or_the_test_and_its_laws(result, tmp_path, monkeypatch):
    titles = []
    monkeypatch.setattr(report, "write_page", lambda file, page, *, title, **more: titles.append(title))
    nothing = attrs.evolve(result, curves={}, frames=())
    for title in ("Block 7", ""):
        write_report({"stiff": nothing, "weak": nothing}, tmp_path / "report.html", title=title)
    assert titles == ["Block 7", "Uniaxial compression: stiff, weak"]


@pytest.mark.parametrize(
    ("test", "words"),
    [
        (protocols.UniaxialCompression, "Uniaxial compression"), (protocols.ThreePointBending, "Three-point bending"),
        (protocols.SemiCircularBend, "Semi-circular bend"), (protocols.SplitHopkinson, "Split Hopkinson"),
    ],
)  # fmt: skip
def test_the_name_of_a_test_is_spelt_as_in_the_field(test, words):
    assert in_words(object.__new__(test)) == words


def test_curves_of_one_law_and_of_two_are_told_apart(result):
    from grainlaw.results.figures.curves import plot_report_curves

    def labels(axes):
        legend = axes.get_legend()
        return [text.get_text() for text in legend.get_texts()] if legend else None

    stress, strains, broken, *_, energy = plot_report_curves({"law": result}).axes
    assert (labels(stress), stress.lines[0].get_marker()) == (None, "None")
    assert labels(strains) == ["volumetric strain", "lateral strain"]
    assert strains.get_ylabel() == "strain, extension positive (%)"
    assert labels(broken) == ["tensile cracks", "shear cracks"]
    assert energy.get_ylabel() == "energy (J/m)"
    assert labels(energy)[0] == "external"
    stress, _, broken, *_ = plot_report_curves({"one": result, "other": result}).axes
    assert labels(stress) == ["one", "other"]
    assert stress.lines[0].get_marker() != "None"
    assert labels(broken)[:2] == ["one, tensile cracks", "one, shear cracks"]


def test_of_a_test_of_ones_own_the_first_four_columns_are_drawn():
    """Over how far it is, what it applies first."""
    every = dict.fromkeys(("time", "stage", "energy_external", "tensile_cracks", "unbalanced"), np.zeros(2))
    columns = every | dict.fromkeys("abcdef", np.zeros(2))
    assert panels_of(columns) == [gl.Panel("time", [name]) for name in "abcd"]
    applied = columns | dict.fromkeys(("deflection", "force"), np.zeros(2))
    assert panels_of(applied) == [gl.Panel("deflection", [name]) for name in ("force", *"abc")]
    assert panels_of(applied, [gl.Panel("a", ["b"]), gl.Panel("a", ["lost"])]) == [gl.Panel("a", ["b"])]
    assert panels_of(every) == [gl.Panel("time", ["unbalanced"])]  # of a test that records nothing itself


@pytest.mark.thorough
def test_laws_stand_side_by_side(tmp_path):
    comparison = gl.compare(small_sample(), {"stiff": Linear(**STIFF), "Mohr & Coulomb": MohrCoulomb(**STRONG)}, SHORT)
    comparison.write_report(tmp_path / "report.html")
    page = Page(tmp_path / "report.html")
    above = comparison["Mohr & Coulomb"].summary["largest_stress"]
    assert page.rows["strength (MPa)"] == [["-", f"> {above / 1e6:.3g}"]]  # what cannot break has no strength
    assert "Mohr & Coulomb (MohrCoulomb)" in page.text
    assert page.rows["kn"] == [["105 TPa/m"]] * 2


@pytest.mark.thorough
def test_laws_of_phases_and_scattered_strength(tmp_path):
    blocks = Bricks(rows=2).tessellate(rectangle(20 * mm, 4 * mm))
    mixed = gl.Specimen(attrs.evolve(blocks, phase=np.array([0, 1])), {0: ROCK, 1: ROCK})
    weak = attrs.evolve(LAW, tensile_strength=np.array([6e6, 8e6]))
    shear = DirectShear(normal_stress=1e6, maximum_slip=1e-6)
    gl.simulate(mixed, {(0, 1): weak}, shear).write_report(tmp_path / "report.html")
    page = Page(tmp_path / "report.html")
    assert "between 0 and 1" in page.text
    assert page.rows["tensile_strength"] == [["6 MPa to 8 MPa in 2 values"]]
    assert page.rows["youngs_modulus"] == [["60 GPa"]] * 2


@pytest.mark.thorough
def test_a_test_of_ones_own_has_its_columns_drawn(tmp_path):
    """Without stress and strain: whatever it measures."""

    @attrs.frozen(kw_only=True)
    class Pull(gl.LoadingProtocol):
        def stages(self, specimen):
            drives = [
                gl.loads.Drive(boundary="top", axis=1, speed=0.1),
                gl.loads.Drive(boundary="bottom", axis=1, speed=0),
            ]
            return [gl.Stage(name="pull", loads=drives, until=[gl.conditions.Reaches("time", 1e-5)], interval=1e-6)]

        def measure(self, state):
            return {"force": state.reaction("top")[1]}

        def summary(self, curves, specimen):
            return {"strength": curves["force"].max(), "never": float("nan")}

    result = gl.simulate(small_sample(), LAW, Pull())
    write_report({"law": result}, tmp_path / "report.html")
    page = Page(tmp_path / "report.html")
    assert page.rows["never"] == [["-"]]
    assert page.text.strip().startswith("Pull: law")
    from grainlaw.results.figures.curves import plot_report_curves

    assert "force (kN/m)" in [axes.get_ylabel() for axes in plot_report_curves({"law": result}).axes]


def test_figures_show_the_recorded_numbers(result):
    from grainlaw.results.figures.curves import plot_report_curves

    upper = plot_report_curves({"law": result}).axes[0]
    assert (upper.get_xlabel(), upper.get_ylabel()) == ("axial strain (%)", "axial stress (MPa)")
    x, y = upper.lines[0].get_data()
    assert x == pytest.approx(result.curves["strain"] * 100)
    assert y == pytest.approx(result.curves["stress"] / 1e6)


@pytest.mark.parametrize(
    ("name", "value", "heading", "text"),
    [
        ("confinement", 4e6, "confinement (MPa)", "4.00"),
        ("slip", 1.25e-6, "slip (µm)", "1.25"),
        ("stress_12", 1.25e6, "stress 12 (MPa)", "1.25"),
        ("lateral_strain", -0.001, "lateral strain (%)", "-0.1000"),
        ("fracture_toughness", 1.5e6, "fracture toughness (MPa √m)", "1.500"),
        ("energy_damping", 3.0, "energy damping (J/m)", "3"),
        ("tensile_cracks", 7, "tensile cracks", "7"),
        ("confinement", np.int64(4_000_000), "confinement (MPa)", "4.00"),
        ("modulus", [50e9, float("nan")], "E (GPa)", "50.00, -"),
        ("anything", 0.25, "anything", "0.25"),
        ("anything", "words", "anything", "words"),
        ("strength", None, "strength (MPa)", "-"),
    ],
)
def test_names_tell_how_they_are_shown(name, value, heading, text):
    assert (quantity_of(name).heading, quantity_of(name).text(value)) == (heading, text)


@pytest.mark.parametrize(
    ("notes", "said"),
    [
        ({"a": "it broke", "b": "it broke"}, ["it broke"]),
        ({"a": "it broke", "b": "no load"}, ["a: it broke", "b: no load"]),
        ({"a": "it broke", "b": ""}, ["a: it broke"]),
        ({"a": "", "b": ""}, []),
        ({"a": "it broke"}, ["it broke"]),
    ],
)
def test_what_was_not_measured_is_said_once_or_by_law(notes, said):
    assert report._not_measured({name: SimpleNamespace(note=note) for name, note in notes.items()}) == said


def test_a_record_has_its_sections():
    record = {"version": "1.2", "python": {"numpy": 2, "of": {"threads": 4, "where": "here"}}, "seconds": 3.5}
    assert list(report._record(record)) == [
        ("", [["version", "1.2"], ["seconds", "3.5"]]),
        ("python", [["numpy", "2"], ["of.threads", "4"], ["of.where", "here"]]),
    ]
    assert list(report._record({"python": {"numpy": 2}})) == [("python", [["numpy", "2"]])]


def test_thresholds_that_some_specimen_has_are_shown_with_their_means():
    """In MPa: 30 and 50 of three specimens under one law, none under the other; those that none has are left out."""
    names = [measure.name for measure in thresholds()]

    def specimen(**found):
        return SimpleNamespace(laboratory=SimpleNamespace(value=lambda name: found.get(name, np.nan)))

    samples = {
        "a": {1: specimen(**{names[1]: 30e6}), 2: specimen(**{names[1]: 50e6}), 3: specimen()},
        "b": {1: specimen()},
    }
    half = 12.706204736 * 20e6 / np.sqrt(2) / np.sqrt(2)  # t of one degree of freedom at 0.975, deviation 20 / sqrt(2)
    [[heading, one, other, source]] = report._thresholds(samples)
    measure = thresholds()[1]
    assert heading.startswith(measure.meaning)
    assert one == f"{40:.3g} ({40 - half / 1e6:.3g} to {40 + half / 1e6:.3g}), 2 of 3"
    assert (other, source) == ("-", measure.source)


def test_samples_are_too_few_where_any_law_has_too_few(monkeypatch):
    monkeypatch.setattr(report, "plot_samples", lambda samples: "figure")
    monkeypatch.setattr(report, "thresholds", list)
    first, other = SimpleNamespace(summary={}), SimpleNamespace(summary={})
    enough = dict.fromkeys(range(7, 7 + report.ENOUGH), other)
    said = report._all_samples({"a": enough, "b": {3: other, 7: first}}, first)
    assert said["too_few"]
    assert (said["this"], said["seeds"][:2], said["seeds"][-1]) == (7, [7, 8], 3)
    assert not report._all_samples({"a": enough, "b": {**enough, 3: first}}, first)["too_few"]


def test_every_failure_of_the_certificate_says_the_line_to_type():
    """Of what one can do on the command line; that contacts flutter is up to the law."""
    cures = {name: cure for name, (_, cure) in LIMITS.items()}
    flutter = cures.pop("energy_made")
    assert all(re.search(r"--set \w+(\.\w+)+=[\d.]+$", cure) for cure in cures.values())
    assert "the law may flutter" in flutter
