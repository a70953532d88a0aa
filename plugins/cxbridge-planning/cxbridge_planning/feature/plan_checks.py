"""Checks of plans during their execution: the facts ``plan-valid`` of the feature ``planner``.

A plan is checked again when facts that it may depend on have changed. The check executes the remaining
actions from the present facts (:mod:`cxbridge_planning.validation`). A fact ``plan-valid`` shows the agent
the result, so that it can plan again before an action fails.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Final

from msgspec.structs import replace

from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.executive.host.values import FALSE, TRUE, Symbol, Value
from cxbridge.executive.pddl.ast import Domain, Problem, TypedNames, names_of
from cxbridge.executive.problem.facts import (
    FUNCTION_TEMPLATE,
    OBJECT_TEMPLATE,
    PREDICATE_TEMPLATE,
    numbers_in,
)
from cxbridge.history.plan_steps import PlannedAction
from cxbridge_planning.feature.base import facts_in, objects_in
from cxbridge_planning.objects import ObjectTable
from cxbridge_planning.service.service import PlanRequest
from cxbridge_planning.validation.plan import check_plan
from cxbridge_planning.validation.world import WorldState

PLAN_VALID: Final = "plan-valid"
# templates of the facts that a plan depends on
_WATCHED_TEMPLATES: Final = (PREDICATE_TEMPLATE, OBJECT_TEMPLATE, FUNCTION_TEMPLATE, "plan-action")

_PENDING_STATES: Final = frozenset({"FORMULATED", "PENDING", "WAITING"})
# states in which an action's effects are not applied yet, so the facts are inconsistent
_UNSETTLED_STATES: Final = frozenset({"EXECUTION-SUCCEEDED", "SENSED-EFFECTS-WAIT", "SENSED-EFFECTS-HOLD"})

# states of an action after which its plan is not checked again: the agent reacts to the failure
_FAILED_STATES: Final = frozenset({"EXECUTION-FAILED", "FAILED"})


@dataclass(slots=True)
class _CheckedPlan:
    """A plan with the result of its last check.

    :param problem: the problem; only its goal counts, because present facts replace the initial state.
    :param object_names: the names of the problem's objects; None: all objects of the environment.
    :param change_count: the number of changes of facts that the last check has considered, or that came while
        the plan could not be checked; -1 before the first check.
    :param failure: the failure in the last check; empty if the plan was valid.
    :param objects: the objects at the last check; None before the first check.
    :param object_change_count: the number of changes of objects up to the last check; -1 before the first.
    """

    domain: Domain
    problem: Problem
    object_names: Collection[str] | None = None
    change_count: int = -1
    failure: str = ""
    objects: ObjectTable | None = None
    object_change_count: int = -1


class PlanChecks:
    """Checks plans of an environment against its facts."""

    def __init__(self, env: ClipsEnvironment, warn: Callable[[str], None]) -> None:
        self._env = env
        self._warn = warn
        self._plans: dict[str, _CheckedPlan] = {}
        self._change_counts: Counter[str] = Counter()  # by template
        self._is_listening = False

    def find_present_failure(
        self, request: PlanRequest, actions: tuple[PlannedAction, ...], object_names: Collection[str] | None
    ) -> str:
        """Return why a new plan fails in the present state; empty if the plan is valid.

        :param object_names: the names of the problem's objects; None: all objects of the environment.
        """
        return self._find_failure(_CheckedPlan(request.domain, request.problem, object_names), actions, ())

    def watch(
        self, plan_id: str, goal_id: str, request: PlanRequest, object_names: Collection[str] | None
    ) -> None:
        """Start to check a plan after changes, and assert its fact.

        :param object_names: as in :meth:`find_present_failure`.
        """
        if not self._is_listening:  # without a plan, changes are not counted
            self._is_listening = True
            for template in _WATCHED_TEMPLATES:
                # each update() counts one change of the template
                self._env.watcher.follow_changes(template, partial(self._change_counts.update, (template,)))
        # the next check is due after the next change: `find_present_failure` has just checked the plan
        self._plans[plan_id] = _CheckedPlan(
            request.domain, request.problem, object_names, self._change_counts.total()
        )
        self._env.assert_fact(PLAN_VALID, {"plan-id": Symbol(plan_id), "goal-id": Symbol(goal_id)})

    def refresh(self) -> None:
        """Check the plans after changes of facts; drop the plans without a fact ``plan-valid``."""
        if not self._plans:
            return
        present_ids = {str(plan) for (plan,) in self._env.columns(PLAN_VALID, "plan-id")}
        for plan_id in list(self._plans):
            if plan_id in present_ids:
                self.check(plan_id)
            else:
                del self._plans[plan_id]

    def check(self, plan_id: str) -> Value:
        """Check the remaining actions of a plan and update its fact; return TRUE if the plan is valid.

        Without relevant changes, or while the plan cannot be checked, the result is that of the last check.
        For an unknown plan, the result is FALSE.
        """
        plan = self._plans.get(plan_id)
        if plan is None:
            self._warn(f"plan '{plan_id}' is not a checked plan")
            return FALSE
        if plan.change_count != self._change_counts.total():
            plan.change_count = self._change_counts.total()
            running_actions, pending_actions, is_settled = self._read_actions(plan_id)
            if is_settled:
                plan.failure = self._find_failure(plan, tuple(pending_actions), tuple(running_actions))
                self._record_failure(plan_id, plan.failure)
        return FALSE if plan.failure else TRUE

    def _read_actions(self, plan_id: str) -> tuple[list[PlannedAction], list[PlannedAction], bool]:
        """Return the running actions, the pending actions, and whether the plan can be checked now."""
        running_actions, pending_actions, is_settled = [], [], True
        action_slots = [
            slots for _, _, slots in self._env.facts("plan-action") if slots["plan-id"] == plan_id
        ]
        for slots in sorted(action_slots, key=_find_action_number):
            state = str(slots["state"])
            if state in _PENDING_STATES:
                pending_actions.append(_make_planned_action(slots))
            elif state == "RUNNING":
                running_actions.append(_make_planned_action(slots))
            is_settled = is_settled and state not in _UNSETTLED_STATES and state not in _FAILED_STATES
        return running_actions, pending_actions, is_settled

    def _find_failure(
        self,
        plan: _CheckedPlan,
        pending_actions: tuple[PlannedAction, ...],
        running_actions: tuple[PlannedAction, ...],
    ) -> str:
        """Return why the actions fail in the present state; empty if they do not."""
        domain = plan.domain
        facts = facts_in(self._env, domain)
        numbers = numbers_in(self._env) if domain.functions else {}
        objects = self._find_objects(plan)
        if plan.object_names is not None:
            # the check would refuse facts about objects that the problem lacks
            known_objects = objects.of_types(())
            facts = [
                (predicate, arguments)
                for predicate, arguments in facts
                if all(argument in known_objects for argument in arguments)
            ]
        state = WorldState(frozenset(facts), numbers)
        return check_plan(
            domain, plan.problem, pending_actions, state=state, running=running_actions, objects=objects
        ).failure

    def _find_objects(self, plan: _CheckedPlan) -> ObjectTable:
        """Return the present objects, cached until their facts change."""
        change_count = self._change_counts[OBJECT_TEMPLATE]
        if plan.objects is None or plan.object_change_count != change_count:
            constants = set(names_of(plan.domain.constants))
            groups = tuple(
                TypedNames((name,), (type_,))
                for name, type_ in dict.fromkeys(objects_in(self._env))
                if name not in constants and (plan.object_names is None or name in plan.object_names)
            )
            plan.objects = ObjectTable(plan.domain, replace(plan.problem, objects=groups))
            plan.object_change_count = change_count
        return plan.objects

    def _record_failure(self, plan_id: str, failure: str) -> None:
        """Update the fact of a plan.

        :param failure: the failure in the last check; empty if the plan is valid.
        """
        # a list, because the loop changes the facts
        for index, _, slots in list(self._env.facts(PLAN_VALID)):
            if slots["plan-id"] != plan_id or slots["message"] == failure:
                continue
            if failure:
                self._warn(f"plan '{plan_id}' is no longer valid: {failure}")
            self._env.retract(index)
            self._env.assert_fact(
                PLAN_VALID, {**slots, "valid": FALSE if failure else TRUE, "message": failure}
            )


def _find_action_number(slots: Mapping[str, Value]) -> int:
    number = slots["id"]
    return number if isinstance(number, int) else 0  # rules may store any value


def _make_planned_action(slots: Mapping[str, Value]) -> PlannedAction:
    """Return the action of a fact ``plan-action``."""
    start, duration, values = slots["dispatch-time"], slots["duration"], slots["param-values"]
    assert isinstance(values, tuple)
    is_timed = isinstance(start, float) and start >= 0.0  # the core's default is -1.0
    # isinstance() again, for the type checker
    return PlannedAction(
        str(slots["action-name"]),
        tuple(map(str, values)),
        start if is_timed and isinstance(start, float) else None,
        duration if is_timed and isinstance(duration, float) else None,
    )
