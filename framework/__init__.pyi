# The public names, each loaded when it is first used.

from .calibration.calibrate import calibrate, first_look
from .calibration.first_look import FirstLook
from .calibration.result import Calibration
from .calibration.targets import Targets
from .cli.rocks import Rock, rocks
from .columns import Panel
from .compiler.batch import CompilationError
from .condition import AtRest, ComesTo, Condition, Fails, FailsTo, FallsTo, Reaches, StageError
from .contact import ContactLaw
from .detection import Detection
from .engine.device import Gpu
from .engine.state import State
from .engine.stepping import InstabilityError, OverlapError
from .fields import ParameterError, UnitWarning, parameter, parameters, part
from .gauges import CentreGauges, ClipGauges, Gauges, WholeSpecimen
from .integration import (
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
    SwayDamping,
    Undamped,
    VibrationDamping,
)
from .loading import AccuracyError, Adaptive, Constant, HeatingRate, Loading, Pace
from .loads import (
    BarEnd,
    Conduction,
    Convection,
    Drive,
    Fixed,
    FixedTemperature,
    FluidPressure,
    Gravity,
    Heat,
    HeatFlux,
    HeatSource,
    Hold,
    InitialVelocity,
    Injection,
    Pressure,
    Quiet,
    Traction,
)
from .material import Elastic, Material, Plane, Rigid
from .observation import Observer
from .protocol import LoadingProtocol
from .quantity import Quantity
from .region import Region
from .results.acoustic import AcousticEvents, acoustic_events
from .results.crack_integrals import CrackTip, StressIntensity, j_integral, notch_tip, stress_intensity
from .results.crack_pattern import FailurePlane, Rose, crack_lengths, crack_rose, failure_plane
from .results.figures.cracks import plot_cracks, side_by_side
from .results.figures.curves import plot_curves
from .results.figures.fields import plot_field
from .results.figures.interactive import write_interactive
from .results.files import OutputWarning
from .results.fragments import Fragments, fragments
from .results.frames import Frame, FrameRecorder
from .results.laboratory import Laboratory, mean_stress
from .results.measure import Measure
from .results.measured import MeasuredCurve, read_curve
from .results.probe import ContactPath, Probe
from .results.result import Cracks, Result
from .results.standard_measures import MEASURES
from .runs.certify import QuasiStaticLimit, certify
from .runs.elastic_properties import ElasticProperties, elastic_properties
from .runs.estimate import CostWarning
from .runs.flutter import Flutter, hold
from .runs.material_check import check_material
from .runs.parallel import Run
from .runs.simulation import simulate
from .runs.stopping import Stop, Stopped
from .specimen import ContactPoints, EndPoints, GaussPoints, InsetPoints, Specimen
from .stage import Ageing, Load, Stage
from .strength import Until
from .studies.comparison import Comparison, compare
from .studies.design import latin_hypercube, sobol
from .studies.envelope import (
    HoekBrownFit,
    MohrCoulombFit,
    StrengthEnvelope,
    fit_hoek_brown,
    fit_mohr_coulomb,
)
from .studies.statistics import Difference, Interaction, Mean
from .studies.study import Status, Study
from .studies.table import Table
from .studies.workers import ExecutorError
from .tessellation import Tessellation, Tessellator, TilingError
from .time_series import TimeSeries, pulse
from .window import Window, within_circle, within_polygon, within_rectangle
from .workbench.characteristics import Characteristics, Mode, characteristics
from .workbench.conformance import Entry, Report, check_law
from .workbench.driver import Trace, trace
from .workbench.law_figure import plot_law
from .workbench.material_figure import plot_material
from .workbench.zone import MaterialTrace, compress, trace_material

__all__ = [
    "MEASURES",
    "AccuracyError",
    "AcousticEvents",
    "Adaptive",
    "AdaptiveRelaxation",
    "Ageing",
    "AtRest",
    "BarEnd",
    "Calibration",
    "CentralDifference",
    "CentreGauges",
    "Characteristics",
    "ClipGauges",
    "ComesTo",
    "Comparison",
    "CompilationError",
    "Condition",
    "Conduction",
    "Constant",
    "ContactLaw",
    "ContactPath",
    "ContactPoints",
    "Convection",
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
    "FirstLook",
    "Fixed",
    "FixedTemperature",
    "FluidPressure",
    "Flutter",
    "Fragments",
    "Frame",
    "FrameRecorder",
    "Gauges",
    "GaussPoints",
    "Gpu",
    "Gravity",
    "Heat",
    "HeatFlux",
    "HeatSource",
    "HeatingRate",
    "HoekBrownFit",
    "Hold",
    "InitialVelocity",
    "Injection",
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
    "MeasuredCurve",
    "Mode",
    "MohrCoulombFit",
    "Motion",
    "Observer",
    "OutputWarning",
    "OverlapError",
    "Pace",
    "Panel",
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
    "Rock",
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
    "SwayDamping",
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
    "WholeSpecimen",
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
    "first_look",
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
    "plot_field",
    "plot_law",
    "plot_material",
    "pulse",
    "read_curve",
    "rocks",
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

__version__: str
