"""The observations and actions of a learning agent as vectors for Gymnasium.

A grounding is a predicate or an action with its objects, e.g. ``on(a#b)``. Groundings have the order of the
class ``CXRLGym`` of the ROS 2 CX, so that a model that was trained there works here, too.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from cxbridge_ros2cx.rl.learning_agent import LearningAgent

NO_OP: Final = "no-op"  # the action with index 0, which has no effect

Observation = NDArray[np.float32]  # 1 for each true predicate

ActionMask = NDArray[np.int8]  # 1 for each action that the free robot can execute, or for `no-op`


class Groundings(Struct, frozen=True):
    """The groundings of an agent's predicates and actions.

    :param predicate_indices: the index of each predicate in an observation.
    :param actions: the names of the actions by index.
    :param action_indices: the index of each action.
    """

    predicate_indices: dict[str, int]
    actions: list[str]
    action_indices: dict[str, int]

    @classmethod
    def from_agent(cls, agent: LearningAgent) -> Groundings:
        """Query an agent for its predicates, actions and objects."""
        predicates = sorted({*agent.observables()})
        actions = [NO_OP, *sorted({*agent.all_actions()})]
        return cls(
            {name: index for index, name in enumerate(predicates)},
            actions,
            {name: index for index, name in enumerate(actions)},
        )

    def encode_observation(self, predicates: Iterable[str]) -> Observation:
        """Return the observation of true predicates; as in ``CXRLGym``, unknown predicates are ignored."""
        observation = np.zeros(len(self.predicate_indices), dtype=np.float32)
        observation[
            [self.predicate_indices[name] for name in predicates if name in self.predicate_indices]
        ] = 1.0
        return observation

    def make_action_mask(self, actions: Iterable[str]) -> ActionMask:
        """Return the mask of executable actions, or of ``no-op`` without any; unknown actions are ignored."""
        mask = np.zeros(len(self.actions), dtype=np.int8)
        mask[[self.action_indices[name] for name in actions if name in self.action_indices]] = 1
        if not mask.any():
            mask[self.action_indices[NO_OP]] = 1
        return mask
