"""Builds the wheel and the sdist of the last commit: python packaging/distribution.py FOLDER (pip install build)

They are the same bytes wherever and whenever they are built by the same versions of Python and setuptools: all files
have the time of the commit, and the build sees neither what is not committed nor the modes and owners of a checkout.
"""

import gzip
import io
import os
import subprocess
import sys
import tarfile
from pathlib import Path
from tempfile import TemporaryDirectory

ROOT = Path(__file__).parents[1]


def committed(*words):
    """What git says of the last commit."""
    return subprocess.run(["git", *words], cwd=ROOT, check=True, capture_output=True).stdout


def normalised(archive, moment):
    """A tar.gz (bytes) with its files in the order of their names, all of one ``moment`` (s), of nobody's.

    setuptools sorts neither, and takes times, modes and owners from the disk.
    """
    made = io.BytesIO()
    with (
        tarfile.open(fileobj=io.BytesIO(archive)) as given,
        gzip.GzipFile(fileobj=made, filename="", mode="wb", mtime=moment) as packed,
        tarfile.open(fileobj=packed, mode="w", format=tarfile.PAX_FORMAT) as sorted_,
    ):
        for member in sorted(given, key=lambda each: each.name):
            entry = tarfile.TarInfo(member.name)
            entry.type, entry.size, entry.mtime = member.type, member.size, moment
            entry.mode = 0o755 if member.isdir() else 0o644
            sorted_.addfile(entry, given.extractfile(member))
    return made.getvalue()


def build(kind, source, folder, moment):
    """One ``kind``, sdist or wheel, of the files in ``source``."""
    command = [sys.executable, "-m", "build", f"--{kind}", "--outdir", folder, source]
    done = subprocess.run(
        command, env=os.environ | {"SOURCE_DATE_EPOCH": str(moment)}, umask=0o022, capture_output=True, text=True
    )
    if done.returncode:
        sys.exit(f"{done.stdout}\n{done.stderr}")


def unpacked(archive, folder):
    """Where the files of a tar.gz (bytes) lie."""
    with tarfile.open(fileobj=io.BytesIO(archive)) as files:
        files.extractall(folder, filter="data")
    return folder


def main(folder):
    """Build both; the files."""
    moment = int(committed("log", "-1", "--format=%ct"))
    folder.mkdir(parents=True, exist_ok=True)
    with TemporaryDirectory() as work:
        work = Path(work)
        build("sdist", unpacked(committed("archive", "--format=tar.gz", "HEAD"), work / "commit"), work, moment)
        (sdist,) = work.glob("*.tar.gz")
        content = normalised(sdist.read_bytes(), moment)
        (inner,) = unpacked(content, work / "sdist").iterdir()
        build("wheel", inner, work, moment)
        (wheel,) = work.glob("*.whl")
        files = [folder / sdist.name, folder / wheel.name]
        files[0].write_bytes(content)
        files[1].write_bytes(wheel.read_bytes())
    return files


if __name__ == "__main__":
    if len(sys.argv) != 2 or sys.argv[1].startswith("-"):
        sys.exit(__doc__)
    print(*main(Path(sys.argv[1])), sep="\n")
