"""The feature ``plansys2`` of ros2-clips-executive (2021), the original, without PlanSys2's nodes.

PlanSys2's problem expert has instances and predicates, its domain expert the domain, and its planner the
plan. Here :class:`~cxbridge_ros2.experts.knowledge.ProblemExpert` has the instances and predicates in memory,
the domain is the last that the environment has parsed, and cxbridge's planners plan. Source:
Plansys2Feature.cpp, and PlanSys2's ProblemExpert.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from cxbridge.errors import CxbridgeError, PddlError
from cxbridge.executive.features.planning_base import (
    DomainOf,
    Known,
    MakeService,
    PlanningFeature,
    PlanningUser,
)
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.executive.host.values import Symbol
from cxbridge.executive.planning.settings import PlannerSettings
from cxbridge_ros2cx.plansys2_domain import why_refused

if TYPE_CHECKING:
    from cxbridge.executive.pddl import Domain
    from cxbridge.executive.planning import PlanCall, PlannerCallReporter, PlanningService, PlanResult


@dataclass(frozen=True, slots=True)
class _PlanOrder:
    """A call of ``psys2-call-planner``.

    :param formula: the goal in PDDL.
    """

    goal_id: str
    plan_id: str
    formula: str


class _PlanSys2User(PlanningUser):
    """The planning state of an environment."""

    def __init__(
        self,
        env: ClipsEnvironment,
        service: PlanningService,
        settings: PlannerSettings,
        domain_of: DomainOf,
        *,
        exact: bool = False,
    ) -> None:
        super().__init__(env, service, settings, domain_of)
        self._exact = exact
        self._checked: Domain | None = None
        self._refusal: PddlError | None = None
        from cxbridge_ros2.experts.knowledge import MemoryKnowledge, ProblemExpert  # noqa: PLC0415 - slow

        self._problem = ProblemExpert(MemoryKnowledge(), lambda: self.domain)
        self._log = env.bus.logger(f"PSYS2CLIPS|{env.name}")
        self._calls: list[tuple[_PlanOrder, PlanCall, PlannerCallReporter]] = []

    # ---- functions

    def add_instance(self, name: str, kind: str) -> None:
        try:
            self._problem.add_instance(str(name), str(kind))
        except PddlError as error:
            self._log.error(f"Problem adding instance: {name} - {kind}: {error.message}")

    def add_predicate(self, text: str) -> None:
        name, *arguments = str(text).strip().removeprefix("(").removesuffix(")").split() or [""]
        # in PlanSys2, a constant of the domain is no instance until a client adds the constant
        unknown = [word for word in arguments if word not in self._problem.knowledge.instances]
        try:
            if unknown:
                raise PddlError(f"there is no instance {', '.join(unknown)}")  # noqa: TRY301
            self._problem.add_predicate((name, tuple(arguments)))
        except PddlError as error:
            self._log.error(f"Problem adding predicate: {text}: {error.message}")

    def clear(self) -> None:
        self._problem.clear()

    def plan(self, goal_id: str, formula: str, plan_id: str) -> None:
        order = _PlanOrder(str(goal_id), str(plan_id), str(formula))
        try:
            request, reporter = self.request(order.goal_id, order.formula)
        except PddlError as error:
            # the original asserts no feedback when its problem expert refuses a goal, and the agent hangs
            self._log.error(f"Could not set the goal '{formula}' of {goal_id}: {error}")
            self._feedback(order, "PLAN-FAILED")
            return
        call = self.service.call(request)
        started = reporter.started(Symbol(order.plan_id), request.problem)
        if self.env.bus.clock.is_virtual:
            # like the original, which blocks: the clock stands still during the call
            result = call.wait()
            assert result is not None
            self._report_result(order, result, started)
        else:
            self._calls.append((order, call, started))

    def known(self, domain: Domain) -> Known:
        """Return the added instances and predicates.

        :raises PddlError: if PlanSys2 would reject the domain.
        """
        if domain is not self._checked:
            self._checked, self._refusal = domain, why_refused(domain.file)
            # cxbridge's planners may be more lenient
            if self._refusal is not None and not self._exact:
                self._log.warn(f"{self._refusal}")
        if self._refusal is not None and self._exact:
            raise self._refusal
        knowledge = self._problem.knowledge
        return list(knowledge.instances.items()), list(knowledge.predicates)

    # ---- results

    def before_run(self) -> None:
        """Assert finished plans."""
        for entry in list(self._calls):
            order, call, reporter = entry
            if call.result is not None:
                self._calls.remove(entry)
                self._report_result(order, call.result, reporter)

    def _report_result(self, order: _PlanOrder, result: PlanResult, reporter: PlannerCallReporter) -> None:
        reporter.ended(result)
        if result.status.value != "PLANNED":
            self._log.error(
                f"Could not find plan to reach goal '{order.formula}' with id {order.goal_id}: "
                f"{result.message or result.status.value}"
            )
            self._feedback(order, "PLAN-FAILED")
            return
        try:
            self.assert_plan(Symbol(order.plan_id), Symbol(order.goal_id), result.actions)
        except CxbridgeError as error:
            self._log.error(f"Cannot assert the plan {order.plan_id}: {error}")
            self._feedback(order, "PLAN-FAILED")
            return
        self._feedback(order, "PLANNED")

    def _feedback(self, order: _PlanOrder, status: str) -> None:
        self.env.assert_fact(
            "pddl-plan-feedback", {"status": Symbol(status), "plan-id": Symbol(order.plan_id)}
        )

    def close(self) -> None:
        """Cancel all planning and end the planners' processes."""
        self.service.close()
        for _, call, reporter in self._calls:
            if (result := call.wait()) is not None:
                reporter.ended(result)
        self._calls.clear()


class Plansys2Feature(PlanningFeature[_PlanSys2User]):
    """Defines the ``psys2-*`` functions.

    :param settings: the choice of planners and their time limit.
    :param domain_of: returns the last domain that an environment has parsed; None before the first.
    :param make_service: returns the planning service of an environment; None for a service with cxbridge's
        planners.
    :param exact: whether to reject domains that PlanSys2 would reject; otherwise they get a warning.
    """

    def __init__(
        self,
        name: str,
        settings: PlannerSettings,
        domain_of: DomainOf,
        make_service: MakeService | None = None,
        *,
        exact: bool = False,
    ) -> None:
        super().__init__(settings, domain_of, make_service)
        self.name = name
        self._exact = exact

    def make_user(
        self, env: ClipsEnvironment, service: PlanningService, settings: PlannerSettings, domain_of: DomainOf
    ) -> _PlanSys2User:
        user = _PlanSys2User(env, service, settings, domain_of, exact=self._exact)
        env.define("psys2-add-domain-instance", user.add_instance, 2, types="*;sy;sy")
        env.define("psys2-add-domain-predicate", user.add_predicate, 1, types="*;sy")
        env.define("psys2-clear-knowledge", user.clear)
        env.define("psys2-call-planner", user.plan, 3, types="*;sy;sy;sy")
        return user
