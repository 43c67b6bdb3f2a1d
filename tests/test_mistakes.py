"""Mistakes that users make: each is refused, or told where it may be meant, with its cause and its cure.

First those of programs, then those of a laboratory: units, signs and sizes.
"""

import warnings

import attrs
import matplotlib.image
import numpy as np
import pytest
from command_line import FILE, SMALL, invoke
from support import BRITTLE, PULL, ROCK, STIFF, STRONG, small_sample

import grainlaw as gl
from grainlaw.geometry import (
    Breakable,
    Minerals,
    Voronoi,
    VoronoiCells,
    from_labels,
    notched_beam,
    plate_with_hole,
    rectangle,
)
from grainlaw.laws import CohesiveCrack, MohrCoulomb
from grainlaw.protocols import BiaxialCompression, Brazilian, Excavation, PlaneWave, UniaxialCompression
from grainlaw.units import GPa, MPa, mm

PRESS = UniaxialCompression(loading=gl.Constant(speed=0.2), maximum_strain=2e-5, samples=10)


def run(law=BRITTLE, test=PRESS, specimen=None, **options):
    return gl.simulate(specimen or small_sample(12), law, test, progress=False, **options)


@attrs.frozen(kw_only=True)
class Own(gl.LoadingProtocol):
    """One stage of the user's own."""

    loads: object = ()
    until: object = gl.conditions.Reaches("time", 1e-5)
    measured: object = attrs.field(factory=lambda: {"height": 0.04})
    found: object = staticmethod(lambda curves: {})

    def stages(self, specimen):
        return [gl.Stage(name="own", loads=self.loads, until=[self.until], interval=1e-7)]

    def measure(self, state):
        return self.measured

    def summary(self, curves, specimen):
        return self.found(curves)


@attrs.frozen(kw_only=True)
class WithoutTraction(gl.ContactLaw):
    stiffness = (1e14, 1e14)


@attrs.frozen(kw_only=True)
class GivesNan(gl.ContactLaw):
    stiffness = (1e14, 1e14)

    def traction(self, opening, slip):
        return np.nan, 1e14 * slip


@attrs.frozen(kw_only=True)
class DoesNotCompile(gl.ContactLaw):
    stiffness = (1e14, 1e14)

    def traction(self, opening, slip):
        return eval("1e14") * opening, 1e14 * slip


@attrs.frozen(kw_only=True)
class ForgetsItsMemory(gl.ContactLaw):
    stiffness = (1e14, 1e14)

    def traction(self, opening, slip, damage):
        return 1e14 * opening, 1e14 * slip


class WithoutAttrs(gl.LoadingProtocol):
    """It lacks attrs, so that its parameters are none."""

    duration: float = gl.parameter("s")

    def stages(self, specimen):
        return [gl.Stage(name="own", loads=[drive()], until=[gl.conditions.Lasts(self.duration)], interval=1e-7)]

    def measure(self, state):
        return {}

    def summary(self, curves, specimen):
        return {}


def case(seed):
    return gl.Run(small_sample(12, seed=seed), BRITTLE, PRESS)


def of_one_sample(seed):
    return gl.Run(small_sample(12), BRITTLE, PRESS)


def drive(**changed):
    return gl.loads.Drive(boundary="top", axis=1, speed=-0.1, **changed)


def resumed(folder):
    run(checkpoint=folder / "run")
    run(attrs.evolve(BRITTLE, cohesion=30 * MPa), checkpoint=folder / "run", restart=True)


def image(folder):
    matplotlib.image.imsave(folder / "one.png", np.full((8, 8), 7, dtype=np.uint8), cmap="gray", vmin=0, vmax=255)
    from_labels(folder / "one.png", pixel=1 * mm)


def curve(folder, head, row, **given):
    """A file of a laboratory: stress up to 100 MPa in an elastic rock of 60 GPa, the row as it writes it."""
    rows = (row(share * 100 / 60e3, share * 100.0) for share in np.linspace(0, 1, 51))
    (folder / "curve.csv").write_text("\n".join([head, *rows]) + "\n", encoding="utf-8")
    return gl.read_curve(folder / "curve.csv", **given)


def commas(strain, stress):
    return f"{100 * strain:.4f},{stress:.3f}".replace(".", ",")


def percent(strain, stress):
    return f"{100 * strain:.6f},{stress:.6f}"


def forces(strain, stress):
    """kN on a cylinder of 50 mm."""
    return f"{100 * strain:.6f},{stress * np.pi * 50**2 / 4 / 1e3:.6f}"


def command(folder, *arguments):
    """Refused by the command line, in one line and before anything is written."""
    done = invoke(arguments[0], *arguments[1:2], "--out", folder / "out", *arguments[2:])
    assert done.exit_code in (1, 2)
    assert not (folder / "out").is_dir()
    (said,) = (line for line in done.output.splitlines() if line.startswith("Error: "))
    raise gl.ParameterError(said)


def compress(folder, *options):
    command(folder, "test", "uniaxial-compression", *SMALL, *options)


def taken(folder):
    (folder / "taken").touch()
    compress(folder, "--out", folder / "taken")


def study(folder, vary):
    (folder / "study.toml").write_text(FILE + vary)
    command(folder, "study", folder / "study.toml")


def asked(folder):
    try:
        return run().laboratory.properties["fracture_toughness"]
    except KeyError as error:
        raise gl.ParameterError(error.args[0]) from None


#: what is done, in a folder, and words of the sentence that refuses it
REFUSED = {
    "negative strength": (
        lambda _: MohrCoulomb(**STRONG | {"tensile_strength": -13 * MPa}),
        r"tensile_strength = -1.3e\+07 Pa is not allowed, it must be .* at least 0",
    ),
    "misspelt parameter": (
        lambda _: MohrCoulomb(**STIFF, tensile_strengh=1),
        "no 'tensile_strengh'; did you mean 'tensile_strength'",
    ),
    "misspelt law": (
        lambda folder: compress(folder, "--law", "mohr-columb"),
        "there is no law 'mohr-columb'; did you mean 'mohr-coulomb'",
    ),
    "misspelt test": (
        lambda folder: command(folder, "test", "brasilian"),
        "there is no test 'brasilian'; did you mean 'brazilian'",
    ),
    "a parameter of the law in the table of the rock": (
        lambda folder: compress(folder, "--set", "rock.tensile_strength=13 MPa"),
        "there is no 'rock.tensile_strength' .rock has: youngs_modulus",
    ),
    "a table for a region": (
        lambda folder: compress(folder, "--set", 'sample.region={type="polygon"}'),
        r"sample.region = .* is not allowed, it must be a name; what it needs are keys of .sample., beside it",
    ),
    "a folder that is a file": (taken, "cannot write to the folder '.*taken'"),
    "a study without levels": (lambda folder: study(folder, '"sample.seed" = []'), "sample.seed has no levels"),
    "a factor without its table": (lambda folder: study(folder, "seed = [1]"), "vary: .*seed"),
    "law without traction": (lambda _: WithoutTraction(), "WithoutTraction cannot be made: it must define traction"),
    "law that gives nan": (
        lambda _: run(GivesNan()),
        "GivesNan: at opening 0 m, slip 0 m the normal traction is nan .* must be finite",
    ),
    "law that does not compile": (
        lambda _: run(DoesNotCompile()),
        r"DoesNotCompile.traction .* cannot be compiled:\n.*'eval'",
    ),
    "law that forgets its memory": (
        lambda _: run(ForgetsItsMemory()),
        "it must return 3 numbers on every path",
    ),
    "text for a number": (
        lambda _: gl.Elastic(youngs_modulus="60 GPa", poissons_ratio=0.2, density=2700),
        "youngs_modulus = '60 GPa' is not allowed, .* above 0 .*write 60 [*] GPa",
    ),
    "equal seeds": (
        lambda _: gl.Study(case, seed=[1, 1, 2]),
        r"seed = \[1, 1, 2\] is not allowed, .* same level twice",
    ),
    "notch beyond the beam": (
        lambda _: notched_beam(0.2, 0.06, notch_depth=0.07, notch_width=5e-4, span=0.16, bearing=8e-3),
        "notch_depth = 0.07 m is not allowed, .* below 0.06",
    ),
    "grain larger than the specimen": (
        lambda _: Voronoi(grain_size=0.1).tessellate(rectangle(0.02, 0.04)),
        "grain_size = 0.1 m is not allowed, it must be at most 0.02 m",
    ),
    "sizes for a region": (
        lambda _: Voronoi(grains=20).tessellate((0.02, 0.04)),
        r"tessellate: region = \(0.02, 0.04\) is not allowed, it must be a Region",
    ),
    "the number of a phase that no grain has": (
        lambda _: run({(0, 7): BRITTLE, ...: BRITTLE}),
        r"\(0, 7\) names what the grains do not have \(phases: without names, numbers 0; joints: none\)",
    ),
    "the material of a phase that no grain has": (
        lambda _: gl.Specimen(small_sample(4).grains, {3: ROCK, ...: ROCK}),
        r"Specimen: material: there is no phase 3 \(phases: without names, numbers 0\)",
    ),
    "negative density": (
        lambda _: gl.Elastic(youngs_modulus=60 * GPa, poissons_ratio=0.2, density=-2700),
        "density = -2700 kg/m3 is not allowed, .* above 0",
    ),
    "stage without loads": (
        lambda _: run(test=Own(until=gl.conditions.Reaches("height", 1.0))),
        "stage 'own' has no loads, and its specimen is at rest: .* wait for ever for .*height.*; give it loads",
    ),
    "a fall to more than the highest": (
        lambda _: gl.conditions.FallsTo("height", 2),
        "FallsTo: fraction = 2 is not allowed, it must be .* below 1",
    ),
    "a condition of a column that is not there": (
        lambda _: run(test=Own(loads=[drive()], until=gl.conditions.FailsTo("hight", 0.5))),
        "FailsTo needs the column hight, which the test does not record; did you mean 'height'. .it records height",
    ),
    "a measure that gives an array": (
        lambda _: run(test=Own(loads=[drive()], measured={"height": np.zeros(2)})),
        "Own.measure: height = array.* is not allowed, it must be one number",
    ),
    "a measure that gives nothing": (
        lambda _: run(test=Own(loads=[drive()], measured=None)),
        "Own.measure = None is not allowed, it must be a dictionary of numbers by name",
    ),
    "a test without attrs": (
        lambda _: run(test=WithoutAttrs()),
        "duration = what a class declares that lacks @attrs.frozen is not allowed",
    ),
    "a parameter in no unit": (
        lambda _: gl.parameter("secs"),
        "parameter: unit = 'secs' is not allowed, it must be a unit such as 'Pa'",
    ),
    "a limit below zero": (
        lambda _: gl.conditions.Reaches("height", -1e-3),
        "limit = -0.001 is not allowed, it must be .* above 0",
    ),
    "two drives of one boundary": (
        lambda _: run(test=Own(loads=[drive(), drive()])),
        "Stage 'own': boundary = 'top' has a Drive and a Drive along the axis 1, it can have one",
    ),
    "a platen under a force that is driven": (
        lambda _: run(test=Own(loads=[drive(), gl.loads.Hold(boundary="top", axis=1, stress=-1e6)])),
        "boundary = 'top' has a Drive and a Hold along the axis 1",
    ),
    "a pressure where a boundary is driven": (
        lambda _: run(test=Own(loads=[drive(), gl.loads.Pressure(boundary="top", pressure=1e6)])),
        "a Pressure on the boundary top is not allowed beside a Drive .* the pressure does nothing",
    ),
    "an interval as a text": (
        lambda _: run(every="60 s"),
        r"simulate: every = '60 s' is not allowed, it must be a finite number and at least 0; write 60",
    ),
    "no frame": (lambda _: run(frames=-5), "simulate: frames = -5 is not allowed, .* whole number, at least 1"),
    "frames as a text": (lambda _: run(frames="30"), "simulate: frames = '30' is not allowed, .* whole number"),
    "a stress to be held as a text": (
        lambda _: gl.hold(small_sample(4), BRITTLE, stress="20 MPa"),
        "hold: stress = '20 MPa' is not allowed",
    ),
    "a number that no float holds": (
        lambda _: gl.loads.Drive(boundary="top", axis=1, speed=10**400),
        "Drive: speed = .* is not allowed",
    ),
    "time step too large": (
        lambda _: run(time_step_factor=2),
        "time_step_factor = 2 is not allowed, .* from 1e-06 to 1",
    ),
    "resumed under another law": (resumed, "belongs to another run: .* differ; give those of before, or begin anew"),
    "image of one colour": (
        image,
        "every pixel of .*one.png has the label 7, a file must have two at least",
    ),
    "image that is not there": (
        lambda folder: from_labels(folder / "none.png", pixel=1e-3),
        "none.png cannot be read as an image: .*No such file",
    ),
    "decimal commas between commas": (
        lambda folder: curve(folder, "strain [%],stress [MPa]", commas),
        r"2 names \(strain \[%\], stress \[MPa\]\) above 4 columns: is the comma the decimal sign too\? .*semicolons",
    ),
    "plotted before it has run": (
        lambda _: gl.plot_curves(case(1)),
        "results = Run.* is not allowed, it must be results by name",
    ),
    "a measure that the test lacks": (asked, "there is no 'fracture_toughness' .there are: .*tangent_modulus"),
    "empty study": (lambda _: gl.Study(case, seed=[]), "seed has no levels, it must have at least one"),
    "a star for any other mineral": (
        lambda _: run({("quartz", "*"): BRITTLE}),
        r"any other is \.\.\. in Python, as in \('mica', \.\.\.\)",
    ),
    "too many threads": (
        lambda folder: compress(folder, "--threads", 100_000),
        "--threads = 100000 is not allowed, it must be a whole number from 1 to 128",
    ),
}


@pytest.mark.parametrize(("mistake", "words"), REFUSED.values(), ids=REFUSED)
def test_a_mistake_is_refused_with_its_cause_and_its_cure(mistake, words, tmp_path):
    with pytest.raises((gl.ParameterError, gl.CompilationError, gl.StageError), match=words):
        mistake(tmp_path)


# --- of a laboratory --------------------------------------------------------------------------------------------------

REFUSED_BY_A_LABORATORY = {
    "UCS below the tensile strength": (
        lambda _: gl.Targets(ucs=10 * MPa, tensile_strength=100 * MPa),
        r"tensile_strength = 1e\+08 Pa is not allowed beside ucs = 1e\+07 Pa, it must be below it: are the two",
    ),
    "CI above CD": (
        lambda _: gl.Targets(crack_initiation=100 * MPa, crack_damage=80 * MPa),
        r"crack_initiation = 1e\+08 Pa is not allowed beside crack_damage = 8e\+07 Pa",
    ),
    "porosity of a grain": (
        lambda _: gl.Elastic(youngs_modulus=60 * GPa, poissons_ratio=0.2, density=2700, porosity=0.01),
        "Elastic: there is no 'porosity'.* .Elastic has: youngs_modulus, poissons_ratio, density, plane",
    ),
    "Poisson's ratio in %": (
        lambda _: gl.Elastic(youngs_modulus=60 * GPa, poissons_ratio=25, density=2700),
        "poissons_ratio = 25 is not allowed, .* below 0.5",
    ),
    "Brazilian test of a plate": (
        lambda _: run(test=Brazilian()),
        "Brazilian: the specimen is no disc: .* make it with grainlaw.geometry.disc",
    ),
    "sampling too coarse": (
        lambda _: UniaxialCompression(samples=3),
        "samples = 3 is not allowed, it must be a whole number, at least 10",
    ),
    "strain rate for a speed": (
        lambda _: gl.Adaptive(rate=0.5),
        "Adaptive: rate = 0.5 is not allowed, .* below 0.05",
    ),
    "calibration without a strength": (
        lambda folder: gl.calibrate(
            gl.Targets(youngs_modulus=60 * GPa), BRITTLE, {"cohesion": (30 * MPa, 60 * MPa)}, small_sample,
            store=folder / "store",
        ),
        "calibrate: targets have no strength",
    ),
}  # fmt: skip


@pytest.mark.parametrize(("mistake", "words"), REFUSED_BY_A_LABORATORY.values(), ids=REFUSED_BY_A_LABORATORY)
def test_a_mistake_of_a_laboratory_is_refused(mistake, words, tmp_path):
    with pytest.raises(gl.ParameterError, match=words):
        mistake(tmp_path)


def few_targets(folder):
    free = {"tensile_strength": (5 * MPa, 20 * MPa), "cohesion": (30 * MPa, 60 * MPa), "friction_angle": (20, 60)}
    gl.calibrate(gl.Targets(ucs=100 * MPa), BRITTLE, free, small_sample, store=folder / "store", progress=False)


def pressed(folder):
    slow = gl.Constant(speed=0.5 * mm / 60)  # 0.5 mm/min
    run(test=UniaxialCompression(loading=slow, maximum_strain=0.4))


#: what is done, in a folder, and words of the sentence that warns of it
TOLD = {
    "strength in MPa": (
        lambda _: MohrCoulomb(**STRONG | {"tensile_strength": 13}),
        "MohrCoulomb: tensile_strength = 13 Pa is unusual, usual are 1000 to .*: is the unit right",
    ),
    "fracture energy in N/mm": (
        lambda _: CohesiveCrack(**STRONG, mode_i_energy=0.15, mode_ii_energy=300),
        "mode_i_energy = 0.15 J/m2 is unusual, usual are 0.3 to 100000 J/m2",
    ),
    "angle of friction as radians or as a coefficient": (
        lambda _: MohrCoulomb(**STRONG | {"friction_angle": 0.94, "residual_friction_angle": 0}),
        "friction_angle = 0.94 deg is unusual, usual are 2 to 90 deg",
    ),
    "modulus in GPa": (
        lambda _: attrs.evolve(ROCK, youngs_modulus=60),
        r"youngs_modulus = 60 Pa is unusual, usual are 1e\+08 to 1e\+12 Pa",
    ),
    "density in g/cm3": (lambda _: attrs.evolve(ROCK, density=2.7), "density = 2.7 kg/m3 is unusual, usual are 500 to"),
    "confinement in MPa": (
        lambda _: run(test=BiaxialCompression(confinement=5)),
        r"stage 'confine': 5 Pa on the boundary \w+ is unusual in this specimen: usual are 1e\+03 to 3e\+09 Pa",
    ),
    "compression in the rock as positive": (
        lambda _: Excavation(xx=20 * MPa, yy=60 * MPa),
        r"Excavation: xx = 2e\+07 Pa is unusual, usual are -1e\+09 to -1000 Pa: is the sign right",
    ),
    "stress of the rock in MPa": (
        lambda _: Excavation(xx=-20),
        r"Excavation: xx = -20 Pa is unusual, usual are -1e\+09 to -1000 Pa: is the unit right",
    ),
    "specimen in mm": (
        lambda _: run(specimen=small_sample(12, width=20, height=40)),
        "a normal stiffness of .* is unusual between grains of 8.2 m",
    ),
    "stiffness of contacts in GPa/mm": (
        lambda _: gl.elastic_properties(small_sample(12), gl.laws.Linear(kn=105, ks=94.5)),
        "Linear: a normal stiffness of 105 Pa/m is unusual between grains of .* m and .* Pa: usual are",
    ),
    "a wave in ms": (
        lambda _: PlaneWave(stress=[(0, 0), (5e-3, -1 * MPa), (10e-3, 0)]),
        "PlaneWave: stress = .* is largest at 0.005 s, after the duration of 6e-05 s: is the unit right",
    ),
    "a mineral of less than a grain": (
        lambda _: Minerals(Voronoi(grains=20), {"quartz": 0.999, "zircon": 0.001}).tessellate(rectangle(0.02, 0.04)),
        r"no grain is zircon \(0.001\): 20 grains are too few for so small a share",
    ),
    "a speed of a testing machine": (pressed, "the run takes .* steps, .* a speed of 8.33e-06 m/s, .* load faster"),
    "targets in GPa": (
        lambda _: gl.Targets(youngs_modulus=60, ucs=100 * MPa),
        "Targets: youngs_modulus = 60 Pa is unusual",
    ),
    "a target in MPa": (lambda _: gl.Targets(ucs=120), "Targets: ucs = 120 Pa is unusual, usual are 1000 to"),
    "a target as a coefficient of friction": (
        lambda _: gl.Targets(ucs=120 * MPa, friction_angle=0.7),
        "Targets: friction_angle = 0.7 deg is unusual, usual are 2 to 90 deg",
    ),
    "toughness in MPa sqrt(m)": (
        lambda _: gl.Targets(fracture_toughness=1.5),
        r"Targets: fracture_toughness = 1.5 Pa √m is unusual, usual are 10000 to 1e\+08",
    ),
    "uncertainty in %": (
        lambda _: gl.Targets(ucs=(120 * MPa, 5)),
        "Targets: ucs: uncertainty over value = 4.16667e-08 is unusual, usual are 0.0001 to 0.5",
    ),
    "too few targets": (
        few_targets,
        r"1 targets of strength \(ucs\) for 3 free parameters \(.*\) cannot determine all of them: give more targets",
    ),
    "a curve in % read as a fraction": (
        lambda folder: curve(folder, "strain,stress [MPa]", percent, strain="1"),
        r"curve.csv: the modulus = 6e\+08 Pa is unusual, usual are 1e\+09 to 2e\+11 Pa",
    ),
    "a radius for a diameter": (
        lambda folder: curve(folder, "strain [%],force [kN]", forces, diameter=25 * mm),
        r"curve.csv: the modulus = 2.4\d*e\+11 Pa is unusual",
    ),
    "sizes of a curve in mm": (
        lambda folder: curve(folder, "strain [%],force [kN]", forces, diameter=50),
        "curve.csv: the largest stress = 100 Pa is unusual",
    ),
    "too many workers": (
        lambda _: gl.Study(case, seed=range(1, 2001)).run(workers=1000, progress=False),
        "workers = 1000 are more than the .* cores of this machine .* take as many as there are cores",
    ),
    "a seed that nothing uses": (
        lambda _: gl.Study(of_one_sample, seed=[1, 2]).run(progress=False),
        r"seed = 1, 2 give one and the same run: does of_one_sample\(seed\) make use of seed",
    ),
}  # fmt: skip


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "a calibration needs a table [targets], such as ucs = "),
        ("[targets]\nucs = '90 MPa'\n", "a calibration needs a table [free], such as cohesion = "),
    ],
)
def test_a_file_of_a_calibration_without_one_of_its_tables_is_refused(text, words, tmp_path):
    file = tmp_path / "rock.toml"
    file.write_text(f"[law]\ntype = 'mohr-coulomb'\n{text}", encoding="utf-8")
    done = invoke("calibrate", file)
    assert done.exit_code == 2
    assert words in done.output
    assert not (tmp_path / "rock").exists()


@pytest.mark.parametrize(("mistake", "words"), TOLD.values(), ids=TOLD)
def test_a_number_that_may_be_a_mistake_is_told_before_any_work(mistake, words, tmp_path):
    """As an error, the warning ends the work where it is given."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises((UserWarning, gl.ParameterError), match=words):
            mistake(tmp_path)


def test_usual_numbers_are_not_told(tmp_path):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        MohrCoulomb(**STRONG)
        CohesiveCrack(**STRONG, mode_i_energy=150, mode_ii_energy=300)
        Excavation(xx=0, yy=-60 * MPa)
        gl.Targets(
            youngs_modulus=60 * GPa, poissons_ratio=0.25, ucs=(120 * MPa, 5 * MPa), tensile_strength=8 * MPa,
            friction_angle=50, cohesion=20 * MPa, fracture_toughness=1.5e6, crack_initiation=50 * MPa,
            crack_damage=90 * MPa,
        )  # fmt: skip
        curve(tmp_path, "strain [%],force [kN]", forces, diameter=50 * mm)
        run(test=BiaxialCompression(confinement=5 * MPa, maximum_strain=1e-4, samples=10))
        run(test=attrs.evolve(PULL, maximum_strain=1e-5))


def test_a_comparison_says_where_more_than_the_law_differs():
    one, other = run(), run(specimen=small_sample(20))
    assert "the runs are of different grains: what they differ by is not the law alone" in str(
        gl.Comparison({"a": one, "b": other})
    )
    pulled = run(test=attrs.evolve(PULL, maximum_strain=1e-5))
    assert "different tests, UniaxialCompression, UniaxialTension" in str(gl.Comparison({"a": one, "b": pulled}))
    assert "the runs are of" not in str(gl.Comparison({"a": one, "b": one}))
    assert "the runs are of" not in str(gl.Comparison({("a", 1): one, ("a", 2): other}))


def test_a_misspelt_name_of_the_package_is_answered_by_the_name_that_was_meant():
    with pytest.raises(AttributeError, match="module 'grainlaw' has no attribute 'simluate'") as caught:
        gl.simluate  # noqa: B018
    assert (caught.value.name, caught.value.obj) == ("simluate", gl)  # by these Python suggests gl.simulate


def test_a_file_in_a_folder_that_is_not_there_names_the_folder(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"there is no folder '.*none'"):
        run().save(tmp_path / "none" / "run.npz")


@pytest.mark.parametrize(
    ("found", "words"),
    [
        (lambda curves: {"low": curves["hight"].min()}, "KeyError: 'hight'"),
        (lambda curves: None, "it returned None, not"),
    ],
)
def test_a_summary_that_fails_costs_no_run(found, words):
    kept = "what was recorded is kept, in Python as error.result"
    with pytest.raises(gl.StageError, match=f"Own.summary, after the run: {words}.*{kept}") as told:
        run(test=Own(loads=[drive()], found=found))
    assert len(told.value.result.curves["height"]) > 50
    assert "tensile_cracks" in told.value.result.summary


def test_a_sliver_that_rules_the_step_is_told():
    """Beside a corner of the hole a triangle is 4 um wide in grains of 13 mm."""
    plate = Voronoi(grains=60, seed=31).tessellate(plate_with_hole(0.1, 0.1, 0.02))
    held = [drive(), gl.loads.Drive(boundary="bottom", axis=1, speed=0)]
    words = r"the step of a run is 0.00028 of what most zones allow, for the thin cell 15 at \(-0.00965, 0.002585\) m"
    with pytest.warns(UserWarning, match=words):
        run(test=Own(loads=held, until=gl.conditions.Reaches("time", 1e-9)), specimen=gl.Specimen(plate, ROCK))


def test_a_law_of_cells_without_cells_is_told():
    """And not where grains have cells, or where laws are by phases."""
    held = Own(loads=[drive(), gl.loads.Drive(boundary="bottom", axis=1, speed=0)])
    with pytest.warns(UserWarning, match=r"law: 'inside' is for cells of one grain, and no grain .* has cells"):
        run({"inside": BRITTLE, ...: BRITTLE}, held)
    with pytest.warns(UserWarning, match=r"law: \('inside', 0\) is for cells"):
        run({("inside", 0): BRITTLE, ...: BRITTLE}, held)
    cells = Breakable(Voronoi(grains=6), VoronoiCells(count=3)).tessellate(rectangle(20 * mm, 40 * mm))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        run({"inside": BRITTLE, ...: BRITTLE}, held, gl.Specimen(cells, ROCK))
        run({(0, 0): BRITTLE, ...: BRITTLE}, held)


def test_platens_that_push_the_same_way_are_told():
    """Both pressed by a negative stress, as if it were normal to each; opposite signs press, and so does a wall."""
    low, high, spring, turned = (
        gl.loads.Hold(boundary=side, axis=0, stress=stress, stiffness=stiffness)
        for side, stress, stiffness in (("left", -1e6, 0), ("right", -1e6, 0), ("right", -1e6, 1e12), ("left", 1e6, 0))
    )
    with pytest.warns(UserWarning, match=r"Hold on left, right along x have a sum of -8e\+04 N/m, and nothing holds"):
        run(test=Own(loads=[low, high]))
    wall = gl.loads.Drive(boundary="right", axis=0, speed=0)
    for sound in (
        [turned, high],
        [low, spring],
        [low, wall],
        [low, gl.loads.Pressure(boundary="right", pressure=1e6)],
    ):
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            run(test=Own(loads=sound))


def test_what_nothing_holds_is_told():
    with pytest.warns(UserWarning, match="stage 'own' moves top, and nothing holds the specimen against it"):
        run(test=Own(loads=[drive()]))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        run(test=Own(loads=[drive(), gl.loads.Drive(boundary="bottom", axis=1, speed=0)]))

    class LetGo(Own):
        def stages(self, specimen):
            (stage,) = super().stages(specimen)
            until = [gl.conditions.Reaches("time", 1.1e-5)]
            return [stage, attrs.evolve(stage, name="hold", loads=[], until=until)]

    held = [drive(), gl.loads.Drive(boundary="bottom", axis=1, speed=0)]
    with pytest.warns(UserWarning, match="stage 'hold' has no loads: what 'own' moved before is free in it"):
        run(test=LetGo(loads=held))
