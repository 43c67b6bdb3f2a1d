"""Random damage of files of all kinds that are read: cut, flipped bits, other numbers, lines lost, doubled, swapped."""

import contextlib
import io
import random
import re
from collections.abc import Callable, Iterator
from pathlib import Path

import meshio
import numpy as np
from fuzz import calls
from fuzz.limits import Case
from matplotlib.image import imsave
from tess_files import GROUPS, tess

import grainlaw as gl
from grainlaw.cli.configuration import configured
from grainlaw.cli.sections import read_file
from grainlaw.geometry import from_labels, from_mesh, read_tess

POINTS = np.array([(0, 0, 0), (1, 0, 0), (1, 2, 0), (0, 2, 0), (0.5, 1, 0)], dtype=float)
TRIANGLES = [("triangle", [(0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)])]
FORMATS = {  # formats of meshio that need no other package, by ending
    "1.msh": ("gmsh22", {"binary": False}), "2.msh": ("gmsh22", {"binary": True}), "3.msh": ("gmsh", {"binary": False}),
    "1.vtk": ("vtk", {"binary": False}), "2.vtk": ("vtk", {"binary": True}), "1.vtu": ("vtu", {"binary": False}),
    "2.vtu": ("vtu", {}), "1.ply": ("ply", {"binary": False}), "1.obj": ("obj", {}), "1.inp": ("abaqus", {}),
    "1.off": ("off", {}), "1.mesh": ("medit", {}), "1.bdf": ("nastran", {}),
}  # fmt: skip
LABELS = np.repeat(np.repeat([[1, 2], [3, 4], [5, 6]], 8, axis=0), 8, axis=1)
CONFIGURATION = """
[sample]
width = "20 mm"
height = "40 mm"
grains = 12
[law]
type = "mohr-coulomb"
cohesion = "20 MPa"
[test]
samples = 20
"""
WORDS = [
    b"nan",
    b"inf",
    b"1e400",
    b"-1",
    b"0",
    b"9" * 23,
    b"1e-320",
    b"abc",
    b"",
    b"1e9",
    b"2147483648",
    b"\xff",
    b"\0",
]


def whole() -> dict[str, tuple[bytes, Callable[[str], object]]]:
    """A sound file of each kind, and what reads it."""
    made: dict[str, tuple[bytes, Callable[[str], object]]] = {"1.tess": (tess(cell=GROUPS).encode(), read_tess)}
    with contextlib.redirect_stderr(io.StringIO()), contextlib.redirect_stdout(io.StringIO()):  # it warns of text
        for name, (form, options) in FORMATS.items():
            meshio.write(name, meshio.Mesh(POINTS, TRIANGLES), file_format=form, **options)
            made[name] = (Path(name).read_bytes(), from_mesh)
    np.save("1.npy", LABELS)
    imsave("1.png", LABELS * 20, vmin=0, vmax=255, cmap="gray")
    calls.result().save("1.grainlaw")
    made |= {name: (Path(name).read_bytes(), lambda file: from_labels(file, 1e-3)) for name in ("1.npy", "1.png")}
    made["1.grainlaw"] = Path("1.grainlaw").read_bytes(), gl.Result.load
    made["1.toml"] = CONFIGURATION.encode(), lambda file: configured("uniaxial-compression", read_file(Path(file)))
    return made


def damaged(content: bytes, dice: random.Random) -> bytes:
    for _ in range(dice.choice([1, 1, 1, 2, 5])):
        place, lines = dice.randrange(len(content) + 1), content.split(b"\n")
        i, j = dice.randrange(len(lines)), dice.randrange(len(lines))
        match dice.choice(["cut", "flip", *3 * ["number"], "word", "lost", "doubled", "swapped", "noise"]):
            case "cut":
                content = content[:place]
            case "flip":
                flipped = bytes(byte ^ 1 << dice.randrange(8) for byte in content[place : place + 1])
                content = content[:place] + flipped + content[place + 1 :]
            case "noise":
                content = content[:place] + dice.randbytes(dice.choice([1, 8, 300])) + content[place:]
            case "number" | "word" as kind:
                found = list(re.finditer(rb"-?\d+\.?\d*(e[-+]?\d+)?" if kind == "number" else rb"\S+", content))
                if found:
                    first, last = dice.choice(found).span()
                    content = content[:first] + dice.choice(WORDS) + content[last:]
            case "lost":
                content = b"\n".join(lines[:i] + lines[i + 1 :])
            case "doubled":
                content = b"\n".join([*lines[:i], lines[j], *lines[i:]])
            case "swapped":
                lines[i], lines[j] = lines[j], lines[i]
                content = b"\n".join(lines)
    return content


def cases(seed: int, count: int) -> Iterator[Case]:
    dice, files = random.Random(seed), whole()
    for n in range(count):
        name = sorted(files)[n % len(files)]
        content, read = files[name]
        file = Path(f"{seed}-{n}-{name}")
        file.write_bytes(damaged(content, dice))
        yield Case(str(file), lambda read=read, file=file: _quiet(read, str(file)), f"{file.read_bytes()[:2000]!r}")
        file.unlink()


def _quiet(read: Callable[[str], object], file: str) -> None:
    """Whatever is printed is a fault, too."""
    with contextlib.redirect_stderr(io.StringIO()) as errors, contextlib.redirect_stdout(io.StringIO()) as words:
        try:
            read(file)
        finally:
            if printed := errors.getvalue() + words.getvalue():
                raise AssertionError(f"printed {printed!r}")
