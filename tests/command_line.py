"""What tests of the command line share: a call of it, and the options of a small test."""

from click.testing import CliRunner

from grainlaw.cli import main

SMALL = ["--quick", "--grains", "20", "--set", "test.maximum_strain=0.0002", "--set", "test.samples=20"]


def invoke(*arguments):
    return CliRunner().invoke(main, [str(argument) for argument in arguments])
