"""Random strength from contact to contact."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, TypeVar

import attrs
import numpy as np
from scipy.special import log_ndtr

from grainlaw.arguments import Checked
from grainlaw.contact import ContactLaw, keys_of_bonds
from grainlaw.declared import units_of
from grainlaw.fields import ParameterError, parameter, whole_number
from grainlaw.specimen import Specimen

WAVES = 1000  #: of random direction, length and phase, whose sum is a normal field (Shinozuka and Deodatis 1991)

AnyLaws = TypeVar("AnyLaws", ContactLaw, Mapping[Any, ContactLaw])


@attrs.frozen(kw_only=True)
class WeibullField(metaclass=Checked):
    """Strength that differs between contacts by a random factor of mean 1 (Weibull 1951, doi:10.1115/1.4010337).

    An edge between two grains has one factor, whatever its length, at all its contact points and for all ``names``. It
    depends on the grains and the seed alone, so that the weak contacts are the same under every law, for every modulus
    and in every mesh. With a ``correlation_length`` it is a function of place, of the middle of the edge: places that
    are nearer to each other than that are weak or strong together. Otherwise each edge has its own, whatever its place.
    """

    modulus: float = parameter("1")  #: m; the smaller, the more scatter
    seed: int = whole_number(default=1, at_least=0)  #: of the random numbers
    names: tuple[str, ...] = ("tensile_strength", "cohesion")  #: what is multiplied
    #: distance at which the correlation of the normal field behind the factors has fallen to 1/e, exp(-(r/l)^2)
    correlation_length: float = parameter("m", default=0.0, at_least=0)

    def factors(self, specimen: Specimen) -> np.ndarray:
        """(c,) one for each interface of the mesh."""
        pieces = 2**specimen.refinement  # of an edge between two grains, one after another
        draws = self._exponential(specimen, pieces) ** (1 / self.modulus) / math.gamma(1 + 1 / self.modulus)
        return np.repeat(draws, pieces)

    def _exponential(self, specimen: Specimen, pieces: int) -> np.ndarray:
        """(e,) numbers of the exponential distribution, one for each edge between two grains."""
        mesh, dice = specimen.mesh, np.random.default_rng(self.seed)
        count = len(mesh.interfaces) // pieces
        if not self.correlation_length:
            return dice.standard_exponential(count)
        middles = mesh.nodes[mesh.interfaces[:, :2]].reshape(count, -1, 2).mean(axis=1)
        waves = dice.normal(size=(WAVES, 2)) * math.sqrt(2) / self.correlation_length
        field = np.zeros(count)
        for wave, phase in zip(waves, dice.uniform(0, 2 * math.pi, WAVES), strict=True):
            field += np.cos(middles @ wave + phase)
        return -log_ndtr(-field * math.sqrt(2 / WAVES))

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
        missing = [name for name in self.names if name not in units_of(type(law))]
        if missing:
            inside = ": scatter the law inside of it, and put it around that" if hasattr(law, "law") else ""
            raise ParameterError(f"WeibullField: {type(law).__name__} has no parameter {missing[0]}{inside}")
        if not len(factors):  # phases that do not meet
            return law
        points = np.tile(factors, 2)
        return attrs.evolve(law, **{name: getattr(law, name) * points for name in self.names})
