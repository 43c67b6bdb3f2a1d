"""Portable code: the same bits from processors with and without fused multiplication and addition, and never mixed."""

import os
import subprocess
import sys

import pytest

from grainlaw.compiler import cache

NO_FUSED = {"NUMBA_CPU_NAME": "generic", "NUMBA_CPU_FEATURES": ""}
FUSED = {"NUMBA_CPU_NAME": "haswell", "NUMBA_CPU_FEATURES": ""}
LAW = """
import attrs, sys
import grainlaw as gl
from grainlaw.compiler.cache import OPTIONS, compile_portably
from grainlaw.compiler.entry import compiled

@attrs.frozen(kw_only=True)
class Mine(gl.ContactLaw):
    kn: float = gl.parameter("Pa/m")
    stiffness = property(lambda self: (self.kn, self.kn))

    def traction(self, opening, slip):
        return self.kn * opening + slip, slip

def kernel(a, b, c):
    return a * b + c

def remainder(add):
    near = 1 + 2.0**-30
    return add(near, near, -(1 + 2.0**-29)) * 2.0**60  # 1 with one rounding, 0 with two

def contact(kn, opening, slip):
    return gl.trace(Mine(kn=kn), opening, slip, compiled=True).normal[0]

{choose}
print(remainder(compiled(kernel)), remainder(contact))
"""


def fuses():
    """Whether this processor can run code for one with fused instructions."""
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as file:
            return {"fma", "avx2", "bmi2"} <= set(file.read().split())
    except OSError:
        return False


fused = pytest.mark.skipif(not fuses(), reason="this processor does not fuse multiplication and addition")


def run(arguments, environment, folder, code=None):
    whole = os.environ | {"GRAINLAW_CACHE": str(folder / "cache"), "GRAINLAW_PORTABLE": "0"} | environment
    done = subprocess.run(
        [sys.executable, *arguments], cwd=folder, env=whole, input=code, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.split()


@pytest.mark.thorough
@fused
def test_portable_code_rounds_twice_and_is_kept_apart(tmp_path):
    """One cache for all: laws and kernels, by the variable and by the function, before and after the other kind."""
    usual, chosen = LAW.format(choose=""), LAW.format(choose="compile_portably()")
    plain, portable = {}, {"GRAINLAW_PORTABLE": "1"}
    for code, environment, expected in (
        (usual, plain, "1.0"), (usual, portable, "0.0"), (chosen, plain, "0.0"), (usual, plain, "1.0"),
    ):  # fmt: skip
        assert run(["-"], FUSED | environment, tmp_path, code) == [expected, expected]
    assert len(list((tmp_path / "cache").iterdir())) == 4  # two functions, of either kind


def test_what_was_compiled_otherwise_is_not_mixed_with_portable_code(monkeypatch):
    monkeypatch.setattr(cache, "FUSED", {"contract"})
    monkeypatch.setattr(cache, "_begun", [])
    cache.compile_portably()
    assert not cache.FUSED
    cache.FUSED.add("contract")
    cache.keyed_njit(lambda x: x, "key")
    with pytest.raises(cache.ParameterError, match="compiled that is not portable: set GRAINLAW_PORTABLE=1"):
        cache.compile_portably()
    assert cache.FUSED


TEST = ["test", "uniaxial-compression", "--quick", "--grains", "40", "--set", "test.maximum_strain=0.008"]
COMPARE = ["compare", "--quick", "--seed", "1", "--grains", "40", "--max-strain", "0.004", "--threads", "2"]


@pytest.mark.slow
@fused
def test_two_processors_give_the_same_curves(tmp_path):
    """Past failure, every digit of every column; and not so without the option."""

    def curves(command, environment):
        run(["-m", "grainlaw", *command, "--out", "out", "--overwrite"], environment, tmp_path)
        return (tmp_path / "out" / "curves.csv").read_bytes()

    for command in (TEST, COMPARE):
        first = curves([*command, "--portable"], FUSED)
        assert curves([*command, "--portable"], NO_FUSED) == first
    assert curves(TEST, FUSED) != curves(TEST, NO_FUSED)
