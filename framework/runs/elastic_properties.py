"""Elastic properties of a specimen from static solutions, without a run."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from operator import is_not

import attrs
import numpy as np

from grainlaw.arguments import Checked, checked
from grainlaw.columns import quantity_of
from grainlaw.contact import ContactLaw, Laws, declared_stiffness
from grainlaw.engine.model import laws_of_bonds
from grainlaw.engine.parts.laws import by_interface, stiffness_of_points
from grainlaw.engine.spring_statics import ElasticModel, stiffness_of_bonds, stiffness_of_contacts
from grainlaw.engine.state import State
from grainlaw.fields import ParameterError
from grainlaw.gauges import lateral_strain
from grainlaw.messages import refusal, short
from grainlaw.moduli import converted
from grainlaw.polygon import linked
from grainlaw.quantity import aligned
from grainlaw.runs.plausibility import warn_of_contacts
from grainlaw.specimen import Specimen

SIDES = ("bottom", "left", "right", "top")
BOUNDARIES: dict[str, Callable[[ElasticModel], np.ndarray]] = {
    "kinematic": ElasticModel.under_uniform_strain,
    "static": ElasticModel.under_uniform_stress,
}


@attrs.frozen(kw_only=True, eq=False)
class ElasticProperties(metaclass=Checked):
    """Elastic properties of a specimen; prints as a table."""

    apparent_modulus: float  #: Pa, of the plane problem, between smooth platens
    apparent_poisson: float  #: of the plane problem, from gauges in the middle half of the height
    modulus: float  #: Pa, converted from plane strain; equal to the apparent one in plane stress
    poisson: float  #: converted from plane strain; equal to the apparent one in plane stress
    stiffness: np.ndarray  #: (3, 3) Pa: stress xx, yy, xy over strain xx, yy and the shear angle
    boundary: str  #: what the rim follows in ``stiffness``: "kinematic" a uniform strain, "static" a uniform stress

    def __str__(self) -> str:
        names = "apparent_modulus", "apparent_poisson", "modulus", "poisson"
        rows = [(quantity_of(name).heading, quantity_of(name).text(getattr(self, name))) for name in names]
        axes = ["xx", "yy", "xy"]
        tensor = [["", *axes]]
        tensor += [[axis, *(f"{c * 1e-9:z.3f}" for c in row)] for axis, row in zip(axes, self.stiffness, strict=True)]
        return f"{aligned(rows)}\nstiffness (GPa), {self.boundary} boundary\n{aligned(tensor)}"

    __repr__ = __str__


@checked
def elastic_properties(
    specimen: Specimen, law: Laws, *, boundary: str = "static", state: State | None = None
) -> ElasticProperties:
    """Elastic properties of a rectangular specimen: those of uniaxial compression, and its stiffness tensor.

    Contact points are springs with the stiffness that their law declares; or, at a ``state`` of a run of this specimen
    and law (from an observer), with the tangent that they have there: see docs/theory.md. The ``boundary`` of the
    stiffness tensor is "static", a uniform stress on the whole rim, or "kinematic", a uniform strain; of grains that
    deform they are the softest and the stiffest answer. Modulus and Poisson's ratio are those that
    :class:`~grainlaw.protocols.UniaxialCompression` would measure between smooth platens.

    Raises :class:`ParameterError` for a specimen whose rim is not top, bottom, left and right with flat ends, or whose
    grains are not bonded into one piece, and for a state of another specimen or law.
    """
    if boundary not in BOUNDARIES:
        raise refusal("elastic_properties: boundary", boundary, " or ".join(map(repr, BOUNDARIES)))
    _check(specimen)
    order, sizes = laws_of_bonds(specimen, law)
    if state is None:
        warn_of_contacts(specimen, law)
        for one, _ in sizes:
            if words := one.exceptions.get("stiffness"):
                name = type(one).__name__
                warnings.warn(f"elastic_properties: {name} counts with its stiffness, but {words}", stacklevel=3)
        kn, ks = _declared(order, sizes)
        model = ElasticModel(specimen, kn, ks)
    else:
        _check_state(state, specimen, [one for one, _ in sizes])
        kn, ks = stiffness_of_bonds(state)
        model = ElasticModel(specimen, kn, ks, stiffness_of_contacts(state))
    young, motion = model.between_smooth_platens()
    ratio = lateral_strain(specimen, motion)
    modulus, poisson = converted(young, ratio, specimen)
    return ElasticProperties(
        apparent_modulus=young, apparent_poisson=ratio, modulus=modulus, poisson=poisson,
        stiffness=BOUNDARIES[boundary](model), boundary=boundary,
    )  # fmt: skip


def _declared(order: np.ndarray, sizes: Sequence[tuple[ContactLaw, int]]) -> np.ndarray:
    """(2, 2, c) Pa/m, kn and ks of both points of each bond, in the order of the mesh."""
    for law, size in sizes:
        for value in declared_stiffness(law):
            if np.shape(value) not in ((), (2 * size,)):
                raise ParameterError(
                    f"{type(law).__name__}: stiffness has {np.size(value)} entries, "
                    f"it must have one for each of the {2 * size} contact points"
                )
    return by_interface(order, stiffness_of_points(sizes))


def _check(specimen: Specimen) -> None:
    mesh = specimen.mesh
    if set(mesh.boundaries) != set(SIDES):
        has = ", ".join(sorted(mesh.boundaries))
        raise ParameterError(
            f"elastic_properties: specimen is not allowed, its boundaries are {short(has)}; they must be "
            f"{', '.join(SIDES)}: one rectangle, without platens"
        )
    for name in ("top", "bottom"):
        if np.ptp(mesh.nodes[mesh.boundaries[name], 1]) > 1e-9 * np.ptp(mesh.nodes[:, 1]):
            raise ParameterError(f"elastic_properties: specimen is not allowed, its {name} is not flat and level")
    if linked(specimen.grains.count, *mesh.held_together.T).any():
        raise ParameterError(
            "elastic_properties: specimen is not allowed, its grains are not held together in one piece"
        )
    if specimen.is_rigid:
        of = mesh.node_grain
        if len(np.intersect1d(of[mesh.boundaries["top"]], of[mesh.boundaries["bottom"]])):
            raise ParameterError(
                "elastic_properties: specimen is not allowed, a rigid grain reaches from the top to the bottom"
            )


def _check_state(state: State, specimen: Specimen, laws: Sequence[ContactLaw]) -> None:
    if state.specimen is not specimen:
        raise ParameterError("elastic_properties: state is not allowed, it is of another specimen")
    has = [group.law for group in state.bonds.groups]
    if len(has) != len(laws) or any(map(is_not, has, laws)):
        raise ParameterError("elastic_properties: state is not allowed, it is of a run with another law")
