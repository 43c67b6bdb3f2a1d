"""What tests of the command line share: a call of it, the options of a small test, the file of a small study."""

from click.testing import CliRunner

from grainlaw.cli.commands import main

SMALL = ["--quick", "--grains", "20", "--set", "test.maximum_strain=0.0002", "--set", "test.samples=20"]


def invoke(*arguments):
    return CliRunner().invoke(main, [str(argument) for argument in arguments])


# --- studies ---------------------------------------------------------------------------------------------------------

FILE = """
[sample]
grains = 12

[test]
type = "uniaxial-compression"
maximum_strain = 0.0001
samples = 10

[numerics]
time_step_factor = 0.9
mass_scaling = 1.5
threads = 2

[vary]
"""
MINE = """
import attrs, helper
import grainlaw as gl

@attrs.frozen(kw_only=True)
class Mine(gl.ContactLaw):
    kn: float = gl.parameter("Pa/m", default=5e13)
    ks: float = gl.parameter("Pa/m", default=4e13)
    stiffness = property(lambda self: (self.kn, self.ks))

    def traction(self, opening, slip):
        return helper.times(self.kn, opening), self.ks * slip  # by the helper
"""
LAWS = 'law = ["mohr-coulomb", "mine.py:Mine"]\n"sample.seed" = "1..2"\n'


def study_file(folder, vary, text=FILE):
    """The file of a study, and that of a law of the user's."""
    (folder / "mine.py").write_text(MINE)
    (folder / "helper.py").write_text("def times(a, b):\n    return a * b\n")
    (folder / "granite.toml").write_text(text + vary)
    return folder / "granite.toml"
