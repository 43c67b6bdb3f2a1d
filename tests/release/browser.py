"""A page as a browser shows it, by headless Chromium."""

import re
import shutil
import subprocess
from pathlib import Path

import numpy as np

NAMES = ("chromium", "chromium-browser", "google-chrome")
OPTIONS = ("--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", "--enable-logging=stderr")


def chromium():
    """Path of the program, or None."""
    return next(filter(None, map(shutil.which, NAMES)), None)


def url(file, query=""):
    return Path(file).resolve().as_uri() + query


def complaints(log):
    """Errors that a page wrote to its console."""
    return [line for line in log.splitlines() if "CONSOLE" in line and re.search(r"error|refused|failed", line, re.I)]


def opened(file, query="", wait=5000):
    """Text of a page after its scripts have run for ``wait`` ms, and what it complained of."""
    command = [chromium(), *OPTIONS, f"--virtual-time-budget={wait}", "--dump-dom", url(file, query)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True)
    return done.stdout, complaints(done.stderr)


def seen(file, picture, width, height=1600):
    """Write a picture of a page at a width (pixels), and give its grey values (height, width)."""
    command = [chromium(), *OPTIONS, f"--screenshot={picture}", f"--window-size={width},{height}", url(file)]
    subprocess.run(command, capture_output=True, timeout=120, check=True)
    return greys(picture)


def greys(picture):
    """Grey values (height, width) of a picture."""
    from matplotlib.image import imread

    return imread(picture)[..., :3].mean(axis=-1)


def is_blank(grey):
    return float(np.std(grey)) < 0.01
