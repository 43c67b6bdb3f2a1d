"""The columns of a run: those of every test, the kinds of energy, and those that pictures and measures need.

A column is an entry of ``Result.curves``, with one number per sample in SI units. A test adds columns of its own by
``LoadingProtocol.measure``; where it uses the names below, pictures and measures find them.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np

from grainlaw.parameter import ParameterError

# --- recorded in every test ------------------------------------------------------------------------------------------

TIME, STEP, STAGE = "time", "step", "stage"
TENSILE_CRACKS, SHEAR_CRACKS, DAMAGED = "tensile_cracks", "shear_cracks", "damaged"
UNBALANCED, MOTION = "unbalanced", "motion"
LOADING_SPEED, VIBRATION, TEMPERATURE = "loading_speed", "vibration", "temperature"
STABILITY, IMBALANCE = "stability", "imbalance"

#: what they mean; the energies below are recorded in every test, too
EVERY_TEST = {
    TIME: "s since the start",
    STEP: "number of steps",
    STAGE: "number of the stage, from 0",
    TENSILE_CRACKS: "contact points that have broken in tension",
    SHEAR_CRACKS: "contact points that have broken in shear",
    DAMAGED: "contact points with any damage",
    UNBALANCED: "mean unbalanced force over mean force of contacts and fluids, 0 at rest",
    LOADING_SPEED: "m/s, by which the speeds of all drives were multiplied, or K/s; 1 where a stage has no loading",
    TEMPERATURE: "°C, of the whole specimen",
    VIBRATION: "J per metre of thickness, kinetic energy of the motion beside the steady motion of the loading",
    IMBALANCE: "sum of the forces on the specimen over the largest load, mean over a period; 0 without a loading",
    STABILITY: "the last stability margin that was found: 1 as stiff as sound, 0 a peak or buckling; nan where none is",
    MOTION: "root of kinetic over stored energy, at most 1, 0 at rest; 1 while a load still changes",
}

# --- the kinds of energy: supplied = kinetic + stored + lost, Eq. (12) of docs/theory.md -----------------------------

SUPPLIED = "external"  #: the work of boundaries, pressures and gravity, and the energy the specimen started with
KINETIC = "kinetic"
#: strain energy of the zones, and the work on contacts: what they store, and what fracture and friction take
CONTACTS = ("contacts_normal", "contacts_shear")
STORED = ("zones", *CONTACTS)
#: what the stored energy of the zones has lost by changes of temperature, the work of stresses on the free thermal
#: strain; below 0 where heating has stored energy
THERMAL = "zones_thermal"
DISSIPATED = "zones_dissipated"  #: what the material of the grains has taken for good, as by plastic strain
ABSORBED = "absorbed"  #: what quiet boundaries have taken of the waves that leave through them
LOST = "damping"
SPENT = (KINETIC, *STORED, THERMAL, DISSIPATED, ABSORBED, LOST)  #: their sum is what was supplied
ENERGIES = (SUPPLIED, *STORED, THERMAL, DISSIPATED, KINETIC, ABSORBED, LOST)  #: in the order in which they are drawn
ENERGY = "energy_"  #: begins the names of their columns, J per metre of thickness


def energy(curves: Mapping[str, np.ndarray], *kinds: str) -> np.ndarray:
    """(t,) J/m, the sum of the energies of one kind or several."""
    first, *others = (curves[ENERGY + kind] for kind in kinds)
    return sum(others, start=first)


def work_done(curves: Mapping[str, np.ndarray]) -> float:
    """J/m, the largest work of the loads or of heat: by which the energies of a run are judged."""
    return float(max(np.abs(energy(curves, kind)).max() for kind in (SUPPLIED, THERMAL)))


# --- those of a test that loads a specimen between two ends ----------------------------------------------------------

STRAIN, STRESS, STRESS_TOP, STRESS_BOTTOM = "strain", "stress", "stress_top", "stress_bottom"
LATERAL_STRAIN, VOLUMETRIC_STRAIN, DEVIATOR = "lateral_strain", "volumetric_strain", "deviator"

#: pictures, comparisons, thresholds and moduli look for them
BETWEEN_ENDS = {
    STRAIN: "change of height over height, positive in the direction of loading",
    STRESS: "Pa, mean of both ends, positive in the direction of loading",
    STRESS_TOP: "Pa, at the upper end",
    STRESS_BOTTOM: "Pa, at the lower end",
    LATERAL_STRAIN: "change of width over width, extension positive",
    VOLUMETRIC_STRAIN: "change of area over area, extension positive",
    DEVIATOR: "Pa, stress less the confinement; the stress counts as the load where a test has no deviator",
}

# --- those of a test in which time passes in jumps --------------------------------------------------------------------

AGED = "aged"  #: s that have passed in jumps, beside the time of the run
JUMPS = "jumps"  #: number of them so far
AGED_LOSS = "aged_loss"  #: J per metre of thickness that bonds have lost in jumps
FATIGUE = "fatigue"  #: mean share of the strength that is gone; and the name of that memory of a law that ages

# --- those of a test with a fluid ------------------------------------------------------------------------------------

WET = "wet"  #: contact points whose faces a fluid presses
SATURATES = "saturates"  #: 1 in the stage before the test in which the pressure of the fluid rises

# --- what curves are drawn over --------------------------------------------------------------------------------------

COURSE = (STRAIN, "displacement", "opening", "deflection", TIME)  #: how far a test is: the first that it records
LOAD = (STRESS, "shear_stress", "load", "force", UNBALANCED)  #: what the test applies: the first that it records


def course(curves: Mapping[str, np.ndarray]) -> str:
    """The column that cracks and energies are drawn over: the first of ``COURSE`` that never falls.

    A fall by a twentieth of its range is allowed. The strain of a cyclic test falls, time never does.
    """

    def grows(values: np.ndarray) -> bool:
        return bool((np.maximum.accumulate(values) - values).max() <= 0.05 * np.ptp(values))

    return next(name for name in COURSE if name in curves and grows(curves[name]))


def missing(curves: Mapping[str, np.ndarray], names: Iterable[str]) -> list[str]:
    """Names of columns that were not recorded."""
    return [name for name in names if name not in curves]


def require(where: str, curves: Mapping[str, np.ndarray], *names: str) -> None:
    """Raise :class:`ParameterError`, which says ``where``, unless these columns were recorded."""
    if absent := missing(curves, names):
        own = [name for name in curves if name not in EVERY_TEST and not name.startswith(ENERGY)]
        raise ParameterError(
            f"{where} needs the column{'s' * (len(absent) > 1)} {' and '.join(absent)}, which the test does not "
            f"record; it records {', '.join(own) or 'nothing else'}"
        )
