"""The elastic contact."""

from __future__ import annotations

import attrs

from grainlaw.contact import ContactLaw
from grainlaw.fields import parameter


@attrs.frozen(kw_only=True)
class Linear(ContactLaw):
    """Two springs, normal and shear, that never break."""

    kn: float = parameter("Pa/m")  #: normal stiffness
    ks: float = parameter("Pa/m")  #: shear stiffness

    @property
    def stiffness(self) -> tuple[float, float]:
        return self.kn, self.ks

    def traction(self, opening, slip):
        return self.kn * opening, self.ks * slip
