"""Bars of bricks with bonds so stiff that waves run in them as in one piece, and waves in them."""

import math

import attrs
import numpy as np

import grainlaw as gl
from grainlaw.conditions import Reaches
from grainlaw.geometry import Bricks, moved, rectangle, together
from grainlaw.integration import CentralDifference, Undamped
from grainlaw.laws import CamachoOrtiz, Friction, Linear
from grainlaw.laws.friction import slid
from grainlaw.loads import Drive, InitialVelocity, Quiet, Traction
from grainlaw.protocols import FreeMotion

ROCK = gl.Elastic(youngs_modulus=60e9, poissons_ratio=0.25, density=2700)
P_SPEED = math.sqrt(60e9 * 0.75 / (1.25 * 0.5) / 2700)  # m/s, plane strain
S_SPEED = math.sqrt(60e9 / 2.5 / 2700)
GLUED = Linear(kn=2e15, ks=2e15)  # 330 times as stiff as a brick of 10 mm


def bar(columns=100, rows=1, size=10e-3, material=ROCK, **options):
    """A bar of square bricks along x."""
    grains = Bricks(rows=rows, columns=columns).tessellate(rectangle(columns * size, rows * size))
    return gl.Specimen(grains, material, **options)


def bell(duration, size, count=64):
    """A smooth pulse, sin^2, as a time series of so many points."""
    t = np.linspace(0, duration, count + 1)
    return gl.TimeSeries(t, size * np.sin(np.pi * t / duration) ** 2)


# --- bars that meet --------------------------------------------------------------------------------------------------

THIN = gl.Elastic(youngs_modulus=60e9, poissons_ratio=0.0, density=2700)  # a plane wave is that of a thin bar
BAR_SPEED = math.sqrt(60e9 / 2700)


def met(columns, ratio):
    """Speeds (m/s) of a bar of so many bricks that met one ``ratio`` times as long at 1 m/s, and of that one.

    St Venant 1867: 0 and 1 / ratio, as the wave has come back in the short bar and takes all of its momentum out.
    """
    length = 0.1
    size = length / columns
    short, long = (Bricks(rows=1, columns=n).tessellate(rectangle(n * size, size)) for n in (columns, columns * ratio))
    specimen = gl.Specimen(together(short, moved(long, by=(length + 1e-7, 0.0))), THIN)
    stiff = {"kn": 1e3 * 60e9 / size, "ks": 1e3 * 60e9 / size}
    test = FreeMotion(
        duration=2.6 * length * ratio / BAR_SPEED, gravity=(0.0, 0.0), samples=20,
        velocity={grain: (1.0, 0.0) for grain in range(columns)},
    )  # fmt: skip
    detection = gl.Detection(law=Friction(**stiff, friction_angle=5))
    result = gl.simulate(specimen, Linear(**stiff), test, detection=detection, frames=1)
    first = specimen.grains.body[specimen.mesh.node_grain] == 0
    speed = result.frames[-1].velocity[:, 0]
    return [float(np.average(speed[part], weights=specimen.node_masses[part])) for part in (first, ~first)]


# --- a joint that slips ----------------------------------------------------------------------------------------------


@attrs.frozen(kw_only=True)
class Slider(gl.ContactLaw):
    """A spring in series with a slider: a Coulomb joint under a pressure that stays."""

    kn: float = gl.parameter("Pa/m")
    ks: float = gl.parameter("Pa/m")
    strength: float = gl.parameter("Pa")

    @property
    def stiffness(self):
        return self.kn, self.ks

    def traction(self, opening, slip, anchor):
        anchor = slid(self.ks, slip, anchor, self.strength)
        return self.kn * opening, self.ks * (slip - anchor), anchor


@attrs.frozen(kw_only=True)
class Shaken(gl.LoadingProtocol):
    """A harmonic S wave runs into a bar from the left; the joint is in its middle, both ends are quiet."""

    amplitude: float = gl.parameter("Pa")
    period: float = gl.parameter("s")
    samples: int = 800

    def stages(self, specimen):
        t = np.linspace(0, 4 * self.period, 257)
        wave = gl.TimeSeries(t, 2 * self.amplitude * np.sin(2 * np.pi * t / self.period))  # half of it comes in
        duration = 4 * self.period + 1.2 * np.ptp(specimen.mesh.nodes[:, 0]) / S_SPEED
        loads = [
            *(Drive(boundary=side, axis=0, speed=0.0) for side in ("top", "bottom")),
            *(Quiet(boundary=side) for side in ("left", "right")),
            Traction(boundary="left", stress=(0, 0, 1.0), factor=wave),
        ]
        undamped = CentralDifference(damping=Undamped())
        return [
            gl.Stage(
                name="shake", loads=loads, until=[Reaches("time", duration)], interval=duration / self.samples,
                integrator=undamped,
            )
        ]  # fmt: skip

    def measure(self, state):
        mesh, length = state.mesh, np.ptp(state.mesh.nodes[:, 0])
        near = np.abs(mesh.nodes[mesh.zones, 0].mean(axis=1) - 0.75 * length) <= state.specimen.grains.grain_size
        joint = np.argmin(np.abs(state.contact_positions[:, 0] - length / 2))
        through = state.zone_state()[0][near, 2].mean()
        return {"through": through, "joint": state.shear[joint], "joint_slip": state.slip[joint]}

    def summary(self, curves, specimen):
        return {}


def slipped(bricks, ratio):
    """Energy through and taken by a joint over that of the wave; first harmonic through, over the amplitude.

    A wave is ``bricks`` long, and ``ratio`` times its amplitude is the strength of the joint.
    """
    columns, size, strength = 2 * bricks, 10e-3, 5e6
    grains = Bricks(rows=1, columns=columns).tessellate(rectangle(columns * size, size))
    halves = attrs.evolve(grains, phase=(np.arange(columns) >= columns // 2).astype(int))
    joint, period = Slider(kn=2e15, ks=2e15, strength=strength), bricks * size / S_SPEED
    test = Shaken(amplitude=strength / ratio, period=period)
    laws = {(0, 0): GLUED, (1, 1): GLUED, (0, 1): joint}
    curves = gl.simulate(gl.Specimen(halves, ROCK), laws, test, frames=1).curves
    time = np.linspace(0, 2 * period, 2001)  # two periods in the middle of four, as they pass

    def passing(name, place):
        return np.interp(time + period + place * columns * size / S_SPEED, curves["time"], curves[name])

    through, shear, slip = passing("through", 0.75), passing("joint", 0.5), passing("joint_slip", 0.5)
    whole = (strength / ratio) ** 2 / 2 / (ROCK.density * S_SPEED) * period  # J/m2 in a period
    taken = np.sum((shear[1:] + shear[:-1]) / 2 * np.diff(slip)) / 2 / whole
    first = 2 * np.mean((through * np.exp(-2j * np.pi * time / period))[:-1])
    energy = np.mean(through[:-1] ** 2) / ((strength / ratio) ** 2 / 2)
    return energy, taken, abs(first) * ratio / strength


def slips(ratio):
    """The same in closed form (Miller 1978, Bull. Seism. Soc. Am. 68, 987-998, for a joint between equal halves).

    The traction is that of the wave up to the strength, and goes on as the wave beyond; what is more comes back. The
    faces slip at twice that over the impedance.
    """
    angle = np.linspace(0, 2 * np.pi, 20001)[:-1]
    wave = np.sin(angle)
    passes = np.clip(wave, -ratio, ratio)
    through, back = 2 * np.mean(passes**2), 2 * np.mean((wave - passes) ** 2)
    return through, 1 - through - back, 2 * np.mean(passes * wave)


# --- a bar that is stretched -----------------------------------------------------------------------------------------

STRENGTH, ENERGY_OF_FRACTURE = 30e6, 30.0  # Pa, J/m2
FRAGMENT = 60e9 * ENERGY_OF_FRACTURE / STRENGTH**2  # m, by which sizes are measured
RATE = BAR_SPEED * STRENGTH**3 / (60e9**2 * ENERGY_OF_FRACTURE)  # 1/s, by which rates are


@attrs.frozen(kw_only=True)
class Stretched(gl.LoadingProtocol):
    """A bar is stretched at one rate everywhere from the start, and its ends go on."""

    rate: float = gl.parameter("1/s")
    duration: float = gl.parameter("s")

    def stages(self, specimen):
        x = specimen.mesh.nodes[:, 0]
        half = np.ptp(x) / 2
        velocity = np.column_stack([self.rate * (x - half), np.zeros(len(x))])
        ends = [
            Drive(boundary=side, axis=0, speed=sign * self.rate * half) for side, sign in (("left", -1), ("right", 1))
        ]
        return [
            gl.Stage(
                name="stretch", loads=[*ends, InitialVelocity(velocity=velocity)],
                until=[Reaches("time", self.duration)], interval=self.duration / 20,
                integrator=CentralDifference(damping=Undamped()),
            )
        ]  # fmt: skip

    def measure(self, state):
        return {}

    def summary(self, curves, specimen):
        return {}


def fragment_size(rate):
    """Mean size over ``FRAGMENT`` at a rate over ``RATE``, fitted to simulations (Zhou, Molinari and Ramesh 2006).

    doi:10.1063/1.2216892; the numbers are second-hand.
    """
    return 4.5 / (1 + 0.77 * rate**0.25 + 5.4 * rate**0.75)


def broken_up(rate, bricks=20, seed=1, scatter=1e-4, count=60):
    """Mean size of fragments over ``FRAGMENT``, at a rate over ``RATE``; ``bricks`` in one of the expected size.

    Strengths of the joints ``scatter`` evenly. The fit is of a bar without defects; there rounding would say which
    joints break, so that they scatter by a ten thousandth.
    """
    expected = fragment_size(rate) * FRAGMENT
    size, columns = expected / bricks, count * bricks
    specimen = gl.Specimen(Bricks(rows=1, columns=columns).tessellate(rectangle(columns * size, size)), THIN)
    stiffness = 20 * 60e9 / size
    strength = STRENGTH * np.repeat(1 + scatter * np.random.default_rng(seed).uniform(-1, 1, columns - 1), 2)
    law = CamachoOrtiz(
        kn=stiffness, ks=stiffness, tensile_strength=strength, cohesion=1e9, residual_friction_angle=5,
        mode_i_energy=ENERGY_OF_FRACTURE, mode_ii_energy=1e4,
    )  # fmt: skip
    true = rate * RATE
    duration = STRENGTH / 60e9 / true + 15 * expected / BAR_SPEED + 6 * ENERGY_OF_FRACTURE / STRENGTH / true / expected
    result = gl.simulate(specimen, law, Stretched(rate=true, duration=duration), frames=1, detection=None)
    return columns * size / len(gl.fragments(result)) / FRAGMENT
