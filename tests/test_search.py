"""The search of neighbours against all pairs; the same bits however it runs."""

import tracemalloc
from types import SimpleNamespace

import numpy as np
import pytest
from bodies import FACES, GRAVITY, RIGID, SOFT, Motion, box, each, thrown, together, turned
from hypothesis import given, settings
from hypothesis import strategies as st
from support import ROCK, STRONG, advance, impose, state_of

import grainlaw as gl
from grainlaw.compiler.entry import compiled
from grainlaw.engine.contacts import contact_exchange as exchange
from grainlaw.engine.contacts import contact_geometry, contact_neighbours, contact_passes, contact_rows, overlap
from grainlaw.engine.contacts import contact_search as search
from grainlaw.engine.contacts.contact_rows import BLOCK, rows_of
from grainlaw.engine.contacts.contact_table import APART, CLOSED, HELD, WAITING
from grainlaw.engine.contacts.contacts import Contacts
from grainlaw.geometry import Voronoi, block, rectangle
from grainlaw.laws import Friction, MohrCoulomb
from grainlaw.protocols import UniaxialCompression

TURN = 0.15  #: rad that an edge may turn by


def distance(p, q):
    """m between two segments (2, 2), 0 where they cross: sampled densely, then refined."""

    def to_segment(point, line):
        way = line[1] - line[0]
        share = np.clip((point - line[0]) @ way / (way @ way), 0, 1)
        return np.hypot(*(line[0] + share * way - point))

    def side(line, point):
        (ax, ay), (bx, by) = line[1] - line[0], point - line[0]
        return ax * by - ay * bx

    if side(p, q[0]) * side(p, q[1]) < 0 and side(q, p[0]) * side(q, p[1]) < 0:
        return 0.0
    return min(*(to_segment(x, q) for x in p), *(to_segment(x, p) for x in q))


def corner(p, q, reach):
    """Whether two edges are the sides of a corner: each runs from about the other's line to far behind it.

    They stay so while their ends move, and their lines turn about them.
    """
    way = reach + 2 * TURN * (np.hypot(*(p[1] - p[0])) + np.hypot(*(q[1] - q[0])))
    heights = [cross(one[1] - one[0], point - one[0]) / np.hypot(*(one[1] - one[0])) for one, other in ((p, q), (q, p))
               for point in other]  # fmt: skip
    return all(min(pair) >= way - 2 * reach and max(pair) > reach + way for pair in (heights[:2], heights[2:]))


def cross(a, b):
    return a[0] * b[1] - a[1] * b[0]


def deep(p, q, reach):
    """Whether each of two edges is behind the other's line, and they may overlap, seen along their mean, soon."""
    ways = p[1] - p[0], q[0] - q[1]
    lengths = [np.hypot(*way) for way in ways]
    mean = sum(way / length for way, length in zip(ways, lengths, strict=True))
    mean = mean / np.hypot(*mean)
    along = [np.sort(edge @ mean) for edge in (p, q)]
    overlap = min(along[0][1], along[1][1]) - max(along[0][0], along[1][0])
    behind = [max(cross(one[1] - one[0], x - one[0]) for x in other) > 0 for one, other in ((p, q), (q, p))]
    return all(behind) and overlap > -reach - 2 * TURN * sum(lengths) and distance(p, q) < 3 * reach


def brute_force(edges, grain, reach):
    """Pairs of edges (e, 2, 2) that are near and face each other, the lower grain first."""
    found = set()
    for e, p in enumerate(edges):
        for f, q in enumerate(edges):
            a, b = p[1] - p[0], q[1] - q[0]
            angle = np.arccos(np.clip(a @ b / np.hypot(*a) / np.hypot(*b), -1, 1))
            facing = angle >= np.arccos(overlap.FACING) - 2 * TURN
            if grain[e] < grain[f] and facing and not corner(p, q, reach):
                found |= {(e, f)} if distance(p, q) < reach or deep(p, q, reach) else set()
    return found


def pairs_of(edges, grain, reach, cell):
    (x0, y0), (x1, y1) = np.ascontiguousarray(edges.transpose(1, 2, 0))
    turn = np.full(len(edges), TURN)
    found = compiled(search.near_pairs)(x0.copy(), y0.copy(), x1.copy(), y1.copy(), grain, turn, reach, cell)
    return {(int(e), int(f)) for e, f in found}


place = st.integers(-200, 200).map(lambda k: k / 16)


@pytest.mark.thorough
@settings(max_examples=150)
@given(
    st.lists(st.tuples(place, place, place, place).filter(lambda e: e[:2] != e[2:]), min_size=2, max_size=14),
    st.sampled_from([0.2, 1.1, 5.3]),
    st.sampled_from([0.7, 3.1, 40.3]),
)
def test_the_search_finds_what_all_pairs_say(rows, reach, cell):
    """Edges far longer than a cell, too, such as those of a floor."""
    edges = np.array(rows).reshape(-1, 2, 2)
    grain = np.arange(len(edges)) // 2
    slack = 1e-9
    found = pairs_of(edges, grain, reach, cell)
    assert brute_force(edges, grain, reach - slack) <= found <= brute_force(edges, grain, reach + slack)


@pytest.mark.parametrize("away", [10.0, 1e7])
def test_a_grain_that_flies_far_away_costs_no_memory(away):
    edges = np.array([[(0, 0), (1, 0)], [(1, 0.05), (0, 0.05)], [(away, away), (away + 1, away)]], dtype=float)
    pairs_of(edges, np.arange(3), 0.1, 0.5)
    tracemalloc.start()
    assert pairs_of(edges, np.arange(3), 0.1, 0.5) == {(0, 1)}
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 1e5


@pytest.mark.thorough
@pytest.mark.parametrize("x", [2.0**64, -(2.0**64)])
def test_an_edge_farther_away_than_cells_can_be_counted_is_in_few_of_them(x):
    edge = x, 0.0, x + 2.0**13, 1000.0
    left, right = search._columns(edge[0], edge[2], 0.1, 1.0)
    assert left == right
    low, high = search._rows(*edge, 0.1, 1.0, left)
    assert high - low <= 1002


def pile(detection=None, threads=1, material=RIGID):
    """Turned blocks that fall on each other and on a floor."""
    blocks = [turned(0.5, 0.5, 20 * k, (0.3 * (k % 3), 0.4 + 0.75 * k), f"block {k}") for k in range(6)]
    return Motion(
        together(box(4, 1, -2, -1, "floor"), *blocks), FACES, gravity=(0, -GRAVITY), fixed=[0], threads=threads,
        detection=detection, velocity=each((0, 0), *((0.3, -2, 1),) * 6), material=material,
    )  # fmt: skip


def bits(motion):
    state, arrays = motion.state, motion.state.contacts.arrays
    return [
        state.freedoms.arrays.displacement.copy(), state.freedoms.arrays.velocity.copy(), arrays.slip.copy(),
        arrays.memory.copy(), state.contacts.work, state.contacts.books.gone.copy(),
    ]  # fmt: skip


def same(first, second):
    return all(np.array_equal(a, b) for a, b in zip(first, second, strict=True))


@pytest.mark.parametrize("material", [RIGID, SOFT], ids=["rigid", "deformable"])
@pytest.mark.alone
def test_the_same_bits_for_any_number_of_threads(material):
    runs = [pile(threads=threads, material=material) for threads in (1, 2, 3)]
    for motion in runs:
        motion.steps(1500)
    first, *others = map(bits, runs)
    assert first[4].any()  # some blocks have met
    assert all(same(first, other) for other in others)


def test_the_same_bits_after_save_and_restore():
    motion = pile()
    motion.steps(700)
    saved, searches = motion.state.save(), motion.state.contacts.searches
    motion.steps(800)
    once = bits(motion)
    assert motion.state.contacts.searches > searches  # neighbours changed meanwhile
    motion.state.restore(saved)
    motion.steps(800)
    assert same(once, bits(motion))


def corner_on_face(detection=None):
    body = together(box(1, 1), turned(1, 1, 20, (1.8, 0.5)))
    return Motion(body, FACES, velocity=each((1, 0.2), (0, 0)), detection=detection)


SKIN = 0.1


@pytest.mark.thorough
@pytest.mark.parametrize("reach", [SKIN, 0.3 * SKIN, 0.02 * SKIN])
def test_what_the_search_leaves_out_stays_beside_or_in_front_until_the_next(reach):
    """Edges nearer than what they are searched for, whose ends then move by half of it."""
    random, left_out = np.random.default_rng(0), 0
    for _ in range(6000):
        angle, length = random.uniform(-np.pi, np.pi), random.uniform(3, 30) * SKIN
        along = length * np.array([np.cos(angle), np.sin(angle)])
        start = (random.uniform(0, 1), random.uniform(-SKIN, SKIN)) - random.choice([0, 1, random.uniform()]) * along
        ends = np.array([(0, 0), (1, 0), start, start + along])  # i, j of edge a, k, m of edge b
        if not search._near(
            *ends[::2].T, *ends[1::2].T, np.arcsin([reach, reach / length]).sum(), 0, 1, reach, SKIN, 2 * SKIN
        ):
            left_out += 1
            turn = random.uniform(-np.pi, np.pi, 4)
            i, j, k, m = ends + 0.5 * reach * np.column_stack([np.cos(turn), np.sin(turn)])
            if distance(ends[:2], ends[2:]) < SKIN:  # touching edges are nowhere deeper behind each other
                stands, depth = (check(*(j - i), *(k - m), *(m - i), *more) for check, more in (
                    (overlap.arrangement, (SKIN,)), (overlap.deepest, ())))  # fmt: skip
                assert stands != overlap.BEHIND or depth == 0
    assert left_out > 1500


def test_what_is_left_out_does_not_depend_on_the_direction_of_the_axes():
    random, found = np.random.default_rng(1), []
    for _ in range(400):
        a, b, c = random.uniform(-1, 1, (3, 2))
        b = -a * random.uniform(0.5, 2) + random.uniform(-0.3, 0.3, 2)  # nearly opposite, as the two sides of a corner
        turn, reach = random.uniform(0, 0.05), random.uniform(0, 0.1)
        answers = []
        for angle in (0.0, 0.5, 1.5, 2.5):
            turned = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
            answers.append(bool(search._stay_beside(*turned @ a, *turned @ b, *turned @ c, turn, reach, SKIN)))
        assert len(set(answers)) == 1
        found.append(answers[0])
    assert 20 < sum(found) < 380


def test_neighbours_are_searched_with_a_grid_once_and_again_only_after_a_way():
    """Few edges that become exposed meanwhile are searched by themselves."""
    motion = corner_on_face()
    near, still = motion.state.contacts._neighbours, np.zeros_like(motion.state.displacement.T)
    moved, chosen = np.zeros(2), np.arange(8, dtype=np.int32)
    near.forget()
    assert near._placed(still, chosen)
    assert np.array_equal(near._ends, np.vstack([near._origin[:, near._edges[:, k]] for k in range(2)]))
    assert near._search(still, moved, chosen)
    assert not near._search(still, moved, chosen)
    near.expose(chosen[:2])
    assert not near._search(still, moved, chosen)
    near.expose(np.zeros(contact_neighbours.FEW + 1))
    assert near._search(still, moved, chosen)
    assert near._search(still, moved + contact_neighbours.REACH * near._skin / 2, chosen)
    assert not near._search(still, moved + contact_neighbours.REACH * near._skin / 2.1, chosen)


def pair(i, j, k, m, table):
    """What becomes of a pair of edges i to j and k to m, as they stand now: state, offset, and length in contact."""
    place = np.array([i, j, k, m], dtype=float).T.copy()
    contact_passes.contact_step(table._replace(place=place), 1.0, 0)
    return int(table.state[0]), float(table.offset[0]), float(table.length[0])


@pytest.fixture
def waiting():
    """A table of one contact that was just found, of faces with friction; they live as long as the test."""
    state = state_of(gl.Specimen(together(box(1, 1), box(1, 1, 2)), RIGID), FACES, gl.Detection())
    table = state.contacts._empty(1)
    yield table._replace(  # noqa: PT022 - the state lives on
        laws=table.laws._replace(first=np.array([0]), last=np.array([1])),
        node=np.arange(4, dtype=np.int32)[:, None],
        state=np.array([WAITING], dtype=np.int8),
        largest_overlap=np.array([1.0]),
        increment=np.zeros((2, 4)),
        cotangent=np.zeros(4),
        skin=SKIN,
        rows=rows_of(1, len(table.memory)),
        chunk=np.zeros((1, BLOCK), dtype=np.int32),
        share=np.array([0, 1]),
    )


@pytest.mark.thorough
def test_a_side_turns_to_the_floor_about_a_corner_that_is_in_it(waiting):
    """It carries nothing before it leans over the floor; there is nothing to wait for then."""

    def turned_to(degrees):
        angle = np.radians(degrees)
        return pair((1, 0), (0, 0), (0.5 + np.cos(angle), np.sin(angle) - 0.01), (0.5, -0.01), waiting)

    assert turned_to(60) == turned_to(75) == (WAITING, 0, 0)
    assert turned_to(85) == (APART, 0, 0)
    state, offset, length = turned_to(91)
    assert (state, offset) == (CLOSED, 0)
    assert 0 < length < turned_to(120)[2]


@pytest.mark.thorough
def test_sides_of_a_corner_that_come_to_face_each_other_begin_without_a_force(waiting):
    def moved(depth):
        """Edge a comes from the left, b goes up and to the left from its end; ``depth`` of it lies behind a."""
        rise, run = depth, 0.3
        return pair((0, 0), (1, 0), (1, -0.01), (1 - run, rise - 0.01), waiting)

    assert moved(0.2) == (WAITING, 0, 0)
    state, offset, length = moved(0.08)
    assert (state, offset > 0.02, length) == (HELD, True, 0)
    assert moved(0.08)[2] == pytest.approx(0, abs=1e-12)  # of 1: processors round it in different ways
    assert moved(0.081)[2] > 1e-6


@pytest.mark.thorough
@pytest.mark.parametrize("make", [corner_on_face, pile])
def test_how_often_neighbours_are_searched_changes_no_bit(make, monkeypatch):
    seldom = make()
    seldom.steps(1500)
    monkeypatch.setattr(contact_neighbours, "SPENT", 0.0)  # a search after every step
    often = make()
    often.steps(1500)
    assert often.state.contacts.searches > 1000 > 3 * seldom.state.contacts.searches
    assert seldom.state.contacts.work.any()
    assert np.array_equal(often.state.freedoms.arrays.displacement, seldom.state.freedoms.arrays.displacement)
    assert np.array_equal(often.state.freedoms.arrays.velocity, seldom.state.freedoms.arrays.velocity)


@pytest.mark.thorough
@pytest.mark.parametrize("seed", [2, 5])
def test_how_often_all_neighbours_are_searched_changes_no_bit(seed):
    """Thrown at each other so that corners dig deep: edges meet that were farther than the skin behind each other."""
    runs = []
    for each_step in (False, True):
        specimen, velocity = thrown(seed, RIGID)
        state = state_of(specimen, Friction(kn=1e12, ks=6e11, friction_angle=30), gl.Detection())
        impose(state, [gl.loads.InitialVelocity(velocity=velocity)])
        for _ in range(1500):
            advance(state, 1, 1e-7)
            if each_step:
                state.contacts._neighbours.forget()
                state.search(state.displacement_at_forces())
        runs.append(state)
    assert runs[1].contacts.searches > 1500 > 10 * runs[0].contacts.searches
    assert np.array_equal(*(state.displacement for state in runs))


def crushed():
    """Bonds that are handed over, pieces that slide and meet, platens that start smoothly."""
    rock = gl.Specimen(Voronoi(grains=14, seed=1).tessellate(rectangle(6e-3, 15e-3)), ROCK)
    test = UniaxialCompression(
        loading=gl.Constant(speed=2, ramp=1e-5), maximum_strain=0.06, stop_fraction=0, samples=300
    )
    local = gl.integration.CentralDifference(damping=gl.integration.LocalDamping())  # pieces stay together
    result = gl.simulate(rock, MohrCoulomb(**STRONG), test, integrator=local)
    assert max(len(frame.contacts["opening"]) for frame in result.frames) > 5
    return result.curves


def agree(one, other):
    booked = ("energy_contacts_normal", "energy_contacts_shear", "energy_damping", "motion")
    for name, curve in one.items():
        if name in booked:  # sums over the table, and a ratio of such sums
            assert other[name] == pytest.approx(curve, rel=1e-9, abs=1e-12)
        else:
            assert np.array_equal(other[name], curve, equal_nan=True), name


@pytest.mark.alone
def test_a_sample_is_crushed_alike_to_the_last_digit_with_a_search_after_every_step(monkeypatch):
    seldom = crushed()
    monkeypatch.setattr(contact_neighbours, "SPENT", 0.0)
    agree(seldom, crushed())


@pytest.mark.thorough
def test_a_sample_is_crushed_alike_to_the_last_digit_with_a_whole_search_where_bonds_break(monkeypatch):
    beside, searched = [], []
    original = contact_neighbours.Neighbours.find_beside

    def watched(self, *given):
        beside.append(original(self, *given))
        return beside[-1]

    monkeypatch.setattr(contact_neighbours.Neighbours, "find_beside", watched)
    seldom = crushed()
    assert sum(found is not None for found in beside) > len(beside) / 2 > 2  # nearly all breaks are searched alone
    monkeypatch.setattr(contact_neighbours.Neighbours, "find_beside", lambda *_: searched.append(1))  # None
    agree(seldom, crushed())
    assert len(searched) > 5


def test_no_grain_moves_farther_than_pairs_were_found_for_until_the_next_search(monkeypatch):
    """However fast: what lies farther than the skin was not found, so none may come so near meanwhile."""
    found = []
    original = contact_neighbours.Neighbours.find

    def watched(self, *given):
        pairs = original(self, *given)
        moved = np.maximum.reduceat(np.hypot(*(given[0] - self.searched)), self._first[:-1])
        found.append((moved + self.way).max())
        return pairs

    monkeypatch.setattr(contact_neighbours.Neighbours, "find", watched)
    motion = corner_on_face(gl.Detection(skin=0.1))
    motion.steps(300)
    skin = motion.state.contacts._skin
    assert len(found) > 3
    assert max(found) <= contact_neighbours.REACH * skin * (1 + 1e-12)


def test_acute_corners_are_known_by_their_angles():
    """A triangle with angles of 30, 80 and 70 degrees, turned: the cotangents of its corners; 0 for right angles."""
    corners = np.array([(0, 0), (1, 0), (0.9397, 0.5425)])  # sin 70 / sin 80 of the base away, at 30 degrees
    turn = np.array([[np.cos(0.4), -np.sin(0.4)], [np.sin(0.4), np.cos(0.4)]])
    grains = together(block((corners @ turn.T + (0, 3)).tolist(), "triangle"), box(1, 1))
    table = state_of(gl.Specimen(grains, RIGID), FACES, gl.Detection()).contacts
    for node in np.unique(table.edges):
        cotangent = table._cotangents()[node]
        angle = corner_angle(table, node)
        assert cotangent == pytest.approx(1 / np.tan(angle) if angle < 1.57 else 0, abs=1e-9)


def corner_angle(table, node):
    place = table._origin.T
    before = next(edge[0] for edge in table.edges if edge[1] == node)
    after = next(edge[1] for edge in table.edges if edge[0] == node)
    one, other = place[before] - place[node], place[after] - place[node]
    return np.arccos(one @ other / np.linalg.norm(one) / np.linalg.norm(other))


@pytest.mark.parametrize(
    ("overlaps", "words"),
    [
        ([2, 5, 10], "grains 4 and 2 overlap by 0.005 m near (2, 7) m, more than the 0.004 m allowed (largest_overlap"),
        ([2, 3, 6], "an edge has passed through a grain; of what still touches grains 4 and 2 overlap by 0.003 m"),
    ],
)
def test_the_deepest_contact_is_that_with_the_largest_share_of_what_is_allowed(overlaps, words):
    """Of 10, 4 and 9 mm, at the start of its edge. An edge that has passed through no longer overlaps."""
    made = object.__new__(Contacts)
    made.detection = gl.Detection(largest_overlap=0.25)
    made.arrays = SimpleNamespace(
        overlap=np.array(overlaps) * 1e-3, largest_overlap=np.array([10e-3, 4e-3, 9e-3]),
        place=np.array([[0.0, 1.0, 2.0, 3.0], [5.0, 6.0, 7.0, 8.0]]), node=np.array([[0, 2, 1], [3, 0, 2]]),
    )  # fmt: skip
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Contacts, "grains", np.array([[0, 1], [4, 2], [5, 6]]), raising=False)
        said = made.deepest()
    assert said.startswith(words)
    assert "largest_overlap = 0.25 of" in said


@pytest.mark.parametrize(
    ("state", "stands", "becomes"),
    [
        (CLOSED, overlap.BESIDE, APART),
        (APART, overlap.BESIDE, WAITING),
        (WAITING, overlap.BESIDE, WAITING),
        (HELD, overlap.BESIDE, WAITING),
        (WAITING, overlap.BEHIND, APART),
    ],
)
def test_edges_beside_each_other_wait_unless_they_were_closed(state, stands, becomes):
    """Without an offset, a lift or an overlap."""
    row = np.zeros(60 * contact_rows.ROW)
    row[contact_rows.AX] = row[contact_rows.BX] = 1.0
    row[contact_rows.WY] = 0.5
    row[contact_rows.STATE], row[contact_rows.STANDS], row[contact_rows.TOUCH] = state, stands, contact_geometry.NOT
    assert contact_geometry.settle.py_func(row, 0) == (becomes, 0, 0)


def test_rows_of_a_chunk_are_copied_and_cleared_where_it_is_said():
    rows = np.arange(12.0)
    exchange.copy.py_func(rows, 2, 7, 3)
    assert rows.tolist() == [0, 1, 2, 3, 4, 5, 6, 2, 3, 4, 10, 11]
    exchange.clear.py_func(rows, 4, 3)
    assert rows.tolist() == [0, 1, 2, 3, 0, 0, 0, 2, 3, 4, 10, 11]
    place = np.zeros(5, dtype=np.int32)
    exchange.fill.py_func(np.array([9, 8, 7, 6]), 1, 2, place)
    assert place.tolist() == [8, 7, 7, 7, 7]  # filled up with the last
