"""Which ingredients make bonded grains a rock? python docs/examples/rock_study.py [--grains 1000] [--write]

A factorial design: cells inside of grains, grains that yield, friction of broken contacts, open cracks, minerals. Each
combination is pressed at 0, 10 and 40 MPa and pulled, on the same grains for each seed, with the bonds and the elastic
grains of Lac du Bonnet granite. Prints what each ingredient changes, with intervals over the seeds, and what it changes
in larger specimens, alone and, in whole grains, with the others. Keeps all in the folder rock-study, the larger ones in
rock-study-size and rock-study-large, the paces in rock-study-pace, and goes on where it was interrupted.
"""

import argparse
import itertools
import warnings
from pathlib import Path

import attrs
import numpy as np
from matplotlib.figure import Figure

import grainlaw as gl
from grainlaw.drawing.palette import color
from grainlaw.geometry import Breakable, Cracked, Minerals, Voronoi, VoronoiCells, rectangle
from grainlaw.laws import Friction
from grainlaw.materials import DruckerPrager
from grainlaw.protocols import BiaxialCompression, UniaxialTension
from grainlaw.results.means import spread
from grainlaw.units import MPa, mm, um

DOCS = Path(__file__).parents[1]
PAGE, SHORT = DOCS / "tables/rock.md", DOCS / "rock.md"
ROCK = gl.rocks["lac-du-bonnet-granite"]
GRAIN, SLENDER = 2.87 * mm, 2.5  #: size of a grain; height over width of a specimen
YIELD = {"cohesion": 120 * MPa, "friction_angle": 30}  #: of grains that yield: at 416 MPa without confinement
SHARES = {"feldspar": 0.6, "quartz": 0.3, "mica": 0.1}
GAP = 1 * um  #: of the open cracks
LOADS = {
    f"{pressure} MPa": BiaxialCompression(confinement=pressure * MPa, maximum_strain=0.02) for pressure in (0, 10, 40)
} | {"tension": UniaxialTension()}
FACTORS = {
    "cells": (1, 5),  #: in a grain, whose bonds are twice as strong as those between grains
    "grains": ("elastic", "plastic"),
    "residual": (5, 45),  #: deg, friction of a broken contact
    "cracks": (0.0, 0.1),  #: share of the length between grains that is open before the test
    "minerals": ("one", "three"),  #: mica is half as stiff, its bonds have half of the strength
}
PLAIN = {factor: levels[0] for factor, levels in FACTORS.items()}
LARGE = {"cells": (1,), "residual": (5, 30, 45)}  #: levels of the design with larger specimens, whole grains


class Drop(gl.Measure):
    name = "drop"
    meaning = "fall of the load after the first failure, before it is exceeded; the test ends at a half"
    unit = "%"
    needs = ["deviator"]  # noqa: RUF012 - as a user writes it

    def find(self, laboratory):
        curves, load = laboratory.result.curves, laboratory.result.curves["deviator"]
        after = load[int(np.argmax(curves["stress"] >= laboratory.result.summary["strength"])) :]
        higher = np.flatnonzero(after > after[0])
        return 1 - after[: higher[0] if len(higher) else None].min() / after[0]


MEASURES = [*gl.MEASURES.values(), Drop()]


def stronger(bond, factor):
    return attrs.evolve(bond, tensile_strength=factor * bond.tensile_strength, cohesion=factor * bond.cohesion)


def textured(grains, material, bond, minerals, cells):
    """Grains, their material and laws with three minerals, and cells in each grain, where they are asked for."""
    laws = {...: bond}
    if minerals:
        grains = Minerals(grains, SHARES, seed=grains.seed)
        material = {"mica": attrs.evolve(material, youngs_modulus=material.youngs_modulus / 2), ...: material}
        laws = {("mica", ...): stronger(bond, 0.5), **laws}
    if cells > 1:
        grains = Breakable(grains, VoronoiCells(count=cells), seed=grains.seed)
        laws = {"inside": stronger(bond, 2), **laws}
    return grains, material, laws


def case(cells, grains, residual, cracks, minerals, load, seed, count):
    bond, material = attrs.evolve(ROCK.law, residual_friction_angle=residual), ROCK.material
    if grains == "plastic":
        elastic = {name: getattr(material, name) for name in ("youngs_modulus", "poissons_ratio", "density")}
        material = DruckerPrager(**elastic, **YIELD)
    made, material, laws = textured(Voronoi(grains=count, seed=seed), material, bond, minerals == "three", cells)
    if cracks:
        made = Cracked(made, share=cracks, seed=seed)
        laws = {"initial cracks": Friction(kn=bond.kn, ks=bond.ks, friction_angle=30, gap=GAP), **laws}
    width = GRAIN * np.sqrt(count / SLENDER)
    return gl.Run(gl.Specimen(made.tessellate(rectangle(width, SLENDER * width)), material), laws, load)


def study(grains, seeds, **levels):
    """All combinations of the ingredients; some may have other levels."""
    factors = FACTORS | levels | {"load": LOADS, "seed": range(1, seeds + 1), "count": [grains]}
    return gl.Study(case, measures=MEASURES, **factors)


def size_study(sizes, seeds):
    """Even grains, and each ingredient alone, on specimens of several numbers of grains."""
    cases = [PLAIN, *(PLAIN | {factor: levels[-1]} for factor, levels in FACTORS.items())]
    return gl.Study(case, cases, measures=MEASURES, load=LOADS, seed=range(1, seeds + 1), count=sorted({*sizes}))


# --- what each ingredient changes -------------------------------------------------------------------------------------

GROWS = ("UCS", "tension", "40 MPa", "E")  #: compared by their ratio, all else by the difference
QUANTITIES = {  #: words, and the range of Lac du Bonnet granite (Potyondy and Cundall 2004), or of most rocks
    "UCS": ("UCS (MPa)", (178, 222)),
    "tension": ("tensile strength (MPa)", (8.0, 10.6)),
    "UCS/T": ("UCS/T", (17, 26)),
    "40 MPa": ("strength at 40 MPa (MPa)", None),
    "slope": ("slope of the envelope up to 10 MPa", (10, 13)),
    "curvature": ("slope from 10 to 40 MPa over it", None),
    "CI": ("CI/UCS, 1 % of the cracks", (0.42, 0.47)),
    "CI lateral": ("CI/UCS, lateral strain", (0.42, 0.47)),
    "CD": ("CD/UCS, area", (0.7, 0.85)),
    "CD cylinder": ("CD/UCS, cylinder", (0.7, 0.85)),
    "drop": ("fall after the first failure, 0 MPa", None),
    "drop 40": ("fall after the first failure, 40 MPa", None),
    "transgranular": ("transgranular share of the cracks", None),
    "E": ("E (GPa)", (63, 75)),
    "nu": ("Poisson's ratio", (0.22, 0.30)),
}


def quantities(table):
    """Of each combination and seed what its four tests say, by name; nan where a test did not find it."""
    found = {}
    for k, row in enumerate(table.rows):
        key = tuple(row[name] for name in (*FACTORS, "seed"))
        found.setdefault(key, {})[row["load"]] = k
    return {key: values(table, of) for key, of in found.items() if len(of) == len(LOADS)}


def values(table, of):
    """Of the rows ``of`` the four tests of a specimen. One that contracts until the peak has its CD there."""
    none, ten, forty, pull = (of[load] for load in LOADS)
    peak = {k: table["strength"][k] for k in of.values()}
    slope = (peak[ten] - peak[none]) / (10 * MPa)
    cracks = table["tensile_cracks"][none] + table["shear_cracks"][none]
    through = table["transgranular_cracks"][none] if "transgranular_cracks" in table.columns else np.nan
    return {
        "UCS": peak[none] / MPa, "tension": peak[pull] / MPa, "UCS/T": peak[none] / peak[pull],
        "40 MPa": peak[forty] / MPa, "slope": slope, "curvature": (peak[forty] - peak[ten]) / (30 * MPa) / slope,
        "CI": table["crack_initiation_count_ratio"][none], "CI lateral": table["crack_initiation_lateral_ratio"][none],
        "CD": at_most_one(table["crack_damage_ratio"][none]),
        "CD cylinder": at_most_one(table["crack_damage_cylinder_ratio"][none]),
        "drop": table["drop"][none], "drop 40": table["drop"][forty],
        "transgranular": through / cracks if cracks else np.nan,
        "E": table["tangent_modulus"][none] / 1e9, "nu": table["tangent_poisson"][none],
    }  # fmt: skip


def at_most_one(ratio):
    return 1.0 if np.isnan(ratio) else ratio


def by_seed(found, name, **levels):
    """Mean of a quantity over all combinations of these levels that have it, by seed; some of the logarithm."""
    seeds, each = {}, list(FACTORS)
    for key, of in found.items():
        if all(key[each.index(factor)] == level for factor, level in levels.items()) and not np.isnan(of[name]):
            seeds.setdefault(key[-1], []).append(np.log(of[name]) if name in GROWS else of[name])
    return {seed: np.mean(some) for seed, some in seeds.items()}


def effect(found, name, factor, low, high, **others):
    """Change of a quantity from one level of a factor to another: mean over the seeds, and half of its interval."""
    one, other = (by_seed(found, name, **{factor: level}, **others) for level in (low, high))
    return mean_and_half(np.array([other[seed] - one[seed] for seed in one if seed in other]))


def interaction(found, name, first, second):
    """By how much more the first factor changes a quantity at the last level of the second than at its first level."""
    (a, b), (c, d) = ((FACTORS[factor][0], FACTORS[factor][-1]) for factor in (first, second))
    corners = [by_seed(found, name, **{first: x, second: y}) for x, y in ((a, c), (b, c), (a, d), (b, d))]
    seeds = set.intersection(*map(set, corners))
    return mean_and_half(np.array([corners[3][s] - corners[2][s] - corners[1][s] + corners[0][s] for s in seeds]))


def mean_and_half(values):
    """Mean and half of its 95 % interval, which is nan for fewer than two."""
    of = spread(values)
    return of["mean"], (of["interval"][1] - of["interval"][0]) / 2


def at_levels(found, name, **levels):
    """The same of a quantity itself over the seeds, at some levels."""
    each = np.array(list(by_seed(found, name, **levels).values()))
    return mean_and_half(np.exp(each) if name in GROWS else each)


def words_at_levels(found, name, **levels):
    """The same as a mean and half of its interval; "-" where nothing has it."""
    mean, half = at_levels(found, name, **levels)
    text = "-" if np.isnan(mean) else f"{mean:.3g}"
    return text if np.isnan(half) else f"{text} ± {half:.2g}"


def shown(name, mean, half):
    """In bold where zero is outside of the interval."""
    if np.isnan(half):
        return "-"
    if name in GROWS:
        text = (
            f"{100 * np.expm1(mean):+.0f} % ({100 * np.expm1(mean - half):+.0f} to {100 * np.expm1(mean + half):+.0f})"
        )
    else:
        text = f"{mean:+.2f} ({mean - half:+.2f} to {mean + half:+.2f})"
    return f"**{text}**" if abs(mean) > half else text


def level(value):
    return value if isinstance(value, str) else f"{value:g}"


def words_of_change(factor, low, high):
    return f"{factor}: {level(low)} to {level(high)}"


def changes(found):
    """Pairs of levels of all factors, as they are in the rows."""
    for k, factor in enumerate(FACTORS):
        first, *others = dict.fromkeys(key[k] for key in found)
        yield from ((factor, first, other) for other in others)


def effects_table(found, cell=shown):
    """A row of cells for each quantity, unless all of them are empty."""
    pairs = list(changes(found))
    heads = ["", *(words_of_change(*pair) for pair in pairs), "laboratory"]
    rows = []
    for name, (words, known) in QUANTITIES.items():
        cells = [cell(name, *effect(found, name, *pair)) for pair in pairs]
        if any(cells):
            rows.append([words, *cells, f"{known[0]:g} to {known[1]:g}" if known else ""])
    return markdown(heads, rows)


def in_short(name, mean, half):
    """The mean alone; nothing where zero is not outside of the interval."""
    digits = 1 if abs(mean) < 0.1 else 2
    text = f"{100 * np.expm1(mean):+.0f} %" if name in GROWS else f"{mean:+.{digits}g}"
    return text if abs(mean) > half else ""


def interactions_table(found, names=("UCS", "slope", "CI", "CD cylinder", "drop 40")):
    """Those of which one quantity's interval is without zero."""
    rows = []
    for first, second in itertools.combinations(FACTORS, 2):
        cells = [shown(name, *interaction(found, name, first, second)) for name in names]
        if any(cell.startswith("**") for cell in cells):
            rows.append([f"{first} x {second}", *cells])
    return markdown(["", *(QUANTITIES[name][0] for name in names)], rows)


def large_table(
    *designs, names=("UCS", "tension", "40 MPa", "slope", "curvature", "CI", "CD cylinder", "drop", "drop 40", "E")
):
    """What each ingredient changes, over all combinations of the others, in a row for each number of grains."""
    of_size = {f"{each.rows[0]['count']:,}": quantities(each) for each in designs}
    *_, largest = of_size.values()
    pairs = list(changes(largest))
    rows = [
        [QUANTITIES[name][0], size, *(shown(name, *effect(found, name, *pair)) for pair in pairs)]
        for name, (size, found) in itertools.product(names, of_size.items())
    ]
    return markdown(["", "grains", *(words_of_change(*pair) for pair in pairs)], rows)


def size_table(table, names=("UCS", "tension", "40 MPa", "slope", "CI", "CD cylinder", "drop", "E")):
    """Even grains, and what each ingredient changes alone, in a row for each number of grains."""
    of_size = {size: quantities(table.where(count=size)) for size in table.levels("count")}
    rows = []
    for name, (size, found) in itertools.product(names, of_size.items()):
        rows.append([QUANTITIES[name][0], f"{size:,}", words_at_levels(found, name, **PLAIN)])
        for factor, levels in FACTORS.items():
            others = {other: usual for other, usual in PLAIN.items() if other != factor}
            rows[-1].append(shown(name, *effect(found, name, factor, levels[0], levels[-1], **others)))
    for size in of_size:
        even, *each = (seconds(table, size, PLAIN | more) for more in ({}, *({f: of[-1]} for f, of in FACTORS.items())))
        rows.append(
            ["CPU time of the four tests (s)", f"{size:,}", f"{even:.3g}", *(f"{t / even:.2g} times" for t in each)]
        )
    heads = [words_of_change(factor, levels[0], levels[-1]) for factor, levels in FACTORS.items()]
    return markdown(["", "grains", "even grains", *heads], rows)


def seconds(table, size, levels):
    """Of the tests of one specimen of this size with these levels, in the mean."""
    of = table.where(count=size, **levels)
    return sum(cost["cpu"] for cost in of.costs) / len(of.levels("seed"))


COMBINED = {  #: rows of their own
    "even grains": {},
    "cells": {"cells": 5},
    "cells, 45 deg": {"cells": 5, "residual": 45},
    "cells, plastic": {"cells": 5, "grains": "plastic"},
    "cells, open cracks, minerals": {"cells": 5, "cracks": 0.1, "minerals": "three"},
    "all": {"cells": 5, "grains": "plastic", "residual": 45, "cracks": 0.1, "minerals": "three"},
}


def combinations_table(found):
    columns = [[words_at_levels(found, name, **PLAIN | more) for name in QUANTITIES] for more in COMBINED.values()]
    rows = [[QUANTITIES[name][0], *cells] for name, *cells in zip(QUANTITIES, *columns, strict=True)]
    return markdown(["", *COMBINED], rows)


def markdown(heads, rows):
    return "\n".join(f"| {' | '.join(line)} |" for line in [heads, ["---"] * len(heads), *rows]) + "\n"


def draw_effects(found, file):
    """Means of each level over all other ingredients, with intervals over the seeds; the laboratory's range is grey."""
    names = [n for n in QUANTITIES if n not in ("tension", "CI lateral", "E")]
    figure = Figure(figsize=(13, 9), layout="constrained")
    for axes, name in zip(figure.subplots(3, 4).flat, names, strict=True):
        place, marks = 0.0, []
        for k, factor in enumerate(FACTORS):
            levels = list(dict.fromkeys(key[k] for key in found))
            for each in levels:
                mean, half = at_levels(found, name, **{factor: each})
                axes.errorbar(place, mean, 0 if np.isnan(half) else half, fmt="o", color=color(k), markersize=4)
                marks.append((place, f"{factor} {level(each)}"))
                place += 1
            place += 0.7
        if known := QUANTITIES[name][1]:
            axes.axhspan(*known, color="#dddddd", zorder=0)
        axes.set_title(QUANTITIES[name][0], fontsize=9)
        axes.set_xticks([at for at, _ in marks], [text for _, text in marks], rotation=70, fontsize=7)
        axes.tick_params(axis="y", labelsize=8)
    figure.savefig(file, dpi=110)


# --- how fast it is loaded --------------------------------------------------------------------------------------------

RATES = (20.0, 10.0, 5.0, 2.0, 1.0, 0.5)  #: 1/s of axial strain; published explicit codes: 9 to 17
PACES = {f"{rate:g} 1/s": rate for rate in RATES} | {"adaptive": 0.0}
DAMPINGS = {
    "ours": gl.integration.CentralDifference(),
    "local": gl.integration.CentralDifference(damping=gl.integration.LocalDamping(fraction=0.7), beside_loading=False),
}


def paced(cells, pace, damping, seed, count):
    """The same rock, with or without cells, under a constant speed from the first moment, or as slow as it must be."""
    run = case(cells, "elastic", 5, 0.0, "one", LOADS["0 MPa"], seed, count)
    low, high = run.specimen.grains.region.bounds
    loading = gl.Constant(speed=pace * (high[1] - low[1])) if pace else gl.Adaptive()
    test = BiaxialCompression(confinement=0, loading=loading, maximum_strain=0.01, integrator=damping)
    return attrs.evolve(run, protocol=test)


def pace_study(grains, seeds):
    factors = {"cells": FACTORS["cells"], "pace": PACES, "damping": DAMPINGS}
    return gl.Study(paced, measures=MEASURES, **factors, seed=range(1, seeds + 1), count=[grains])


def pace_table(table):
    """Means over the seeds; stresses over those of the same specimens under our adaptive loading and damping."""
    rows = []
    for cells, damping, pace in itertools.product(FACTORS["cells"], DAMPINGS, PACES):
        of, slow = paces(table, cells, damping, pace)
        ratios = [over(of[name] / slow[name]) for name in ("strength", "largest_stress")]
        words = [grains_of(cells), damping, pace, *ratios, *(about(reversals(of, laterals)) for laterals in (1, 2))]
        rows.append([*words, f"{np.mean(of['drop']):.2f}", f"{100 * np.mean(of['imbalance']):.2g} %"])
    heads = ["grains", "damping", "pace", "first failure", "largest stress"]
    heads += ["CD over it, area", "CD over it, cylinder", "fall after the first failure", "imbalance"]
    return markdown(heads, rows)


def short_pace_table(table, chosen=("10 1/s", "1 1/s", "adaptive")):
    """CD as of a cylinder over the largest stress, and that over the largest under slow loading."""
    each = list(itertools.product(DAMPINGS, FACTORS["cells"]))
    rows = []
    for pace in chosen:
        rows.append([pace])
        for damping, cells in each:
            of, slow = paces(table, cells, damping, pace)
            ratio = np.exp(np.log(of["largest_stress"] / slow["largest_stress"]).mean())
            rows[-1].append(f"{reversals(of, 2).mean():.2f}; {ratio:.2f}")
    return markdown(["pace", *(f"{grains_of(cells)}, {damping}" for damping, cells in each)], rows)


def paces(table, cells, damping, pace):
    """Rows of one pace, and those of the same specimens under our adaptive loading and damping."""
    of = table.where(cells=cells)
    return of.where(damping=damping, pace=pace), of.where(damping="ours", pace="adaptive")


def grains_of(cells):
    return "even" if cells == 1 else f"{cells} cells"


def reversals(table, laterals):
    return np.array([reversal(table.run(k).curves, laterals) for k in range(len(table))])


def reversal(curves, laterals):
    """Stress at which axial and so many times the lateral strain reverse on the way to the largest, over that."""
    stress, lateral = curves["stress"], curves["lateral_strain"]
    way = slice(0, int(np.argmax(stress)) + 1)
    volume = curves["volumetric_strain"] + (laterals - 1) * lateral
    return stress[int(np.argmin(volume[way]))] / stress[way][-1]


def over(ratios):
    """Geometric mean of ratios, and its interval."""
    of = spread(np.log(ratios))
    low, high = np.exp(of["interval"])
    return f"{np.exp(of['mean']):.2f}" + ("" if np.isnan(low) else f" ({low:.2f} to {high:.2f})")


def about(values):
    """Mean, and the range of the seeds."""
    return f"{values.mean():.2f} ({values.min():.2f} to {values.max():.2f})"


# --- from the command line --------------------------------------------------------------------------------------------


def write(name, text, page=PAGE):
    """Put a table into a page, between its marks."""
    whole, (begin, end) = page.read_text(encoding="utf-8"), (f"<!-- {name} -->\n", f"<!-- end of {name} -->")
    before, after = whole.split(begin)[0], whole.split(end)[1]
    page.write_text(f"{before}{begin}{text}{end}{after}", encoding="utf-8")


def asked(doc, folder, write="tables into docs/tables/rock.md", **options):
    """What is given of ``options`` (name and look), and of workers, folder and write, which all these studies have."""
    words = argparse.ArgumentParser(description=doc, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name, look in options.items():
        words.add_argument(f"--{name.replace('_', '-')}", **({"type": int} | look))
    words.add_argument("--workers", type=int, help="all cores unless given")
    words.add_argument("--folder", default=folder, help="of the store")
    words.add_argument("--write", action="store_true", help=write)
    warnings.simplefilter("ignore", gl.CostWarning)
    return words.parse_args()


def main():
    given = asked(
        __doc__, "rock-study", "tables, picture and data into docs/", grains={"default": 150}, seeds={"default": 10},
        residual={"type": float, "nargs": "+", "default": FACTORS["residual"], "help": "deg"},
        large={"default": 1000, "help": "grains of the larger specimens"},
        large_seeds={"default": 3, "help": "of the larger specimens, each ingredient alone"},
        design_seeds={"default": 4, "help": "of the larger specimens, all ingredients but cells together"},
    )  # fmt: skip
    studies = {  #: all are made, and refused, before the first is run
        given.folder: study(given.grains, given.seeds, residual=given.residual),
        f"{given.folder}-pace": pace_study(given.grains, given.seeds),
        f"{given.folder}-size": size_study([given.grains, given.large], given.large_seeds),
        f"{given.folder}-large": study(given.large, given.design_seeds, **LARGE),
    }
    table, pace, sizes, large = (each.run(folder, workers=given.workers) for folder, each in studies.items())
    found = quantities(table)
    texts = {
        "effects": effects_table(found), "interactions": interactions_table(found),
        "combinations": combinations_table(found), "size": size_table(sizes), "pace": pace_table(pace),
        "large": large_table(table.where(cells=1), large), "large interactions": interactions_table(quantities(large)),
        "cost": cost(table, sizes, large, pace),
    }  # fmt: skip
    short = {"effects in short": effects_table(found, in_short), "paces in short": short_pace_table(pace)}
    print("\n".join([*texts.values(), *short.values()]))
    draw_effects(found, DOCS / "images/rock_effects.png" if given.write else "rock_effects.png")
    if given.write:
        for name, text in texts.items():
            write(name, text)
        for name, text in short.items():
            write(name, text, SHORT)
        for name, of in (("rock", table), ("rock-pace", pace), ("rock-size", sizes), ("rock-large", large)):
            of.to_pandas().to_csv(DOCS / f"{name}.csv", index=False, float_format="%.6g")


def cost(design, sizes, large, pace):
    def hours(table):
        return f"{sum(of['cpu'] for of in table.costs) / 3600:.1f}"

    def words(table):
        return f"{table.rows[0]['count']:,} grains, {len(table.levels('seed'))} seeds: {hours(table)}"

    failed = sum(len(table.failed) for table in (design, sizes, large, pace))
    return (
        f"{len(design):,} tests of the design, {words(design)} hours of one core; {len(sizes):,} of sizes: "
        f"{hours(sizes)}; {len(large):,} of the larger design, {words(large)}; {len(pace):,} of paces: {hours(pace)}; "
        f"{failed} of all ended with an error.\n"
    )


if __name__ == "__main__":
    main()
