"""Readings of the cohesive crack model where its description leaves a choice; the first of each is the default."""

from __future__ import annotations

import enum


class PrePeak(enum.IntEnum):
    """How a traction rises to its peak."""

    EXPONENTIAL = 0  #: k u exp(-u/u_p) on loading, peak at u_p = e f/k, Eqs. (1, 9); the secant never rises again
    AS_PRINTED = 1  #: the same on loading and unloading: the secant follows the pressure, which makes energy; flutters
    LINEAR = 2  #: k u, peak at u_p = f/k


class SofteningLength(enum.IntEnum):
    """L in o_res = o_p + L G_I/f_t and s_res = s_p + L G_II/f_s."""

    ENERGY = 0  #: the softening branch dissipates the fracture energy exactly
    CLOSED_FORM = 1  #: L = 3 as printed; with Eq. (2) the branch dissipates 1.1589 times the fracture energy


class OtherMode(enum.IntEnum):
    """The branch of one mode before its own peak, once the other mode has done damage."""

    SCALED = 0  #: reduced by the softening curve like everything else
    NOT_SCALED = 1  #: as if intact; its traction drops when it reaches its own peak, and when the contact breaks


class Residual(enum.IntEnum):
    """How the shear branch ends in residual friction f_res, Eq. (7)."""

    FLOOR = 0  #: max(chi f_s, f_res)
    BLEND = 1  #: f_res + chi (f_s - f_res)
    AS_PRINTED = 2  #: chi f_s down to nothing, then f_res, which returns over the slip f_res/k_s


class TensionShear(enum.IntEnum):
    """Shear strength of a contact under tension."""

    EXTENDED = 0  #: Eq. (5) with its sign: by the tension before its peak, by f_t after it
    CONSTANT = 1  #: the cohesion
