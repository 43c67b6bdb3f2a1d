"""An observer that says what the contacts have lost for good."""

import attrs
import numpy as np

import grainlaw as gl


@attrs.define
class Dissipation(gl.Observer):
    """Energy lost in opening and in slip, by the ledger of the framework and the springs of the contacts."""

    state: gl.State | None = None

    def observe(self, state, curves, stage, progress):
        self.state = state

    def lost(self, kn, ks):
        """J/m in opening and in slip: the work done on damaged contact points, less what they would give back.

        Closed they give back sigma^2/(2 kn) and open sigma o/2; in slip, tau s/2 of the softening branch and
        tau^2/(2 ks) of the spring of friction. A contact without damage is elastic and has lost nothing.
        """
        state, damage = self.state, self.state.memory("damage")
        normal = np.where(state.opening > 0, state.normal * state.opening / 2, state.normal**2 / (2 * kn))
        friction = np.where(damage < 1, ks * (state.slip - state.memory("anchor")), state.shear)
        shear = (state.shear - friction) * state.slip / 2 + friction**2 / (2 * ks)
        lost = state.bonds.work - np.stack([normal, shear])
        return np.sum((damage > 0) * state.contact_lengths * lost, axis=1)
