"""The contact law: tractions of one contact from its opening, slip and memory."""

from __future__ import annotations

import inspect
from abc import abstractmethod
from collections.abc import Mapping
from typing import Any

from grainlaw.arguments import Checked, short
from grainlaw.parameter import ParameterError


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

    one_per_contact = True  #: parameters may be arrays

    @property
    @abstractmethod
    def stiffness(self) -> tuple[float, float]:
        """Normal and shear stiffness (Pa/m) of the first response; the stable step starts from them."""

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
        ``dilation`` (m, how far slip has lifted the faces: they press where the opening is less).
        """


BY_POSITION = (inspect.Parameter.POSITIONAL_ONLY, inspect.Parameter.POSITIONAL_OR_KEYWORD)
Laws = ContactLaw | Mapping[tuple[int, int], ContactLaw]  #: one law, or one for each pair of phases


def check_laws(where: str, laws: Any) -> None:
    """Raise :class:`ParameterError` for what is neither a law nor a mapping of phase pairs to laws."""
    pairs = isinstance(laws, Mapping) and all(
        isinstance(law, ContactLaw) and isinstance(pair, tuple) and len(pair) == 2 for pair, law in laws.items()
    )
    if not (isinstance(laws, ContactLaw) or pairs):
        raise ParameterError(
            f"{where} = {short(laws)} is not allowed, it must be a ContactLaw or a mapping of phase pairs to them"
        )


def declared_stiffness(law: ContactLaw) -> Any:
    """What a law says of its stiffness. Raises :class:`ParameterError` where its property fails."""
    try:
        return law.stiffness
    except Exception as error:
        raise ParameterError(
            f"{type(law).__name__}.stiffness cannot be found: {type(error).__name__}: {error}"
        ) from error


def law_of_pair(laws: Laws, one: int, other: int) -> ContactLaw | None:
    """The law between two phases, or None."""
    if isinstance(laws, ContactLaw):
        return laws
    return laws.get((one, other)) or laws.get((other, one))


def memory_names(law: ContactLaw) -> tuple[str, ...]:
    """Names of a law's memory: the arguments of its ``traction`` after ``opening`` and ``slip``.

    Raises :class:`ParameterError` where there are no such two, and for memory without a name or a start at zero.
    """
    arguments = list(inspect.signature(law.traction).parameters.values())
    where = f"{type(law).__name__}.traction"
    if len(arguments) < 2 or not all(argument.kind in BY_POSITION for argument in arguments[:2]):
        raise ParameterError(
            f"{where} must take opening and slip before its memory, not ({', '.join(map(str, arguments))})"
        )
    for argument in arguments[2:]:
        if argument.kind not in BY_POSITION:
            raise ParameterError(
                f"{where}: {argument} is not allowed, the memory after opening and slip is given by position: "
                "write each number of it as a plain argument"
            )
        if argument.default is not argument.empty:
            raise ParameterError(
                f"{where}: {argument} is not allowed, an argument after opening and slip is memory and begins at 0: "
                "leave the default away, or make it a field of the law if it is a constant"
            )
    return tuple(argument.name for argument in arguments[2:])


def answered(law: ContactLaw, names: tuple[str, ...], answer: Any) -> tuple[float, ...]:
    """What ``traction`` of a law with a memory of these ``names`` returned, as floats. Raises TypeError."""
    if isinstance(answer, tuple) and len(answer) == 2 + len(names):
        try:
            return tuple(map(float, answer))
        except (TypeError, ValueError):
            pass
    raise TypeError(
        f"{type(law).__name__}.traction must return {2 + len(names)} numbers, normal and shear traction and "
        f"{', '.join(names) or 'no memory'}, not {short(answer)}"
    )
