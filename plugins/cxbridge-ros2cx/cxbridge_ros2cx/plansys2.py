"""The original's feature ``plansys2``, with our planners in place of PlanSys2's nodes.

PlanSys2's problem expert keeps instances and predicates, its domain expert the domain, and its planner makes
the plan. Here the first is :class:`~cxbridge_ros2.experts.knowledge.ProblemExpert`, in memory, the
domain is the last one that the environment parsed, and the planning service plans.
Source: Plansys2Feature.cpp, and PlanSys2's ProblemExpert.
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
class _WantedPlan:
    """A plan that was asked for."""

    goal_id: str
    plan_id: str
    formula: str


class _PlanSys2User(PlanningUser):
    """An environment that plans."""

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
        from cxbridge_ros2.experts.knowledge import MemoryKnowledge, ProblemExpert  # noqa: PLC0415

        self._problem = ProblemExpert(MemoryKnowledge(), lambda: self.domain)
        self._log = env.bus.logger(f"PSYS2CLIPS|{env.name}")
        self._calls: list[tuple[_WantedPlan, PlanCall, PlannerCallReporter]] = []

    # ---- functions

    def add_instance(self, name: str, kind: str) -> None:
        try:
            self._problem.add_instance(str(name), str(kind))
        except PddlError as error:
            self._log.error(f"Problem adding instance: {name} - {kind}: {error.message}")

    def add_predicate(self, text: str) -> None:
        name, *arguments = str(text).strip().removeprefix("(").removesuffix(")").split() or [""]
        # a constant of the domain is no instance there, until a client adds it
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
        wanted = _WantedPlan(str(goal_id), str(plan_id), str(formula))
        try:
            request, reporter = self.request(wanted.goal_id, wanted.formula)
        except PddlError as error:
            # the original says nothing to CLIPS when its problem expert refuses a goal: the agent hangs
            self._log.error(f"Could not set the goal '{formula}' of {goal_id}: {error}")
            self._feedback(wanted, "PLAN-FAILED")
            return
        call = self.service.call(request)
        started = reporter.started(Symbol(wanted.plan_id), request.problem)
        if self.env.bus.clock.is_virtual:
            # as the original, which blocks: the clock stands still during the call
            result = call.wait()
            assert result is not None
            self._report_result(wanted, result, started)
        else:
            self._calls.append((wanted, call, started))

    def known(self, domain: Domain) -> Known:
        """Return the instances and predicates that were added.

        :raises PddlError: when PlanSys2 would refuse the domain.
        """
        self._check(domain)
        if self._refusal is not None and self._exact:
            raise self._refusal
        knowledge = self._problem.knowledge
        return list(knowledge.instances.items()), list(knowledge.predicates)

    def _check(self, domain: Domain) -> None:
        """See whether PlanSys2 would take the domain; our planners may well do."""
        if domain is self._checked:
            return
        self._checked, self._refusal = domain, why_refused(domain.file)
        if self._refusal is not None and not self._exact:
            self._log.warn(f"{self._refusal}")

    # ---- results

    def before_run(self) -> None:
        """Assert the plans that are ready."""
        for entry in list(self._calls):
            wanted, call, reporter = entry
            if call.result is not None:
                self._calls.remove(entry)
                self._report_result(wanted, call.result, reporter)

    def _report_result(self, wanted: _WantedPlan, result: PlanResult, reporter: PlannerCallReporter) -> None:
        reporter.ended(result)
        if result.status.value != "PLANNED":
            self._log.error(
                f"Could not find plan to reach goal '{wanted.formula}' with id {wanted.goal_id}: "
                f"{result.message or result.status.value}"
            )
            self._feedback(wanted, "PLAN-FAILED")
            return
        try:
            self.assert_plan(Symbol(wanted.plan_id), Symbol(wanted.goal_id), result.actions)
        except CxbridgeError as error:
            self._log.error(f"Cannot assert the plan {wanted.plan_id}: {error}")
            self._feedback(wanted, "PLAN-FAILED")
            return
        self._feedback(wanted, "PLANNED")

    def _feedback(self, wanted: _WantedPlan, status: str) -> None:
        self.env.assert_fact(
            "pddl-plan-feedback", {"status": Symbol(status), "plan-id": Symbol(wanted.plan_id)}
        )

    def close(self) -> None:
        """Cancel all planning and end the planners' processes."""
        self.service.close()
        for _, call, reporter in self._calls:
            if (result := call.wait()) is not None:
                reporter.ended(result)
        self._calls.clear()


class Plansys2Feature(PlanningFeature[_PlanSys2User]):
    """Gives the ``psys2-*`` functions.

    :param name: the name of the feature in the configuration.
    :param settings: which planner, how long.
    :param domain_of: the domain that an environment parsed last; None when it parsed none.
    :param make_service: makes the service that plans for the environment of this name; None: by planners.
    :param exact: refuse domains that PlanSys2 would refuse; else there is a warning.
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
        """Define the functions."""
        user = _PlanSys2User(env, service, settings, domain_of, exact=self._exact)
        env.define("psys2-add-domain-instance", user.add_instance, 2, types="*;sy;sy")
        env.define("psys2-add-domain-predicate", user.add_predicate, 1, types="*;sy")
        env.define("psys2-clear-knowledge", user.clear)
        env.define("psys2-call-planner", user.plan, 3, types="*;sy;sy;sy")
        return user
