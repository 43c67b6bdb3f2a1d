"""A step in plain Python loops, by docs/theory.md alone: the judge of every engine, slow and without numba.

A specimen of grains of any material, or of rigid ones, with bonds, contacts without a bond, pressures, fluids that
are given or pumped in, tractions, weight, and driven, held and quiet boundaries; what an engine does in its own order
and its own form is done here freedom by freedom.
"""

import math

import numpy as np
from reference_plane import cross, dot, parts
from reference_touch import Touching

import grainlaw as gl
from grainlaw.contact import memory_names
from grainlaw.material import material_arguments


class Reference:
    """Displacements and velocities of a specimen under constant loads, from rest or from given velocities."""

    def __init__(
        self, specimen, law, loads, integrator, time_step, memory, velocity=None, detection=None, temperature=20.0
    ):  # fmt: skip
        self.mesh, self.specimen, self.law, self.names = specimen.mesh, specimen, law, memory_names(law)
        self.loads, self.integrator, self.dt = loads, integrator, time_step
        count = len(self.mesh.nodes)
        self.x0 = [complex(*node) for node in self.mesh.nodes.tolist()]
        self.u = [0j] * count
        self.v = [0j] * count if velocity is None else [complex(*each) for each in velocity.tolist()]
        self.mass = [0.0] * count
        self.memory = {(c, p): list(memory) for c in range(len(self.mesh.interfaces)) for p in (0, 1)}
        self.tractions = {}
        asked = () if specimen.is_rigid else material_arguments(specimen.material, "stress")
        told = {"temperature": temperature, "ezz": 0.0}  # no strain across the plane
        self.told = [told[name] for name in asked if name in told]
        self.remembered = [[0.0] * (len(asked) - len(self.told))] * len(self.mesh.zones)
        for z, corners in enumerate(self.mesh.zones.tolist()):
            for i in corners:
                self.mass[i] += specimen.material.density * self.area(z) / 3
        self.before = [self.weight(i) for i in range(count)]  # a change of the weight is no vibration
        self.platens = [Platen(self, hold) for kind in (gl.loads.Hold, gl.loads.BarEnd) for hold in self.of(kind)]
        self.came = [0j] * count  #: the last increments of the displacements
        self.touching = Touching(self, law, memory, detection) if detection else None
        self.wet, self.full = {}, {}
        for pumped in self.of(gl.loads.Injection):
            self.pressure, self.pumped, self.room = pumped.pressure, pumped, pumped.volume
            self.content = self.room * (1 + self.pressure / pumped.bulk_modulus)
        self.soak()

    def area(self, z):
        a, b, c = (self.x0[i] for i in self.mesh.zones[z].tolist())
        return cross(b - a, c - a) / 2

    def weight(self, i):
        return sum((self.mass[i] * complex(*g.acceleration) for g in self.of(gl.loads.Gravity)), 0j)

    def of(self, kind):
        return [load for load in self.loads if isinstance(load, kind)]

    # --- forces, as complex numbers x + iy -------------------------------------------------------------------------

    def forces(self):
        f = [0j] * len(self.u)
        for z in range(len(self.mesh.zones)):
            self.add_zone(z, f)
        for c in range(len(self.mesh.interfaces)):
            self.add_bond(c, f)
        if self.touching:
            self.touching.add(f)
        self.add_fluids(f)
        for load in self.of(gl.loads.Pressure):
            for i, j in self.mesh.boundary_edges[load.boundary].tolist():
                now = self.x0[j] + self.u[j] - self.x0[i] - self.u[i]
                for node in (i, j):
                    f[node] += load.pressure * 1j * now / 2  # towards the grain, on its left
        for load in self.of(gl.loads.Traction):
            xx, yy, xy = load.stress
            for i, j in self.mesh.boundary_edges[load.boundary].tolist():
                out = -1j * (self.x0[j] + self.u[j] - self.x0[i] - self.u[i])
                for node in (i, j):
                    f[node] += complex(xx * out.real + xy * out.imag, xy * out.real + yy * out.imag) / 2
        return [force + self.weight(i) for i, force in enumerate(f)]

    def add_zone(self, z, f):
        """Eqs. (2) to (5): the gradient of the stored energy in a frame that turns with the zone."""
        corners, area, rock = self.mesh.zones[z].tolist(), self.area(z), self.specimen.material
        a, b, c = (self.x0[i] for i in corners)
        slopes = [1j * side / (2 * area) for side in (c - b, a - c, b - a)]  # gradients of the shape functions
        F = np.eye(2)
        for i, g in zip(corners, slopes, strict=True):
            F += np.outer([self.u[i].real, self.u[i].imag], [g.real, g.imag])
        angle = math.atan2(F[1, 0] - F[0, 1], F[0, 0] + F[1, 1])
        R = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
        strain = R.T @ F - np.eye(2)
        strain = (strain + strain.T) / 2
        if isinstance(rock, gl.Elastic):
            young, nu = rock.youngs_modulus, rock.poissons_ratio
            lame, shear = young * nu / ((1 + nu) * (1 - 2 * nu)), young / (2 * (1 + nu))
            stress = R @ (lame * np.trace(strain) * np.eye(2) + 2 * shear * strain)
        else:  # Eq. (21): the stress in the turned frame, with the turn that leaves the zone no moment
            exx, eyy, exy = strain[0, 0], strain[1, 1], strain[0, 1]
            xx, yy, xy, *memory = rock.stress(exx, eyy, exy, *self.told, *self.remembered[z])
            turn = (xy * (exx - eyy) - exy * (xx - yy)) / (2 + exx + eyy)
            self.remembered[z], stress = memory, R @ [[xx, xy + turn], [xy - turn, yy]]
        for i, g in zip(corners, slopes, strict=True):
            f[i] -= area * complex(*(stress @ [g.real, g.imag]))

    def add_bond(self, c, f):
        """Eqs. (6) to (8), with the couple."""
        a1, a2, b1, b2 = self.mesh.interfaces[c].tolist()
        edge = (self.at(a2) - self.at(a1) + self.at(b2) - self.at(b1)) / 2
        t = edge / abs(edge)
        n = -1j * t
        length = abs(self.x0[a2] - self.x0[a1])
        w = float(self.specimen.contact_points.weights(np.array([length]))[0])
        ends = self.u[b1] - self.u[a1], self.u[b2] - self.u[a2]
        moment, pulls = 0.0, []
        for p, (near, far) in enumerate((ends, ends[::-1])):
            gap = (1 - w) * near + w * far
            opening, slip = dot(gap, n), dot(gap, t)
            normal, along, *memory = self.law.traction(opening, slip, *self.memory[c, p])
            self.memory[c, p], self.tractions[c, p] = memory, (normal, along)
            pulls.append(length / 2 * (normal * n + along * t))
            moment += length / 2 * (normal * slip - along * opening)
        couple = moment * n / (2 * abs(edge))
        first, second = (1 - w) * pulls[0] + w * pulls[1], w * pulls[0] + (1 - w) * pulls[1]
        for node, force in ((a1, first - couple), (a2, second + couple), (b1, -first - couple), (b2, -second + couple)):
            f[node] += force

    def at(self, i):
        return self.x0[i] + self.u[i]

    def gone(self, i):
        return self.came[i]

    def behind(self, edge):
        """kg that a force on an edge accelerates directly."""
        return sum(self.mass[i] for i in edge)

    # --- fluids ------------------------------------------------------------------------------------------------------

    def soak(self):
        """Find the contact points that a fluid has reached: on its boundary, or through points that are broken."""
        self.wet = {}
        fluids = [*self.of(gl.loads.FluidPressure), *self.of(gl.loads.Injection)]
        damage = self.names.index("damage") if fluids else None
        for fluid in sorted(fluids, key=lambda fluid: fluid.pressure):
            corners, points, reached = set(self.mesh.boundaries[fluid.boundary].tolist()), set(), -1
            while reached < len(corners) + len(points):
                reached = len(corners) + len(points)
                for c, (a1, a2, b1, b2) in enumerate(self.mesh.interfaces.tolist()):
                    broken = [self.memory[c, p][damage] >= 1 for p in (0, 1)]
                    for p, corner in enumerate(({a1, b1}, {a2, b2})):
                        if (c, p) in points or corners & corner:
                            corners |= corner
                            points |= {(c, p)} if broken[p] else set()
                        if (c, 1 - p) in points and broken[p]:
                            points.add((c, p))
            self.wet |= dict.fromkeys(points, fluid.pressure if isinstance(fluid, gl.loads.FluidPressure) else None)
        for place in self.pumped_faces():
            if place not in self.full:  # as it was at the last forces, with the room of what it has opened
                now = [u - came for u, came in zip(self.u, self.came, strict=True)]
                self.full[place] = self.face(place, now)
                self.room += self.gap(place, now) / 2

    def pumped_faces(self):
        """First and second end, weight of the second, and part of the edge, of faces that an injection presses."""
        for (c, p), pressure in self.wet.items():
            if pressure is None:
                yield from ((*ends, 0.5) for ends in self.sides(c, p))
        for pumped in self.of(gl.loads.Injection):
            for i, j in [] if pumped.cracks_only else self.mesh.boundary_edges[pumped.boundary].tolist():
                yield i, j, 0.5, 1.0

    def sides(self, c, p):
        a1, a2, b1, b2 = self.mesh.interfaces[c].tolist()
        w = float(self.specimen.contact_points.weights(np.array([abs(self.x0[a2] - self.x0[a1])]))[0])
        return (a1, a2, w if p == 0 else 1 - w), (b2, b1, 1 - w if p == 0 else w)

    def face(self, place, u):
        """Normal towards the grain times the length, and the motion of where the pressure acts."""
        i, j, w2, share = place
        return share * 1j * (self.x0[j] + u[j] - self.x0[i] - u[i]), (1 - w2) * u[i] + w2 * u[j]

    def gap(self, place, u):
        """m2 that the crack of a face has opened, from the ends of its bond."""
        for c, p in self.wet:
            a1, a2, b1, b2 = self.mesh.interfaces[c].tolist()
            if place in [(*ends, 0.5) for ends in self.sides(c, p)]:
                edge = self.x0[a2] - self.x0[a1] + (u[a2] - u[a1] + u[b2] - u[b1]) / 2
                w = self.sides(c, p)[0][2]
                opening = dot((1 - w) * (u[b1] - u[a1]) + w * (u[b2] - u[a2]), -1j * edge / abs(edge))
                return max(opening, 0.0) * abs(self.x0[a2] - self.x0[a1]) / 2
        return 0.0

    def pump(self):
        """The pressure at which what is there fills the room that the faces have made, by the trapezoidal rule."""
        for pumped in self.of(gl.loads.Injection):
            self.content += pumped.rate * self.dt
            for place, (normal, moved) in self.full.items():
                now = self.face(place, self.u)
                self.room += dot((normal + now[0]) / 2, now[1] - moved)
                self.full[place] = now
            self.pressure = max(pumped.bulk_modulus * (self.content / self.room - 1), 0.0)

    def add_fluids(self, f):
        self.pump()
        for i, j, w2, share in self.full:
            force = share * self.pressure * 1j * (self.at(j) - self.at(i))
            f[i] += (1 - w2) * force
            f[j] += w2 * force
        for (c, p), pressure in self.wet.items():
            for first, second, w2 in self.sides(c, p) if pressure is not None else ():
                force = pressure / 2 * 1j * (self.at(second) - self.at(first))
                f[first] += (1 - w2) * force
                f[second] += w2 * force
        for fluid in self.of(gl.loads.FluidPressure):
            for i, j in [] if fluid.cracks_only else self.mesh.boundary_edges[fluid.boundary].tolist():
                for node in (i, j):
                    f[node] += fluid.pressure * 1j * (self.at(j) - self.at(i)) / 2

    # --- a step ----------------------------------------------------------------------------------------------------

    def step(self):
        f = self.forces()
        held = {
            (int(i), drive.axis): drive.speed
            for drive in self.of(gl.loads.Drive) for i in self.mesh.boundaries[drive.boundary]
        }  # fmt: skip
        held |= {(i, platen.hold.axis): math.nan for platen in self.platens for i in platen.nodes}
        self.absorb(f, held)
        for platen in self.platens:
            speed = platen.step(f)
            held |= {(i, platen.hold.axis): speed for i in platen.nodes}
        for i in range(len(self.u)):
            v = []
            rows = zip(*map(parts, (f[i], self.before[i], self.v[i])), strict=True)
            for axis, (force, before, speed) in enumerate(rows):
                moved, _ = self.integrator.step(force, force - before, speed, self.mass[i], self.dt)
                v.append(held.get((i, axis), moved))
            self.v[i] = complex(*v)
            self.came[i] = self.v[i] * self.dt
            self.u[i] += self.came[i]
        self.before = f

    def absorb(self, f, held):
        """Dashpots of quiet boundaries, on the mean of the velocities before and after the step."""
        dashpots, rock = {}, self.specimen.material
        for load in self.of(gl.loads.Quiet):
            young, nu, density = rock.youngs_modulus, rock.poissons_ratio, rock.density
            along = math.sqrt(density * young * (1 - nu) / ((1 + nu) * (1 - 2 * nu)))
            across = math.sqrt(density * young / (2 * (1 + nu)))
            for i, j in self.mesh.boundary_edges[load.boundary].tolist():
                way = self.x0[j] - self.x0[i]
                t = np.array(parts(way / abs(way)))
                n = np.array([t[1], -t[0]])
                for node in (i, j):
                    more = abs(way) / 2 * (along * np.outer(n, n) + across * np.outer(t, t))
                    dashpots[node] = dashpots.get(node, 0) + more
        for i, dashpot in dashpots.items():
            free = np.array([float((i, axis) not in held) for axis in (0, 1)])
            dashpot = dashpot * np.outer(free, free)
            half = self.dt / (2 * self.mass[i])
            mean = np.linalg.solve(np.eye(2) + half * dashpot, parts(self.v[i] + half * f[i]))
            f[i] -= complex(*(dashpot @ mean))


class Platen:
    """The nodes of a held boundary, which move as one body along an axis."""

    def __init__(self, of, hold):
        self.of, self.hold = of, hold
        self.nodes = of.mesh.boundaries[hold.boundary].tolist()
        self.length = sum(abs(of.x0[j] - of.x0[i]) for i, j in of.mesh.boundary_edges[hold.boundary].tolist())
        self.mass = sum(of.mass[i] for i in self.nodes)
        self.speed = sum(of.mass[i] * parts(of.v[i])[hold.axis] for i in self.nodes) / self.mass
        self.moved = self.before = 0.0

    def step(self, f):
        force = sum(parts(f[i])[self.hold.axis] for i in self.nodes)
        if isinstance(self.hold, gl.loads.BarEnd):
            width, half = self.hold.width or self.length, self.of.dt / (2 * self.mass)
            force += 2 * width * self.hold.stress
            dashpot = width * self.hold.impedance
            force -= dashpot * (self.speed + half * force) / (1 + half * dashpot)
        else:
            force += self.length * (self.hold.stress - self.hold.stiffness * self.moved)
        self.speed, _ = self.of.integrator.step(force, force - self.before, self.speed, self.mass, self.of.dt)
        self.moved, self.before = self.moved + self.of.dt * self.speed, force
        return self.speed


class RigidReference(Reference):
    """Grains that do not deform: two translations and a turn each, with the moments of the forces on their corners."""

    def __init__(self, specimen, law, loads, integrator, time_step, memory, velocity=None, **more):
        super().__init__(specimen, law, loads, integrator, time_step, memory, **more)
        self.grain = self.mesh.node_grain.tolist()
        grains = range(specimen.grains.count)
        self.middle = [complex(*centroid) for centroid in specimen.grains.centroids.tolist()]
        self.moved, self.turned = [0j for _ in grains], [0.0 for _ in grains]
        self.drift, self.spin = [0j for _ in grains], [0.0 for _ in grains]
        self.whole, self.inertia = [0.0 for _ in grains], [0.0 for _ in grains]
        for z, corners in enumerate(self.mesh.zones.tolist()):
            g, mass = self.grain[corners[0]], specimen.material.density * self.area(z)
            a, b, c = (self.x0[i] - self.middle[g] for i in corners)
            self.whole[g] += mass
            self.inertia[g] += mass / 6 * sum(dot(p, q) for p, q in ((a, a), (b, b), (c, c), (a, b), (b, c), (c, a)))
        for g in grains if velocity is not None else ():  # of a motion of nodes the mean, and the turn that fits best
            own = [i for i, of in enumerate(self.grain) if of == g]
            self.drift[g] = sum(complex(*velocity[i]) for i in own) / len(own)
            arms = [self.x0[i] - self.middle[g] for i in own]
            rest = [complex(*velocity[i]) - self.drift[g] for i in own]
            self.spin[g] = sum(map(cross, arms, rest)) / sum(abs(arm) ** 2 for arm in arms)
        self.pulled = [(self.heavy(g), 0.0) for g in grains]

    def heavy(self, g):
        return sum((self.whole[g] * complex(*each.acceleration) for each in self.of(gl.loads.Gravity)), 0j)

    def behind(self, edge):
        return self.whole[self.grain[edge[0]]]

    def weight(self, i):
        return 0j  # it acts on the whole grain

    def add_zone(self, z, f):
        """Nothing strains."""

    def step(self):
        f = self.forces()
        driven = {
            (self.grain[i], d.axis): d.speed for d in self.of(gl.loads.Drive) for i in self.mesh.boundaries[d.boundary]
        }
        held = {g for g, _ in driven}
        for g in range(len(self.middle)):
            own = [i for i, of in enumerate(self.grain) if of == g]
            force = sum((f[i] for i in own), self.heavy(g))
            moment = sum(cross(self.at(i) - self.middle[g] - self.moved[g], f[i]) for i in own)
            rows = zip(*map(parts, (force, self.pulled[g][0], self.drift[g])), strict=True)
            velocity = [
                driven.get((g, axis), self.integrator.step(now, now - before, speed, self.whole[g], self.dt)[0])
                for axis, (now, before, speed) in enumerate(rows)
            ]
            change = moment - self.pulled[g][1]
            spin, _ = self.integrator.step(moment, change, self.spin[g], self.inertia[g], self.dt)
            self.drift[g], self.spin[g] = complex(*velocity), 0.0 if g in held else spin
            self.moved[g] += self.drift[g] * self.dt
            self.turned[g] += self.spin[g] * self.dt
            self.pulled[g] = force, moment
            turn = complex(math.cos(self.turned[g]), math.sin(self.turned[g]))
            for i in own:
                was, self.u[i] = self.u[i], self.moved[g] + (turn - 1) * (self.x0[i] - self.middle[g])
                self.came[i] = self.u[i] - was
