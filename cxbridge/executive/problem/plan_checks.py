"""Validation of plans during their execution: the facts ``plan-valid`` of the feature ``planner``."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Final

from cxbridge.errors import PddlError
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.executive.host.values import FALSE, TRUE, Symbol, Value
from cxbridge.executive.problem.facts import FUNCTION, INSTANCE, PREDICATE, facts_in, numbers_in, objects_in

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Mapping

    from cxbridge.executive.pddl import Domain, Problem
    from cxbridge.executive.pddl.types import ObjectTable
    from cxbridge.executive.planning import PlannedAction, PlanRequest

FACT: Final = "plan-valid"
# templates of the facts that a plan depends on
_DEPENDS_ON: Final = (PREDICATE, INSTANCE, FUNCTION, "plan-action")

_NOT_BEGUN: Final = frozenset({"FORMULATED", "PENDING", "WAITING"})
# states in which an action's effects are not applied yet, so the facts are inconsistent
_SETTLING: Final = frozenset({"EXECUTION-SUCCEEDED", "SENSED-EFFECTS-WAIT", "SENSED-EFFECTS-HOLD"})

# states after which a plan is not checked again: the agent reacts to the failure
_FAILED: Final = frozenset({"EXECUTION-FAILED", "FAILED"})


@dataclass(slots=True)
class _CheckedPlan:
    """A checked plan.

    :param problem: the problem; only its goal counts, since present facts replace the initial state.
    :param only: the objects of a partial problem; None stands for all objects.
    :param checked_at: the count of changes at the last check.
    :param failure: the failure of the last check; empty if the plan was valid.
    :param objects: the objects, with the count of object changes they are valid for.
    """

    domain: Domain
    problem: Problem
    only: Collection[str] | None = None
    checked_at: int = -1
    failure: str = ""
    objects: tuple[int, ObjectTable] | None = None


class PlanChecks:
    """Checks plans of an environment against its facts."""

    def __init__(self, env: ClipsEnvironment, warn: Callable[[str], None]) -> None:
        self._env = env
        self._warn = warn
        self._plans: dict[str, _CheckedPlan] = {}
        self._changes: Counter[str] = Counter()
        self._listens = False

    def failure_now(
        self, request: PlanRequest, actions: tuple[PlannedAction, ...], only: Collection[str] | None
    ) -> str:
        """Return why a new plan fails in the present state; empty if it is valid."""
        return self._failure(_CheckedPlan(request.domain, request.problem, only), actions, ())

    def watch(self, plan_id: str, goal_id: str, request: PlanRequest, only: Collection[str] | None) -> None:
        """Start checking a plan, and assert its fact."""
        self._listen()
        self._plans[plan_id] = _CheckedPlan(request.domain, request.problem, only, self._changes.total())
        slots: dict[str, Value] = {"plan-id": Symbol(plan_id), "goal-id": Symbol(goal_id)}
        self._env.assert_fact(FACT, slots)

    def refresh(self) -> None:
        """Check the plans whose facts have changed; drop plans without ``plan-valid`` fact."""
        if not self._plans:
            return
        facts = {str(plan) for (plan,) in self._env.columns(FACT, "plan-id")}
        for plan_id in list(self._plans):
            if plan_id in facts:
                self.check(plan_id)
            else:
                del self._plans[plan_id]

    def check(self, plan_id: str) -> Value:
        """Check the remaining actions of a plan and update its fact."""
        plan = self._plans.get(plan_id)
        if plan is None:
            self._warn(f"plan '{plan_id}' is not a checked plan")
            return FALSE
        if plan.checked_at != self._changes.total():
            plan.checked_at = self._changes.total()
            running, pending, is_settled = self._actions(plan_id)
            if is_settled:
                plan.failure = self._failure(plan, tuple(pending), tuple(running))
                self._record_failure(plan_id, plan.failure)
        return FALSE if plan.failure else TRUE

    def _listen(self) -> None:
        """Start counting changes of facts, at the first plan."""
        if not self._listens:
            self._listens = True
            for template in _DEPENDS_ON:
                self._env.watcher.follow_changes(template, partial(self._changes.update, (template,)))

    def _actions(self, plan_id: str) -> tuple[list[PlannedAction], list[PlannedAction], bool]:
        """Return running actions, pending actions, and whether the facts are consistent."""
        running, pending, is_settled = [], [], True
        rows = [slots for _, _, slots in self._env.facts("plan-action") if slots["plan-id"] == plan_id]
        for slots in sorted(rows, key=_number):
            state = str(slots["state"])
            if state in _NOT_BEGUN:
                pending.append(_planned(slots))
            elif state == "RUNNING":
                running.append(_planned(slots))
            is_settled = is_settled and state not in _SETTLING and state not in _FAILED
        return running, pending, is_settled

    def _failure(
        self, plan: _CheckedPlan, pending: tuple[PlannedAction, ...], running: tuple[PlannedAction, ...]
    ) -> str:
        from cxbridge.executive.planning.validation.plan import check_plan  # noqa: PLC0415
        from cxbridge.executive.planning.validation.world import WorldState  # noqa: PLC0415

        domain = plan.domain
        facts = facts_in(self._env, {predicate.name for predicate in domain.predicates})
        numbers = numbers_in(self._env) if domain.functions else {}
        objects = self._objects(plan)
        if plan.only is not None:
            # a fact about an object outside of a partial problem would be an error
            present = objects.of(())
            facts = [fact for fact in facts if all(name in present for name in fact[1])]
        state = WorldState(frozenset(facts), numbers)
        try:
            result = check_plan(domain, plan.problem, pending, state=state, running=running, objects=objects)
        except PddlError as error:
            return str(error)
        return result.failure

    def _objects(self, plan: _CheckedPlan) -> ObjectTable:
        """Return the present objects, cached until their facts change."""
        from msgspec.structs import replace  # noqa: PLC0415  slow: most agents do not plan

        from cxbridge.executive.pddl.ast import TypedNames, names_of  # noqa: PLC0415
        from cxbridge.executive.pddl.types import ObjectTable  # noqa: PLC0415

        changes = self._changes[INSTANCE]
        if plan.objects is None or plan.objects[0] != changes:
            constants = set(names_of(plan.domain.constants))
            groups = [
                TypedNames((name,), (kind,))
                for name, kind in dict.fromkeys(objects_in(self._env))
                if name not in constants and (plan.only is None or name in plan.only)
            ]
            problem = replace(plan.problem, objects=tuple(groups))
            plan.objects = (changes, ObjectTable(plan.domain, problem))
        return plan.objects[1]

    def _record_failure(self, plan_id: str, failure: str) -> None:
        for index, _, slots in list(self._env.facts(FACT)):
            if slots["plan-id"] != plan_id or slots["message"] == failure:
                continue
            if failure:
                self._warn(f"plan '{plan_id}' holds no longer: {failure}")
            self._env.retract(index)
            self._env.assert_fact(FACT, {**slots, "valid": FALSE if failure else TRUE, "message": failure})


def _number(slots: Mapping[str, Value]) -> int:
    value = slots["id"]
    return value if isinstance(value, int) else 0


def _planned(slots: Mapping[str, Value]) -> PlannedAction:
    from cxbridge.executive.planning import PlannedAction  # noqa: PLC0415

    start, duration, values = slots["dispatch-time"], slots["duration"], slots["param-values"]
    assert isinstance(values, tuple)
    timed = isinstance(start, float) and start >= 0.0
    return PlannedAction(
        str(slots["action-name"]),
        tuple(map(str, values)),
        float(start) if timed and isinstance(start, float) else None,
        float(duration) if timed and isinstance(duration, float) else None,
    )
