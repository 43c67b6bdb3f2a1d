"""Laboratory tests."""

from grainlaw.protocols.biaxial_compression import BiaxialCompression
from grainlaw.protocols.direct_shear import DirectShear
from grainlaw.protocols.joint_tension import JointTension
from grainlaw.protocols.platens import Moving, Platens
from grainlaw.protocols.uniaxial_compression import UniaxialCompression
from grainlaw.protocols.uniaxial_tension import UniaxialTension

__all__ = [
    "BiaxialCompression",
    "DirectShear",
    "JointTension",
    "Moving",
    "Platens",
    "UniaxialCompression",
    "UniaxialTension",
]
