"""Published laws whose shape is none of those in the package: with a level peak, or bent from the start."""

import math

import attrs

import grainlaw as gl


@attrs.frozen(kw_only=True)
class Trapezoid(gl.ContactLaw):
    """Tvergaard and Hutchinson (1992), doi:10.1016/0022-5096(92)90020-3: level from ``first`` to ``second`` of the way.

    The way is that of opening and slip together, as shares of the critical ones. Unloads by the secant.
    """

    strength: float = gl.parameter("Pa", default=10e6)
    opening: float = gl.parameter("m", default=8e-6)
    slip: float = gl.parameter("m", default=10e-6)
    first: float = gl.parameter("1", default=0.0125)
    second: float = gl.parameter("1", default=0.5)
    kn = property(lambda self: self.strength / (self.first * self.opening))
    ks = property(lambda self: self.kn * (self.opening / self.slip) ** 2)
    stiffness = property(lambda self: (self.kn, self.ks))

    @property
    def fracture_energies(self):
        after_peak = self.strength * self.opening * ((self.second - self.first) + (1 - self.second) / 2)
        return {"mode_i": after_peak, "mode_ii": after_peak}

    def traction(self, opening, slip, damage, widest):
        widest = max(widest, math.hypot(max(opening, 0.0) / self.opening, slip / self.slip), self.first)
        level = min((1 - widest) / (1 - self.second), 1.0)  # of the strength
        damage = max(damage, 1 - max(level, 0.0) * self.first / widest)
        return (1 - damage if opening > 0 else 1.0) * self.kn * opening, (1 - damage) * self.ks * slip, damage, widest


@attrs.frozen(kw_only=True)
class Dugdale(gl.ContactLaw):
    """Dugdale (1960), doi:10.1016/0022-5096(60)90013-2: a level stress over the fracture energy, then nothing.

    Rises elastically, unloads by the secant, and is elastic in shear.
    """

    kn: float = gl.parameter("Pa/m", default=1e14)
    strength: float = gl.parameter("Pa", default=10e6)
    energy: float = gl.parameter("J/m2", default=50.0)
    stiffness = property(lambda self: (self.kn, self.kn))
    fracture_energies = property(lambda self: {"mode_i": self.energy})
    exceptions = property(lambda self: {"continuity": "the stress drops to nothing at the critical opening"})

    def traction(self, opening, slip, damage, widest):
        peak = self.strength / self.kn
        widest = max(widest, opening, peak)
        damage = min((widest - peak) * self.strength / self.energy, 1.0)
        secant = self.strength / widest if damage < 1 else 0.0
        return (secant if opening > 0 else self.kn) * opening, self.kn * slip, damage, widest


@attrs.frozen(kw_only=True)
class Needleman(gl.ContactLaw):
    """Needleman (1987), doi:10.1115/1.3173064, pulled: a cubic that bends from the start. Elastic in shear."""

    strength: float = gl.parameter("Pa", default=10e6)
    opening: float = gl.parameter("m", default=5e-6)  #: where nothing is left
    kn = property(lambda self: 27 / 4 * self.strength / self.opening)
    stiffness = property(lambda self: (self.kn, self.kn))

    @property
    def fracture_energies(self):
        """9/16 in all, less what the rise to a third of the opening takes."""
        return {"mode_i": (9 / 16 - 11 / 48) * self.strength * self.opening}

    def traction(self, opening, slip, damage, widest):
        widest = max(widest, opening)
        left = max(1 - widest / self.opening, 0.0)
        damage = max(damage, 1 - left * left)
        return (left * left if opening > 0 else 1.0) * self.kn * opening, self.kn * slip, damage, widest


@attrs.frozen(kw_only=True)
class Hyperbolic(gl.ContactLaw):
    """Duncan and Chang (1970), doi:10.1061/JSFEAQ.0001458, in slip: a hyperbola, whose strength is never reached."""

    kn: float = gl.parameter("Pa/m", default=1e14)
    ks: float = gl.parameter("Pa/m", default=5e13)
    strength: float = gl.parameter("Pa", default=5e6)
    stiffness = property(lambda self: (self.kn, self.ks))

    def traction(self, opening, slip, longest):
        longest = max(longest, abs(slip))
        return self.kn * opening, self.ks * slip / (1 + self.ks * longest / self.strength), longest
