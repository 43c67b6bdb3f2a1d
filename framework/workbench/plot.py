"""Pictures of a contact law and of a material, for those who do not want matplotlib loaded before they draw."""

from __future__ import annotations

from typing import TYPE_CHECKING

from grainlaw.arguments import checked
from grainlaw.contact import ContactLaw
from grainlaw.material import Material

if TYPE_CHECKING:
    from grainlaw.drawing.figure import Figure


@checked
def plot_law(law: ContactLaw) -> Figure:
    """Draw what a law answers: pull and release, closure, shear under pressure, mixed paths, and its strength.

    Ranges follow the law's own peaks and breaks. Pressures are held while the contact slips. Raises TypeError for what
    is no law, ValueError for one whose numbers differ from contact to contact.
    """
    from grainlaw.workbench.law_figure import draw_law  # loads matplotlib, which takes longer than all the rest

    return draw_law(law)


@checked
def plot_material(material: Material) -> Figure:
    """Draw what one zone of a material answers: compressed under four confinements, pulled, and sheared to and fro.

    Ranges follow the end of its first response. Raises ParameterError for one whose numbers differ from grain to grain.
    """
    from grainlaw.workbench.material_figure import draw_material

    return draw_material(material)
