"""Sources of acoustic events: their tensors by hand, their motion in a run, and their sum over a specimen."""

from types import SimpleNamespace

import attrs
import numpy as np
import pytest
import pyvista
from hypothesis import assume, given
from hypothesis import strategies as st
from support import ROCK
from test_crack_pattern import cracks_of

import grainlaw as gl
from grainlaw.engine.parts.breaks import Breaks
from grainlaw.engine.state import State
from grainlaw.geometry import Bricks, Voronoi, rectangle
from grainlaw.laws import MohrCoulomb
from grainlaw.protocols import UniaxialCompression, UniaxialTension
from grainlaw.results.acoustic import KINDS, clustered
from grainlaw.units import mm

ANGLES = st.floats(0, np.pi, exclude_max=True)
MOTIONS = st.floats(-1e-5, 1e-5).filter(lambda u: u == 0 or abs(u) > 1e-8)
LAME, SHEAR = 25e9, 20e9  #: Pa
STIFFNESS = np.array([[LAME + 2 * SHEAR, LAME, 0], [LAME, LAME + 2 * SHEAR, 0], [0, 0, SHEAR]])


def event_of(angle, opening, slip, length=2e-3, thickness=0.5, **more):
    """One event of one crack."""
    crack = cracks_of(1, orientation=[angle], source_opening=[opening], source_slip=[slip], length=[length], **more)
    return clustered(crack, 1.0, 1.0, thickness, STIFFNESS[None])


def whole(tensor):
    xx, yy, xy = tensor
    return np.array([[xx, xy], [xy, yy]])


# --- one crack --------------------------------------------------------------------------------------------------------


@given(ANGLES, MOTIONS, MOTIONS)
def test_the_moment_of_a_crack_is_that_of_a_displacement_discontinuity(angle, opening, slip):
    """Lame's l tr(P) I + 2 G P, with P the symmetric part of the jump times the normal, times length and thickness."""
    along = np.array([np.cos(angle), np.sin(angle)])
    normal = np.array([along[1], -along[0]])
    jump = opening * normal + slip * along
    potency = (np.outer(jump, normal) + np.outer(normal, jump)) / 2 * 2e-3 * 0.5
    moment = LAME * np.trace(potency) * np.eye(2) + 2 * SHEAR * potency
    event = event_of(angle, opening, slip)
    assert whole(event.potency[0]) == pytest.approx(potency, abs=1e-9 * 1e-8)
    assert whole(event.moment[0]) == pytest.approx(moment, rel=1e-9, abs=1e-9 * np.abs(moment).max())


@given(ANGLES, MOTIONS, MOTIONS)
def test_one_of_the_two_planes_is_that_of_the_crack(angle, opening, slip):
    assume(opening != 0 or slip != 0)
    event = event_of(angle, opening, slip)
    assert event.tensile_angle[0] == pytest.approx(np.degrees(np.arctan2(opening, abs(slip))), abs=1e-4)
    assert np.abs(np.sin(event.planes[0] - angle)).min() < 1e-6
    middle, ends = event.position[0], event.plane_lines[0]
    assert ends.mean(axis=1) == pytest.approx(np.array([middle, middle]), abs=1e-12)
    assert np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1) == pytest.approx([2e-3] * 2)


@pytest.mark.parametrize("angle", [0.0, 0.4, 2.0])
def test_opening_slip_and_closing_by_hand(angle):
    """A crack of 10 cm2 by 1 um: slip has G u A; opening the principal moments (l + 2 G) u A and l u A."""
    opens, slips, closes = (event_of(angle, *motion) for motion in ((1e-6, 0), (0, -1e-6), (-1e-6, 0)))
    assert slips.scalar_moment == pytest.approx([20e9 * 1e-9])
    assert slips.moment_magnitude == pytest.approx([2 / 3 * (np.log10(20) - 9.1)])
    assert opens.scalar_moment == pytest.approx([np.sqrt((65e9**2 + 25e9**2) / 2) * 1e-9])
    bulk = LAME + 2 / 3 * SHEAR
    share = (bulk + SHEAR / 3) / (bulk + 4 * SHEAR / 3)
    found = [event.isotropic[0] for event in (opens, slips, closes)]
    assert found == pytest.approx([share, 0, -share], abs=1e-12)
    assert [event.kind[0] for event in (opens, slips, closes)] == list(KINDS)


def test_several_breaks_of_an_event_add_up():
    """Two cracks that cross and open: no direction, all isotropic; and of opening with slip between them a half."""
    both = cracks_of(2, orientation=[0, np.pi / 2], source_opening=[1e-6, 1e-6], source_slip=[0, 0])
    event = clustered(both, 1.0, 1.0, 1.0, np.repeat(STIFFNESS[None], 2, axis=0))
    assert event.moment[0] == pytest.approx([90e3, 90e3, 0], abs=1e-6)
    assert (event.isotropic[0], event.tensile_angle[0], event.kind[0]) == (1, 90, "opening")
    exactly = attrs.evolve(event, potency=np.array([[1e-9, 1e-9, 0.0]]))  # no largest extension at all
    assert exactly.tensile_angle == pytest.approx([90])
    mixed = event_of(0.3, 1e-6, 1e-6)
    assert mixed.tensile_angle == pytest.approx([45])


def test_the_size_of_an_event_is_that_of_its_crack():
    """Three pieces in a row, of 1, 2 and 3 mm, are one of 6 mm, whatever direction they have."""
    place = np.array([0.5, 2, 4.5])[:, None] * 1e-3 * [np.cos(0.7), np.sin(0.7)]
    row = cracks_of(3, position=place, length=[1e-3, 2e-3, 3e-3])
    assert clustered(row, 1, 1).size == pytest.approx([6e-3])
    assert clustered(row, 0, 1).size == pytest.approx([1e-3, 2e-3, 3e-3])


def test_without_stiffness_or_motion_there_is_no_moment():
    rigid = clustered(cracks_of(1, source_opening=[1e-6], source_slip=[0]), 1, 1)
    assert rigid.moment.tolist() == [[0, 0, 0]]
    assert np.isnan(rigid.moment_magnitude[0])
    assert rigid.isotropic == [0.5]  # of the potency: opening alone
    unknown = clustered(cracks_of(1), 1, 1, 1.0, STIFFNESS[None])
    assert np.isnan(unknown.moment).all()
    assert np.isnan(unknown.radiated).all()


# --- sizes and energy -------------------------------------------------------------------------------------------------


def test_what_goes_into_motion_is_radiated_by_the_events_of_that_time():
    """1 J in the sample of the first break and 3 and 2 in the next: of the last sample both events have their share."""
    curves = {"time": np.arange(6.0), "energy_kinetic": np.array([0, 1, 2, 0, 0, 9.0]),
              "energy_damping": np.array([0, 0, 2, 6, 7, 0.0]), "energy_absorbed": np.zeros(6)}  # fmt: skip
    cracks = cracks_of(2, time=[1, 2], position=[(0, 0), (1, 0)], spent=[1, 3])  # gains of 1, 3, 2, 1, 2
    events = clustered(cracks, 0.1, 0.1, 10.0, curves=curves)
    assert events.radiated == pytest.approx([10 * (1 + 3 / 4), 10 * (3 * 3 / 4 + 2)])
    longer = clustered(cracks, 0.1, 0.1, 1.0, curves=curves, passage=2.0)
    assert longer.radiated == pytest.approx([1 + 3 / 4 + 2 / 4, 3 * 3 / 4 + 2 * 3 / 4 + 1])
    silent = clustered(cracks_of(1, time=[5]), 0.1, 0.1, curves=curves)
    assert silent.radiated == [2]


@pytest.mark.parametrize("least", [None, -6.0])
def test_the_interval_of_b_holds_it_as_often_as_it_says(least):
    """Magnitudes drawn with b = 1.3 above -6: of 400 sets of 30 the interval must miss 20 or so."""
    rng, missed = np.random.default_rng(5), 0
    for _ in range(400):
        magnitude = -6 + rng.exponential(np.log10(np.e) / 1.3, 30)
        cracks = cracks_of(30, time=np.arange(30), spent=10 ** (1.5 * magnitude + 4.8))
        low, high = clustered(cracks, 0.1, 0.1).b_interval(least)
        missed += not low <= 1.3 <= high
    assert 9 <= missed <= 33  # 99.5 % of a binomial distribution
    assert np.isnan(event_of(0.0, 1e-6, 0).b_interval()).all()


def test_the_interval_of_b_by_hand():
    """Eleven from -4 on: 95 % of chi-squared with 22 freedoms lie in 10.982 to 36.781, with 20 in 9.591 to 34.170."""
    cracks = cracks_of(11, time=np.arange(11), spent=10 ** (1.5 * np.linspace(-4, -3, 11) + 4.8))
    events = clustered(cracks, 0.1, 0.1)
    assert events.b_interval(-4.1) == pytest.approx(np.log10(np.e) / 0.6 * np.array([10.982, 36.781]) / 22, rel=1e-3)
    assert events.b_interval() == pytest.approx(np.log10(np.e) / 0.5 * np.array([9.591, 34.170]) / 22, rel=1e-3)


def test_events_are_complete_from_the_most_frequent_magnitude_on():
    magnitude = np.array([-6.1, -5.9, -5.5, -5.45, -5.41, -4.9])  # bins of 0.2 from -5.6: three
    cracks = cracks_of(6, time=np.arange(6), spent=10 ** (1.5 * magnitude + 4.8))
    assert clustered(cracks, 0.1, 0.1).completeness() == pytest.approx(-5.6)
    assert clustered(cracks, 0.1, 0.1).completeness(1.0) == pytest.approx(-6)
    assert np.isnan(clustered(cracks_of(1), 0.1, 0.1).completeness())
    with pytest.raises(gl.ParameterError, match="completeness: width = 0 is not allowed"):
        clustered(cracks, 0.1, 0.1).completeness(0)


# --- when a source is known -------------------------------------------------------------------------------------------


def test_a_source_is_what_a_point_gains_until_waves_have_left():
    breaks = Breaks(3, passage=2.0)
    moved = {"opening": np.array([1.0, 2, 3]), "slip": np.array([5.0, 7, 9])}
    pulled = {"normal": np.zeros(3), "shear": np.array([2.0, 4, 6]), "stiffness": np.full((2, 3), 2.0)}
    breaks.whole(State.beyond_elastic.fget(SimpleNamespace(**moved, **pulled)))
    breaks.books.time[1] = 10.0  # it breaks, seen at 10 s
    breaks.whole(np.array([[7.0, 8, 9], [7, 8, 9]]))
    assert breaks.books.before.tolist() == [[7, 2, 9], [7, 5, 9]]
    assert not breaks.waiting(10.0).any()
    assert not breaks.waiting(11.9).any()
    assert breaks.waiting(12.0).tolist() == [False, True, False]
    breaks.settle(breaks.waiting(12.5), np.array([[0, 20.0, 0], [0, 30.0, 0]]))
    assert breaks.books.source[:, 1].tolist() == [18, 25]
    assert np.isnan(breaks.books.source[:, [0, 2]]).all()
    assert not breaks.waiting(13.0).any()  # it keeps its source
    at_once = Breaks(1, passage=0.0)
    at_once.books.time[0] = 10.0
    assert not at_once.waiting(10.0).any()
    assert at_once.waiting(10.1).all()


# --- in a run ---------------------------------------------------------------------------------------------------------

LAW = MohrCoulomb(
    kn=1.05e14, ks=9.45e13, tensile_strength=10e6, cohesion=29e6, friction_angle=40, residual_friction_angle=20
)


@pytest.fixture(scope="module")
def pressed():
    grains = Voronoi(grains=40, seed=3).tessellate(rectangle(20 * mm, 40 * mm))
    test = UniaxialCompression(samples=800, stop_fraction=0.8)
    return gl.simulate(gl.Specimen(grains, ROCK), LAW, test, frames=2, threads=1, progress=False)


def test_a_bar_that_parts_radiates_what_it_had_stored():
    """Two halves of a bar under tension: the source is the gap behind the break, all of the energy beside G leaves."""
    corners = np.array([(0, 1, 3, 2), (2, 3, 5, 4)])
    vertices = np.array([(x, y) for y in (0, 10e-3, 20e-3) for x in (0, 5e-3)])
    grains = gl.Tessellation(rectangle(5e-3, 20e-3), vertices, corners.ravel(), np.arange(0, 9, 4))
    test = UniaxialTension(loading=gl.Constant(speed=0.02), samples=2000, stop_fraction=0.1)
    result = gl.simulate(gl.Specimen(grains, ROCK), LAW, test, frames=1, threads=1, progress=False)
    events = gl.acoustic_events(result, thickness=0.1)
    assert events.breaks.tolist() == [2]
    assert events.kind[0] == "opening"
    opening = events.potency[0, 1] / (5e-3 * 0.1)
    assert events.potency[0] == pytest.approx([0, opening * 5e-4, 0], abs=1e-3 * opening * 5e-4)
    stretch = 10e6 / (60e9 / (1 - 0.25**2)) * 20e-3 + 10e6 / 1.05e14  # of zones, sides free, and of the bond
    assert 0 < opening < 2 * stretch  # the halves spring back, and swing as far again at most
    planes = np.abs(np.sin(events.planes[0]))
    assert planes == pytest.approx([0, 0], abs=0.05)
    stored = 10e6**2 / 2 * (20e-3 / (60e9 / (1 - 0.25**2)) + 1 / 1.05e14) * 5e-3 * 0.1
    assert events.energy[0] + events.radiated[0] == pytest.approx(stored, rel=0.05)


def test_sources_at_all_angles_are_the_strain_that_is_not_elastic(pressed):
    """The mean strain by the displacement of the rim (Gauss), less zones and springs, is that of broken points."""
    mesh, frame = pressed.mesh, pressed.frames[-1]
    u = frame.displacement
    total = np.zeros((2, 2))
    for edges in mesh.boundary_edges.values():
        along = mesh.nodes[edges[:, 1]] - mesh.nodes[edges[:, 0]]
        normal = np.column_stack([along[:, 1], -along[:, 0]])  # the grain is on the left
        total += (u[edges].mean(axis=1)[:, :, None] * normal[:, None]).sum(axis=0)
    corner, moved = mesh.nodes[mesh.zones], u[mesh.zones]
    edges, changes = corner[:, 1:] - corner[:, :1], moved[:, 1:] - moved[:, :1]
    gradient = np.linalg.solve(edges, changes).transpose(0, 2, 1)
    zones = (gradient * mesh.zone_areas[:, None, None]).sum(axis=0)
    ends = mesh.nodes[pressed.interfaces]
    along = np.tile((ends[:, 1] - ends[:, 0]) / 2, (2, 1))
    normal = np.column_stack([along[:, 1], -along[:, 0]])  # times half a length
    tangent = along
    spring = [frame.bonds["normal"] / LAW.kn, frame.bonds["shear"] / LAW.ks]
    jump = spring[0][:, None] * normal + spring[1][:, None] * tangent
    unit = normal / np.linalg.norm(normal, axis=1)[:, None]
    springs = (jump[:, :, None] * unit[:, None]).sum(axis=0)
    left = total - zones - springs
    left = (left + left.T) / 2
    cracks = pressed.cracks
    broken = frame.bonds["broken_time"]
    chosen = np.flatnonzero(~np.isnan(broken))
    chosen = chosen[np.argsort(broken[chosen], kind="stable")]
    beyond = [cracks.opening - spring[0][chosen], cracks.slip - spring[1][chosen]]
    now = attrs.evolve(cracks, source_opening=beyond[0], source_slip=beyond[1])
    potency = whole(clustered(now, 1.0, 1.0).potency.sum(axis=0))
    assert potency == pytest.approx(left, rel=0.02, abs=0.02 * np.abs(left).max())


def test_events_of_a_run_radiate_all_that_went_into_motion(pressed):
    events, curves = gl.acoustic_events(pressed), pressed.curves
    motion = curves["energy_kinetic"] + curves["energy_damping"]
    assert 0.9 * motion[-1] <= events.radiated.sum() <= motion[-1] * (1 + 1e-9)
    assert np.isfinite(events.moment).all()
    assert (events.scalar_moment > 0).all()
    counts = ", ".join(f"{kind}: {np.sum(events.kind == kind)}" for kind in KINDS)
    low, high = events.magnitude.min(), events.magnitude.max()
    sizes = f"{1e3 * events.size.min():.4g} mm to {1e3 * events.size.max():.4g} mm"
    largest = f"size: {sizes}, magnitude: {low:.2f} to {high:.2f}"
    told = f"AcousticEvents(events: {len(events)}, breaks: {len(pressed.cracks)}, {counts}, {largest})"
    assert str(events) == told
    assert "magnitude" not in str(clustered(cracks_of(1), 1, 1))


def test_events_become_tables_and_lines(pressed, tmp_path):
    pandas = pytest.importorskip("pandas")
    events = gl.acoustic_events(pressed)
    frame = events.to_pandas()
    assert isinstance(frame, pandas.DataFrame)
    assert len(frame) == len(events)
    assert {"x", "y", "moment_xx", "moment_xy", "potency_yy", "kind", "plane", "other_plane"} <= set(frame)
    events.write_vtk(tmp_path / "events.vtu")
    mesh = pyvista.read(tmp_path / "events.vtu")
    assert mesh.n_cells == 2 * len(events)
    assert [KINDS[kind] for kind in mesh["kind"][::2]] == events.kind.tolist()
    attrs.evolve(events, moment=0 * events.moment, potency=np.nan * events.potency).write_vtk(tmp_path / "none.vtu")
    assert set(pyvista.read(tmp_path / "none.vtu")["kind"]) == {-1}  # unknown
    assert mesh["scalar_moment"][::2] == pytest.approx(events.scalar_moment)
    assert mesh["moment"][1::2][:, [0, 1, 3]] == pytest.approx(events.moment)
    assert mesh.points.reshape(-1, 2, 2, 3)[..., :2] == pytest.approx(events.plane_lines, abs=1e-9)
    assert "moment: N m" in mesh.field_data["units"]
    assert mesh.field_data["kinds"][0] == "opening, shear, closing"
    for file, of in ((tmp_path / "events.csv", events), (tmp_path / "no.vtu", clustered(cracks_of(0), 1, 1))):
        with pytest.raises(gl.ParameterError, match=r"a name that ends in \.vtu, of at least one event"):
            of.write_vtk(file)


@attrs.frozen(kw_only=True)
class Pull(gl.LoadingProtocol):
    """Both ends of a plate are pulled by a stress that rises in 20 us and stays."""

    stress: float = gl.parameter("Pa")

    def stages(self, specimen):
        ends = [gl.loads.Traction(boundary=name, stress=(0, self.stress, 0), ramp=20e-6) for name in ("top", "bottom")]
        undamped = gl.integration.CentralDifference(damping=gl.integration.Undamped())
        until = [gl.conditions.Reaches("time", 60e-6)]
        return [gl.Stage(name="pull", loads=ends, until=until, interval=0.1e-6, integrator=undamped)]

    def measure(self, state):
        return {}

    def summary(self, curves, specimen):
        return {}


@pytest.mark.thorough
def test_a_crack_that_runs_through_a_solid_is_one_of_opening_and_slower_than_rayleigh_waves():
    """Along a seam in tied cells, from a slit; no bond or spring but those of the seam."""
    grains = Bricks(rows=40, columns=80).tessellate(rectangle(80 * mm, 40 * mm))
    pairs = np.stack([grains.edges.start, grains.edges.end], axis=1)
    x, y = grains.vertices[pairs].transpose(2, 0, 1)
    on = (abs(y - 20 * mm) < 1e-9).all(axis=1)
    slit = on & (x.max(axis=1) < 20.1 * mm)
    grains = attrs.evolve(grains, joints={"slit": pairs[slit], "seam": pairs[on & ~slit]})
    specimen = gl.Specimen(grains, ROCK, tied=["between"], slits=["slit"])
    seam = MohrCoulomb(kn=5e15, ks=5e15, tensile_strength=20e6, cohesion=80e6, friction_angle=30)
    result = gl.simulate(specimen, seam, Pull(stress=2e6), detection=None, frames=2, progress=False)
    cracks, events = result.cracks, gl.acoustic_events(result)
    assert len(cracks) == 2 * 60
    assert set(events.kind) == {"opening"}
    assert events.tensile_angle == pytest.approx(90, abs=0.1)
    ratio = ROCK.poissons_ratio
    lame = ratio / (1 - ratio)  # of xx to yy
    assert events.moment[:, 0] / events.moment[:, 1] == pytest.approx(lame, rel=1e-3)
    assert np.abs(np.sin(events.planes)).max() < 0.01
    opened = float(np.sum(cracks.source_opening * cracks.length))
    assert events.potency[:, 1].sum() == pytest.approx(opened, rel=1e-9)
    shear_speed = np.sqrt(ROCK.youngs_modulus / (2 * (1 + ratio)) / ROCK.density)
    rayleigh = shear_speed * (0.862 + 1.14 * ratio) / (1 + ratio)  # Viktorov 1967
    running = (cracks.position[:, 0] > 30 * mm) & (cracks.position[:, 0] < 70 * mm)
    speed = np.polyfit(cracks.time[running], cracks.position[running, 0], 1)[0]
    assert 0.7 * rayleigh < speed < rayleigh
