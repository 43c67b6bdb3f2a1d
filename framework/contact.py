"""The contact law: tractions of one contact from its opening, slip and memory."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from typing import Any

import numpy as np

from grainlaw.arguments import Checked
from grainlaw.edge_keys import Names, check_keys, check_known, key_between, keys_of
from grainlaw.fields import ParameterError
from grainlaw.memory import names_of_arguments, only_memory, refuse_untold
from grainlaw.messages import refusal
from grainlaw.specimen import Specimen


class ContactLaw(metaclass=Checked):
    """What two grains do to each other at one contact point, written in scalars as a pure function.

    A whole law, linear softening over the fracture energy (Hillerborg, Modeer and Petersson 1976,
    doi:10.1016/0008-8846(76)90007-7)::

        @attrs.frozen(kw_only=True)
        class Hillerborg(gl.ContactLaw):
            kn: float = gl.parameter("Pa/m")
            ks: float = gl.parameter("Pa/m")
            strength: float = gl.parameter("Pa")
            energy: float = gl.parameter("J/m2")
            stiffness = property(lambda self: (self.kn, self.ks))

            def traction(self, opening, slip, damage, widest):
                peak, last = self.strength / self.kn, 2 * self.energy / self.strength
                widest = max(widest, opening, peak)
                damage = min((widest - peak) / (last - peak), 1.0)
                secant = self.strength * (1 - damage) / widest
                return (secant if opening > 0 else self.kn) * opening, self.ks * slip, damage, widest

    Inside ``traction``, ``self`` gives the fields and properties of the law (numbers, flags, enumeration members),
    its parts (frozen attrs classes with scalar methods, ``self.softening.remaining(damage)``) and its own methods.
    Fields and properties are read once, before the loop. Written without branches (``min``, ``max``, conditional
    expressions) it vectorises.
    """

    takes_arrays = True  #: parameters may be arrays

    @property
    @abstractmethod
    def stiffness(self) -> tuple[float, float]:
        """Normal and shear stiffness (Pa/m) of the first response; the stable step starts from them."""

    @property
    def retardation_time(self) -> float:
        """Viscosity over stiffness (s) of dashpots beside the bond, the largest: it shortens the stable step."""
        return 0.0

    @property
    def exceptions(self) -> dict[str, str]:
        """Properties of :func:`grainlaw.check_law` that the law is known to break: why and by how much.

        "continuity", "energy", "fracture energies", or "stiffness" for a law without a finite tangent at the origin;
        the others bear no exception.
        """
        return {}

    @property
    def fracture_energies(self) -> dict[str, float]:
        """Work (J/m2) from the peak to the break, for a law that promises it: "mode_i" pulled, "mode_ii" sheared.

        Sheared under no pressure; a level peak counts from where it begins. What the rise to it takes does not: a law
        that includes it, like the one above, returns ``{"mode_i": self.energy - self.strength**2 / (2 * self.kn)}``.
        """
        return {}

    @abstractmethod
    def traction(self, opening: Any, slip: Any, *memory: Any) -> tuple[Any, ...]:
        """Normal traction (Pa, tension positive), shear traction (Pa), then the new memory.

        ``opening`` and ``slip`` (m) are the relative displacement of grain B against A along the normal and the
        tangent. The arguments after ``slip`` are the memory, by name, zero at the start. The framework knows
        ``damage`` (0 intact to 1 broken, never decreasing), ``mode`` (share of shear in the damage, 0 to 1) and
        ``dilation`` (m, how far slip has lifted the faces: they press where the opening is less). An argument
        ``time_step`` is no memory: it is the time (s) since the law was asked last, and 0 where no time passes, as on
        trial or along a curve. ``*law`` at the end hands on what a part ``law`` takes there, as in
        ``self.law.traction(opening, slip, *law)``. ``temperature`` and ``ezz`` are for materials and not allowed.
        """


#: one law, or laws by the phases they are between and by kinds of bonds, see :func:`law_between`
Laws = ContactLaw | Mapping[Any, ContactLaw]


def check_laws(where: str, laws: Any) -> None:
    """Raise :class:`ParameterError` for what is neither a law nor a mapping of pairs of phases, or kinds, to laws."""
    if isinstance(laws, ContactLaw):
        return
    if not isinstance(laws, Mapping) or not all(isinstance(law, ContactLaw) for law in laws.values()):
        raise refusal(where, laws, "a ContactLaw or a mapping of phase pairs to them")
    check_keys(where, laws)


def law_between(laws: Laws, one: Names, other: Names, kind: str = "between") -> ContactLaw | None:
    """The law of bonds of a kind between two phases, each given by all that it is called; None if there is none."""
    if isinstance(laws, ContactLaw):
        return laws
    key = key_between(laws, one, other, kind, "law")
    return None if key is None else laws[key]


def each_law(laws: Laws) -> list[ContactLaw]:
    """One law, or all of a mapping. Raises :class:`ParameterError` for one without any."""
    found = [laws] if isinstance(laws, ContactLaw) else list(laws.values())
    if not found:
        raise refusal("law", laws, "a law, or one for each kind of contact")
    return found


def declared_stiffness(law: ContactLaw) -> tuple[Any, Any]:
    """What a law says of its stiffness, normal and shear (Pa/m), each a number or one for each contact.

    Raises :class:`ParameterError` where its property fails, and where they are not positive and finite.
    """
    try:
        given = law.stiffness
    except Exception as error:
        raise ParameterError(
            f"{type(law).__name__}.stiffness cannot be found: {type(error).__name__}: {error}"
        ) from error
    try:
        normal, shear = given
        fine = all(np.all(np.isfinite(k) & (np.asarray(k) > 0)) for k in (normal, shear))
    except (TypeError, ValueError):
        fine = False
    if not fine:
        raise refusal(f"{type(law).__name__}.stiffness", given, "two positive finite numbers (Pa/m), normal and shear")
    return normal, shear


def keys_of_bonds(specimen: Specimen, laws: Mapping[Any, ContactLaw]) -> np.ndarray:
    """(c,) number of the key that each bond of a specimen follows, in the order of the mesh's interfaces.

    Raises :class:`ParameterError` for a bond without one or with two, and for a key that names what is not there.
    """
    grains, mesh = specimen.grains, specimen.mesh
    check_names(specimen, laws)
    found = keys_of(grains, list(laws), mesh.interface_grains, mesh.interface_kind, "law")
    if (found < 0).any():
        lacking = int(np.argmin(found))
        kind = int(mesh.interface_kind[lacking])
        where = "" if kind == 0 else f" ({grains.kinds[kind]})"
        phases = sorted(grains.phase[mesh.interface_grains[lacking]].tolist())
        pair = " and ".join(map(grains.phase_name, phases))
        cut = (
            "; give one for them (...: law), or, where beside joints they are cuts of whole blocks, tie them by "
            "Specimen(..., tied=['between'])"
        )
        raise ParameterError(
            f"law: no law is given for contacts between the phases {pair}{where}"
            f"{cut if grains.joints and kind == 0 and phases[0] == phases[1] else ''}"
        )
    return found


def check_names(specimen: Specimen, laws: Laws) -> None:
    """Raise :class:`ParameterError` for a law of a phase or a joint that the specimen does not have by that name."""
    check_known("law", () if isinstance(laws, ContactLaw) else laws, specimen.grains)


def law_arguments(law: ContactLaw) -> tuple[str, ...]:
    """Names of what a law's ``traction`` takes after ``opening`` and ``slip``: scalars of the step, and its memory.

    Raises :class:`ParameterError` where there are no such two, for memory without a name or a start at zero, and for a
    scalar that laws do not get.
    """
    names = names_of_arguments(law, "traction", "opening and slip", 2)
    refuse_untold(law, "traction", names, ("time_step",))
    return names


def memory_names(law: ContactLaw) -> tuple[str, ...]:
    """Names of a law's memory. Raises :class:`ParameterError` as :func:`law_arguments` does."""
    return only_memory(law_arguments(law))


def dilates(law: ContactLaw) -> bool:
    """Whether slip lifts the faces of a law: it has a ``dilation`` in its memory, and no ``dilation_angle`` of 0."""
    inner = getattr(law, "law", None)
    if isinstance(inner, ContactLaw):
        return dilates(inner)
    return "dilation" in memory_names(law) and bool(np.any(getattr(law, "dilation_angle", 1.0)))
