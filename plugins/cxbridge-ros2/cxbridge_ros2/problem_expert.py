"""The feature `problem-expert`: the world model as PlanSys2's experts see it. See docs/ros2.md."""

from __future__ import annotations

from itertools import count
from typing import TYPE_CHECKING, Final

from cxbridge.executive.feature import Feature
from cxbridge.executive.features.planning_base import DomainOf
from cxbridge.executive.host.environment import CORE_DIR, ClipsEnvironment
from cxbridge.executive.problem.numbers import load_functions

if TYPE_CHECKING:
    from cxbridge.run.agent import Run
    from cxbridge_ros2.experts.knowledge import ProblemExpert

_FILE: Final = CORE_DIR / "features" / "problem.clp"
_WATCHED: Final = ("domain-object", "domain-fact", "problem-function", "problem-goal")


class ProblemExpertFeature(Feature):
    """Provides the templates ``problem-goal`` and ``problem-function``.

    :param domain_of: returns the domain that an environment has parsed last.
    """

    name = "problem-expert"

    def __init__(self, domain_of: DomainOf) -> None:
        self._domain_of = domain_of
        self._goals = count(1)
        self.env: ClipsEnvironment | None = None  # the environment that has the feature, or None
        self.version = 0  # incremented by each change of the problem

    def init_context(self, env: ClipsEnvironment) -> None:
        env.load(_FILE)
        load_functions(env)
        self.env = env
        for template in _WATCHED:
            env.watcher.follow_changes(template, self._count_change)
        self._count_change()

    def context_destroyed(self, env: ClipsEnvironment) -> None:
        if env is self.env:
            self.env = None
            self._count_change()

    def _count_change(self) -> None:
        self.version += 1

    def expert(self, env: ClipsEnvironment) -> ProblemExpert:
        """Return the expert. Hold the environment's lock while using it."""
        from cxbridge_ros2.experts.facts import FactKnowledge, domain_of_facts  # noqa: PLC0415 - slow, for clients
        from cxbridge_ros2.experts.knowledge import ProblemExpert  # noqa: PLC0415 - likewise

        domain = domain_of_facts(env, self._domain_of(env))
        return ProblemExpert(FactKnowledge(env, self._goals), lambda: domain)


def make_problem_expert(context: Run) -> ProblemExpertFeature:
    return ProblemExpertFeature(context.pddl_parser.domain_of)


def problem_expert(context: Run) -> ProblemExpertFeature:
    """Return the feature of a run, which rules and servers share."""
    return context.one_of(make_problem_expert)
