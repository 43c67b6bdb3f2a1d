"""Gauges of a prism: what each reads of displacements that are known."""

import attrs
import numpy as np
import pytest
from support import ROCK, STIFF, small_sample

import grainlaw as gl
from grainlaw.cli.configuration import configured
from grainlaw.gauges import CentreGauges, ClipGauges, WholeSpecimen
from grainlaw.geometry import Voronoi, between_platens, moved, rectangle
from grainlaw.laws import Linear
from grainlaw.protocols import UniaxialCompression

GAUGES = (
    WholeSpecimen(),
    CentreGauges(),
    CentreGauges(share=1.0),
    ClipGauges(),
)
W, H = 0.02, 0.05
PRISM = gl.Specimen(Voronoi(grains=400, seed=2).tessellate(rectangle(W, H)), ROCK)


def read(gauges, field):
    """Lateral and axial strain of a displacement field of x and y, from the middle of the prism."""
    low, high = PRISM.grains.region.bounds
    x, y = (PRISM.mesh.nodes - (low + high) / 2).T
    return gauges.strains(PRISM, np.column_stack(np.broadcast_arrays(*field(x, y))))


@pytest.mark.parametrize("gauges", GAUGES)
def test_an_even_strain_is_what_all_gauges_read(gauges):
    assert read(gauges, lambda x, y: (2e-4 * x + 5.0, -7e-4 * y - 3.0)) == pytest.approx((2e-4, -7e-4), rel=0.03)


@pytest.mark.parametrize(
    ("gauges", "width", "height"),
    [
        (WholeSpecimen(), W, H), (CentreGauges(), W / 4, H / 4), (CentreGauges(share=0.5), W / 2, H / 2),
        (ClipGauges(), W, H / 2),
    ],
)  # fmt: skip
def test_a_crack_counts_over_the_length_that_a_gauge_spans(gauges, width, height):
    opened = read(gauges, lambda x, y: (1e-6 * (x > 0), 1e-6 * (y > 0)))
    assert opened == pytest.approx((1e-6 / width, 1e-6 / height), rel=0.12)  # nodes are not just where they should be


def test_a_barrel_is_widest_at_mid_height():
    def barrel(x, y):
        return 1e-3 * x * np.cos(np.pi * y / H), -1e-3 * y * np.cos(np.pi * x / W)

    quarter = np.pi / 4  # the middle half of the height, and the mean of a cosine over it
    assert read(ClipGauges(), barrel)[0] == pytest.approx(1e-3, rel=0.01)
    assert read(WholeSpecimen(), barrel)[0] == pytest.approx(1e-3 * np.sin(quarter) / quarter, rel=0.01)
    eighth = np.pi / 8
    assert read(CentreGauges(), barrel)[0] == pytest.approx(1e-3 * np.sin(eighth) / eighth, rel=0.02)
    assert read(ClipGauges(), barrel)[1] == pytest.approx(0, abs=1e-18)  # the sides do not move up or down
    assert read(CentreGauges(), barrel)[1] == pytest.approx(-1e-3 * np.sin(eighth) / eighth, rel=0.02)


@pytest.mark.parametrize("gauges", GAUGES)
def test_gauges_do_not_see_where_a_prism_stands(gauges):
    """It is moved by more than its size, and strained and moved as before."""
    x, y = (PRISM.mesh.nodes - (W / 2, H / 2)).T
    barrel = np.column_stack([1e-3 * x * np.cos(np.pi * y / H), -1e-3 * y * np.cos(np.pi * x / W)])
    there = gl.Specimen(moved(PRISM.grains, by=(0.3, -0.7)), ROCK)
    assert there.mesh.nodes == pytest.approx(PRISM.mesh.nodes + np.array([0.3, -0.7]))
    assert gauges.strains(there, barrel) == pytest.approx(gauges.strains(PRISM, barrel), rel=1e-6, abs=1e-12)


def test_ends_are_those_of_the_rock_between_platens():
    made = between_platens(small_sample(30).grains, thickness=2e-3)
    specimen = gl.Specimen(made, ROCK)
    rock = specimen.mesh.nodes[specimen.mesh.boundaries["rock_top"], 1].min()
    moved = np.where(specimen.mesh.nodes[:, 1:] >= rock, [0.0, -1e-6], 0.0)
    height = np.ptp(made.region.bounds, axis=0)[1]
    assert WholeSpecimen().strains(specimen, moved)[1] == pytest.approx(-1e-6 / height)


@pytest.mark.thorough
def test_a_test_records_what_its_gauges_read():
    press = UniaxialCompression(maximum_strain=1e-4, samples=20)
    runs = [gl.simulate(PRISM, Linear(**STIFF), attrs.evolve(press, gauges=each), frames=30) for each in GAUGES]
    for gauges, result in zip(GAUGES, runs, strict=True):
        read = [gauges.strains(PRISM, frame.displacement) for frame in result.frames[-2:]]
        lateral, axial = np.mean(read, axis=0)  # over the last sample
        assert result.curves["lateral_strain"][-1] == pytest.approx(lateral, rel=0.004)  # a step later
        assert result.curves["strain_points"][-1] == pytest.approx(-axial, rel=0.004)
        assert result.curves["volumetric_strain"][-1] == pytest.approx(lateral + axial, rel=0.004)
        stress, axial = result.curves["stress"], "strain" if gauges == WholeSpecimen() else "strain_points"
        assert np.array_equal(stress, runs[0].curves["stress"])
        chosen = (stress >= 0.2 * stress[-1]) & (stress <= 0.5 * stress[-1])
        slopes = [
            np.polyfit(result.curves[axial][chosen], each[chosen], 1)[0]
            for each in (stress, result.curves["lateral_strain"])
        ]
        found = result.summary["apparent_modulus"], result.summary["apparent_poisson"]
        assert found == pytest.approx(slopes, rel=1e-6)


def test_gauges_are_chosen_by_name():
    for given, made in (
        ("clip", ClipGauges()),
        ({"type": "centre", "share": 0.5}, CentreGauges(share=0.5)),
    ):
        assert (
            configured("biaxial-compression", {"test": {"confinement": 1e6, "gauges": given}}).protocol.gauges == made
        )
