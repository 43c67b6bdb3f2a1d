"""The tests that the command line knows by name, each with its default specimen."""

from __future__ import annotations

from typing import Any

import attrs

from grainlaw import protocols
from grainlaw.cli.components import name_of, settings
from grainlaw.cli.default_rock import LAWS, QUICK, ROCK, SAMPLE
from grainlaw.contact import ContactLaw
from grainlaw.units import mm

WIDTH, PULLED, SHEARED = 50 * mm, 10 * mm, 4 * mm  #: of two blocks with a joint: low ones do not snap back


def _prism(width: float, height: float, grains: int) -> dict[str, Any]:
    size = {"width": width, "height": height}
    return {"region": "rectangle", **size, "tessellator": "voronoi", "grains": grains, "seed": 1}


PRISM, SMALL_PRISM = _prism(*SAMPLE), _prism(*QUICK)


def _blocks(height: float) -> dict[str, Any]:
    return {"region": "rectangle", "width": WIDTH, "height": height, "tessellator": "bricks", "rows": 2}


def _bar(columns: int) -> dict[str, Any]:
    size = {"width": columns * 2 * mm, "height": 4 * mm}
    return {"region": "rectangle", **size, "tessellator": "bricks", "rows": 2, "columns": columns}


PULLED_BLOCKS, SHEARED_BLOCKS = _blocks(PULLED), _blocks(SHEARED)


def _grains(count: int) -> dict[str, Any]:
    return {"tessellator": "voronoi", "grains": count, "seed": 1}


DISC = {"region": "disc", "diameter": 50 * mm}
NOTCHED = {"notch_width": 0.5 * mm, "bearing": 3 * mm}
BEAM = {"region": "notched_beam", "length": 100 * mm, "height": 25 * mm, "span": 80 * mm, "notch_depth": 8 * mm}
PLATE = {"region": "plate_with_hole", "width": 100 * mm, "height": 100 * mm, "diameter": 20 * mm}
HALF_DISC = {"region": "semi_disc", "diameter": 75 * mm, "span": 45 * mm, "notch_depth": 18 * mm}
EXPANDS = {"type": "thermal", "material": settings(ROCK)}
CONDUCTS = {"conductivity": 3.0, "heat_capacity": 800.0}  #: W/m/K and J/kg/K, those of many rocks (Robertson 1988)
AGES = {"type": "static-fatigue", "law": settings(LAWS["cohesive-crack"], ContactLaw)}


@attrs.frozen
class Setup:
    """A test and its samples, as in the section [sample] of a configuration.

    A test that most rocks or laws cannot be put through has ones with which it can, as far as they are known.
    """

    protocol: Any  #: a class of tests, or a test
    sample: dict[str, Any]
    quick: dict[str, Any]
    rock: dict[str, Any] = attrs.field(factory=dict)
    law: dict[str, Any] = attrs.field(factory=dict)


SETUPS = {
    name_of(setup.protocol): setup
    for setup in (
        Setup(protocols.UniaxialCompression, PRISM, SMALL_PRISM),
        Setup(protocols.UniaxialTension, PRISM, SMALL_PRISM),
        Setup(protocols.BiaxialCompression, PRISM, SMALL_PRISM),
        Setup(protocols.Brazilian, DISC | _grains(400), DISC | _grains(80)),
        Setup(protocols.Creep, PRISM, SMALL_PRISM, law=AGES),
        Setup(protocols.Cyclic, PRISM, SMALL_PRISM),
        Setup(protocols.Heating, PRISM, SMALL_PRISM, rock=EXPANDS),
        Setup(protocols.Saturated, PRISM, SMALL_PRISM),
        Setup(protocols.ThreePointBending, BEAM | NOTCHED | _grains(400), BEAM | NOTCHED | _grains(80)),
        Setup(protocols.SemiCircularBend, HALF_DISC | NOTCHED | _grains(400), HALF_DISC | NOTCHED | _grains(80)),
        Setup(protocols.DirectShear, SHEARED_BLOCKS, SHEARED_BLOCKS),
        Setup(protocols.JointTension, PULLED_BLOCKS, PULLED_BLOCKS),
        Setup(protocols.Excavation, PLATE | _grains(1500), PLATE | _grains(200)),
        Setup(protocols.HydraulicFracturing, PLATE | _grains(1500), PLATE | _grains(200)),
        Setup(protocols.SplitHopkinson, PRISM, SMALL_PRISM),
        Setup(protocols.PlaneWave, _bar(100), _bar(50)),
        Setup(protocols.ThermalShock, DISC | _grains(400), DISC | _grains(80), rock=EXPANDS | CONDUCTS),
    )
}
