"""Detection of contacts without a bond, and the law and damping that act at them."""

from __future__ import annotations

from typing import Any

import attrs

from grainlaw.arguments import Checked
from grainlaw.contact import Laws, check_laws
from grainlaw.fields import parameter


def _laws_or_none(detection: Detection, attribute: attrs.Attribute, value: Any) -> None:
    if value is not None:
        check_laws("Detection: law", value)


@attrs.frozen(kw_only=True)
class Detection(metaclass=Checked):
    """Contacts between edges of grains that were never bonded, or whose bond has broken and moved apart.

    Without a ``law`` of their own such contacts follow the law of the bonds between their phases, as it is after
    breaking. A bond becomes a contact once it is broken at both points and one of its ends has moved by ``hand_over``,
    or once it has turned about the only point that holds until corners overlap as much.
    """

    #: of contacts without a bond; what the bonds' laws become, if not given
    law: Laws | None = attrs.field(default=None, validator=_laws_or_none)
    skin: float = parameter("1", default=0.1, above=0, at_most=1)  #: search distance over the grain size
    hand_over: float = parameter("1", default=0.05, above=0, at_most=1)  #: displacement of an end over its length
    largest_overlap: float = parameter("1", default=0.1, above=0, at_most=0.5)  #: over the smaller grain's width
    damping: float = parameter("1", default=0.0, at_least=0, at_most=1)  #: viscous, along the normal, over the critical


EVERYWHERE = Detection()  #: the default
