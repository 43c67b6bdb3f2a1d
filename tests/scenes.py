"""Bodies that meet in ways of which theory says what follows: held to by tests, measured for docs/validation.md."""

import math

import attrs
import numpy as np
from bodies import GRAVITY, Motion, box, each, momentum, together, turned
from scipy.spatial import ConvexHull
from support import ROCK

import grainlaw as gl
from grainlaw.geometry import Bricks, block, moved, rectangle
from grainlaw.laws import BandisClosure, BartonBandis, Friction, MohrCoulomb
from grainlaw.protocols import DirectShear, FreeMotion
from grainlaw.units import mm

DOWN = (0.0, -GRAVITY)

#: laws of 30 degrees of friction
RUBBING = {
    "linear": Friction(kn=1e9, ks=1e9, friction_angle=30),
    "Bandis": Friction(kn=1e9, ks=1e9, friction_angle=30, closure=BandisClosure(maximum_closure=5e-3)),
    "dilating": MohrCoulomb(
        kn=1e9, ks=1e9, tensile_strength=0, cohesion=0, friction_angle=30, residual_friction_angle=30, dilation_angle=5
    ),
}
TAN_30 = math.tan(math.radians(30))

#: a joint that dilates: its width (m), the pressure on it (Pa), friction and dilation (degrees)
WIDTH, PRESSURE, FRICTION, DILATION = 50e-3, 1e6, 32, 5
TAN, SLOPE = math.tan(math.radians(FRICTION)), math.tan(math.radians(DILATION))
JOINT = {"kn": 1e12, "ks": 5e11, "friction_angle": FRICTION, "dilation_angle": DILATION}
DILATING = {
    "Barton-Bandis": BartonBandis(**JOINT, closure=BandisClosure(maximum_closure=1e-5)),
    "Mohr-Coulomb": MohrCoulomb(**JOINT, tensile_strength=0, cohesion=0, residual_friction_angle=FRICTION),
}


def faces(friction_angle=0.0, stiffness=1e9):
    return Friction(kn=stiffness, ks=stiffness, friction_angle=friction_angle)


def on_incline(friction, material, *, width=1.0, height=0.5, stiffness=1e9, **options):
    """A block on an incline of 30 degrees; motion along it."""
    body = moved(together(box(40, 1, 0, -1, "base"), box(width, height, left=30)), turn=30)
    motion = Motion(body, faces(friction, stiffness), material=material, gravity=DOWN, fixed=[0], **options)
    along, mine = np.array([math.cos(math.pi / 6), 0.5]), motion.state.mesh.node_grain == 1
    way = {
        "way": lambda state: -float(state.displacement[mine].mean(axis=0) @ along),
        "speed": lambda state: -float(state.velocity[mine].mean(axis=0) @ along),
    }
    return motion, way


def slid(material):
    """m/s2 of a block that slides down an incline of 30 degrees with 20 degrees of friction."""
    motion, way = on_incline(20, material, detection=gl.Detection(damping=0.2))
    run = motion.run(2.0, 40, **way)
    return np.polyfit(run["time"][8:], run["speed"][8:], 1)[0]


def stayed(material):
    """(k,) m that a block with 35 degrees of friction has moved down the incline, in 2 s."""
    motion, way = on_incline(35, material, damping=gl.integration.LocalDamping())
    return motion.run(2.0, 20, **way)["way"]


def leaned(material, share):
    """Degrees by which a block has turned on the incline; its width over height is ``share`` of tan 30."""
    motion, _ = on_incline(
        60, material, width=share * TAN_30, height=1.0, stiffness=1e10, damping=gl.integration.LocalDamping()
    )
    motion.run(3.0)
    first, second = motion.state.positions[motion.state.mesh.node_grain == 1][:2]
    return math.degrees(math.atan2(*(second - first)[::-1])) - 30


def rocking(safety=0.9, samples=300, seconds=1.5):
    """A block of 1 x 2 m, released at half its critical angle; its angle from upright."""
    tilt = math.atan(0.5) / 2
    body = together(box(7, 1, -3, -1, "floor"), moved(box(1, 2, -1), turn=-math.degrees(tilt)))
    motion = Motion(body, faces(60, 1e10), gravity=DOWN, fixed=[0], safety=safety)
    return motion.run(seconds, samples, angle=lambda state: float(state.freedoms.arrays.displacement[2, 1]) - tilt)


def swing(run):
    """s of the first passage of the upright, s from there to the next, and what Housner says of both."""
    critical, p = math.atan(0.5), math.sqrt(3 * GRAVITY / (4 * math.sqrt(1.25)))
    at = np.flatnonzero(np.diff(np.sign(run["angle"])))
    share = -run["angle"][at] / (run["angle"][at + 1] - run["angle"][at])
    crossing = run["time"][at] + share * (run["time"][at + 1] - run["time"][at])
    top = run["angle"][at[0] : at[1]].max() / critical
    return crossing[0], crossing[1] - crossing[0], math.acosh(2) / p, 2 / p * math.acosh(1 / (1 - top))


#: degrees by which the second of two blocks is turned, and its height: faces, corners on faces, corners
MEETINGS = [(0, 0.5), (0, 0.8), (0, 1.45), (20, 0.5), (30, 1.3), (44, 1.2), (45, 0.5)]


def collided(material, turn, height, safety=0.1):
    """Rows of a motion in which two blocks meet without friction, and its momentum before and after."""
    body = together(box(1, 1), turned(1, 1, turn, (1.8, height)))
    motion = Motion(body, faces(), material=material, safety=safety, velocity=each((1, 0.2), (0, 0)))
    before = momentum(motion.state)
    run = motion.run(0.6, 60)
    assert motion.state.velocity[motion.state.mesh.node_grain == 1, 0].mean() > 0.1  # they met
    return run, before, momentum(motion.state)


def thrown_at_random(seed, friction=0.0, samples=1):
    """Rows of a motion in which two random convex polygons are thrown at each other, and the energy (J) they got."""
    generator = np.random.default_rng(seed)
    first, second = (p[ConvexHull(p).vertices] for p in generator.uniform(-0.5, 0.5, (2, 7, 2)))
    place = np.array([1.2, generator.uniform(-0.4, 0.4)])
    fields = generator.uniform((1, -1, -2, -2), (3, 1, 2, 2))
    motion = Motion(
        together(block(first), block(second + place)), faces(friction), safety=0.3,
        velocity=each(fields[:3], (0, 0, fields[3])),
    )  # fmt: skip
    return motion.run(0.8, samples), float(motion.state.freedoms.books.given[0])


def over_joints(material, step=0.0, damping=0.0, samples=1000):
    """Ripple of what drags and of what carries a block of 1.37 m over blocks of 1 m, over its weight; its bound.

    The bound is the sinking over the length: what a strip that deep can feel of an end. A dashpot's pulse is short:
    ``samples=None`` sees every step.
    """
    floor = [box(1, 1, k, -1 + step * (k % 2), f"floor {k}") for k in range(5)]
    drive = gl.loads.Drive(boundary="box", axis=0, speed=0.5, ramp=0.2)
    motion = Motion(
        together(*floor, box(1.37, 1, 0.2, step)), faces(), material=material, gravity=DOWN, fixed=range(5),
        drives=[drive], damping=gl.integration.MassDamping(coefficient=100.0), detection=gl.Detection(damping=damping),
    )  # fmt: skip
    weight = 2600 * 1.37 * GRAVITY
    run = motion.run(
        4.0, samples or round(4.0 / motion.state.time_step), drag=lambda state: state.reaction("box")[0] / weight,
        pressed=lambda state: float(state.contacts.forces[1, 2:].sum()) / weight,
    )  # fmt: skip
    moving = run["time"] > 1.0
    return np.ptp(run["drag"][moving]), np.abs(run["pressed"][moving] - 1).max(), weight / (1.37 * faces().kn) / 1.37


#: over teeth: as slow as shows what happens at their tips
SLOWLY = {"speed": 0.02, "seconds": 40.0, "samples": 8000, "damping": 1.0, "safety": 0.3}


def over_teeth(angle, *, stiffness=1e9, speed=0.1, seconds=12.0, samples=600, damping=0.3, safety=0.9):
    """Rows of a corner pulled over frictionless teeth of 1 m: drag over weight times slope, place (m) on a tooth."""
    slope = math.tan(math.radians(angle))
    tooth = [(0, -0.5), (1, -0.5), (1, 0), (0.5, slope / 2), (0, 0)]
    teeth = [moved(block(tooth, f"tooth {k}"), by=(k, 0)) for k in range(4)]
    body = moved(box(0.6, 0.6, -0.3, -0.3), by=(1.0, 0.3 * math.sqrt(2)), turn=45)
    motion = Motion(
        together(*teeth, body), faces(stiffness=stiffness), gravity=DOWN, fixed=range(4), safety=safety,
        drives=[gl.loads.Drive(boundary="box", axis=0, speed=speed, ramp=0.5)], detection=gl.Detection(damping=damping),
    )  # fmt: skip
    scale = 2600 * 0.36 * GRAVITY * slope
    return scale, motion.run(
        seconds, samples, drag=lambda state: state.reaction("box")[0] / scale, x=lambda state: state.moved("box")[0] % 1
    )


def rebound(share):
    """Speed after over speed before a central impact with dashpots, as closed form, and rows of the motion.

    A spring and a dashpot that do not pull part when their force is zero; both blocks are free.
    """
    body = together(box(1, 1), box(1, 1, 1.001, name="other"))
    motion = Motion(body, faces(), safety=0.05, velocity=each((1, 0), (0, 0)), detection=gl.Detection(damping=share))
    run = motion.run(0.03, 10)
    x, y = motion.state.freedoms.arrays.velocity[0]
    root = math.sqrt(1 - share**2)
    expected = math.exp(-share / root * math.atan2(2 * share * root, 2 * share**2 - 1))
    return y - x, expected, run


def grazed(damping):
    """Impulse along over impulse across of an impact that slides from first to last, with 30 degrees of friction."""
    target, thrown = box(40, 1, 0, -1, "target"), moved(box(1, 1, 5, 1e-3, "thrown"))
    motion = Motion(
        together(target, thrown), RUBBING["linear"], fixed=[0], safety=0.1, velocity=each((0, 0), (40.0, -0.1)),
        detection=gl.Detection(damping=damping),
    )  # fmt: skip
    before = momentum(motion.state)
    motion.run(0.05)
    lost = momentum(motion.state) - before
    assert lost[1] > 0.1 * 2600
    return -lost[0] / lost[1]


def pressed_and_sheared(state):
    """(k, 2) N of each closed contact: pressure and size of the shear force, from the forces on its nodes."""
    contacts = state.contacts
    closed = contacts.arrays.length > 0
    (x, y), (tx, ty) = contacts.forces[:, :2, closed].sum(axis=1), contacts.closed()["tangent"].T
    return np.column_stack([x * -ty + y * tx, np.abs(x * tx + y * ty)])


def thrown_at_floor(law, material, degrees, damping, count=1000):
    """(k, 2) of all contacts in so many steps of an oblique impact with dashpots, and rows of the motion."""
    floor = box(20, 1, 0, -1, "floor")
    height = math.hypot(0.5, 0.5) * math.cos(math.radians(45 - degrees)) + 1e-4
    motion = Motion(
        together(floor, turned(1, 1, degrees, (5, height), "thrown")), law, material=material, fixed=[0], safety=0.3,
        velocity=each((0, 0), (0.2, -0.1)), detection=gl.Detection(damping=damping),
    )  # fmt: skip
    forces = []
    run = motion.run(
        count * motion.state.time_step, count, closed=lambda state: len(forces.append(pressed_and_sheared(state)) or [])
    )
    return np.concatenate(forces), run


class JointTractions(gl.Observer):
    """Mean pressure and shear (Pa) of the joint itself: at the platens the damping of the blocks is part of them."""

    def __init__(self):
        self.rows = []

    def observe(self, state, curves, stage, progress):
        if state.replaced.any():
            closed = state.contacts.closed()
            found = [float(closed[name] @ closed["length"]) / WIDTH for name in ("normal", "shear")]
        else:
            found = [state.normal.mean(), state.shear.mean()]
        self.rows.append([curves["displacement"][-1], -found[0], abs(found[1])])


def sheared(law, detection, slip=8e-4):
    """Result of a joint sheared under pressure, and (3, k) slip, pressure and shear of the joint itself."""
    blocks = gl.Specimen(Bricks(rows=2).tessellate(rectangle(WIDTH, 20e-3)), ROCK)
    test = DirectShear(
        normal_stress=PRESSURE, loading=gl.Constant(speed=0.05), maximum_slip=slip, resolution=slip / 200
    )
    joint = JointTractions()
    return gl.simulate(blocks, law, test, detection=detection, observers=[joint], frames=1), np.array(joint.rows).T


def lift(curves):
    """(k,) m by which a joint that is sheared has opened; the closure under the pressure comes first."""
    return curves["dilation"] - curves["dilation"][:5].min()


def ridden(law, material, damping):
    """Way down an incline of 40 degrees, lift from it (m), and acceleration (m/s2) of a block that nothing bonded."""
    soft = attrs.evolve(law, kn=1e9, ks=1e9)
    if isinstance(soft, BartonBandis):
        soft = attrs.evolve(soft, closure=BandisClosure(maximum_closure=1e-3))
    blocks = moved(together(box(40, 1, 0, -1, "base"), box(1.0, 0.5, left=30)), turn=40)
    # sliding up its own dilation, an elastic block without damping vibrates more and more (theory.md): look before
    duration = 0.5 if damping or isinstance(material, gl.Rigid) else 0.35
    motion = FreeMotion(duration=duration, settle=0.1, fixed=[0], tracked=[1])
    detection = gl.Detection(damping=damping)
    curves = gl.simulate(gl.Specimen(blocks, material), soft, motion, detection=detection).curves
    angle = math.radians(40)
    along, up = np.array([math.cos(angle), math.sin(angle)]), np.array([-math.sin(angle), math.cos(angle)])
    way = np.column_stack([curves["x_1"] - curves["x_1"][0], curves["y_1"] - curves["y_1"][0]])
    way, lifted, move = -way @ along, way @ up, curves["stage"] == 1
    return way, lifted, 2 * np.polyfit(curves["time"][move] - curves["time"][move][0], way[move], 2)[0]


# --- bricks that are shaken ------------------------------------------------------------------------------------------

UNDAMPED = gl.integration.CentralDifference(damping=gl.integration.Undamped())


@attrs.frozen(kw_only=True)
class Shaken(gl.LoadingProtocol):
    """Nodes that are thrown in all directions, or apart, between ends that are held, or free."""

    speed: float = 1.0  #: m/s, or 1/s of the strain
    duration: float = 2e-5
    apart: bool = False
    integrator: gl.integration.Integrator = UNDAMPED

    def stages(self, specimen):
        places = specimen.mesh.nodes - specimen.mesh.nodes.mean(axis=0)
        thrown = np.random.default_rng(1).normal(size=places.shape)
        ends = [gl.loads.Drive(boundary=end, axis=axis, speed=0.0) for end in ("bottom", "top") for axis in (0, 1)]
        velocity = self.speed * (places * [1, 0] if self.apart else thrown)
        return [
            gl.Stage(
                name="shake", loads=[*([] if self.apart else ends), gl.loads.InitialVelocity(velocity=velocity)],
                until=[gl.conditions.Reaches("time", self.duration)],
                interval=self.duration / 20, integrator=self.integrator,
            )
        ]  # fmt: skip

    def measure(self, state):
        return {}

    def summary(self, curves, specimen):
        return {}


def bricks(rows=8, columns=5, size=(25 * mm, 20 * mm)):
    return gl.Specimen(Bricks(rows=rows, columns=columns).tessellate(rectangle(*size)), ROCK)


def taken(result):
    """(t,) J that contacts have taken so far, over what was put in."""
    curves = result.curves
    return (curves["energy_contacts_normal"] + curves["energy_contacts_shear"]) / curves["energy_external"].max()
