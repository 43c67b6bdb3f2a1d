"""Laboratory tests."""

from grainlaw.protocols.platens import Moving, Platens
from grainlaw.protocols.uniaxial_compression import UniaxialCompression
from grainlaw.protocols.uniaxial_tension import UniaxialTension

__all__ = ["Moving", "Platens", "UniaxialCompression", "UniaxialTension"]
