"""The command line: help, the main job in small, and refusals that leave nothing behind."""

import json
import re
import subprocess
import sys
from importlib.metadata import version

import numpy as np
import pytest
from click.testing import CliRunner
from command_line import invoke

from grainlaw.cli.commands import COMMANDS, main

SMALL = ["compare", "--quick", "--grains", "20", "--max-strain", "0.0005", "--threads", "1"]


def test_the_list_of_commands_says_what_they_say_of_themselves():
    """Its words are kept apart, so that no command is loaded for the list."""
    shown = invoke("--help").output
    for name, words in COMMANDS.items():
        of_itself = main.get_command(None, name).help.partition(".")[0]
        assert re.findall(r"\w+", words)[:5] == re.findall(r"\w+", of_itself)[:5]
        assert f"  {name} " in shown


INTERRUPTED = """
import sys
class Stops:
    def find_spec(self, name, path=None, target=None):
        if name == sys.argv[-1]:
            raise KeyboardInterrupt
sys.meta_path.insert(0, Stops())
sys.argv[1:] = ["test", "uniaxial-compression", sys.argv[-1]]
from grainlaw.cli import main
main()
"""


@pytest.mark.parametrize("module", ["click", "numba", "scipy.sparse"])
def test_ctrl_c_while_modules_are_loaded_is_one_line(module):
    done = subprocess.run([sys.executable, "-c", INTERRUPTED, module], capture_output=True, text=True)
    assert done.returncode == 130
    assert done.stderr == "\nstopped; go on with the same command\n"


def test_help_names_every_option():
    assert "compare" in invoke("--help").output
    shown = invoke("compare", "--help").output
    for option in ("grains", "seeds", "seed", "laws", "speed", "max-strain", "out", "threads", "quick"):
        assert f"--{option} " in shown
    assert "linear,mohr-coulomb,cohesive-crack" in "".join(shown.split())


def test_the_shell_completes_commands_and_names(monkeypatch):
    """As click's line in the documents does."""
    for begun, found in (
        ("grainlaw comp", ["plain,compare"]),
        ("grainlaw test brazil", ["plain,brazilian"]),
        ("grainlaw test mine", ["file,mine"]),
        ("grainlaw schema mine", []),
        ("grainlaw schema creep", ["plain,creep"]),
        ("grainlaw law mohr", ["plain,mohr-coulomb"]),
        ("grainlaw law mine", ["file,mine"]),
        ("grainlaw material drucker", ["plain,drucker-prager"]),
        ("grainlaw test creep --law linear", ["plain,linear"]),
        ("grainlaw test creep --rock palabora-carbonatite-p", ["plain,palabora-carbonatite-printed"]),
    ):
        monkeypatch.setenv("COMP_WORDS", begun)
        monkeypatch.setenv("COMP_CWORD", str(begun.count(" ")))
        monkeypatch.setenv("_GRAINLAW_COMPLETE", "bash_complete")
        shown = CliRunner().invoke(main, prog_name="grainlaw")
        assert shown.output.split() == found


def test_version():
    assert version("grainlaw") in invoke("--version").output


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    folder = tmp_path_factory.mktemp("job") / "new" / "out"
    return invoke(*SMALL, "--seed", 3, "--out", folder), folder


@pytest.mark.thorough
def test_the_main_job_prints_the_table_and_writes_the_folder(done):
    result, folder = done
    assert result.exit_code == 0, result.output
    assert re.search(r"^ +linear +mohr-coulomb +cohesive-crack$", result.output, re.MULTILINE)
    assert re.search(r"^strength \(MPa\) +-( +> \d+\.\d\d){2}$", result.output, re.MULTILINE)
    for law in ("linear", "mohr-coulomb", "cohesive-crack"):
        for name in ("grains", "cracks"):
            assert (folder / law / f"{name}.pvd").exists()
        assert (folder / f"cracks_{law}.png").exists()
    assert {"comparison.png", "curves.csv", "summary.json"} <= {file.name for file in folder.iterdir()}
    assert str(folder) in result.output


@pytest.mark.thorough
def test_the_summary_records_what_the_run_was_made_with(done):
    content = json.loads((done[1] / "summary.json").read_text())
    assert content["seed"] == 3
    record = json.loads((done[1] / "run.json").read_text())
    assert record["status"] == "finished"
    assert record["made_with"]["versions"]["grainlaw"] == version("grainlaw")
    assert {"python", "numpy", "numba"} <= set(record["made_with"]["versions"])
    parameters = content["parameters"]
    assert (parameters["sample"]["tessellator"], parameters["sample"]["grains"]) == ("voronoi", 20)
    assert parameters["material"]["youngs_modulus"] == 60e9
    assert parameters["protocol"]["maximum_strain"] == 0.0005
    assert parameters["laws"]["cohesive-crack"]["mode_i_energy"] == 150
    assert parameters["laws"]["cohesive-crack"]["softening"]["type"] == "EvansMarathe"


@pytest.mark.thorough
def test_laws_are_compared_on_three_samples(done, tmp_path):
    """Each with the numbers of its own; and one seed is one of the three."""
    result = invoke(*SMALL, "--laws", "linear,mohr-coulomb", "--out", tmp_path)
    assert result.exit_code == 0, result.output
    assert re.search(r"^strength \(MPa\)( +> \d+\.\d\d \(\d+\.\d\d to \d+\.\d\d\)| +-){2}$", result.output, re.M)
    assert "mean (range) of the samples with the seeds 1, 2, 3" in result.output
    content = json.loads((tmp_path / "summary.json").read_text())
    assert content["seeds"] == [1, 2, 3]
    one = json.loads((done[1] / "summary.json").read_text())["laws"]["linear"]
    assert set(content["laws"]["linear"]) == set(one)
    assert content["samples"]["3"]["linear"] | {"seconds": 0} == one | {"seconds": 0}
    for law in ("linear", "mohr-coulomb"):
        peaks = [content["samples"][seed][law]["largest_stress"] for seed in ("1", "2", "3")]
        assert len(set(peaks)) == 3
        assert np.isclose(content["laws"][law]["largest_stress"], sum(peaks) / 3, rtol=1e-12)
        assert all((tmp_path / f"{law}_seed_{seed}" / "grains.pvd").exists() for seed in (1, 2, 3))
        assert (tmp_path / f"cracks_{law}.png").exists()
    assert {"comparison.png", "report.html", "curves.csv"} <= {file.name for file in tmp_path.iterdir()}


@pytest.mark.thorough
def test_options_reach_the_run(done, tmp_path):
    result = invoke(*SMALL, "--laws", "linear", "--speed", 0.2, "--seed", 3, "--out", tmp_path / "fast")
    assert result.exit_code == 0, result.output
    fast, other = (json.loads((f / "summary.json").read_text()) for f in (tmp_path / "fast", done[1]))
    assert list(fast["laws"]) == ["linear"]
    speeds = np.genfromtxt(tmp_path / "fast" / "linear" / "curves.csv", names=True, delimiter=",")["loading_speed"]
    assert set(speeds) == {0.2}
    moduli = [found["laws"]["linear"]["apparent_modulus"] for found in (fast, other)]
    assert np.isclose(*moduli, rtol=0.1)  # of other grains


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--laws", "mohr-colomb"], "there is no law 'mohr-colomb'; did you mean 'mohr-coulomb'?"),
        (["--laws", "linear,ccm"], "there is no law 'ccm'"),
        (["--laws", ""], "there is no law ''"),
        (["--laws", "linear,my.py:Law"], '[vary] law = ["linear", "my.py:Law"]'),
        (["--grain", "5"], "--grains"),
        (["--frob"], "No such option"),
        (["--grains", "many"], "'many' is not a valid integer"),
        (["--grains", "0"], "grains = 0 is not allowed"),
        (["--grains", "10000000000"], "memory"),
        (["--speed", "-1"], "speed = -1 m/s is not allowed"),
        (["--speed", "nan"], "speed = nan m/s is not allowed"),
        (["--max-strain", "0"], "maximum_strain = 0 is not allowed"),
        (["--threads", "0"], "threads = 0 is not allowed"),
        (["--threads", "100000"], "threads = 100000 is not allowed"),
        (["--threads", "many"], "threads = 'many' is not allowed, it must be a whole number from 1 to 128, or 'auto'"),
        (["--seed", "-1"], "seed = -1 is not allowed"),
        (["--seeds", "1,-1"], "seed = -1 is not allowed"),
        (["--seeds", "1,2.5"], "--seeds = 1,2.5 is not allowed, it must be whole numbers with commas between"),
        (["--seeds", "2,2"], "--seeds = 2,2 is not allowed, it must be finite numbers, each once"),
        (["--seeds", "1..3"], "--seeds = 1..3 is not allowed, it must be numbers with commas between"),
        (["--seeds", "1,2", "--seed", "3"], "--seed and --seeds are not allowed together"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_refusals_are_one_message_and_leave_nothing(arguments, words, tmp_path):
    result = invoke("compare", "--quick", "--out", tmp_path / "out", *arguments)
    assert result.exit_code != 0
    assert words in " ".join(result.output.split())
    assert "Traceback" not in result.output
    assert result.exception is None or isinstance(result.exception, SystemExit)
    assert not list(tmp_path.iterdir())


def test_a_folder_that_cannot_be_written_is_named(tmp_path):
    (tmp_path / "taken").write_text("a file")
    result = invoke(*SMALL, "--out", tmp_path / "taken" / "out")
    assert result.exit_code == 1
    assert "cannot write to the folder" in result.output
    assert (tmp_path / "taken").read_text() == "a file"


@pytest.mark.thorough
def test_a_law_is_shown_as_table_and_picture(tmp_path):
    result = invoke("law", "mohr-coulomb", "--out", tmp_path / "new")
    assert result.exit_code == 0, result.output
    assert re.search(r"^tension +13 +0\.1238 ", result.output, re.MULTILINE)
    assert {file.name for file in (tmp_path / "new").iterdir()} == {"law_mohr-coulomb.png", "law_mohr-coulomb.json"}
    record = json.loads((tmp_path / "new" / "law_mohr-coulomb.json").read_text())
    assert record["law"]["tensile_strength"] == 13e6
    assert record["made_with"]["processor"]
    assert "law_mohr-coulomb.png" in result.output


@pytest.mark.thorough
@pytest.mark.parametrize("law", ["munjiza", "camacho-ortiz", "bilinear-mixed-mode", "xu-needleman", "barton-bandis"])
def test_every_law_of_the_table_can_be_compared(law, tmp_path):
    few = ["compare", "--quick", "--seed", "1", "--grains", "8", "--max-strain", "0.0001", "--threads", "1"]
    result = invoke(*few, "--laws", law, "--out", tmp_path)
    assert result.exit_code == 0, result.output
    assert (tmp_path / f"cracks_{law}.png").exists()


def test_a_law_of_a_file_is_shown(tmp_path):
    (tmp_path / "mine.py").write_text("from grainlaw.laws import Linear\nlaw = Linear(kn=2e13, ks=1e13)\n")
    result = invoke("law", f"{tmp_path / 'mine.py'}:law", "--out", tmp_path)
    assert result.exit_code == 0, result.output
    assert "Linear: first stiffness 2e+13 Pa/m normal, 1e+13 Pa/m shear" in result.output
    assert (tmp_path / "law_mine_law.png").exists()


@pytest.mark.parametrize(
    ("law", "words"),
    [
        ("cohesive", "there is no law 'cohesive'; did you mean 'cohesive-crack'?"),
        ("nothing.py:law", "there is no file nothing.py"),
        ("mine.py", "name the law, as in mine.py:law"),
        ("mine.py:low", "there is no 'low' in mine.py; did you mean 'law'?"),
        ("mine.py:scattered", "give the law of one contact"),
    ],
)
def test_laws_that_cannot_be_shown_are_refused_in_words(law, words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = "import grainlaw.laws as known\nlaw = known.Linear(kn=2e13, ks=1e13)\n"
    text += "scattered = known.Linear(kn=[1e13, 2e13], ks=1e13)\n"
    (tmp_path / "mine.py").write_text(text)
    result = invoke("law", law, "--out", "out")
    assert result.exit_code == 2
    assert words in " ".join(result.output.split())
    assert not (tmp_path / "out").exists()
