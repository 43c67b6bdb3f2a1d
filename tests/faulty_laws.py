"""One small law for each fault that the conformance kit must find, and two sound ones that they change."""

import attrs

import grainlaw as gl


@attrs.frozen(kw_only=True)
class Hillerborg(gl.ContactLaw):
    """Linear tension softening over the fracture energy; elastic in shear. The faulty ones change one thing."""

    kn: float = gl.parameter("Pa/m", default=1e14)
    ks: float = gl.parameter("Pa/m", default=5e13)
    strength: float = gl.parameter("Pa", default=13e6)
    energy: float = gl.parameter("J/m2", default=50.0)
    stiffness = property(lambda self: (self.kn, self.ks))
    fracture_energies = property(lambda self: {"mode_i": self.energy - self.strength**2 / (2 * self.kn)})

    def traction(self, opening, slip, damage, widest):
        return self.softened(opening, slip, damage, max(widest, opening), self.energy)

    def softened(self, opening, slip, damage, widest, energy):
        peak, last = self.strength / self.kn, 2 * energy / self.strength
        damage = min(max(widest - peak, 0.0) / (last - peak), 1.0)
        secant = self.strength * (1 - damage) / max(widest, peak)
        return (secant if opening > 0 else self.kn) * opening, self.ks * slip, damage, widest


class Heals(Hillerborg):
    """Damage follows the opening back."""

    def traction(self, opening, slip, damage, widest):
        return self.softened(opening, slip, damage, opening, self.energy)


class Mends(Hillerborg):
    """Damage stays, tension comes back: in place of the widest opening it keeps the last."""

    def traction(self, opening, slip, damage, widest):
        normal, shear, now, _ = self.softened(opening, slip, damage, opening, self.energy)
        return normal, shear, max(damage, now), opening


class Bulges(Hillerborg):
    """Beyond the peak it comes back above the way it went, by more than it has lost there."""

    def traction(self, opening, slip, damage, widest):
        normal, shear, damage, widest = self.softened(opening, slip, damage, max(widest, opening), self.energy)
        return normal * (widest / opening) ** 0.5 if damage > 0 and opening > 0 else normal, shear, damage, widest


class ComesBackStiff(Hillerborg):
    """It comes back three times as stiff, until nothing is left at 0.8 of the widest opening."""

    def traction(self, opening, slip, damage, widest):
        normal, shear, damage, widest = self.softened(opening, slip, damage, max(widest, opening), self.energy)
        if 0 < opening < widest and damage > 0:
            normal = min(normal, 3 * self.kn * max(opening - 0.8 * widest, 0.0))
        return normal, shear, damage, widest


class Overshoots(Hillerborg):
    """Damage passes 1."""

    def traction(self, opening, slip, damage, widest):
        normal, shear, damage, widest = self.softened(opening, slip, damage, max(widest, opening), self.energy)
        return normal, shear, 1.001 * damage, widest


class TooTough(Hillerborg):
    """The softening area is 5 % too large."""

    def traction(self, opening, slip, damage, widest):
        return self.softened(opening, slip, damage, max(widest, opening), 1.05 * self.energy)


class Jumps(Hillerborg):
    """The softening branch starts 5 % below the peak."""

    def traction(self, opening, slip, damage, widest):
        normal, shear, damage, widest = self.softened(opening, slip, damage, max(widest, opening), self.energy)
        return normal * (0.95 if damage > 0 and opening > 0 else 1.0), shear, damage, widest


class JumpsFar(Hillerborg):
    """A tenth of the shear strength is lost where a damaged contact closes."""

    def traction(self, opening, slip, damage, widest):
        normal, shear, damage, widest = self.softened(opening, slip, damage, max(widest, opening), self.energy)
        return normal, shear * (0.9 if damage > 0 and opening < 0 else 1.0), damage, widest


class Declared(Jumps):
    """The same, which says so."""

    @property
    def exceptions(self):
        return {"continuity": "falls by a twentieth", "odd in slip": "no excuse is taken for this"}


class Loose(Hillerborg):
    """A first response that is 2 % below its stiffness."""

    def traction(self, opening, slip, damage, widest):
        normal, shear, damage, widest = self.softened(opening, slip, damage, max(widest, opening), self.energy)
        return normal, 0.98 * shear, damage, widest


class Undefined(Hillerborg):
    """The fresh closed contact that has once been torn open is 0/0."""

    def traction(self, opening, slip, damage, widest):
        normal, shear, damage, widest = self.softened(opening, slip, damage, max(widest, opening), self.energy)
        return normal if damage < 1 or opening > 0 else float("nan"), shear, damage, widest


class Divides(Hillerborg):
    """Stops at no opening."""

    def traction(self, opening, slip, damage, widest):
        normal, shear, damage, widest = self.softened(opening, slip, damage, max(widest, opening), self.energy)
        return normal / opening * opening, shear, damage, widest


class Lopsided(Hillerborg):
    """Softer in slip to one side."""

    def traction(self, opening, slip, damage, widest):
        normal, shear, damage, widest = self.softened(opening, slip, damage, max(widest, opening), self.energy)
        return normal, shear if slip < 1e-7 else shear - 0.01 * self.ks * (slip - 1e-7), damage, widest


class Gives(Hillerborg):
    """Pressure stiffens the shear spring at rest: slip, press, slip back, release gives energy."""

    def traction(self, opening, slip, damage, widest):
        normal, shear, damage, widest = self.softened(opening, slip, damage, max(widest, opening), self.energy)
        return normal, shear * (1 + min(max(-opening, 0.0) * 1e7, 1.0)), damage, widest


SEEN = []


class Remembers(Hillerborg):
    """Counts in a global how often it was called."""

    def traction(self, opening, slip, damage, widest):
        SEEN.append(opening)
        normal, shear, damage, widest = self.softened(opening, slip, damage, max(widest, opening), self.energy)
        return normal, shear * (1 + 1e-9 * len(SEEN)), damage, widest


@attrs.define(kw_only=True)
class Keeps(gl.ContactLaw):
    """Keeps the widest opening in an attribute of its own, for all contacts."""

    kn: float = gl.parameter("Pa/m", default=1e14)
    widest: float = gl.parameter("m", default=0.0, at_least=0)
    stiffness = property(lambda self: (self.kn, self.kn))

    def traction(self, opening, slip, damage):
        self.widest = max(self.widest, opening)
        damage = min(self.widest / 1e-6, 1.0)
        return self.kn * opening * (1 - damage if opening > 0 else 1.0), self.kn * slip, damage


@attrs.frozen(kw_only=True)
class Joint(gl.ContactLaw):
    """A cohesive joint with Coulomb friction; no tension beyond 1 um."""

    kn: float = gl.parameter("Pa/m", default=1e14)
    ks: float = gl.parameter("Pa/m", default=5e13)
    friction: float = gl.parameter("1", default=0.6)
    stiffness = property(lambda self: (self.kn, self.ks))
    exceptions = property(lambda self: {"continuity": "no tension beyond 1 um"})

    def traction(self, opening, slip, plastic):
        return self.slid(opening, slip, plastic, 5e6 + self.friction * self.kn * max(-opening, 0.0))

    def slid(self, opening, slip, plastic, strength, sign=1.0):
        trial = self.ks * (slip - plastic)
        plastic = plastic + sign * (trial - min(max(trial, -strength), strength)) / self.ks
        return self.kn * opening if opening < 1e-6 else 0.0, self.ks * (slip - plastic), plastic


class Backwards(Joint):
    """Plastic slip of the wrong sign."""

    def traction(self, opening, slip, plastic):
        return self.slid(opening, slip, plastic, 5e6 + self.friction * self.kn * max(-opening, 0.0), -1.0)


class RubsInTension(Joint):
    """Friction with the sign of who counts pressure positive."""

    def traction(self, opening, slip, plastic):
        return self.slid(opening, slip, plastic, 5e6 + self.friction * self.kn * max(opening, 0.0))


class Weakens(Joint):
    """Friction that falls with pressure."""

    def traction(self, opening, slip, plastic):
        return self.slid(opening, slip, plastic, max(50e6 - 0.1 * self.kn * max(-opening, 0.0), 1e6))


@attrs.frozen(kw_only=True)
class WeakensBroken(Hillerborg):
    """Broken, its friction falls with pressure; sound, it does not slip."""

    def traction(self, opening, slip, damage, widest):
        normal, shear, damage, widest = self.softened(opening, slip, damage, max(widest, opening), self.energy)
        limit = max(40e6 + 0.5 * normal, 0.0) if opening < 0 else 0.0
        free = min(max(shear, -limit), limit)
        return normal, damage * free + (1 - damage) * shear, damage, widest


@attrs.frozen(kw_only=True)
class Unitless(Hillerborg):
    """A number that is not declared."""

    factor: float = 1.0


@attrs.frozen(kw_only=True)
class Stops(Hillerborg):
    """Does not compile."""

    def traction(self, opening, slip, damage, widest):
        if opening > 1:
            raise ValueError("too far")
        return self.softened(opening, slip, damage, max(widest, opening), self.energy)


@attrs.frozen(kw_only=True)
class Overflows(Hillerborg):
    """A whole number beyond 64 bits, which only the interpreter has."""

    def traction(self, opening, slip, damage, widest):
        normal, shear, damage, widest = self.softened(opening, slip, damage, max(widest, opening), self.energy)
        return normal, shear * (1 + 0.01 * (int(abs(slip) * 1e32) % 3)), damage, widest


@attrs.frozen(kw_only=True)
class Pushes(Hillerborg):
    """A dashpot of the wrong sign."""

    def traction(self, opening, slip, time_step, before, damage, widest):
        normal, shear, damage, widest = self.softened(opening, slip, damage, max(widest, opening), self.energy)
        rate = (opening - before) / time_step if time_step > 0 else 0.0
        return normal - 1e7 * rate, shear, opening, damage, widest


@attrs.frozen(kw_only=True)
class Drags(Hillerborg):
    """A dashpot that the law does not declare."""

    def traction(self, opening, slip, time_step, before, damage, widest):
        normal, shear, damage, widest = self.softened(opening, slip, damage, max(widest, opening), self.energy)
        rate = (opening - before) / time_step if time_step > 0 else 0.0
        return normal + (1 - damage) * 1e6 * rate, shear, opening, damage, widest


@attrs.frozen(kw_only=True)
class Vanishes(Hillerborg):
    """A broken contact bears nothing, also where it is closed."""

    def traction(self, opening, slip, damage, widest):
        normal, shear, damage, widest = self.softened(opening, slip, damage, max(widest, opening), self.energy)
        return (normal if opening > 0 else (1 - damage) * normal), shear, damage, widest


@attrs.frozen(kw_only=True)
class Stays(Hillerborg):
    """Stiffer by a tenth wherever time passes, however slow."""

    def traction(self, opening, slip, time_step, damage, widest):
        normal, shear, damage, widest = self.softened(opening, slip, damage, max(widest, opening), self.energy)
        return (1.1 if time_step > 0 else 1.0) * normal, shear, damage, widest


@attrs.frozen(kw_only=True)
class Around(gl.ContactLaw):
    """Around another law, and not that law at rest."""

    law: gl.ContactLaw = Hillerborg()
    stiffness = property(lambda self: self.law.stiffness)

    def traction(self, opening, slip, time_step, *law):
        answer = self.law.traction(opening, 0.99 * slip, *law)
        return (answer[0], 0.99 * answer[1], *answer[2:])


FAULTS = {
    Heals: "damage",
    Mends: "damage",
    Bulges: "energy",
    ComesBackStiff: "stiffness",
    RubsInTension: "friction",
    Overshoots: "damage",
    TooTough: "fracture energies",
    Jumps: "continuity",
    JumpsFar: "continuity",
    Loose: "stiffness",
    Undefined: "finite",
    Divides: "finite",
    Lopsided: "odd in slip",
    Gives: "energy",
    Remembers: "no hidden state",
    Keeps: "no hidden state",
    Backwards: "friction",
    Weakens: "friction",
    WeakensBroken: "friction",
    Unitless: "units",
    Stops: "compiled",
    Overflows: "compiled",
    Pushes: "rate",
    Drags: "rate",
    Vanishes: "damage",
    Stays: "rate",
    Around: "rate",
}
