"""The observations and actions of an agent as vectors, in the order of the original's ``CXRLGym``."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from cxbridge_ros2cx.rl.interface import LearningAgent

NO_OP: Final = "no-op"
"""The first action: it does nothing."""

Observation = NDArray[np.float32]
"""A 1 for each predicate that holds."""

Mask = NDArray[np.int8]
"""A 1 for each action that the free robot can execute."""


class Spaces(Struct, frozen=True):
    """The groundings of an agent's predicates and actions.

    :param observables: the place of each predicate in an observation.
    :param actions: the names of the actions, by number.
    :param numbers: the number of each action.
    """

    observables: dict[str, int]
    actions: list[str]
    numbers: dict[str, int]

    @classmethod
    def of(cls, agent: LearningAgent) -> Spaces:
        """Ask an agent for its predicates, actions and objects."""
        observables = sorted({*agent.observables()})
        actions = [NO_OP, *sorted({*agent.all_actions()})]
        return cls(
            {name: place for place, name in enumerate(observables)},
            actions,
            {name: number for number, name in enumerate(actions)},
        )

    def observation(self, predicates: Iterable[str]) -> Observation:
        """Return the observation in which these predicates hold."""
        observed = np.zeros(len(self.observables), dtype=np.float32)
        observed[[self.observables[name] for name in predicates if name in self.observables]] = 1.0
        return observed

    def mask(self, actions: Iterable[str]) -> Mask:
        """Return the mask of executable actions; without any, the mask of ``no-op``."""
        mask = np.zeros(len(self.actions), dtype=np.int8)
        mask[[self.numbers[name] for name in actions if name in self.numbers]] = 1
        if not mask.any():
            mask[self.numbers[NO_OP]] = 1
        return mask
