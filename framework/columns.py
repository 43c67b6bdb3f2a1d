"""The names that many share, each with its words and unit: columns of a run, properties of a test, arrays of a frame.

A column is an entry of ``Result.curves``, with one number per sample in SI units. A test adds columns of its own by
``LoadingProtocol.measure``; where it uses the names below, pictures and measures find them. What one test alone records
it declares itself (``LoadingProtocol.quantities``).
"""

from __future__ import annotations

import re
from collections.abc import Container, Iterable, Mapping, Sequence

import attrs
import numpy as np

from grainlaw.arguments import Checked
from grainlaw.fields import ParameterError
from grainlaw.messages import LIKE, enumeration, nearest, refusal
from grainlaw.quantity import Quantity

# --- recorded in every test ------------------------------------------------------------------------------------------

TIME, STEP, STAGE = "time", "step", "stage"
STAGE_TIME = "stage_time"  #: since the stage began (s): for conditions alone, not recorded
TENSILE_CRACKS, SHEAR_CRACKS, DAMAGED = "tensile_cracks", "shear_cracks", "damaged"
IN_MOTION = "without_static_solution"
UNBALANCED, MOTION = "unbalanced", "motion"
LOADING_SPEED, VIBRATION, TEMPERATURE = "loading_speed", "vibration", "temperature"
STABILITY, IMBALANCE = "stability", "imbalance"

#: the energies below are recorded in every test, too
EVERY_TEST = (
    Quantity(TIME, "s", meaning="since the start", counts=True),
    Quantity(STEP, meaning="number of steps"),
    Quantity(STAGE, meaning="number of the stage, from 0"),
    Quantity(
        TENSILE_CRACKS, form=".0f", meaning="contact points that have broken in tension", is_main=True, counts=True
    ),
    Quantity(SHEAR_CRACKS, form=".0f", meaning="contact points that have broken in shear", is_main=True, counts=True),
    Quantity(DAMAGED, meaning="contact points with any damage", counts=True),
    Quantity(UNBALANCED, meaning="mean unbalanced force over mean force of contacts and fluids, 0 at rest"),
    Quantity(
        LOADING_SPEED, meaning="by which the speeds of all drives were multiplied (m/s), or K/s; 1 without a loading"
    ),
    Quantity(TEMPERATURE, "°C", meaning="of the whole specimen, its mean by heat capacity where heat is conducted"),
    Quantity(VIBRATION, "J/m", meaning="kinetic energy of the motion beside the steady motion of the loading"),
    Quantity(
        IMBALANCE, "%", form=".2f",
        meaning="sum of the forces on the specimen over the largest load, mean over a period; 0 without a loading",
    ),
    Quantity(
        STABILITY,
        meaning="the last stability margin found: 1 as stiff as sound, 0 a peak or buckling; nan where none is",
    ),
    Quantity(
        MOTION, meaning="root of kinetic over stored energy, at most 1, 0 at rest; 1 while a load still changes"
    ),
)  # fmt: skip

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
LOST = "damping"  #: what the damping of the motion has taken, and all else that resists it, such as a drag
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


def cracks(curves: Mapping[str, np.ndarray]) -> np.ndarray:
    """(t,) contact points that have broken, in tension or in shear."""
    return curves[TENSILE_CRACKS] + curves[SHEAR_CRACKS]


# --- those of a test that loads a specimen between two ends ----------------------------------------------------------

STRAIN, STRESS, STRESS_TOP, STRESS_BOTTOM = "strain", "stress", "stress_top", "stress_bottom"
LATERAL_STRAIN, VOLUMETRIC_STRAIN, DEVIATOR = "lateral_strain", "volumetric_strain", "deviator"
NOISE = "noise"  #: Pa, standard deviation of the load of a record of a laboratory; not in a run

#: pictures, comparisons, thresholds and moduli look for them
BETWEEN_ENDS = (
    Quantity(
        STRAIN, "%", form=".4f", meaning="change of height over height, positive in the direction of loading",
        counts=True,
    ),
    Quantity(STRESS, "MPa", form=".2f", meaning="mean of both ends, positive in the direction of loading"),
    Quantity(STRESS_TOP, "MPa", form=".2f", meaning="at the upper end"),
    Quantity(STRESS_BOTTOM, "MPa", form=".2f", meaning="at the lower end"),
    Quantity(LATERAL_STRAIN, "%", form=".4f", meaning="change of width over width, extension positive", counts=True),
    Quantity(VOLUMETRIC_STRAIN, "%", form=".4f", meaning="change of area over area, extension positive", counts=True),
    Quantity(
        DEVIATOR, "MPa", form=".2f",
        meaning="stress less the confinement; the stress counts as the load where a test has no deviator",
    ),
)  # fmt: skip

# --- those of a test in which time passes in jumps, and of one with a fluid -------------------------------------------

AGED, JUMPS, AGED_LOSS = "aged", "jumps", "aged_loss"
FATIGUE = "fatigue"  #: also the name of that memory of a law that ages
WET, SATURATES = "wet", "saturates"
HEAT_TIME, COLDEST, HOTTEST = "heat_time", "coldest", "hottest"
HEAT_SUPPLIED, HEAT_STORED = "heat_supplied", "heat_stored"
SOME_TESTS = (
    Quantity(AGED, "s", words="time passed in jumps", meaning="beside the time of the run"),
    Quantity(JUMPS, form=".0f", meaning="number of jumps of time so far"),
    Quantity(AGED_LOSS, "J/m", words="energy lost in jumps", meaning="what bonds have lost in jumps of time"),
    Quantity(FATIGUE, meaning="mean share of the strength that is gone"),
    Quantity(WET, meaning="contact points whose faces a fluid presses"),
    Quantity(SATURATES, meaning="1 in the stage before the test in which the pressure of the fluid rises"),
    Quantity(HEAT_TIME, "s", words="time of heat", meaning="of conduction, since its stage began"),
    Quantity(COLDEST, "°C", words="coldest node", meaning="where heat is conducted"),
    Quantity(HOTTEST, "°C", words="hottest node", meaning="where heat is conducted"),
    Quantity(HEAT_SUPPLIED, "J/m", meaning="that has come in by conduction since the start, above 20 °C"),
    Quantity(HEAT_STORED, "J/m", meaning="heat above 20 °C; what was supplied, but for rounding"),
    Quantity("injection_pressure", "MPa", meaning="of a fluid that is pumped in"),
    Quantity("injected", "m2", meaning="volume over thickness of the fluid that was pumped in, without pressure"),
    Quantity("room", "m2", meaning="by which the room behind the boundary of an injection has grown"),
    Quantity("crack_room", "m2", meaning="room of the cracks that the fluid of an injection has entered"),
    Quantity("crack_fluid", "m2", meaning="of the fluid that was pumped in, without pressure, what is in cracks"),
    Quantity("outflow", "m2", meaning="of it, what has left at boundaries with a pressure of their own"),
    Quantity(
        "end_difference",
        "%",
        words="difference of end forces",
        form=".2f",
        meaning="of the forces on both ends of a specimen between bars, over their mean; of a test at its failure",
        is_main=True,
    ),
    Quantity("displacement", "µm", meaning="of what the test moves"),
    Quantity("opening", "µm", meaning="of a joint or a contact, closing negative"),
    Quantity("slip", "µm", meaning="of a joint or a contact"),
    Quantity("normal", "MPa", words="normal traction", meaning="of a joint or a contact, tension positive"),
    Quantity("shear", "MPa", words="shear traction", meaning="of a joint or a contact"),
    Quantity("broken", "%", meaning="share of a joint"),
    Quantity("force", "kN/m", meaning="what the test applies"),
    Quantity("load", "MPa", form=".2f", meaning="stress that the test applies"),
)

# --- properties of tests and of runs ---------------------------------------------------------------------------------

PROPERTIES = (
    Quantity("strength", "MPa", form=".2f", meaning="load at the first failure", is_main=True),
    Quantity("failure_strain", "%", words="strain at failure", form=".4f", is_main=True),
    Quantity("largest_stress", "MPa", form=".2f", is_main=True),
    Quantity("apparent_modulus", "GPa", words="E*", form=".2f", meaning="as measured in the plane", is_main=True),
    Quantity("apparent_poisson", words="nu*", form=".3f", meaning="as measured in the plane"),
    Quantity("modulus", "GPa", words="E", form=".2f", meaning="of the rock"),
    Quantity("poisson", words="nu", form=".3f", meaning="of the rock"),
    Quantity("confinement", "MPa", form=".2f"),
    Quantity("transgranular_cracks", form=".0f", meaning="contact points inside of grains that have broken"),
    Quantity("kinetic_ratio", form=".1e"),
    Quantity("unstable_rise", "%", words="rise while unstable", form=".2f"),
    Quantity("energy_error", form=".1e"),
    Quantity("energy_made", form=".1e"),
    Quantity("energy_returned", form=".1e"),
    Quantity("steps", form=".0f"),
    Quantity("seconds", form=".1f"),
    Quantity("time_step", "s", form=".3e"),
    Quantity(IN_MOTION, words="static stages brought under their loads in motion", form=".0f", is_main=True),
    Quantity("mass_added", "%", form=".3g"),
)

# --- properties of a rock, as a laboratory names them ----------------------------------------------------------------

ROCK = (
    Quantity("youngs_modulus", "GPa", words="E", form=".2f"),
    Quantity("poissons_ratio", words="nu", form=".3f"),
    Quantity("ucs", "MPa", words="UCS", form=".2f", meaning="uniaxial compressive strength"),
    Quantity("cohesion", "MPa", form=".2f"),
    Quantity("friction_angle", "deg", form=".2f", factor=1.0),
    Quantity("tensile_strength", "MPa", form=".2f"),
    Quantity("brazilian_strength", "MPa", words="Brazilian strength", form=".2f"),
    Quantity("fracture_toughness", "MPa √m", form=".3f", factor=1e-6),
    Quantity("toughness", "MPa √m", form=".3f", factor=1e-6, is_main=True),
    Quantity("crack_initiation", "MPa", words="CI", form=".2f"),
    Quantity("crack_damage", "MPa", words="CD", form=".2f", is_main=True),
)

# --- arrays of a frame that are no columns of a run ------------------------------------------------------------------

FRAME = (
    Quantity("stress_1", "MPa", form=".2f", meaning="the larger principal stress in the plane, tension positive"),
    Quantity("stress_2", "MPa", form=".2f", meaning="the smaller principal stress in the plane, tension positive"),
    Quantity("zone_stress", "MPa", form=".2f", meaning="of the zone itself, tension positive"),
    Quantity("rotation", "rad", meaning="of a grain, counter-clockwise"),
    Quantity("velocity", "m/s"),
    Quantity("broken_time", "ms", words="broke at"),
    Quantity("fluid_pressure", "MPa", form=".2f", meaning="on the faces of a contact point"),
    Quantity("lost_opening", "J/m2"),
    Quantity("lost_slip", "J/m2"),
    Quantity("made", "J/m2", meaning="energy that an intact contact has made"),
)

SHARED: Mapping[str, Quantity] = {
    each.name: each
    for each in (
        *EVERY_TEST, *(Quantity(ENERGY + kind, "J/m") for kind in ENERGIES), *BETWEEN_ENDS, *SOME_TESTS, *PROPERTIES,
        *ROCK, *FRAME,
    )
}  # fmt: skip
NUMBERED = re.compile(r"(.+)_(\d+)")  #: as ``stress_0`` of a gauge


def quantity_of(name: str, own: Mapping[str, Quantity] | None = None) -> Quantity:
    """The quantity of this name: one of their ``own``, a shared one, or one that is shown as it is.

    One of several, as ``stress_0``, is shown as they are, and that of a part, as ``mica.youngs_modulus``, by its name.
    """
    part, dot, last = name.rpartition(".")
    if dot:
        kind = quantity_of(last, own)
        return attrs.evolve(kind, name=name, words=f"{part} {kind.words}")
    numbered = NUMBERED.fullmatch(name)
    for known in (own or {}, SHARED):
        if name in known:
            return known[name]
        if numbered and numbered[1] in known:
            kind = known[numbered[1]]
            return attrs.evolve(kind, name=name, words=f"{kind.words} {numbered[2]}")
    return Quantity(name)


def is_of_every_test(name: str) -> bool:
    """Whether a column is recorded in every test."""
    return name.startswith(ENERGY) or name in _EVERY


_EVERY = {each.name for each in EVERY_TEST}

# --- what curves are drawn over --------------------------------------------------------------------------------------

COURSE = (STRAIN, "displacement", "opening", "deflection", TIME)  #: how far a test is: the first that it records
LOAD = (STRESS, "shear_stress", "load", "force", UNBALANCED)  #: what the test applies: the first that it records


def leading(recorded: Container[str]) -> list[str]:
    """The columns of how far a test is and of what it applies, of those that are recorded."""
    found = (next((name for name in kind if name in recorded), None) for kind in (COURSE, LOAD))
    return [name for name in found if name is not None]


def readings(names: Iterable[str], values: Iterable[float]) -> str:
    """Values of columns with their units, as "0.12 %, 43.1 MPa"."""
    return ", ".join(quantity_of(name).with_unit(value) for name, value in zip(names, values, strict=False))


def course(curves: Mapping[str, np.ndarray]) -> str:
    """The column that says how far a test is: the first of ``COURSE`` that never falls; time never does."""
    return next(name for name in COURSE if name in curves and grows(curves[name]))


def grows(values: np.ndarray) -> bool:
    """Whether a column never falls, but for a twentieth of its range. The strain of a cyclic test falls."""
    return bool((np.maximum.accumulate(values) - values).max() <= 0.05 * np.ptp(values))


def _names(value: Sequence[str]) -> tuple[str, ...]:
    found = () if isinstance(value, str) or not isinstance(value, Sequence) else tuple(value)
    if not found or not all(isinstance(name, str) for name in found):
        raise refusal("Panel: columns", value, "a list of at least one name of a column")
    return found


def since(
    curves: Mapping[str, np.ndarray], begin: int, declared: Mapping[str, Quantity] | None = None
) -> dict[str, np.ndarray]:
    """Samples from the number ``begin`` on; what a test ``counts`` from its own beginning counts from there.

    So do shared columns that count, such as the time, where a test declares them anew in another unit.
    """
    after = {name: values[begin:] for name, values in curves.items()}
    if begin:
        told = {each.name for known in (SHARED, declared or {}) for each in known.values() if each.counts}
        told |= {name for name in curves if (numbered := NUMBERED.fullmatch(name)) and numbered[1] in told}
        after |= {name: after[name] - curves[name][begin - 1] for name in told & after.keys()}
    return after


@attrs.frozen
class Panel(metaclass=Checked):
    """One pair of axes of a figure: columns of the curves over a column.

    A test declares its own (:attr:`LoadingProtocol.panels`). The words of the upright axis are those of the quantity
    that is drawn, in its unit; several columns in one panel have one unit, and ``words`` for what they have in common.
    """

    over: str  #: column along the axis
    columns: Sequence[str] = attrs.field(converter=_names)  #: drawn over it
    words: str = ""  #: of the upright axis, for several columns

    @property
    def names(self) -> tuple[str, ...]:
        """All columns that it needs."""
        return (self.over, *self.columns)


MOST_PANELS = 4  #: of a test that declares none


def panels_of(curves: Mapping[str, np.ndarray], declared: Sequence[Panel] = ()) -> Sequence[Panel]:
    """Those of the declared panels whose columns were recorded; without one the columns of the test over its course.

    What the test applies (``LOAD``) comes first, if it is one of them.
    """
    if found := [panel for panel in declared if not missing(curves, panel.names)]:
        return found
    along = course(curves)
    own = [name for name in curves if name != along and not is_of_every_test(name)]
    first = next(name for name in LOAD if name in curves)
    own = [*([first] if first in own else []), *(name for name in own if name != first)]
    return [Panel(along, [name]) for name in own[:MOST_PANELS] or [first]]


def misspelt(
    panels: Sequence[Panel], quantities: Sequence[Quantity], recorded: Sequence[str], properties: Iterable[str]
) -> list[str]:  # fmt: skip
    """What a test declares by names that it does not have, though it has others that are like them, in words.

    A panel or a quantity of what is not there says nothing else by itself: it may be of something that only other
    settings of the test record.
    """
    found = []
    for name in sorted({name for panel in panels for name in missing(recorded, panel.names)}):
        if like := nearest(name, recorded, LIKE):
            found.append(f"a panel of '{name}', which is not recorded{like}")
    own = {each.name: each for each in quantities}
    unshown = [name for name in (*recorded, *properties) if quantity_of(name, own) == Quantity(name)]
    for name in sorted(set(own).difference(recorded, properties)):
        if like := nearest(name, unshown, LIKE):
            found.append(f"a quantity '{name}', which is neither a column nor a property{like}")
    return found


def check_panels(where: str, panels: Sequence[Panel], quantities: Sequence[Quantity]) -> None:
    """Raise :class:`ParameterError`, which says ``where``, for a panel whose columns have several units."""
    own = {each.name: each for each in quantities}
    for panel in panels:
        shown = {name: quantity_of(name, own) for name in panel.columns}
        units = {name: look.unit_shown or "no unit" for name, look in shown.items() if look != Quantity(name)}
        if len({*units.values()}) > 1:
            said = ", ".join(f"{name} ({unit})" for name, unit in units.items())
            raise ParameterError(f"{where}: a panel of columns with several units is not allowed: {said}")


def missing(curves: Container[str], names: Iterable[str]) -> list[str]:
    """Names of columns that were not recorded."""
    return [name for name in names if name not in curves]


def require(where: str, curves: Mapping[str, np.ndarray], *names: str) -> None:
    """Raise :class:`ParameterError`, which says ``where``, unless these columns were recorded."""
    if absent := missing(curves, names):
        own = [name for name in curves if not (is_of_every_test(name) or name == STAGE_TIME)]
        raise ParameterError(
            f"{where} needs the column{'s' * (len(absent) > 1)} {enumeration(absent)}, which the test does not "
            f"record{nearest(absent[0], curves, LIKE)} (it records {', '.join(own) or 'nothing else'})"
        )
