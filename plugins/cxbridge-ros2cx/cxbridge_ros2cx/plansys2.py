"""The feature ``plansys2`` of the thesis' executive, without the nodes of PlanSys2.

In the thesis' executive, ros2-clips-executive (2021), rules plan with PlanSys2, the planning system of ROS 2:
its problem expert stores instances and predicates, its domain expert stores the domain, and its planner
returns the plan. Here :class:`~cxbridge_ros2.experts.knowledge.ProblemExpert` stores the instances and
predicates in memory, the domain is the last domain that the environment parsed, and cxbridge's planners plan.
Sources: Plansys2Feature.cpp, and PlanSys2's ProblemExpert.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from cxbridge.errors import CxbridgeError, PddlError
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.executive.host.values import Symbol
from cxbridge_planning.feature.base import (
    KnownWorld,
    PlanningFeature,
    PlanningFunctions,
)

if TYPE_CHECKING:
    from cxbridge.executive.pddl import Domain
    from cxbridge_planning import PlanCall, PlannerCallReporter, PlanResult


@dataclass(frozen=True, slots=True)
class _PlanArguments:
    """The arguments of a call of ``psys2-call-planner``.

    :param formula: the goal in PDDL.
    """

    goal_id: str
    plan_id: str
    formula: str


class _PlanSys2Functions(PlanningFunctions):
    """The functions of the feature in one environment, with its instances, predicates and running calls."""

    def __init__(self, env: ClipsEnvironment, feature: PlanningFeature) -> None:
        super().__init__(env, feature)
        from cxbridge_ros2.experts.knowledge import MemoryKnowledge, ProblemExpert  # noqa: PLC0415 - slow

        self._problem_expert = ProblemExpert(MemoryKnowledge(), lambda: self.domain)
        self._log = env.bus.logger(f"PSYS2CLIPS|{env.name}")
        self._running_calls: list[tuple[_PlanArguments, PlanCall, PlannerCallReporter]] = []

    # --- functions ----------------------------------------------------------------------------------------

    def define(self) -> None:
        self.env.define("psys2-add-domain-instance", self.add_instance, 2, types="*;sy;sy")
        self.env.define("psys2-add-domain-predicate", self.add_predicate, 1, types="*;sy")
        self.env.define("psys2-clear-knowledge", self._problem_expert.clear)
        self.env.define("psys2-call-planner", self.call_planner, 3, types="*;sy;sy;sy")

    def add_instance(self, name: str, type_name: str) -> None:
        try:
            self._problem_expert.add_instance(str(name), str(type_name))
        except PddlError as error:
            self._log.error(f"Problem adding instance: {name} - {type_name}: {error.message}")

    def add_predicate(self, predicate: str) -> None:
        # the domain has no predicate with an empty name, so an empty text is an error
        name, *arguments = str(predicate).strip().removeprefix("(").removesuffix(")").split() or [""]
        # PlanSys2 counts a constant of the domain as an instance only after a client has added the constant
        instances = self._problem_expert.knowledge.instances
        unknown_names = [argument for argument in arguments if argument not in instances]
        try:
            if unknown_names:
                raise PddlError(f"there is no instance {', '.join(unknown_names)}")  # noqa: TRY301 - logged below
            self._problem_expert.add_predicate((name, tuple(arguments)))
        except PddlError as error:
            self._log.error(f"Problem adding predicate: {predicate}: {error.message}")

    def call_planner(self, goal_id: str, formula: str, plan_id: str) -> None:
        """Plan for a goal; the plan and a ``pddl-plan-feedback`` become facts when the planner has ended."""
        arguments = _PlanArguments(str(goal_id), str(plan_id), str(formula))
        try:
            request, reporter = self.request(arguments.goal_id, arguments.formula)
        except PddlError as error:
            # the thesis' executive asserts no feedback in this case, and the agent hangs
            self._log.error(f"Could not set the goal '{formula}' of {goal_id}: {error}")
            self._assert_feedback(arguments, "PLAN-FAILED")
            return
        call = self.service.call(request)
        reporter.report_start(arguments.plan_id, request.problem)
        if self.env.bus.clock.is_virtual:
            # planning takes no virtual time; the thesis' executive waits for the planner here, too
            result = call.wait()
            assert result is not None
            self._report_result(arguments, result, reporter)
        else:
            self._running_calls.append((arguments, call, reporter))

    def known_world(self, domain: Domain) -> KnownWorld:  # noqa: ARG002 - the same for each domain
        """Return the added instances and predicates."""
        knowledge = self._problem_expert.knowledge
        return KnownWorld(list(knowledge.instances.items()), list(knowledge.predicates), [])

    # --- results ------------------------------------------------------------------------------------------

    def before_run(self) -> None:
        """Assert the plans of the calls that have ended."""
        for running_call in list(self._running_calls):
            arguments, call, reporter = running_call
            if call.result is not None:
                self._running_calls.remove(running_call)
                self._report_result(arguments, call.result, reporter)

    def _report_result(
        self, arguments: _PlanArguments, result: PlanResult, reporter: PlannerCallReporter
    ) -> None:
        reporter.report_end(result)
        if result.status.value != "PLANNED":
            self._log.error(
                f"Could not find plan to reach goal '{arguments.formula}' with id {arguments.goal_id}: "
                f"{result.message or result.status.value}"
            )
            self._assert_feedback(arguments, "PLAN-FAILED")
            return
        try:
            self.assert_plan(Symbol(arguments.plan_id), Symbol(arguments.goal_id), result.actions)
        except CxbridgeError as error:
            self._log.error(f"Cannot assert the plan {arguments.plan_id}: {error}")
            self._assert_feedback(arguments, "PLAN-FAILED")
        else:
            self._assert_feedback(arguments, "PLANNED")

    def _assert_feedback(self, arguments: _PlanArguments, status: str) -> None:
        self.env.assert_fact(
            "pddl-plan-feedback", {"status": Symbol(status), "plan-id": Symbol(arguments.plan_id)}
        )

    def close(self) -> None:
        """Cancel all planning and end the planners' processes."""
        self.service.close()
        for _, call, reporter in self._running_calls:
            if (result := call.wait()) is not None:
                reporter.report_end(result)
        self._running_calls.clear()


class PlanSys2Feature(PlanningFeature):
    """Defines the ``psys2-*`` functions."""

    name = "plansys2"
    functions_class = _PlanSys2Functions
