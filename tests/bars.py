"""Bars of bricks with bonds so stiff that waves run in them as in one piece, and waves in them."""

import math

import numpy as np

import grainlaw as gl
from grainlaw.geometry import Bricks, rectangle
from grainlaw.laws import Linear

ROCK = gl.Elastic(youngs_modulus=60e9, poissons_ratio=0.25, density=2700)
P_SPEED = math.sqrt(60e9 * 0.75 / (1.25 * 0.5) / 2700)  # m/s, plane strain
S_SPEED = math.sqrt(60e9 / 2.5 / 2700)
GLUED = Linear(kn=2e15, ks=2e15)  # 330 times as stiff as a brick of 10 mm


def bar(columns=100, rows=1, size=10e-3, material=ROCK, **options):
    """A bar of square bricks along x."""
    grains = Bricks(rows=rows, columns=columns).tessellate(rectangle(columns * size, rows * size))
    return gl.Specimen(grains, material, **options)


def bell(duration, size, count=64):
    """A smooth pulse, sin^2, as a time series of so many points."""
    t = np.linspace(0, duration, count + 1)
    return gl.TimeSeries(t, size * np.sin(np.pi * t / duration) ** 2)
