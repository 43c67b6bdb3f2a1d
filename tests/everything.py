"""A law that is made of everything that a law may be made of: parts, options, helpers of modules, closures."""

import enum
import math
import types

import attrs

import grainlaw as gl


class Branch(enum.Enum):
    TWICE = 1
    ONCE = 2


FACTOR = 3.0


def doubled(x):
    return 2 * x


def scaled(x, by=FACTOR):
    return doubled(x) * by


helpers = types.ModuleType("helpers")
helpers.inner = types.ModuleType("helpers.inner")
helpers.inner.GAIN = 0.5
exec("import math\ndef bend(x):\n    return math.tanh(x * 1e6)", helpers.inner.__dict__)


def adding(amount):
    return lambda x: x + amount


shifted = adding(1e-7)


@attrs.frozen(kw_only=True)
class Curve:
    """A part that has a part."""

    height: float = gl.parameter("Pa")
    branch: Branch = Branch.TWICE

    def at(self, x):
        return self.height * (2 * x if self.branch == Branch.TWICE else x)


@attrs.frozen(kw_only=True)
class Pair:
    first: Curve
    second: Curve

    def at(self, x):
        return self.first.at(x) - self.second.at(-x * self.slope)

    @property
    def slope(self):
        return math.tan(math.radians(self.first.height))


@attrs.frozen(kw_only=True)
class Everything(gl.ContactLaw):
    """Parts, methods, flags, options, properties, helpers of modules, closures, a method named like math's."""

    kn: float = gl.parameter("Pa/m")
    pair: Pair
    branch: Branch = Branch.ONCE
    soft: bool = True
    power: int = 3
    stiffness = property(lambda self: (self.kn, self.kn))

    @property
    def half(self):
        return self.kn / 2

    def exp(self, x):
        return math.exp(-abs(x) * 1e6) * self.half

    def both(self, x):
        return self.exp(x) + (self.kn if self.branch == Branch.ONCE else 0.0)

    def traction(self, opening, slip, count, largest):
        largest = max(largest, abs(shifted(slip)))
        count = count + (1 if self.soft and opening > 0 else 2)
        normal = self.both(opening) * opening + self.pair.at(opening) * (opening * 1e6) ** self.power
        return normal + scaled(slip), helpers.inner.bend(slip) * helpers.inner.GAIN, count, largest


EVERYTHING = Everything(kn=1e6, pair=Pair(first=Curve(height=30), second=Curve(height=20, branch=Branch.ONCE)))
