"""What the modifiers of laws share: the law that they modify, and its strength made larger or smaller.

``factor * traction(opening / factor, slip / factor)`` keeps the stiffness and the friction of a law; its strengths, and
the displacements at which it softens and breaks, are those of before times the factor, its fracture energies times the
square.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import attrs

from grainlaw.contact import ContactLaw, dilates, law_arguments, memory_names
from grainlaw.fields import ParameterError
from grainlaw.laws.closure import LinearClosure
from grainlaw.messages import refusal

#: begin the names of memory that a law takes a rate from: the opening and slip at the step before
BEFORE = ("last_", "previous_")


def _is_law(component: Any, attribute: Any, value: Any) -> None:
    if not isinstance(value, ContactLaw):
        raise refusal(f"{type(component).__name__}: law", value, "a ContactLaw")
    kind = type(component)
    if any(type(law) is kind for law in _within(value)):
        raise ParameterError(f"{kind.__name__}: law is not allowed to be a {kind.__name__}: give the parameters of one")


def _within(law: Any) -> Iterator[Any]:
    """A law, and the laws that it modifies."""
    while isinstance(law, ContactLaw):
        yield law
        law = getattr(law, "law", None)


def innermost(law: Any) -> Any:
    """The law that modifiers are around."""
    return list(_within(law))[-1]


def refuse_without_damage(component: Any) -> None:
    """Refuse a law to modify that does not count its damage."""
    if "damage" not in memory_names(component.law):
        name = type(component.law).__name__
        raise ParameterError(
            f"{type(component).__name__}: law = {name} is not allowed, it must have a damage in its memory"
        )


def refuse_what_does_not_scale(component: Any) -> None:
    """Refuse a law to modify whose strength cannot be scaled.

    It must count its damage; closure and lift are lengths of the faces, which do not follow the strength of the bond.
    A law that takes the rate of what it is given would take that of opening / factor, while the factor changes.
    """
    refuse_without_damage(component)
    own, law = type(component).__name__, innermost(component.law)
    for within in _within(component.law):
        arguments = law_arguments(within)
        if "time_step" in arguments and any(name.startswith(BEFORE) for name in arguments):
            kind = type(within).__name__
            raise ParameterError(
                f"{own}: law = {kind} is not allowed, it takes a rate, and {own} scales displacements: put it outside, "
                f"{kind}(law={own}(...))"
            )
    name = type(law).__name__
    if not isinstance(getattr(law, "closure", LinearClosure()), LinearClosure):
        raise ParameterError(f"{own}: law = {name} is not allowed with a closure that stiffens, give a LinearClosure")
    if dilates(law):
        raise ParameterError(f"{own}: law = {name} is not allowed with dilation, give dilation_angle = 0")


@attrs.frozen(kw_only=True)
class Modifier(ContactLaw):
    """A law around another, with its stiffness and what it promises; none modifies its own kind."""

    law: ContactLaw = attrs.field(validator=_is_law)  #: that is modified

    @property
    def stiffness(self) -> tuple[float, float]:
        return self.law.stiffness

    @property
    def retardation_time(self) -> float:
        return self.law.retardation_time

    @property
    def exceptions(self) -> dict[str, str]:
        return self.law.exceptions

    @property
    def fracture_energies(self) -> dict[str, float]:
        return self.law.fracture_energies
