"""Factors that turn everyday units into SI, angles into degrees: ``13 * MPa``, ``50 * mm``, ``150 * J / m**2``.

``min`` is not among the names of ``from grainlaw.units import *``, where it would hide that of Python.
"""

km, m, cm, mm, um = 1e3, 1.0, 1e-2, 1e-3, 1e-6
GPa, MPa, kPa, Pa = 1e9, 1e6, 1e3, 1.0
MN, kN, N = 1e6, 1e3, 1.0
kJ, J = 1e3, 1.0
kg, g = 1.0, 1e-3
year, day, h, min, s, ms, us = 31_557_600.0, 86_400.0, 3600.0, 60.0, 1.0, 1e-3, 1e-6  # a year of 365.25 days
deg = 1.0

__all__ = [
    "MN",
    "GPa",
    "J",
    "MPa",
    "N",
    "Pa",
    "cm",
    "day",
    "deg",
    "g",
    "h",
    "kJ",
    "kN",
    "kPa",
    "kg",
    "km",
    "m",
    "mm",
    "ms",
    "s",
    "um",
    "us",
    "year",
]  # fmt: skip
