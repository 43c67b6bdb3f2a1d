# The public names, each loaded when it is first used.

from . import conditions as conditions
from . import gauges as gauges
from . import geometry as geometry
from . import integration as integration
from . import laws as laws
from . import loads as loads
from . import materials as materials
from . import protocols as protocols
from . import units as units
from .calibration.calibrate import calibrate, first_look
from .calibration.targets import Targets
from .cli.rocks import rocks
from .columns import Panel
from .compiler.batch import CompilationError
from .conditions import StageError
from .contact import ContactLaw
from .detection import Detection
from .engine.device import Gpu
from .engine.stepping import InstabilityError, OverlapError
from .fields import ParameterError, UnitWarning, parameter, parameters, part
from .loading import AccuracyError, Adaptive, Constant, HeatingRate
from .material import Elastic, Material, Plane, Rigid
from .observation import Observer
from .protocol import LoadingProtocol
from .quantity import Quantity
from .region import Region
from .results.acoustic import acoustic_events
from .results.crack_integrals import CrackTip, j_integral, notch_tip, stress_intensity
from .results.crack_pattern import crack_lengths, crack_rose, failure_plane
from .results.figures.cracks import plot_cracks, side_by_side
from .results.figures.curves import plot_curves
from .results.figures.fields import plot_field
from .results.figures.interactive import write_interactive
from .results.files import OutputWarning
from .results.fragments import fragments
from .results.laboratory import Laboratory, mean_stress
from .results.measure import Measure
from .results.measured import read_curve
from .results.probe import Probe
from .results.result import Result
from .results.standard_measures import MEASURES
from .runs.certify import certify
from .runs.elastic_properties import elastic_properties
from .runs.estimate import CostWarning
from .runs.flutter import hold
from .runs.material_check import check_material
from .runs.parallel import Run
from .runs.simulation import simulate
from .runs.stopping import Stop, Stopped
from .specimen import EndPoints, GaussPoints, InsetPoints, Specimen
from .stage import Ageing, Stage
from .strength import Until
from .studies.comparison import Comparison, compare
from .studies.design import latin_hypercube, sobol
from .studies.envelope import StrengthEnvelope, fit_hoek_brown, fit_mohr_coulomb
from .studies.study import Study, read_study
from .studies.workers import ExecutorError
from .tessellation import Tessellation, Tessellator, TilingError
from .time_series import TimeSeries, pulse
from .window import within_circle, within_polygon, within_rectangle
from .workbench.characteristics import characteristics
from .workbench.conformance import check_law
from .workbench.driver import trace
from .workbench.law_figure import plot_law
from .workbench.material_figure import plot_material
from .workbench.zone import compress, trace_material

__all__ = [
    "MEASURES",
    "AccuracyError",
    "Adaptive",
    "Ageing",
    "Comparison",
    "CompilationError",
    "Constant",
    "ContactLaw",
    "CostWarning",
    "CrackTip",
    "Detection",
    "Elastic",
    "EndPoints",
    "ExecutorError",
    "GaussPoints",
    "Gpu",
    "HeatingRate",
    "InsetPoints",
    "InstabilityError",
    "Laboratory",
    "LoadingProtocol",
    "Material",
    "Measure",
    "Observer",
    "OutputWarning",
    "OverlapError",
    "Panel",
    "ParameterError",
    "Plane",
    "Probe",
    "Quantity",
    "Region",
    "Result",
    "Rigid",
    "Run",
    "Specimen",
    "Stage",
    "StageError",
    "Stop",
    "Stopped",
    "StrengthEnvelope",
    "Study",
    "Targets",
    "Tessellation",
    "Tessellator",
    "TilingError",
    "TimeSeries",
    "UnitWarning",
    "Until",
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
    "read_study",
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
MODULES: tuple[str, ...]
