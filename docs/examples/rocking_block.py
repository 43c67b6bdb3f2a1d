"""A block of 1 x 2 m that rocks from corner to corner, let go at half the angle at which it would tip over.

    python docs/examples/rocking_block.py [--quick] [--out FOLDER]

Housner (1963, doi:10.1785/BSSA0530020403): a slender block that turns about its corner passes the upright after the
quarter period acosh(1 / (1 - start / alpha)) / p, with p = sqrt(3 g / (4 R)); an impact without rebound takes
1 - (1 - 1.5 sin(alpha)^2)^2 of its energy. Next to him the same block without his small angles. Contacts land on a
whole face and lose less than his impact on a corner. Writes rocking_block.png, and files for ParaView to
rocking_block/.
"""

import numpy as np
from matplotlib.figure import Figure
from moments import command_line, draw, frame_at
from scipy.integrate import solve_ivp

import grainlaw as gl
from grainlaw.geometry import block, moved, together
from grainlaw.laws import Friction
from grainlaw.protocols import FreeMotion

WIDTH, HEIGHT, GRAVITY = 1.0, 2.0, 9.81
ALPHA = np.arctan(WIDTH / HEIGHT)  # rad, critical
START = ALPHA / 2
P = np.sqrt(3 * GRAVITY / (2 * np.hypot(WIDTH, HEIGHT)))  # 1/s
HOUSNER = np.arccosh(1 / (1 - START / ALPHA)) / P  # s
DAMPING = (0.0, 0.2, 1.0)  # of critical
INTERVAL = 2e-3  # s, between samples


def run(duration, damping, stiffness=1e11):
    """Result of the block let go at START, and its angle (rad) at every sample."""
    floor = block([(-3, -0.5), (4, -0.5), (4, 0), (-3, 0)], "floor")
    upright = block([(-WIDTH, 0), (0, 0), (0, HEIGHT), (-WIDTH, HEIGHT)])
    specimen = gl.Specimen(together(floor, moved(upright, turn=-np.degrees(START))), gl.Rigid(density=2600))
    law = Friction(kn=stiffness, ks=stiffness, friction_angle=60)
    motion = FreeMotion(duration=duration, fixed=[0], tracked=[1], samples=round(duration / INTERVAL))
    result = gl.simulate(specimen, law, motion, detection=gl.Detection(damping=damping))
    return result, START - result.curves["rotation_1"]


def passages(time, angle):
    """Times (s) at which the block passes the upright."""
    at = np.flatnonzero(np.diff(np.sign(angle)))
    return time[at] + angle[at] / (angle[at] - angle[at + 1]) * (time[at + 1] - time[at])


def theory(times, restitution):
    """Angle (rad) of a block on a rigid floor, and when (s) it lands; ``restitution`` of its turning is left then."""

    def motion(t, y):
        return y[1], -(P**2) * np.sign(y[0]) * np.sin(ALPHA - abs(y[0]))

    def upright(t, y):
        return y[0]

    upright.terminal = True
    begin, state, angle, impacts = 0.0, [START, 0.0], np.zeros(len(times)), []
    while begin < times[-1] and (abs(state[1]) > 1e-3 or begin == 0):
        run = solve_ivp(motion, (begin, times[-1] + 1), state, events=upright, rtol=1e-9, atol=1e-12, dense_output=True)
        end = run.t[-1]
        mine = (times >= begin) & (times <= end)
        angle[mine] = run.sol(times[mine])[0] if mine.any() else 0.0
        speed = restitution * run.y[1, -1]
        begin, state = end, [np.sign(speed) * 1e-9, speed]
        impacts.append(end)
    return angle, impacts


def main():
    options = command_line(__doc__)
    duration = 1.5 if options.quick else 6.0
    restitution = 1 - 1.5 * np.sin(ALPHA) ** 2
    times = np.linspace(0, duration, 1200)
    exact, impacts = theory(times, restitution)
    print(f"quarter period: Housner {HOUSNER:.5f} s, large angles {impacts[0]:.5f} s")
    figure = Figure(figsize=(9, 7), layout="constrained")
    grid = figure.add_gridspec(2, 4, height_ratios=[2, 1.2])
    axes = figure.add_subplot(grid[0, :])
    axes.plot(times, np.degrees(exact), "k--", lw=1, label=f"theory, no rebound, speed times {restitution:.2f}")
    for damping in DAMPING:
        result, angle = run(duration, damping)
        time = result.curves["time"]
        through = passages(time, angle)
        back = np.degrees(-angle[time < through[1]].min()) if len(through) > 1 else np.nan
        print(
            f"damping {damping:3.1f}: quarter period {through[0]:.5f} s, angle after the first impact {back:.3f} of "
            f"{np.degrees(START):.3f} degrees, energy error {result.summary['energy_error']:.1e}"
        )
        axes.plot(time, np.degrees(angle), lw=1.3, label=f"damping {damping:g} of critical")
    axes.set(xlabel="time (s)", ylabel="angle (degrees)", xlim=(0, duration))
    axes.grid(alpha=0.25)
    axes.legend(frameon=False, loc="upper right", fontsize=8)
    for k, time in enumerate(np.linspace(0, 3 * HOUSNER, 4)):
        axes, frame = figure.add_subplot(grid[1, k]), frame_at(result, time)
        draw(axes, result, frame, ["0.85", "#e8b04a"])
        axes.set(xlim=(-2, 1.2), ylim=(-0.6, 2.5), title=f"{frame.time:.2f} s")
    figure.savefig(options.out / "rocking_block.png", dpi=100)
    result.write_vtk(options.out / "rocking_block")


if __name__ == "__main__":
    main()
