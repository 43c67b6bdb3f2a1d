"""J and stress intensity factors against closed forms, the energy that a growing crack sets free, and each other."""

import re

import attrs
import numpy as np
import pytest
from support import state_of

import grainlaw as gl
from grainlaw.conditions import AtRest
from grainlaw.geometry import Bricks, disc, notched_beam, rectangle, semi_disc
from grainlaw.laws import Linear
from grainlaw.loads import FluidPressure, Pressure, Traction
from grainlaw.materials import TransverselyIsotropic
from grainlaw.results.frames import take_frame
from grainlaw.units import mm

E, NU = 60e9, 0.25
ROCK = gl.Elastic(youngs_modulus=E, poissons_ratio=NU, density=2700)
PLANE = {"apparent_modulus": E / (1 - NU**2), "apparent_poisson": NU / (1 - NU)}
BRICK = 1 * mm
pytestmark = pytest.mark.filterwarnings("ignore:Linear. a normal stiffness of 1000:grainlaw.UnitWarning")
GLUE, OPEN = Linear(kn=1e17, ks=1e17), Linear(kn=1e3, ks=1e3)  # a crack is open: its springs bear nothing
TENSION = 1e6  #: Pa


@attrs.frozen(kw_only=True)
class Stretch(gl.LoadingProtocol):
    """A uniform stress beyond the rim, by a static solution."""

    stress: tuple = (0.0, TENSION, 0.0)

    def stages(self, specimen):
        rim = [Traction(boundary=name, stress=self.stress, ramp=1e-9) for name in specimen.grains.boundary_names]
        return [gl.Stage(name="stretch", loads=rim, until=[AtRest()], interval=1e-9, static=True)]

    def measure(self, state):
        return {}

    def summary(self, curves, specimen):
        return {}


def plate(columns, rows, crack, material=ROCK, brick=BRICK):
    """Square bricks with a crack along x, from ``crack[0]`` to ``crack[1]`` m in the middle of the height."""
    grains = Bricks(rows=rows, columns=columns).tessellate(rectangle(columns * brick, rows * brick))
    pairs = np.stack([grains.edges.start, grains.edges.end], axis=1)
    x, y = grains.vertices[pairs].transpose(2, 0, 1)
    near = 1e-6 * brick
    on = (abs(y - rows * brick / 2) < near) & (x > crack[0] - near) & (x < crack[1] + near)
    return gl.Specimen(attrs.evolve(grains, joints={"crack": pairs[on.all(axis=1)]}), material)


def stretched(specimen, law=GLUE, stress=(0.0, TENSION, 0.0)):
    return gl.simulate(specimen, {"crack": OPEN, ...: law}, Stretch(stress=stress), detection=None, frames=2)


def tip(x, y, direction=0.0, inner=3 * mm, outer=6 * mm):
    return gl.CrackTip(position=(x, y), direction=direction, inner=inner, outer=outer)


# --- fields that are known -------------------------------------------------------------------------------------------


def at(specimen, displacement):
    """A result whose one frame has the displacement (i, 2) m."""
    law = {"crack": OPEN, ...: GLUE}
    state = state_of(specimen, law)
    frame = attrs.evolve(take_frame(state), displacement=displacement)
    return gl.Result.from_run(state, Stretch(), {}, [frame], 0.0)


def williams_motion(place, above, one, two):
    """(i, 2) m of Williams' field (Anderson 2017, table 2.2), its own form: independent of the tested one."""
    r, half = np.hypot(*place.T), np.where(above, 1, -1) * abs(np.arctan2(place[:, 1], place[:, 0])) / 2
    s, c, kappa = np.sin(half), np.cos(half), 3 - 4 * NU
    scale = (1 + NU) / E * np.sqrt(r / (2 * np.pi))
    x = one * c * (kappa - 1 + 2 * s**2) + two * s * (kappa + 1 + 2 * c**2)
    y = one * s * (kappa + 1 - 2 * c**2) - two * c * (kappa - 1 - 2 * s**2)
    return scale[:, None] * np.stack([x, y], axis=1)


@pytest.mark.parametrize(("one", "two"), [(1e6, 0), (0, 1e6), (2e6, -1e6)])
@pytest.mark.parametrize("side", ["left", "right"])
def test_the_field_of_williams_has_its_factors(one, two, side):
    """On a fine grid; the field is that of the tip alone, everywhere."""
    specimen = plate(40, 40, (0, 20 * mm) if side == "left" else (20 * mm, 40 * mm))
    specimen = attrs.evolve(specimen, contact_points=gl.GaussPoints() if side == "left" else gl.EndPoints())
    centre = np.full(2, 20 * mm)
    above = specimen.grains.centroids[specimen.mesh.node_grain][:, 1] > centre[1]
    turn = 1 if side == "left" else -1
    motion = williams_motion(turn * (specimen.mesh.nodes - centre), above == (turn == 1), one, two)
    result, size = at(specimen, turn * motion), np.hypot(one, two)
    for inner, outer in ((4, 8), (4, 15), (10, 16)):
        here = tip(*centre, direction=0.0 if turn == 1 else 180.0, inner=inner * mm, outer=outer * mm)
        found = gl.stress_intensity(result, here, **PLANE)
        assert (found.mode_i, found.mode_ii) == pytest.approx((one, two), abs=0.01 * size)
        assert gl.j_integral(result, here) == pytest.approx(size**2 / PLANE["apparent_modulus"], rel=0.02)


@pytest.fixture(scope="module")
def edge_crack():
    specimen = plate(20, 40, (0, 8 * mm))
    return specimen, stretched(specimen), tip(8 * mm, 20 * mm)


def factors(result, here):
    found = gl.stress_intensity(result, here, **PLANE)
    return np.array([found.mode_i, found.mode_ii])


def test_a_rotation_of_the_specimen_changes_nothing(edge_crack):
    specimen, result, here = edge_crack
    turn = np.array([[np.cos(0.03), -np.sin(0.03)], [np.sin(0.03), np.cos(0.03)]])
    frame, nodes = result.frames[-1], specimen.mesh.nodes
    turned = attrs.evolve(frame, displacement=(nodes + frame.displacement) @ turn.T - nodes)
    other = attrs.evolve(result, frames=[turned])
    assert gl.j_integral(other, here) == pytest.approx(gl.j_integral(result, here), rel=1e-6)
    assert factors(other, here) == pytest.approx(factors(result, here), rel=1e-6, abs=1)


@pytest.fixture(scope="module")
def edge_crack_in_shear(edge_crack):
    specimen, _, here = edge_crack
    return specimen, stretched(specimen, stress=(0.0, 0.0, TENSION)), here


@pytest.mark.parametrize("how", ["fluid", "contact", "friction"])
def test_loaded_faces_do_as_much_as_the_stress_that_they_take_away(edge_crack, edge_crack_in_shear, how):
    """Superposition (Bueckner 1958): stress at the rim = uniform stress, of no factor, + as much on the faces."""
    specimen, result, here = edge_crack_in_shear if how == "friction" else edge_crack
    frame, mesh = result.frames[-1], specimen.mesh
    (x, y), column_row = mesh.nodes.T, np.round(specimen.grains.centroids[mesh.node_grain] / BRICK - 0.5)
    column, row = column_row.T
    strain, gap = (1 + NU) * TENSION / E, TENSION / GLUE.kn  # each row of bonds opens or slips by the gap
    first, second = result.interfaces[:, :2].T
    along = mesh.nodes[second] - mesh.nodes[first]
    along /= np.hypot(*along.T)[:, None]
    if how == "friction":
        uniform = np.stack([strain * y + gap * row, strain * x + gap * column], axis=1)
        normal, shear = 2 * TENSION * -along[:, 0] * along[:, 1], TENSION * (along[:, 1] ** 2 - along[:, 0] ** 2)
    else:
        uniform = np.stack([-strain * NU * x, strain * (1 - NU) * y + gap * row], axis=1)
        normal, shear = TENSION * along[:, 0] ** 2, -TENSION * along[:, 0] * along[:, 1]
    cracked = (abs(mesh.nodes[[first, second], 1] - 20 * mm) < 1e-9).all(axis=0) & (mesh.nodes[first, 0] < 8 * mm)
    pressed = np.tile(cracked, 2) * TENSION * (how == "fluid")
    bonds = {name: values - np.tile(one, 2) for name, values, one in (
        ("normal", frame.bonds["normal"], normal), ("shear", frame.bonds["shear"], shear),
    )}  # fmt: skip
    bonds["normal"] += pressed
    bonds["normal"][np.tile(cracked, 2)] = np.minimum(bonds["normal"][np.tile(cracked, 2)], 0)
    moved = attrs.evolve(frame, displacement=frame.displacement - uniform, bonds=bonds | {"fluid_pressure": pressed})
    other = attrs.evolve(result, frames=[moved])
    assert factors(other, here) == pytest.approx(factors(result, here), rel=2e-3, abs=200)
    assert gl.j_integral(other, here) == pytest.approx(gl.j_integral(result, here), rel=2e-2)


# --- closed forms ----------------------------------------------------------------------------------------------------


def edge_factor(share):
    """K_I over stress sqrt(pi a) of an edge crack in a long strip, to 0.5 % (Tada, Paris and Irwin 2000, 2.11)."""
    return np.polynomial.Polynomial([1.122, -0.231, 10.550, -21.710, 30.382])(share)


@pytest.mark.thorough
def test_an_edge_crack_in_tension_converges_to_its_factor():
    """Zones of constant strain err in proportion to their size: two sizes give the limit."""
    specimen, depth = plate(10, 30, (0, 8 * mm), brick=2 * mm), 8 * mm
    found = []
    for refinement in (1, 2):
        result = stretched(attrs.evolve(specimen, refinement=refinement))
        found.append(gl.stress_intensity(result, tip(depth, 30 * mm), **PLANE))
    one, two = (each.mode_i / (TENSION * np.sqrt(np.pi * depth) * edge_factor(0.4)) for each in found)
    assert abs(one - 1) < 0.06
    assert abs(two - 1) < 0.03
    assert 2 * two - one == pytest.approx(1, abs=0.01)
    assert abs(found[1].mode_ii) < 1e-4 * found[1].mode_i


def test_both_tips_of_a_crack_in_tension_and_shear():
    """K_I as in an infinite plate, times 1.055 of a square one (Isida 1971, Murakami 1987, 1.1), K_II as there."""
    specimen, stress = plate(40, 40, (16 * mm, 24 * mm)), (0.0, TENSION, TENSION)
    result, infinite = stretched(specimen, stress=stress), TENSION * np.sqrt(np.pi * 4 * mm)
    for x, direction in ((24 * mm, 0.0), (16 * mm, 180.0)):
        found = gl.stress_intensity(result, tip(x, 20 * mm, direction), **PLANE)
        assert found.mode_i == pytest.approx(1.055 * infinite, rel=0.03)
        assert found.mode_ii == pytest.approx(infinite, rel=0.03)
        assert found.energy_release_rate == pytest.approx(
            (found.mode_i**2 + found.mode_ii**2) / PLANE["apparent_modulus"]
        )
        assert gl.j_integral(result, tip(x, 20 * mm, direction)) == pytest.approx(found.energy_release_rate, rel=0.1)


# --- soft bonds ------------------------------------------------------------------------------------------------------

SOFT = Linear(kn=2e14, ks=1e14)  #: a quarter of the compliance of the plate is that of its bonds
BRICKS = Bricks(rows=40, columns=20).tessellate(rectangle(20 * mm, 40 * mm))


@pytest.mark.parametrize(
    ("size", "stress", "rings", "within"),
    [
        pytest.param((20, 40, 8), (0, TENSION, 0), ((2, 5), (3, 6), (4, 7)), 0.01, marks=pytest.mark.thorough),
        ((12, 16, 5), (0, TENSION, TENSION), ((1.2, 4), (2.5, 4.5)), 0.02),
    ],
)
def test_j_and_k_are_the_energy_that_a_longer_crack_sets_free(size, stress, rings, within):
    """Under given forces it is what the specimen stores more; central difference of the fourth order, over bricks."""
    columns, rows, depth = size

    def pulled(bricks):
        return stretched(plate(columns, rows, (0, bricks * BRICK)), SOFT, stress)

    def stored(bricks):
        curves = pulled(bricks).curves
        return sum(curves[f"energy_{name}"][-1] for name in ("zones", "contacts_normal", "contacts_shear"))

    near, far = (stored(depth + k) - stored(depth - k) for k in (1, 2))
    free, result = (8 * near - far) / 12 / BRICK, pulled(depth)
    grains = Bricks(rows=rows, columns=columns).tessellate(rectangle(columns * BRICK, rows * BRICK))
    whole = gl.elastic_properties(attrs.evolve(result.specimen, grains=grains), SOFT)
    moduli = {"apparent_modulus": whole.apparent_modulus, "apparent_poisson": whole.apparent_poisson}
    for inner, outer in rings:
        here = tip(depth * BRICK, rows / 2 * BRICK, 0.0, inner * mm, outer * mm)
        assert gl.j_integral(result, here) == pytest.approx(free, rel=within)
        assert gl.stress_intensity(result, here, **moduli).energy_release_rate == pytest.approx(free, rel=within)


def test_without_a_crack_there_is_no_j():
    result = gl.simulate(gl.Specimen(BRICKS, ROCK), SOFT, Stretch(), detection=None, frames=2)
    for direction in (0.0, 90.0):
        assert abs(gl.j_integral(result, tip(12 * mm, 20 * mm, direction))) < 1e-4 * TENSION**2 / E * 6 * mm
    with pytest.raises(gl.ParameterError, match=re.escape("bonds on the line of the crack bear 1e+06 Pa in tension")):
        gl.stress_intensity(result, tip(12 * mm, 20 * mm), **PLANE)


# --- notches, and what is refused ------------------------------------------------------------------------------------

BEAM = {"notch_depth": 5 * mm, "notch_width": 1 * mm, "span": 40 * mm, "bearing": 2 * mm}


@pytest.mark.parametrize(
    ("region", "x"), [(notched_beam(50 * mm, 12 * mm, **BEAM), 25 * mm), (semi_disc(50 * mm, **BEAM), 0.0)]
)
def test_the_tip_of_a_notch(region, x):
    specimen = gl.Specimen(gl.geometry.Voronoi(grains=60, seed=1).tessellate(region), ROCK)
    found = gl.notch_tip(specimen, inner=2 * mm, outer=4 * mm)
    assert found.position == pytest.approx((x, 5 * mm), abs=1e-9)
    assert found.direction == pytest.approx(90)
    assert found.axes == pytest.approx(np.array([[0, 1], [-1, 0]]), abs=1e-12)


def test_tension_near_the_tip_is_not_of_the_faces(edge_crack):
    """A crack is bonds that give way near its tip, within ``inner``: there it may be said to be longer than open."""
    _, result, here = edge_crack
    longer = tip(9 * mm, 20 * mm)
    assert gl.j_integral(result, longer) == pytest.approx(gl.j_integral(result, here), rel=0.01)
    gl.stress_intensity(result, longer, **PLANE)
    with pytest.raises(gl.ParameterError, match=r"bonds on the line of the crack bear .* beyond 0\.003 m behind"):
        gl.stress_intensity(result, tip(12 * mm, 20 * mm), **PLANE)


@attrs.frozen(kw_only=True)
class Loaded(Stretch):
    loads: tuple = ()

    def stages(self, specimen):
        return [gl.Stage(name="load", loads=self.loads, until=[AtRest()], interval=1e-9)]


@pytest.fixture(scope="module")
def notched():
    region = notched_beam(20 * mm, 12 * mm, notch_depth=5 * mm, notch_width=0.4 * mm, span=16 * mm, bearing=2 * mm)
    specimen = gl.Specimen(gl.geometry.Voronoi(grains=120, seed=1).tessellate(region), ROCK, refinement=2)
    state = state_of(specimen, GLUE)
    still = take_frame(state)
    return specimen, lambda *loads: gl.Result.from_run(state, Loaded(loads=loads), {}, [still], 0.0)


def test_faces_of_a_notch_may_lie_in_the_ring_where_nothing_loads_them(notched):
    specimen, under = notched
    here = gl.notch_tip(specimen, inner=2 * mm, outer=4.5 * mm)
    pressure = {"boundary": "notch", "pressure": 1e6}
    bearable = (
        FluidPressure(**pressure, cracks_only=True), Pressure(boundary="top", pressure=1e6, ramp=1e-9),
    )  # fmt: skip
    assert gl.j_integral(under(*bearable), here) == 0
    for load in (FluidPressure(**pressure), Pressure(**pressure, ramp=1e-9)):
        with pytest.raises(gl.ParameterError, match=r"the boundary notch, a face of the crack within 0\.0045 m"):
            gl.j_integral(under(load), here)
    ahead = attrs.evolve(here, inner=0.1 * mm)
    with pytest.raises(gl.ParameterError, match=re.escape("the boundary notch is 0 m from the tip at (0.01, 0.005) m")):
        gl.j_integral(under(), ahead)
    with pytest.raises(
        gl.ParameterError, match=r"the boundary notch is 0\.00\d+ m from the tip at \(0\.01, 0\.005\) m"
    ):
        gl.j_integral(under(), attrs.evolve(here, direction=0.0))


def test_what_has_no_answer_is_refused(edge_crack):
    specimen, result, here = edge_crack
    round_one = gl.Specimen(gl.geometry.Hexagonal(grain_size=8 * mm).tessellate(disc(40 * mm)), ROCK)
    touching = {"position": np.array([[9 * mm, 21 * mm]])}
    closed = attrs.evolve(result, frames=[attrs.evolve(result.frames[-1], contacts=touching)])
    foliation = TransverselyIsotropic(
        youngs_modulus=E, youngs_modulus_across=0.5 * E, poissons_ratio=NU, poissons_ratio_across=NU,
        shear_modulus_across=0.3 * E, density=2700,
    )  # fmt: skip
    rigid, foliated = (
        attrs.evolve(result, specimen=attrs.evolve(specimen, material=material))
        for material in (gl.Rigid(density=2700), foliation)
    )
    soft = {"apparent_modulus": -1.0, "apparent_poisson": 0.3}
    for call, words in [
        (lambda: tip(0, 0, 0.0, 2 * mm, 2 * mm), "outer = 0.002 m is not allowed, it must be above inner = 0.002 m"),
        (lambda: tip(0, 0, 0.0, 0.0), "CrackTip: inner = 0 m is not allowed"),
        (lambda: gl.CrackTip(position=3, inner=1, outer=2), "CrackTip: position = 3 is not allowed"),
        (lambda: gl.j_integral(result, tip(30 * mm, 20 * mm)), "position = (0.03, 0.02) m is not allowed, it lies out"),
        (lambda: gl.j_integral(result, tip(15 * mm, 20 * mm)), "the boundary right is 0.005 m from the tip at (0.015"),
        (
            lambda: gl.j_integral(result, tip(15 * mm, 3.7 * mm, 45)),
            "the boundary bottom is 0.0037 m from the tip at (0.015",
        ),
        (
            lambda: gl.j_integral(result, tip(15 * mm, 5.3 * mm, 45)),
            "the boundary right is 0.005 m from the tip at (0.015",
        ),
        (lambda: gl.j_integral(result, tip(8 * mm, 20 * mm, 0, 3 * mm, 3.1 * mm)), "no zone lies between them: the gr"),
        (lambda: gl.j_integral(result, tip(8 * mm, 20 * mm, 0, 0.5 * mm)), "inner = 0.0005 m is not allowed, the zon"),
        (lambda: gl.j_integral(closed, here), "grains touch without a bond at 1 places"),
        (lambda: gl.j_integral(result, here, frame=7), "j_integral: frame = 7 is not allowed"),
        (lambda: gl.stress_intensity(result, here, **soft), "stress_intensity: apparent_modulus = -1.0 Pa is not all"),
        (lambda: gl.j_integral(rigid, here), "material of the grains = Rigid(density=2700"),
        (lambda: gl.j_integral(foliated, here), "is not allowed, it must be Elastic"),
        (
            lambda: gl.notch_tip(specimen, inner=1.0, outer=2.0, boundary="left"),
            "must be a notch",
        ),
        (lambda: gl.notch_tip(specimen, inner=1.0, outer=2.0), "notch_tip: boundary = 'notch' is not allowed, it must"),
        (
            lambda: gl.notch_tip(round_one, inner=1.0, outer=2.0, boundary=round_one.grains.region.sides[0]),
            "a notch, w",
        ),
    ]:
        with pytest.raises(gl.ParameterError, match=re.escape(words)):
            call()


# --- cracks in tied cells: no glue ------------------------------------------------------------------------------------


def tied_factor(columns, refinement):
    """K_I over stress sqrt(pi a) of a slit of 8 mm in the edge of a plate, 20 x 40 mm, over that of theory."""
    specimen = plate(columns, 2 * columns, (0, 8 * mm), brick=20 * mm / columns)
    specimen = attrs.evolve(specimen, tied=..., slits="crack", refinement=refinement)
    result = gl.simulate(specimen, GLUE, Stretch(), detection=None, frames=2, progress=False)
    one, two = factors(result, tip(8 * mm, 20 * mm))
    assert abs(two) < 1e-6 * one
    return one / (TENSION * np.sqrt(np.pi * 8 * mm) * edge_factor(0.4))


@pytest.mark.thorough
def test_a_slit_in_tied_cells_has_the_factor_of_an_edge_crack():
    """Zones of constant strain at the tip err in proportion to their size: two sizes give the limit."""
    one, two = tied_factor(20, 0), tied_factor(40, 0)
    assert abs(one - 1) < 0.055
    assert (1 - one) / (1 - two) == pytest.approx(2, rel=0.15)
    assert 2 * two - one == pytest.approx(1, abs=0.005)
    assert tied_factor(40, 1) == pytest.approx(1, abs=0.012)
