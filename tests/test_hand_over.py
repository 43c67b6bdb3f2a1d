"""Broken interfaces that slide away become contacts of their edges: no jump, friction goes on, places are geometric."""

import math
from itertools import combinations, pairwise
from types import SimpleNamespace

import attrs
import numpy as np
import pytest
from support import small_sample

import grainlaw as gl
from grainlaw.columns import SPENT, SUPPLIED, energy
from grainlaw.engine.contacts.hand_over import _leaving
from grainlaw.geometry import Bricks, Cracked, Voronoi, from_polygons, rectangle
from grainlaw.geometry.cells.convex import hull, split
from grainlaw.laws import BandisClosure, CohesiveCrack, Friction, MohrCoulomb
from grainlaw.protocols import DirectShear, FreeMotion, UniaxialCompression

WIDTH, PRESSURE, ANGLE = 0.02, 5e6, 25
JOINT = {"kn": 1e12, "ks": 1e12, "tensile_strength": 1e6, "cohesion": 2e6, "friction_angle": 40,
         "residual_friction_angle": ANGLE}  # fmt: skip
LAWS = {
    "brittle": MohrCoulomb(**JOINT),
    "cohesive": CohesiveCrack(**JOINT, mode_i_energy=1.5, mode_ii_energy=5),
    "friction": Friction(kn=1e12, ks=1e12, friction_angle=ANGLE),
}
MATERIALS = {
    "rigid": gl.Rigid(density=2600), "deformable": gl.Elastic(youngs_modulus=60e9, poissons_ratio=0.2, density=2600)
}  # fmt: skip


def sheared(law, material, detection):
    specimen = gl.Specimen(Bricks(rows=2).tessellate(rectangle(WIDTH, WIDTH)), material)
    test = DirectShear(
        normal_stress=PRESSURE, loading=gl.Constant(speed=1.0), maximum_slip=0.1 * WIDTH, resolution=5e-4 * WIDTH
    )
    return gl.simulate(specimen, law, test, detection=detection)


def unaccounted(curves):
    return energy(curves, SUPPLIED) - energy(curves, *SPENT)


@pytest.mark.thorough
@pytest.mark.parametrize("material", MATERIALS.values(), ids=MATERIALS)
@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
def test_sliding_goes_on_after_the_hand_over(law, material):
    """Against the same run without detection, from just before the hand-over to just after, and on."""
    alone = sheared(law, material, None).curves
    result = sheared(law, material, gl.Detection(hand_over=0.05))
    with_it = result.curves
    at = int(np.searchsorted(with_it["displacement"], 0.05 * WIDTH))
    friction = PRESSURE * math.tan(math.radians(ANGLE))
    assert with_it["shear_stress"][: at - 3] == pytest.approx(alone["shear_stress"][: at - 3])
    around = slice(at - 3, at + 10)
    # The even traction of a bond becomes that of one point on a shorter length: 2 % ring in a deformable block.
    assert np.abs(with_it["shear_stress"][around] - alone["shear_stress"][around]).max() < 0.04 * friction
    assert np.abs(with_it["normal_stress"][around] - PRESSURE).max() < 0.01 * PRESSURE
    assert with_it["shear_stress"][at + 20 :].mean() == pytest.approx(friction, rel=5e-3)
    step = np.max(np.diff(with_it["time"]) / np.diff(with_it["step"]))
    jumps = np.abs(np.diff(unaccounted(with_it)))
    assert jumps.max() < 1.1 * friction * WIDTH * 1.0 * step  # the work of friction in one step


@attrs.frozen(kw_only=True)
class PartAndReturn(gl.LoadingProtocol):
    """Pull the upper block off, carry it sideways, and put it back."""

    lift: float = gl.parameter("m")
    aside: float = gl.parameter("m")
    press: float = gl.parameter("m")
    turn: float = 2e-4  #: s for each way

    def stages(self, specimen):
        def stage(name, x, y):
            drives = [
                gl.loads.Drive(boundary="bottom", axis=0, speed=0),
                gl.loads.Drive(boundary="bottom", axis=1, speed=0),
            ]
            drives += [gl.loads.Drive(boundary="top", axis=k, speed=way / self.turn) for k, way in enumerate((x, y))]
            column = "x" if x else ("down" if y < 0 else "up")
            until = [gl.conditions.Reaches(column, abs(x) + abs(y))]
            return gl.Stage(name=name, loads=drives, until=until, interval=self.turn / 1000)

        return [
            stage("lift", 0, self.lift), stage("aside", self.aside, 0), stage("down", 0, -self.lift - self.press),
        ]  # fmt: skip

    def measure(self, state):
        x, y = state.moved("top")
        return {"x": float(x), "up": float(y), "down": float(self.lift - y), "force": -float(state.reaction("top")[1])}

    def summary(self, curves, specimen):
        return {}


@pytest.mark.thorough
@pytest.mark.parametrize("aside", [0.0, 0.3, 0.8])
def test_what_has_parted_meets_again_where_its_edges_are(aside):
    """A closure of 0.1 mm on what is left of the width, at 1e12 Pa/m; no force before the edges meet."""
    specimen = gl.Specimen(Bricks(rows=2).tessellate(rectangle(WIDTH, WIDTH)), gl.Rigid(density=2600))
    lift = 0.2 * WIDTH
    way = PartAndReturn(lift=lift, aside=aside * WIDTH or 1e-9, press=1e-4)
    curves = gl.simulate(specimen, LAWS["brittle"], way, time_step_factor=0.05).curves
    back = np.flatnonzero(curves["stage"] == 2)[5:]  # the platen has turned round
    closure = curves["down"][back] - lift
    above = closure < -0.02 * lift
    assert above.sum() > 10
    assert np.abs(curves["force"][back][above]).max() < 1
    stiffness = 1e12 * (1 - aside) * WIDTH
    assert curves["force"][-1] == pytest.approx(stiffness * closure[-1], rel=0.05)


class Steps(gl.Observer):
    """Where all nodes are, by step, and how many bonds were handed over."""

    def __init__(self):
        self.places, self.handed_over = {}, 0

    def observe(self, state, curves, stage, progress):
        self.places[state.steps] = state.displacement.tobytes()
        self.handed_over = int(state.replaced.sum())


@pytest.mark.parametrize(
    "integrator",
    [gl.integration.CentralDifference(), gl.integration.DynamicRelaxation()],
    ids=["central", "relaxation"],
)
@pytest.mark.thorough
def test_how_often_one_samples_changes_no_bit_of_the_motion(integrator):
    """Crushed until bonds are handed over, with a platen whose speed rises, and a closure that shortens the step."""
    specimen = small_sample(16)
    law = CohesiveCrack(**JOINT | {"kn": 1e14, "ks": 1e14}, mode_i_energy=1, mode_ii_energy=2,
                        closure=BandisClosure(maximum_closure=2e-6))  # fmt: skip
    runs = []
    for samples in (120, 5000):
        test = UniaxialCompression(
            loading=gl.Constant(speed=4.0, ramp=2e-5),
            maximum_strain=0.02,
            stop_fraction=0,
            samples=samples,
            integrator=integrator,
        )
        watch = Steps()
        gl.simulate(specimen, law, test, detection=gl.Detection(hand_over=0.02), observers=[watch], frames=1)
        runs.append(watch)
    one, other = runs
    common = sorted(set(one.places) & set(other.places))
    assert len(common) > 60
    assert len(other.places) > 6 * len(common)  # after every step
    assert all(one.places[step] == other.places[step] for step in common)
    assert one.handed_over == other.handed_over > 3


def test_a_bond_leaves_with_the_memory_of_the_point_that_is_pressed_most():
    """Of three bonds the first and the last: of their points the second and the first."""
    arrays = SimpleNamespace(
        leaving=np.array([1, 0, 1]), slip=np.array([1.0, 2, 3, 4, 5, 6]), normal=np.array([5.0, 0, -9, -1, 0, -3]),
        force_x=np.arange(12.0), force_y=np.arange(12.0) + 100, memory=np.arange(6.0)[None] + 50,
    )  # fmt: skip
    groups = [SimpleNamespace(last=2), SimpleNamespace(last=3)]

    class Bonds:
        def __len__(self):
            return 3

        def sever(self, chosen):
            self.severed = chosen.tolist()

    bonds = Bonds()
    bonds.arrays, bonds.groups = arrays, groups
    found = _leaving(SimpleNamespace(bonds=bonds, last=lambda rows: rows))
    assert arrays.leaving.tolist() == [0, 0, 0]
    assert bonds.severed == [0, 2]
    assert found.bond.tolist() == [0, 2]
    assert found.slip.tolist() == [4, 3]
    assert found.group.tolist() == [0, 1]
    assert found.memory.tolist() == [[53, 52]]
    assert found.force.tolist() == [[[0, 2], [3, 5], [6, 8], [9, 11]], [[100, 102], [103, 105], [106, 108], [109, 111]]]


# --- a bond that is broken at one point, about which its grains turn --------------------------------------------------

KITE = 10e-3  #: m, length of the edge that two triangles share
SPIN = -2000.0  #: rad/s, so that the second point opens


@attrs.frozen(kw_only=True)
class Turning(FreeMotion):
    """The second grain turns about the first contact point of their bond."""

    def stages(self, specimen):
        settle, move = super().stages(specimen)
        share = specimen.contact_points.weights(np.array([KITE]))[0]
        ends = specimen.mesh.nodes[specimen.mesh.interfaces[0, :2]]
        x, y = (specimen.mesh.nodes - ends[0] - share * (ends[1] - ends[0])).T
        moves = (specimen.mesh.node_grain == 1)[:, None]
        loads = [*move.loads[:-1], gl.loads.InitialVelocity(velocity=SPIN * moves * np.stack([-y, x], axis=1))]
        return [settle, attrs.evolve(move, loads=loads)]


@attrs.define
class Weakened(gl.Observer):
    """Breaks the second contact point at rest, and sees how far grains had turned when the bond went."""

    turned: float = math.nan

    def observe(self, state, curves, stage, progress):
        if stage.name == "settle":
            state.bonds.arrays.memory[state.bonds.groups[0].row("damage"), 1] = 1.0
        if math.isnan(self.turned) and state.replaced.any():
            self.turned = math.degrees(state.rotation(1))


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("points", "until"),
    [(gl.EndPoints(), -90), (gl.GaussPoints(), -math.degrees(2 * math.asin(0.05 / (1 - 1 / math.sqrt(3)))))],
)
@pytest.mark.parametrize("material", MATERIALS.values(), ids=MATERIALS)
def test_a_bond_that_is_half_broken_lasts_until_corners_overlap_or_its_edges_stand_across(material, points, until):
    """Free to turn by 298 degrees: beyond 180 the mean edge points the other way, and a gap would be an overlap.

    Corners beyond a point that holds, at 0.2113 of the edge, overlap by 0.05 of it when the edges have turned by 14
    degrees: a corner that digs in deeper then presses the grains apart, and gives back what it took.
    """
    flat = [(0.0, 0.0), (0.0, KITE), (-3e-3, KITE / 2)], [(0.0, 0.0), (3e-3, KITE / 2), (0.0, KITE)]
    specimen = gl.Specimen(from_polygons(flat), material, contact_points=points)
    law = MohrCoulomb(kn=1e13, ks=1e13, tensile_strength=1e9, cohesion=1e9, friction_angle=0)
    seen, lasts = Weakened(), math.radians(220) / abs(SPIN)
    test = Turning(settle=1e-6, duration=lasts, gravity=(0, 0), fixed=[0], tracked=[1], samples=220)
    result = gl.simulate(specimen, law, test, observers=[seen])
    assert seen.turned == pytest.approx(until, abs=2)
    assert len(result.cracks) == 2
    energy = result.curves["energy_kinetic"][result.curves["stage"] == 1]
    assert energy[-1] == pytest.approx(energy[0], rel=0.001)
    if until == -90:
        assert energy == pytest.approx(energy[0], rel=0.02)
        assert np.degrees(result.curves["rotation_1"][-1]) % 360 == pytest.approx(140, abs=5)
    assert result.summary["energy_error"] < 1e-3


def deepest_overlap(specimen, displacement):
    """m, least width of what two grains have in common, whether a contact knows of it or not."""
    mesh = specimen.mesh
    place = (mesh.nodes + displacement).tolist()
    grains = [hull([tuple(node) for node in place[a:b]]) for a, b in pairwise(mesh.first_node.tolist())]
    reach = 2 * specimen.grains.grain_size
    deepest = 0.0
    for one, other in combinations(grains, 2):
        if math.dist(one[0], other[0]) > 2 * reach:
            continue
        common = one
        for (ax, ay), (bx, by) in zip(other, other[1:] + other[:1], strict=True):
            common = split(common, (ax, ay), (bx - ax, by - ay), 0.0)[0] if common else []
        if len(common) > 2:
            sides = zip(common, common[1:] + common[:1], strict=True)
            deepest = max(deepest, min(max(height(point, *side) for point in common) for side in sides))
    return deepest


def height(point, start, end):
    """m, how far a point is to the left of a line."""
    (ax, ay), (bx, by), (x, y) = start, end, point
    return ((bx - ax) * (y - ay) - (by - ay) * (x - ax)) / math.dist(start, end)


@pytest.mark.thorough
def test_grains_of_a_crushed_specimen_overlap_little():
    """By geometry alone. Of bonds that held by one point up to a right angle, corners overlapped by a quarter."""
    rock, size = gl.rocks["lac-du-bonnet-granite"], 0.02 * math.sqrt(2 / 40)
    softer = 2.87e-3 / size  # the bonds are those of grains of 2.87 mm
    bond = attrs.evolve(rock.law, kn=rock.law.kn * softer, ks=rock.law.ks * softer, residual_friction_angle=45)
    open_crack = Friction(kn=bond.kn, ks=bond.ks, friction_angle=30, gap=1e-6)
    grains = Cracked(Voronoi(grains=40, seed=3), share=0.1, seed=3).tessellate(rectangle(0.02, 0.04))
    specimen = gl.Specimen(grains, rock.material)
    result = gl.simulate(
        specimen, {"initial cracks": open_crack, ...: bond}, UniaxialCompression(maximum_strain=0.02), frames=10
    )
    assert result.curves["strain"].max() > 0.01
    assert max(deepest_overlap(specimen, frame.displacement) for frame in result.frames[1:]) < 0.1 * size
