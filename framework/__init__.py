"""Grain-based distinct element simulation of rock fracture, with pluggable contact laws."""

from grainlaw.characteristics import Characteristics, Mode, characteristics, plot_law
from grainlaw.comparison import Comparison, compare
from grainlaw.conformance import Entry, Report, check_law
from grainlaw.contact import ContactLaw, Trace, trace
from grainlaw.envelope import (
    HoekBrownFit,
    MohrCoulombFit,
    StrengthEnvelope,
    fit_hoek_brown,
    fit_mohr_coulomb,
    strength_envelope,
)
from grainlaw.integration import (
    AdaptiveRelaxation,
    CentralDifference,
    Damping,
    DynamicRelaxation,
    Integrator,
    KineticRelaxation,
    LocalDamping,
    MassDamping,
    Motion,
    Relaxation,
    Undamped,
)
from grainlaw.kernels.batch import CompilationError
from grainlaw.loading import (
    AtRest,
    Condition,
    Drive,
    FallsTo,
    Hold,
    LoadingProtocol,
    Pressure,
    Reaches,
    Stage,
    StageError,
)
from grainlaw.observation import Frame, FrameRecorder, Observer
from grainlaw.parameter import ParameterError, parameter, parameters, part
from grainlaw.probe import ContactPath, Probe
from grainlaw.result import Cracks, Result
from grainlaw.simulation import InstabilityError, simulate
from grainlaw.specimen import ContactPoints, Elastic, EndPoints, GaussPoints, InsetPoints, Plane, Rigid, Specimen
from grainlaw.state import State
from grainlaw.tessellation import Region, Tessellation, Tessellator, TilingError

__all__ = [
    "AdaptiveRelaxation",
    "AtRest",
    "CentralDifference",
    "Characteristics",
    "Comparison",
    "CompilationError",
    "Condition",
    "ContactLaw",
    "ContactPath",
    "ContactPoints",
    "Cracks",
    "Damping",
    "Drive",
    "DynamicRelaxation",
    "Elastic",
    "EndPoints",
    "Entry",
    "FallsTo",
    "Frame",
    "FrameRecorder",
    "GaussPoints",
    "HoekBrownFit",
    "Hold",
    "InsetPoints",
    "InstabilityError",
    "Integrator",
    "KineticRelaxation",
    "LoadingProtocol",
    "LocalDamping",
    "MassDamping",
    "Mode",
    "MohrCoulombFit",
    "Motion",
    "Observer",
    "ParameterError",
    "Plane",
    "Pressure",
    "Probe",
    "Reaches",
    "Region",
    "Relaxation",
    "Report",
    "Result",
    "Rigid",
    "Specimen",
    "Stage",
    "StageError",
    "State",
    "StrengthEnvelope",
    "Tessellation",
    "Tessellator",
    "TilingError",
    "Trace",
    "Undamped",
    "characteristics",
    "check_law",
    "compare",
    "fit_hoek_brown",
    "fit_mohr_coulomb",
    "parameter",
    "parameters",
    "part",
    "plot_law",
    "simulate",
    "strength_envelope",
    "trace",
]

__version__ = "0.1.0"
