"""The feature ``planner``: plans made in the background from the environment's facts.

See docs/planning.md.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
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
    KnownWorld,
    PlanningFeature,
    PlanningFunctions,
    facts_in,
    objects_in,
    service_maker,
)
from cxbridge_planning.feature.plan_checks import PlanChecks
from cxbridge_planning.planner import PlanResult
from cxbridge_planning.service.service import PlanCall, PlanRequest
from cxbridge_planning.settings import PlannerSettings

if TYPE_CHECKING:
    from cxbridge.run.agent import Run

_RULES_DIR: Final = Path(__file__).resolve().parent
_GOAL_TEMPLATES: Final = ("goal", "plan", "plan-action")


@dataclass(frozen=True, slots=True)
class _RunningCall:
    """A call without result.

    :param object_names: the names of the problem's objects; None: all objects of the environment.
    :param start_us: the time of the call on the run's clock.
    """

    call: PlanCall
    reporter: PlannerCallReporter
    object_names: Collection[str] | None
    start_us: int


class _PlannerFunctions(PlanningFunctions):
    """The functions of the feature in one environment, and their running calls."""

    def __init__(self, env: ClipsEnvironment, feature: PlanningFeature) -> None:
        super().__init__(env, feature)
        self._log = env.bus.logger(f"Planner|{env.name}")
        self._checks = PlanChecks(env, self._log.warn)
        self._running_calls: dict[str, _RunningCall] = {}  # by id
        self._call_count = 0
        self._refused_count = 0
        self._has_goal_rules = False

    def define(self) -> None:
        self.env.load(_RULES_DIR / "calls.clp")
        # the types are CLIPS' codes for the arguments: any by default (*); `sy` is a string or a symbol,
        # `ld` a number, `m` a multifield
        for name, function, argument_count, types in (
            ("planner-plan", self.plan, 2, "*;sy;sy"),
            ("planner-plan-with", self.plan, 4, "*;sy;sy;sy;ld"),
            ("planner-plan-part", self.plan_part, 3, "*;sy;sy;m"),
            ("planner-cancel", self.cancel, 1, "*;sy"),
            ("planner-check", self._checks.check, 1, "*;sy"),
        ):
            self.env.define(name, function, argument_count, types=types)

    def plan_part(self, goal_id: str, formula: str, object_names: tuple[Value, ...]) -> Value:
        """Plan with some of the objects, and with the facts about these objects only."""
        return self.plan(goal_id, formula, object_names=frozenset(map(str, object_names)))

    def plan(
        self,
        goal_id: str,
        formula: str,
        planner: str = "",
        timeout: float = 0.0,
        object_names: Collection[str] | None = None,
    ) -> Value:
        """Start to plan; return the id of the call. An impossible request is a call that FAILED at once."""
        try:
            request, reporter = self.request(goal_id, formula, planner, timeout, object_names)
        except PddlError as error:
            self._log.error(f"Cannot plan for {formula}: {error}")
            # with its own number: a replay finds the calls of planners by their consecutive numbers
            self._refused_count += 1
            call_id = Symbol(f"no-plan-{self._refused_count}")
            slots = {"planner": Symbol(planner or NIL), "status": Symbol("FAILED"), "message": str(error)}
        else:
            self._call_count += 1
            call_id = Symbol(f"plan-{self._call_count}")
            reporter.report_start(call_id, request.problem)
            call, start_us = self.service.call(request), self.env.bus.clock.now_us()
            self._running_calls[call_id] = _RunningCall(call, reporter, object_names, start_us)
            slots = {"planner": Symbol(request.planner)}
        self.env.assert_fact("planner-call", {"id": call_id, "goal-id": Symbol(goal_id), **slots})
        return call_id

    def cancel(self, call_id: str) -> Value:
        """Cancel a call; return FALSE if there is no call with this id that waits for its result."""
        running_call = self._running_calls.get(call_id)
        if running_call is None:
            return FALSE
        running_call.call.cancel()
        return TRUE

    def known_world(self, domain: Domain) -> KnownWorld:
        """Return the objects, facts and values of functions in the environment."""
        functions = {function.name for function in domain.functions}
        numbers = numbers_in(self.env).items() if functions else ()
        return KnownWorld(
            objects_in(self.env),
            facts_in(self.env, domain),
            [(ground, value) for ground, value in numbers if ground[0] in functions],
        )

    def before_run(self) -> None:
        """Check the plans in execution, and assert the finished plans.

        The first run after the templates of goals exist loads the rules for goals.
        """
        # the agent's files may define goals after the feature was requested
        if not self._has_goal_rules and all(map(self.env.has_template, _GOAL_TEMPLATES)):
            self._has_goal_rules = True
            self.env.load(_RULES_DIR / "goals.clp")
        self._checks.refresh()
        # a virtual clock does not advance during the call, so that runs are reproducible
        must_wait = self.env.bus.clock.is_virtual
        for call_id, running_call in list(self._running_calls.items()):
            result = running_call.call.wait() if must_wait else running_call.call.result
            if result is not None:
                del self._running_calls[call_id]
                self._assert_result(Symbol(call_id), running_call, result)

    def _assert_result(self, call_id: Symbol, running_call: _RunningCall, result: PlanResult) -> None:
        running_call.reporter.report_end(result)
        request, object_names = running_call.call.request, running_call.object_names
        status, message = result.status.value, result.message
        if status == "PLANNED" and self.settings.check_plans:
            failure = self._checks.find_present_failure(request, result.actions, object_names)
            if failure:
                status, message = "INVALID", f"the plan does not hold: {failure}"
        has_plan = status == "PLANNED"
        if has_plan:
            self._assert_actions(call_id, request, result.actions, object_names)
        outcome_text = f"{len(result.actions)} actions" if has_plan else message
        reason = f" ({result.why})" if result.why else ""
        self._log.info(f"{call_id}: {status} by {result.planner}: {outcome_text}{reason}")
        # seconds of the run's clock: with real time in a fact, two runs would never be equal
        seconds = (self.env.bus.clock.now_us() - running_call.start_us) / MICROSECONDS
        self.env.call(
            "planner-call-ended",
            call_id,
            Symbol(status),
            Symbol(result.planner),
            call_id if has_plan else NIL,
            message,
            seconds,
            result.why,
        )

    def close(self) -> None:
        """Cancel all calls and stop the planner processes."""
        self.service.close()
        for running_call in self._running_calls.values():
            if (result := running_call.call.wait()) is not None:
                running_call.reporter.report_end(result)

    def _assert_actions(
        self,
        call_id: Symbol,
        request: PlanRequest,
        actions: tuple[PlannedAction, ...],
        object_names: Collection[str] | None,
    ) -> None:
        # rules may have retracted the fact of the call, and with it the id of the goal
        calls = (slots for _, _, slots in self.env.facts("planner-call") if slots["id"] == call_id)
        goal_id = next((Symbol(str(slots["goal-id"])) for slots in calls), NIL)
        has_times = any(action.start is not None for action in actions)
        try:
            self.assert_plan(call_id, goal_id, actions, has_times=has_times)
        except CxbridgeError as error:
            self._log.error(f"Cannot assert the plan {call_id}: {error}")
            return
        if self.settings.check_plans:
            self._checks.watch(call_id, goal_id, request, object_names)


class PlannerFeature(PlanningFeature):
    """Provides ``planner-plan`` and its variants, ``planner-cancel`` and ``planner-check``."""

    name = "planner"
    functions_class = _PlannerFunctions


def make_feature(run: Run) -> PlannerFeature:
    """Make the feature of a run."""
    settings = PlannerSettings.from_config(run.config)
    return PlannerFeature(settings, run.pddl_parser.domain_of, service_maker(run, settings))
