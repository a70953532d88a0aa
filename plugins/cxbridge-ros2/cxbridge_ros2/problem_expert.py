"""The feature `problem-expert`: the world model of an agent for PlanSys2's experts (docs/ros2.md).

PlanSys2's experts are ROS nodes that serve a PDDL domain and a PDDL problem to clients. Here the problem is
the facts of an environment.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import count
from typing import TYPE_CHECKING, Final

from cxbridge.executive.feature import Feature
from cxbridge.executive.host.environment import CORE_DIR, ClipsEnvironment
from cxbridge.executive.problem.numbers import load_functions

if TYPE_CHECKING:
    from cxbridge.executive.pddl import Domain
    from cxbridge.run.agent import Run
    from cxbridge_ros2.experts.knowledge import ProblemExpert

_TEMPLATES_FILE: Final = CORE_DIR / "features" / "problem.clp"
_WATCHED_TEMPLATES: Final = ("domain-object", "domain-fact", "problem-function", "problem-goal")


class ProblemExpertFeature(Feature):
    """Provides the templates ``problem-goal`` and ``problem-function``, and the problem expert.

    :param find_domain: returns the domain that an environment has parsed last, or None.
    :ivar env: the environment that has the feature, or None.
    :ivar version: incremented by each change of the problem.
    """

    name = "problem-expert"

    def __init__(self, find_domain: Callable[[ClipsEnvironment], Domain | None]) -> None:
        self._find_domain = find_domain
        self._goal_numbers = count(1)
        self.env: ClipsEnvironment | None = None
        self.version = 0

    def init_context(self, env: ClipsEnvironment) -> None:
        env.load(_TEMPLATES_FILE)
        load_functions(env)
        self.env = env
        for template in _WATCHED_TEMPLATES:
            env.watcher.follow_changes(template, self._increment_version)
        self._increment_version()

    def context_destroyed(self, env: ClipsEnvironment) -> None:
        if env is self.env:
            self.env = None
            self._increment_version()

    def _increment_version(self) -> None:
        self.version += 1

    def make_expert(self, env: ClipsEnvironment) -> ProblemExpert:
        """Return an expert, which the caller uses while holding the lock of the environment."""
        # imported here, since the imports are slow and only clients use an expert
        from cxbridge_ros2.experts.facts import FactKnowledge  # noqa: PLC0415
        from cxbridge_ros2.experts.knowledge import ProblemExpert  # noqa: PLC0415

        return ProblemExpert(FactKnowledge(env, self._goal_numbers), lambda: self._find_domain(env))


def _make_feature(context: Run) -> ProblemExpertFeature:
    return ProblemExpertFeature(context.pddl_parser.domain_of)


def shared_problem_expert_feature(context: Run) -> ProblemExpertFeature:
    """Return the feature of a run. Rules and the servers of the experts share one instance."""
    return context.shared_object(_make_feature)
