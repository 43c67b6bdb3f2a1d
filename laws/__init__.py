"""Contact laws and the parts they are made of."""

from grainlaw.laws.barton_bandis import BartonBandis, Roughness
from grainlaw.laws.bilinear_mixed_mode import BilinearMixedMode
from grainlaw.laws.camacho_ortiz import CamachoOrtiz
from grainlaw.laws.closure import BandisClosure, Closure, LinearClosure
from grainlaw.laws.cohesive_crack import CohesiveCrack
from grainlaw.laws.friction import Friction
from grainlaw.laws.linear import Linear
from grainlaw.laws.mohr_coulomb import MohrCoulomb
from grainlaw.laws.munjiza import MunjizaJoint, Unloading
from grainlaw.laws.rate_dependent import CowperSymonds, JohnsonCook, RateDependent, RateEffect
from grainlaw.laws.readings import OtherMode, PrePeak, Residual, SofteningLength, TensionShear
from grainlaw.laws.softening import (
    EvansMarathe,
    ExponentialSoftening,
    HordijkSoftening,
    LinearSoftening,
    PeterssonSoftening,
    Softening,
)
from grainlaw.laws.static_fatigue import CharlesGrowth, ExponentialGrowth, Growth, StaticFatigue
from grainlaw.laws.viscous import Viscous
from grainlaw.laws.weibull import WeibullField
from grainlaw.laws.xu_needleman import Coupling, XuNeedleman

__all__ = [
    "BandisClosure",
    "BartonBandis",
    "BilinearMixedMode",
    "CamachoOrtiz",
    "CharlesGrowth",
    "Closure",
    "CohesiveCrack",
    "Coupling",
    "CowperSymonds",
    "EvansMarathe",
    "ExponentialGrowth",
    "ExponentialSoftening",
    "Friction",
    "Growth",
    "HordijkSoftening",
    "JohnsonCook",
    "Linear",
    "LinearClosure",
    "LinearSoftening",
    "MohrCoulomb",
    "MunjizaJoint",
    "OtherMode",
    "PeterssonSoftening",
    "PrePeak",
    "RateDependent",
    "RateEffect",
    "Residual",
    "Roughness",
    "Softening",
    "SofteningLength",
    "StaticFatigue",
    "TensionShear",
    "Unloading",
    "Viscous",
    "WeibullField",
    "XuNeedleman",
]


def __dir__() -> list[str]:  # a notebook offers what is public, not the modules that it came from
    return [*__all__]
