"""The feature ``planner``: plans made in the background from the environment's facts.

See docs/planning.md.
"""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path
from typing import TYPE_CHECKING, Final

from cxbridge.clock import MICROSECONDS
from cxbridge.errors import CxbridgeError, PddlError
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.executive.host.values import FALSE, NIL, TRUE, Symbol, Value
from cxbridge.executive.pddl.ast import Domain
from cxbridge.executive.problem.facts import numbers_in
from cxbridge.history.plan_steps import PlannedAction
from cxbridge_planning.call_events import PlannerCallReporter
from cxbridge_planning.feature.base import (
    DomainOf,
    KnownWorld,
    Numbers,
    PlanningFeature,
    PlanningFunctions,
    facts_in,
    objects_in,
    service_maker,
)
from cxbridge_planning.feature.plan_checks import PlanChecks
from cxbridge_planning.planner import PlanResult
from cxbridge_planning.service.service import PlanCall, PlanningService, PlanRequest
from cxbridge_planning.settings import PlannerSettings

if TYPE_CHECKING:
    from cxbridge.run.agent import Run

_RULES_DIR: Final = Path(__file__).resolve().parent
_GOAL_TEMPLATES: Final = ("goal", "plan", "plan-action")


class _PlannerFunctions(PlanningFunctions):
    """The functions of the feature in one environment, and their running calls."""

    def __init__(
        self,
        env: ClipsEnvironment,
        service: PlanningService,
        settings: PlannerSettings,
        domain_of: DomainOf,
    ) -> None:
        super().__init__(env, service, settings, domain_of)
        self._log = env.bus.logger(f"Planner|{env.name}")
        self._checks = PlanChecks(env, self._log.warn)
        # the running calls by id, with their objects, reporters and start times
        self._calls: dict[str, PlanCall] = {}
        self._objects: dict[str, Collection[str] | None] = {}
        self._reporters: dict[str, PlannerCallReporter] = {}
        self._began_us: dict[str, int] = {}
        self._call_count = 0
        self._refused_count = 0
        self._has_goal_rules = False

    def plan(self, goal_id: str, formula: str, planner: str = "", timeout: float = 0.0) -> Value:
        return self._plan(goal_id, formula, planner, timeout)

    def plan_part(self, goal_id: str, formula: str, objects: tuple[Value, ...]) -> Value:
        """Plan with some of the objects, and with the facts about these objects only."""
        return self._plan(goal_id, formula, objects=frozenset(map(str, objects)))

    def _plan(
        self,
        goal_id: str,
        formula: str,
        planner: str = "",
        timeout: float = 0.0,
        objects: Collection[str] | None = None,
    ) -> Value:
        """Start to plan; return the id of the call. An impossible request is a call that FAILED at once."""
        try:
            request, reporter = self.request(goal_id, formula, planner, timeout, objects)
        except PddlError as error:
            self._log.error(f"Cannot plan for {formula}: {error}")
            slots = {"status": Symbol("FAILED"), "message": str(error), "planner": Symbol(planner or NIL)}
            self._refused_count += 1
            refused_id = Symbol(f"no-plan-{self._refused_count}")
            self.env.assert_fact("planner-call", {"id": refused_id, "goal-id": Symbol(goal_id), **slots})
            return refused_id
        self._call_count += 1
        call_id = Symbol(f"plan-{self._call_count}")
        self._objects[call_id] = objects
        self._reporters[call_id] = reporter.report_start(call_id, request.problem)
        self._calls[call_id] = self.service.call(request)
        self._began_us[call_id] = self.env.bus.clock.now_us()
        self.env.assert_fact(
            "planner-call", {"id": call_id, "goal-id": Symbol(goal_id), "planner": Symbol(request.planner)}
        )
        return call_id

    def cancel(self, call_id: str) -> Value:
        """Cancel a call; return FALSE if no call with this id is running."""
        call = self._calls.get(call_id)
        if call is None:
            return FALSE
        call.cancel()
        return TRUE

    def known_world(self, domain: Domain) -> KnownWorld:
        """Return the objects and facts of the environment."""
        predicates = {predicate.name for predicate in domain.predicates}
        return objects_in(self.env), facts_in(self.env, predicates)

    def numbers(self, domain: Domain) -> Numbers:
        """Return the values of the domain's functions."""
        functions = {function.name for function in domain.functions}
        return [item for item in numbers_in(self.env).items() if item[0][0] in functions] if functions else []

    def before_run(self) -> None:
        """Assert the finished plans."""
        if not self._has_goal_rules:  # the agent's files may define goals after the feature was requested
            self._load_goal_rules()
        self._checks.refresh()
        # a virtual clock does not advance during the call, so that runs are reproducible
        must_wait = self.env.bus.clock.is_virtual
        for call_id, call in list(self._calls.items()):
            result = call.wait() if must_wait else call.result
            if result is not None:
                del self._calls[call_id]
                self._assert_result(call_id, call.request, result)

    def check(self, plan_id: str) -> Value:
        """Check the remaining actions of a plan."""
        return self._checks.check(plan_id)

    def _load_goal_rules(self) -> None:
        """Load the rules that plan for goals, if the templates of goals and plans exist."""
        if all(self.env.has_template(name) for name in _GOAL_TEMPLATES):
            self._has_goal_rules = True
            self.env.load(_RULES_DIR / "goals.clp")

    def _assert_result(self, call_id: str, request: PlanRequest, result: PlanResult) -> None:
        self._reporters.pop(call_id).report_end(result)
        objects = self._objects.pop(call_id)
        status, message = result.status.value, result.message
        if status == "PLANNED" and self.settings.check_plans:
            failure = self._checks.present_failure(request, result.actions, objects)
            if failure:
                status, message = "INVALID", f"the plan does not hold: {failure}"
        planned = status == "PLANNED"
        if planned:
            self._assert_actions(Symbol(call_id), request, result.actions, objects)
        text = f"{len(result.actions)} actions" if planned else message
        reason = f" ({result.why})" if result.why else ""
        self._log.info(f"{call_id}: {status} by {result.planner}: {text}{reason}")
        # seconds of the run's clock: with real time in a fact, two runs would never be equal
        seconds = (self.env.bus.clock.now_us() - self._began_us.pop(call_id)) / MICROSECONDS
        self.env.call(
            "planner-call-ended",
            Symbol(call_id),
            Symbol(status),
            Symbol(result.planner),
            Symbol(call_id) if planned else NIL,
            message,
            seconds,
            result.why,
        )

    def close(self) -> None:
        """Cancel all calls and stop the planner processes."""
        self.service.close()
        for call_id, call in self._calls.items():
            if (result := call.wait()) is not None:
                self._reporters.pop(call_id).report_end(result)

    def _assert_actions(
        self,
        call_id: Symbol,
        request: PlanRequest,
        actions: tuple[PlannedAction, ...],
        objects: Collection[str] | None,
    ) -> None:
        # rules may have retracted the fact of the call, and with it the id of the goal
        goals = [slots["goal-id"] for _, _, slots in self.env.facts("planner-call") if slots["id"] == call_id]
        goal_id = Symbol(str(goals[0])) if goals else NIL
        timed = any(action.start is not None for action in actions)
        try:
            self.assert_plan(call_id, goal_id, actions, timed=timed)
        except CxbridgeError as error:
            self._log.error(f"Cannot assert the plan {call_id}: {error}")
            return
        if self.settings.check_plans:
            self._checks.watch(call_id, goal_id, request, objects)


class PlannerFeature(PlanningFeature[_PlannerFunctions]):
    """Provides ``planner-plan`` and its variants, ``planner-cancel`` and ``planner-check``."""

    name = "planner"

    def make_functions(
        self, env: ClipsEnvironment, service: PlanningService, settings: PlannerSettings, domain_of: DomainOf
    ) -> _PlannerFunctions:
        functions = _PlannerFunctions(env, service, settings, domain_of)
        env.load(_RULES_DIR / "calls.clp")
        for name, function, argument_count, types in (
            ("planner-plan", functions.plan, 2, "*;sy;sy"),
            ("planner-plan-with", functions.plan, 4, "*;sy;sy;sy;ld"),
            ("planner-plan-part", functions.plan_part, 3, "*;sy;sy;m"),
            ("planner-cancel", functions.cancel, 1, "*;sy"),
            ("planner-check", functions.check, 1, "*;sy"),
        ):
            env.define(name, function, argument_count, types=types)
        return functions


def make_feature(run: Run) -> PlannerFeature:
    """Make the feature of a run."""
    settings = PlannerSettings.from_config(run.config)
    return PlannerFeature(settings, run.pddl_parser.domain_of, service_maker(run, settings))
