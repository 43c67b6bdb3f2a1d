"""Contacts of edges without a bond in plain Python, by docs/theory.md alone: for the reference step.

Places are complex numbers x + iy. Edge ``a`` runs from the start of grain A's edge, edge ``b`` the other way round B,
so that both point in about the same direction; ``w`` leads from the start of a to the start of b.
"""

import itertools
import math

from reference_plane import cross, dot

LITTLE = 1e-200  #: step into the complex plane: derivatives without a difference


class Touching:
    """All pairs of edges on the rims of grains; of a law with a linear closure that, with dashpots, does not dilate.

    (With both the engine looks for a pressure, to a millionth.)
    """

    def __init__(self, of, law, memory, detection):
        self.of, self.law, self.virgin, self.detection = of, law, list(memory), detection
        grain, grains = of.mesh.node_grain.tolist(), of.specimen.grains
        edges = sorted({tuple(edge) for edges in of.mesh.boundary_edges.values() for edge in edges.tolist()})
        self.met = set()  #: pairs that have ever touched
        self.skin = detection.skin * grains.grain_size
        rings = [
            [complex(*grains.vertices[k]) for k in grains.corners[first:last]]
            for first, last in itertools.pairwise(grains.first.tolist())
        ]
        self.largest = [min(detection.largest_overlap * width(ring), self.skin) for ring in rings]
        self.cotangent = [0.0] * len(of.x0)
        before, after = {j: i for i, j in edges}, dict(edges)
        for k in before:
            back, on = of.x0[before[k]] - of.x0[k], of.x0[after[k]] - of.x0[k]
            self.cotangent[k] = dot(back, on) / cross(on, back) if dot(back, on) > 0 else 0.0  # of an acute angle
        self.pairs = [
            Pair(self, a, b) for a, b in itertools.combinations(edges, 2) if grain[a[0]] != grain[b[0]]
        ]  # fmt: skip

    def add(self, f):
        for pair in self.pairs:
            pair.add(f)


class Pair:
    def __init__(self, touching, a, b):
        (self.i, self.j), (self.k, self.m) = a, b
        self.all, self.of = touching, touching.of
        grain = self.of.mesh.node_grain.tolist()
        self.largest = min(touching.largest[grain[a[0]]], touching.largest[grain[b[0]]])
        self.cotangents = {end: touching.cotangent[end] for end in (*a, *b)}
        self.waits, self.closed, self.offset = True, False, 0.0
        self.reset()

    @property
    def dashpot(self):
        one, other = self.of.behind((self.i, self.j)), self.of.behind((self.k, self.m))
        return 2 * self.all.detection.damping * math.sqrt(one * other / (one + other))

    def reset(self, lift=0.0):
        self.memory, self.slip, self.shear, self.length, self.used = list(self.all.virgin), 0.0, 0.0, 0.0, 0.0
        if lift > 0:
            self.memory[self.names.index("dilation")] = lift

    @property
    def names(self):
        return self.of.names

    @property
    def lift(self):
        return self.memory[self.names.index("dilation")] if "dilation" in self.names else 0.0

    def edges(self, at):
        return at(self.j) - at(self.i), at(self.k) - at(self.m), at(self.m) - at(self.i)

    def add(self, f):
        a, b, w = self.edges(self.of.at)
        apart = in_front(a, b, w)
        beside = not apart and is_beside(a, b, w, self.all.skin)
        facing = not apart and not beside
        held = not self.waits and (self.offset != 0 or self.lift > 0)
        found = Overlap(self, a, b, w)  # lifted faces touch while their edges are still apart
        if found.some and (self.closed or (not self.waits and not beside and (held or facing))):
            self.closed = True
            self.all.met.add(self)
            return self.push(f, a, b, w, found)
        lift = offset = 0.0
        if self.closed or (held and not beside):
            reach = self.offset - self.lift - self.largest
            lift = self.lift if depth(a, b, shifted(a, b, w, reach)) > 0 else 0.0
            offset = max(min(self.offset, depth(a, b, w)), 0.0)
        elif self.waits and facing and found.some:
            offset = depth(a, b, w)
        self.waits = beside and not self.closed
        self.closed, self.offset = False, offset
        self.reset(lift)

    def push(self, f, a, b, w, found):
        """Law, dashpot and forces of a closed contact, Eqs. (14) to (16)."""
        law, n, t, length, overlap = self.all.law, found.n, 1j * found.n, found.length, found.overlap
        da, db, dw = self.edges(self.of.gone)
        at_a, at_b = found.x, found.x - w
        way = dw + carried(at_b, b, db) - carried(at_a, a, da)  # of B relative to A where the force acts
        fresh = max(1 - self.length / length, 0.0)  # of the length has just come into contact
        self.slip += dot(way, t) - fresh * self.shear / law.ks
        spring, lift = -law.kn * overlap * length, self.lift
        push, opening = spring, lift - overlap
        if self.dashpot:
            opened = dot(way, n) - (lift - self.used if self.length > 0 else 0.0)
            push += min(self.dashpot * math.sqrt(law.kn * length) * opened / self.of.dt, -spring)
            opening = lift - push / spring * overlap
        normal, self.shear, *self.memory = law.traction(opening, self.slip, *self.memory)
        if not self.dashpot:
            spring = push = min(normal, 0.0) * length
        self.length, self.used = length, lift
        force = push * n + self.shear * length * t  # on A
        more = -spring * found.moment
        for edge, start, end, arm, pull, turn in (
            (a, self.i, self.j, at_a, force, more), (b, self.m, self.k, at_b, -force, -more),
        ):  # fmt: skip
            share = dot(arm, edge) / abs(edge) ** 2
            couple = (cross(arm, pull) + turn - cross(edge, share * pull)) / abs(edge) ** 2 * 1j * edge
            f[start] += (1 - share) * pull - couple
            f[end] += share * pull + couple


class Overlap:
    """Eq. (13) and its derivatives, after b is moved along the mean normal by offset less lift."""

    def __init__(self, pair, a, b, w):
        shift = pair.offset - pair.lift
        u, e, g = shifted(a, b, w, shift), a / abs(a), b / abs(b)
        t = mean(a, b)
        self.some = False
        starts, ends = (0.0, dot(u, t)), (dot(a, t), dot(u + b, t))
        if max(starts) >= min(ends):
            return
        corners = [0j if starts[1] <= starts[0] else u, a if ends[0] <= ends[1] else u + b]
        of_a = [starts[1] <= starts[0], ends[0] <= ends[1]]
        depths = [-cross(g, x - u) if mine else cross(e, x) for x, mine in zip(corners, of_a, strict=True)]
        if max(depths) <= 0:
            return
        # By the displacement of B at each end: its depth, and its place along a and along b.
        slopes = [(1j * g, 0j, -g) if mine else (1j * e, e, 0j) for mine in of_a]
        crossed = [d < 0 for d in depths]
        if any(crossed):
            at = crossed.index(True)
            depths[at], corners[at] = 0.0, cross(u, g) / cross(e, g) * e
            slopes[at] = (0j, -1j * g / cross(e, g), -1j * e / cross(e, g))
        cut = [0.0, 0.0]
        if of_a[0] != of_a[1] and not any(crossed):
            own = (pair.i, pair.k) if of_a[0] else (pair.m, pair.j)
            cut = [pair.cotangents[k] for k in (own if of_a[0] else own[::-1])]
        along = [dot(corners[1] - corners[0], way) for way in (e, g)]
        d1, d2 = depths
        runs = [run - c * 2 * d1 * d2 / (d1 + d2) for run, c in zip(along, cut, strict=True)]
        self.some = min(runs) > 0
        if not self.some:
            return
        by = [slope(lambda *x: energy(*x, *cut), (d1, d2, *along), k) for k in range(4)]
        pulls = [
            by[end] * slopes[end][0] + (-1, 1)[end] * (by[2] * slopes[end][1] + by[3] * slopes[end][2])
            for end in (0, 1)
        ]  # fmt: skip
        whole = sum(pulls)
        self.n = -whole / abs(whole)
        square, squares = runs[0] * runs[1], (d1 * d1 + d1 * d2 + d2 * d2) / 3
        self.overlap = (d1 + d2) / 2 * math.sqrt(square / (square + squares))
        self.length = abs(whole) / self.overlap
        share = dot(pulls[1], self.n) / dot(whole, self.n)
        middles = [  # between the edges
            x + (0.5j * g if mine else -0.5j * e) * d for x, mine, d in zip(corners, of_a, depths, strict=True)
        ]  # fmt: skip
        x = (1 - share) * middles[0] + share * middles[1]
        self.moment = sum(cross(corner - x, pull) for corner, pull in zip(corners, pulls, strict=True)) / abs(whole)
        self.x = x - shift / 2 * -1j * t


def energy(d1, d2, along_a, along_b, cut_a, cut_b):
    """Eq. (13) for kn = 1."""
    both = 2 * d1 * d2 / (d1 + d2)
    square, squares = (along_a - cut_a * both) * (along_b - cut_b * both), (d1 * d1 + d1 * d2 + d2 * d2) / 3
    return square**1.5 * squares / (square + squares) / 2


def slope(function, at, k):
    """The derivative by the k-th number, exact to rounding."""
    return function(*(complex(x, LITTLE) if k == n else x for n, x in enumerate(at))).imag / LITTLE


def mean(a, b):
    t = a / abs(a) + b / abs(b)
    return t / abs(t) if t else 1 + 0j


def shifted(a, b, w, by):
    return w - by * 1j * mean(a, b)


def carried(x, edge, increment):
    """The displacement of a point x, seen from the start of an edge, that goes with the edge."""
    share = dot(x, edge) / abs(edge) ** 2
    return share * increment + cross(edge, increment) / abs(edge) ** 2 * 1j * (x - share * edge)


def behind(a, b, w):
    """Depths of the corners of b behind the line of a, and of those of a behind that of b (m)."""
    e, g = a / abs(a), b / abs(b)
    return (cross(e, w), cross(e, w + b)), (cross(g, w), cross(g, w - a))


def in_front(a, b, w):
    return any(max(depths) <= 0 for depths in behind(a, b, w))


def is_beside(a, b, w, skin):
    """Whether outward normals are less than 78 degrees apart, or the edges are the two sides of one corner."""
    both = behind(a, b, w)
    corner = all(min(depths) >= -2 * skin and max(depths) > skin for depths in both)
    return -dot(a, b) > 0.2 * abs(a) * abs(b) or corner


def depth(a, b, w):
    """How deep two edges overlap, across their mean tangent."""
    t = mean(a, b)
    starts, ends = (0.0, dot(w, t)), (dot(a, t), dot(w + b, t))
    if max(starts) >= min(ends):
        return 0.0

    def across(s):
        on_a, on_b = a * s / dot(a, t), w + b * (s - dot(w, t)) / dot(b, t)
        return cross(t, on_b - on_a)

    return max(across(max(starts)), across(min(ends)), 0.0)


def width(ring):
    """Of a convex polygon: the least distance of two parallel lines round it."""
    sides = list(zip(ring, ring[1:] + ring[:1], strict=True))
    return min(max(abs(cross(q - p, x - p)) for x in ring) / abs(q - p) for p, q in sides)
