"""Laboratory tests."""

from grainlaw.protocols.bending import SemiCircularBend, ThreePointBending
from grainlaw.protocols.between_platens import Moving, Platens
from grainlaw.protocols.brazilian import Brazilian
from grainlaw.protocols.creep import Creep
from grainlaw.protocols.cyclic import Cyclic
from grainlaw.protocols.excavation import Excavation
from grainlaw.protocols.free_motion import FreeMotion
from grainlaw.protocols.heating import Heating, Held
from grainlaw.protocols.hydraulic_fracturing import HydraulicFracturing
from grainlaw.protocols.joint import DirectShear, JointTension
from grainlaw.protocols.measures import failure_summary
from grainlaw.protocols.plane_wave import PlaneWave, Wave
from grainlaw.protocols.saturated import Saturated
from grainlaw.protocols.split_hopkinson import SplitHopkinson
from grainlaw.protocols.thermal_shock import ThermalShock
from grainlaw.protocols.uniaxial import BiaxialCompression, UniaxialCompression, UniaxialTension

__all__ = [
    "BiaxialCompression", "Brazilian", "Creep", "Cyclic", "DirectShear", "Excavation", "FreeMotion", "Heating",
    "Held", "HydraulicFracturing", "JointTension", "Moving", "PlaneWave", "Platens", "Saturated", "SemiCircularBend",
    "SplitHopkinson", "ThermalShock", "ThreePointBending", "UniaxialCompression", "UniaxialTension", "Wave",
    "failure_summary",
]  # fmt: skip


def __dir__() -> list[str]:  # a notebook offers what is public, not the modules that it came from
    return [*__all__]
