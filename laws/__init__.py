"""Contact laws and the parts they are made of."""

from grainlaw.laws.closure import BandisClosure, Closure, LinearClosure
from grainlaw.laws.cohesive_crack import CohesiveCrack
from grainlaw.laws.friction import Friction
from grainlaw.laws.linear import Linear
from grainlaw.laws.mohr_coulomb import MohrCoulomb
from grainlaw.laws.readings import OtherMode, PrePeak, Residual, SofteningLength, TensionShear
from grainlaw.laws.softening import (
    EvansMarathe,
    ExponentialSoftening,
    HordijkSoftening,
    LinearSoftening,
    PeterssonSoftening,
    Softening,
)

__all__ = [
    "BandisClosure",
    "Closure",
    "CohesiveCrack",
    "EvansMarathe",
    "ExponentialSoftening",
    "Friction",
    "HordijkSoftening",
    "Linear",
    "LinearClosure",
    "LinearSoftening",
    "MohrCoulomb",
    "OtherMode",
    "PeterssonSoftening",
    "PrePeak",
    "Residual",
    "Softening",
    "SofteningLength",
    "TensionShear",
]
