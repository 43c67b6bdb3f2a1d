"""Random strength from contact to contact."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, TypeVar

import attrs
import numpy as np

from grainlaw.arguments import Checked
from grainlaw.contact import ContactLaw, keys_of_bonds
from grainlaw.parameter import ParameterError, parameter, whole_number
from grainlaw.specimen import Specimen

AnyLaws = TypeVar("AnyLaws", ContactLaw, Mapping[Any, ContactLaw])


@attrs.frozen(kw_only=True)
class WeibullField(metaclass=Checked):
    """Strength that differs between contacts by a random factor of mean 1 (Weibull 1951, doi:10.1115/1.4010337).

    An interface has one factor, whatever its length, at both contact points and for all ``names``. It depends on the
    specimen and the seed alone, so that the weak contacts are the same under every law and for every modulus.
    """

    modulus: float = parameter("1")  #: m; the smaller, the more scatter
    seed: int = whole_number(default=1, at_least=0)  #: of the random numbers
    names: tuple[str, ...] = ("tensile_strength", "cohesion")  #: what is multiplied

    def factors(self, specimen: Specimen) -> np.ndarray:
        """(c,) one for each interface of the mesh."""
        draws = np.random.default_rng(self.seed).standard_exponential(len(specimen.mesh.interfaces))
        return draws ** (1 / self.modulus) / math.gamma(1 + 1 / self.modulus)

    def scatter(self, laws: AnyLaws, specimen: Specimen) -> AnyLaws:
        """The same law, or mapping of laws, with a value for each contact point in place of ``names``.

        Raises :class:`ParameterError` for a name the law does not have, and for what it refuses at any contact.
        """
        factors = self.factors(specimen)
        if isinstance(laws, ContactLaw):
            return self._scattered(laws, factors)
        which = keys_of_bonds(specimen, laws)
        return {key: self._scattered(law, factors[which == k]) for k, (key, law) in enumerate(laws.items())}

    def _scattered(self, law: Any, factors: np.ndarray) -> Any:
        numbers = {field.name for field in attrs.fields(type(law)) if "unit" in field.metadata}
        missing = [name for name in self.names if name not in numbers]
        if missing:
            raise ParameterError(f"WeibullField: {type(law).__name__} has no parameter {missing[0]}")
        if not len(factors):  # phases that do not meet
            return law
        points = np.tile(factors, 2)
        return attrs.evolve(law, **{name: getattr(law, name) * points for name in self.names})
