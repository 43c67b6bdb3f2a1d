"""Grain-based distinct element simulation of rock fracture, with pluggable contact laws."""

from grainlaw.calibration.calibrate import calibrate
from grainlaw.calibration.result import Calibration
from grainlaw.calibration.targets import Targets
from grainlaw.compiler.batch import CompilationError
from grainlaw.condition import AtRest, ComesTo, Condition, Fails, FailsTo, FallsTo, Reaches, StageError
from grainlaw.contact import ContactLaw
from grainlaw.detection import Detection
from grainlaw.engine.state import State
from grainlaw.engine.stepping import InstabilityError, OverlapError
from grainlaw.fields import ParameterError, UnitWarning, parameter, parameters, part
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
    VibrationDamping,
)
from grainlaw.loading import AccuracyError, Adaptive, Constant, HeatingRate, Loading, Pace
from grainlaw.loads import (
    Drive,
    Fixed,
    FluidPressure,
    Gravity,
    Heat,
    Hold,
    InitialVelocity,
    Pressure,
    Quiet,
    Traction,
)
from grainlaw.material import Elastic, Material, Plane, Rigid
from grainlaw.observation import Observer
from grainlaw.protocol import LoadingProtocol
from grainlaw.quantity import Quantity
from grainlaw.region import Region
from grainlaw.results.acoustic import AcousticEvents, acoustic_events
from grainlaw.results.crack_integrals import StressIntensity, j_integral, stress_intensity
from grainlaw.results.crack_pattern import FailurePlane, Rose, crack_lengths, crack_rose, failure_plane
from grainlaw.results.crack_tip import CrackTip, notch_tip
from grainlaw.results.files import OutputWarning
from grainlaw.results.fragments import Fragments, fragments
from grainlaw.results.frames import Frame, FrameRecorder
from grainlaw.results.laboratory import Laboratory, mean_stress
from grainlaw.results.measure import Measure
from grainlaw.results.plot import plot_cracks, plot_curves, side_by_side, write_interactive
from grainlaw.results.probe import ContactPath, Probe
from grainlaw.results.result import Cracks, Result
from grainlaw.results.standard_measures import MEASURES
from grainlaw.runs.certify import QuasiStaticLimit, certify
from grainlaw.runs.elastic_properties import ElasticProperties, elastic_properties
from grainlaw.runs.estimate import CostWarning
from grainlaw.runs.flutter import Flutter, hold
from grainlaw.runs.material_check import check_material
from grainlaw.runs.parallel import Run
from grainlaw.runs.simulation import simulate
from grainlaw.runs.stopping import Stop, Stopped
from grainlaw.specimen import ContactPoints, EndPoints, GaussPoints, InsetPoints, Specimen
from grainlaw.stage import Ageing, Load, Stage
from grainlaw.strength import Until
from grainlaw.studies.comparison import Comparison, compare
from grainlaw.studies.design import latin_hypercube, sobol
from grainlaw.studies.envelope import (
    HoekBrownFit,
    MohrCoulombFit,
    StrengthEnvelope,
    fit_hoek_brown,
    fit_mohr_coulomb,
)
from grainlaw.studies.statistics import Difference, Interaction, Mean
from grainlaw.studies.study import Status, Study
from grainlaw.studies.table import Table
from grainlaw.studies.workers import ExecutorError
from grainlaw.tessellation import Tessellation, Tessellator, TilingError
from grainlaw.time_series import TimeSeries
from grainlaw.window import Window, within_circle, within_polygon, within_rectangle
from grainlaw.workbench.characteristics import Characteristics, Mode, characteristics
from grainlaw.workbench.conformance import Entry, Report, check_law
from grainlaw.workbench.driver import Trace
from grainlaw.workbench.plot import plot_law, plot_material
from grainlaw.workbench.trace import trace
from grainlaw.workbench.zone import MaterialTrace, compress, trace_material

__all__ = [
    "MEASURES",
    "AccuracyError",
    "AcousticEvents",
    "Adaptive",
    "AdaptiveRelaxation",
    "Ageing",
    "AtRest",
    "Calibration",
    "CentralDifference",
    "Characteristics",
    "ComesTo",
    "Comparison",
    "CompilationError",
    "Condition",
    "Constant",
    "ContactLaw",
    "ContactPath",
    "ContactPoints",
    "CostWarning",
    "CrackTip",
    "Cracks",
    "Damping",
    "Detection",
    "Difference",
    "Drive",
    "DynamicRelaxation",
    "Elastic",
    "ElasticProperties",
    "EndPoints",
    "Entry",
    "ExecutorError",
    "Fails",
    "FailsTo",
    "FailurePlane",
    "FallsTo",
    "Fixed",
    "FluidPressure",
    "Flutter",
    "Fragments",
    "Frame",
    "FrameRecorder",
    "GaussPoints",
    "Gravity",
    "Heat",
    "HeatingRate",
    "HoekBrownFit",
    "Hold",
    "InitialVelocity",
    "InsetPoints",
    "InstabilityError",
    "Integrator",
    "Interaction",
    "KineticRelaxation",
    "Laboratory",
    "Load",
    "Loading",
    "LoadingProtocol",
    "LocalDamping",
    "MassDamping",
    "Material",
    "MaterialTrace",
    "Mean",
    "Measure",
    "Mode",
    "MohrCoulombFit",
    "Motion",
    "Observer",
    "OutputWarning",
    "OverlapError",
    "Pace",
    "ParameterError",
    "Plane",
    "Pressure",
    "Probe",
    "Quantity",
    "QuasiStaticLimit",
    "Quiet",
    "Reaches",
    "Region",
    "Relaxation",
    "Report",
    "Result",
    "Rigid",
    "Rose",
    "Run",
    "Specimen",
    "Stage",
    "StageError",
    "State",
    "Status",
    "Stop",
    "Stopped",
    "StrengthEnvelope",
    "StressIntensity",
    "Study",
    "Table",
    "Targets",
    "Tessellation",
    "Tessellator",
    "TilingError",
    "TimeSeries",
    "Trace",
    "Traction",
    "Undamped",
    "UnitWarning",
    "Until",
    "VibrationDamping",
    "Window",
    "acoustic_events",
    "calibrate",
    "certify",
    "characteristics",
    "check_law",
    "check_material",
    "compare",
    "compress",
    "crack_lengths",
    "crack_rose",
    "elastic_properties",
    "failure_plane",
    "fit_hoek_brown",
    "fit_mohr_coulomb",
    "fragments",
    "hold",
    "j_integral",
    "latin_hypercube",
    "mean_stress",
    "notch_tip",
    "parameter",
    "parameters",
    "part",
    "plot_cracks",
    "plot_curves",
    "plot_law",
    "plot_material",
    "side_by_side",
    "simulate",
    "sobol",
    "stress_intensity",
    "trace",
    "trace_material",
    "within_circle",
    "within_polygon",
    "within_rectangle",
    "write_interactive",
]

__version__ = "0.2.0"


def __dir__() -> list[str]:  # a notebook offers what is public, not the modules that it came from
    imported = (name for name in ("geometry", "laws", "materials", "protocols", "units") if name in globals())
    return [*__all__, "__version__", *imported]
