"""How well prescribed areas are met, and how long it takes: the table of docs/tables/speed.md.

    python tests/benchmarks/grain_sizes.py [largest number of grains, 10000]

Times are of the processor, not of the wall, for one diagram after another in one thread.
"""

import sys
import time

import numpy as np

from grainlaw.geometry import Laguerre, Lognormal, polygon, rectangle

RING = 2 + np.column_stack([np.cos(np.arange(24) * np.pi / 12), np.sin(np.arange(24) * np.pi / 12)])
REGIONS = {
    "rectangle": rectangle(0.05, 0.125),
    "plate with a hole": polygon([(0, 0), (4, 0), (4, 4), (0, 4)], holes={"hole": RING}),
}
CASES = [
    ("rectangle", 755, 0.42, 5), ("rectangle", 755, 0.42, 0), ("rectangle", 755, 0.8, 5),
    ("plate with a hole", 755, 0.42, 5), ("rectangle", 10_000, 0.42, 5), ("rectangle", 100_000, 0.42, 5),
]  # fmt: skip


def main() -> None:
    most = int(sys.argv[1]) if len(sys.argv) > 1 else 10_000
    print(
        "| region, grains, deviation, rounds | before merging: largest, rms | after: largest, rms | circularity | CPU |"
    )
    print("|---|---|---|---|---|")
    for name, grains, deviation, rounds in CASES:
        if grains > most:
            continue
        seeds, fits = (1, 2, 3) if grains < 1000 else (1,), []
        start = time.process_time()
        for seed in seeds:
            sizes = Lognormal(deviation=deviation)
            fits.append(Laguerre(grains=grains, sizes=sizes, relaxation=rounds, seed=seed).fit(REGIONS[name]))
        took = (time.process_time() - start) / len(seeds)
        before = f"{max(f.largest_before for f in fits):.2%}, {max(f.rms_before for f in fits):.3%}"
        after = f"{max(f.largest_after for f in fits):.2%}, {max(f.rms_after for f in fits):.3%}"
        circularity = np.mean([f.circularity.mean() for f in fits])
        print(f"| {name}, {grains:,}, {deviation}, {rounds} | {before} | {after} | {circularity:.2f} | {took:.2f} s |")


if __name__ == "__main__":
    main()
