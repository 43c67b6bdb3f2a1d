"""Drucker-Prager plasticity of grains."""

from __future__ import annotations

import enum
import math
from typing import Any

import attrs

from grainlaw.checks import not_above
from grainlaw.fields import STRENGTHS, angle_of_friction, parameter, part
from grainlaw.materials.isotropic import Plastic, equivalent

TINY = 1e-300  # Pa: keeps the share of an unsheared stress from being 0/0


class Cone(enum.Enum):
    """Which cone stands for the hexagon of Mohr and Coulomb."""

    PLANE_STRAIN = enum.auto()  #: the same strength in plane strain, if the dilation angle is the friction angle
    OUTER = enum.auto()  #: through its corners in triaxial compression
    INNER = enum.auto()  #: through its corners in triaxial extension


@attrs.frozen(kw_only=True)
class DruckerPrager(Plastic):
    """Elastic to sqrt(J2) + eta p = xi c, then perfectly plastic, with the return to the cone or its tip in one step.

    Drucker and Prager (1952), Q. Appl. Math. 10, 157-165; the return and the cones as in de Souza Neto, Peric and Owen
    (2008), Computational methods for plasticity, section 8.3, p = tr(stress) / 3. The plastic potential has the cone of
    the dilation angle.
    """

    cohesion: float = parameter("Pa", usual=STRENGTHS)  #: c
    friction_angle: float = angle_of_friction()  #: phi
    #: psi; friction_angle makes the flow associated
    dilation_angle: float = parameter("deg", default=0.0, at_least=0, below=90)
    cone: Cone = part(Cone, Cone.PLANE_STRAIN)  #: which cone stands for the hexagon of Mohr and Coulomb

    def __attrs_post_init__(self) -> None:
        not_above(self, "dilation_angle", "friction_angle", "plastic strain would create energy")

    strength = property(lambda self: self._of_cone(self.friction_angle)[1] * self.cohesion)
    eta = property(lambda self: self._of_cone(self.friction_angle)[0])
    eta_dilation = property(lambda self: self._of_cone(self.dilation_angle)[0])

    @property
    def tip(self) -> float:
        """Pa, the tension at the tip of the cone; far away without friction."""
        return self.strength / self.eta if self.eta > 0 else 1e30

    def _of_cone(self, angle: float) -> tuple[float, float]:
        """Slope and factor of the cohesion at an angle in degrees."""
        sine, cosine = math.sin(math.radians(angle)), math.cos(math.radians(angle))
        if self.cone is Cone.PLANE_STRAIN:
            root = math.sqrt(9 * cosine**2 + 12 * sine**2)
            return 3 * sine / root, 3 * cosine / root
        low = math.sqrt(3) * (3 - sine if self.cone is Cone.OUTER else 3 + sine)
        return 6 * sine / low, 6 * cosine / low

    def stress(
        self, exx: Any, eyy: Any, exy: Any, ezz: Any, pxx: Any, pyy: Any, pzz: Any, pxy: Any, plastic_strain: Any
    ) -> Any:
        xx, yy, zz, xy = exx - pxx, eyy - pyy, ezz - pzz, exy - pxy
        mean = (xx + yy + zz) * (1 / 3)
        xx, yy, zz = xx - mean, yy - mean, zz - mean
        pressed = 3 * self.bulk * mean
        root = 2 * self.shear * math.sqrt(0.5 * (xx**2 + yy**2 + zz**2) + xy**2)
        steps = max(root + self.eta * pressed - self.strength, 0.0)
        steps = steps * (1 / (self.shear + self.bulk * self.eta * self.eta_dilation))
        left = root - self.shear * steps
        share = max(left, 0.0) / max(root, TINY)  # of the deviator that remains
        held = pressed - self.bulk * self.eta_dilation * steps
        held = held if left >= 0 else self.tip
        gone, swell = 1 - share, (pressed - held) * (1 / (3 * self.bulk))
        gone = gone if steps > 0 else 0.0
        dxx, dyy, dzz, dxy = gone * xx + swell, gone * yy + swell, gone * zz + swell, gone * xy
        plastic_strain = plastic_strain + equivalent(dxx, dyy, dzz, dxy)
        twice = 2 * self.shear * (1 - gone)
        return (
            twice * xx + held, twice * yy + held, twice * xy, pxx + dxx, pyy + dyy, pzz + dzz, pxy + dxy, plastic_strain
        )  # fmt: skip
