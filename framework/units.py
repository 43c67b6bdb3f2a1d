"""Factors that turn everyday units into SI: ``13 * MPa``, ``50 * mm``."""

km, m, cm, mm, um = 1e3, 1.0, 1e-2, 1e-3, 1e-6
GPa, MPa, kPa, Pa = 1e9, 1e6, 1e3, 1.0
s, ms, us = 1.0, 1e-3, 1e-6

__all__ = ["GPa", "MPa", "Pa", "cm", "kPa", "km", "m", "mm", "ms", "s", "um", "us"]
