"""The observations and actions of an agent as vectors, in the order of the original's ``CXRLGym``."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from cxbridge_ros2cx.rl.interface import LearningAgent

NO_OP: Final = "no-op"  # the first action, which has no effect

Observation = NDArray[np.float32]  # 1 for each true predicate

Mask = NDArray[np.int8]  # 1 for each action that the free robot can execute


class Spaces(Struct, frozen=True):
    """The groundings of an agent's predicates and actions.

    :param observables: the index of each predicate in an observation.
    :param actions: the names of the actions by index.
    :param numbers: the index of each action.
    """

    observables: dict[str, int]
    actions: list[str]
    numbers: dict[str, int]

    @classmethod
    def of(cls, agent: LearningAgent) -> Spaces:
        """Query an agent for its predicates, actions and objects."""
        observables = sorted({*agent.observables()})
        actions = [NO_OP, *sorted({*agent.all_actions()})]
        return cls(
            {name: index for index, name in enumerate(observables)},
            actions,
            {name: number for number, name in enumerate(actions)},
        )

    def observation(self, predicates: Iterable[str]) -> Observation:
        observed = np.zeros(len(self.observables), dtype=np.float32)
        observed[[self.observables[name] for name in predicates if name in self.observables]] = 1.0
        return observed

    def mask(self, actions: Iterable[str]) -> Mask:
        """Return the mask of executable actions; the mask of ``no-op`` if there are none."""
        mask = np.zeros(len(self.actions), dtype=np.int8)
        mask[[self.numbers[name] for name in actions if name in self.numbers]] = 1
        if not mask.any():
            mask[self.numbers[NO_OP]] = 1
        return mask
