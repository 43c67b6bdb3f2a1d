"""The cohesive crack model taken apart: the path to its peak, its fracture energies, its friction.

    python docs/examples/take_apart.py [--quick] [--out FOLDER]

The study of compare_laws.py, with variants of one law.
"""

import attrs
from compare_laws import LAWS, main

from grainlaw.laws import PrePeak

MODEL = LAWS["cohesive crack"]
VARIANTS = {
    f"{shape.name.lower()}, {'G' if share == 1 else 'G/10'}, {angle} deg": attrs.evolve(
        MODEL, pre_peak=shape, mode_i_energy=share * MODEL.mode_i_energy, mode_ii_energy=share * MODEL.mode_ii_energy,
        friction_angle=angle, residual_friction_angle=min(angle, MODEL.residual_friction_angle),
    )
    for angle in (54, 0) for shape in (PrePeak.EXPONENTIAL, PrePeak.LINEAR) for share in (1, 0.1)
} | {"exponential, G, 54 then 0 deg": attrs.evolve(MODEL, residual_friction_angle=0)}  # fmt: skip

if __name__ == "__main__":
    main(VARIANTS, "take-apart")
