"""The check of a plan: its execution step by step, with conditions, effects, and finally the goal.

A durative action has two happenings, start and end. Simultaneous happenings read the same state, and none of
them may change a fact that another one reads or changes differently (PDDL 2.1: no moving targets).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Final, NamedTuple

from cxbridge.errors import PddlError
from cxbridge.executive.pddl.ast import (
    ActionSchema,
    Domain,
    Formula,
    Ground,
    Problem,
    TermComparison,
    Variable,
    names_of,
)
from cxbridge.executive.pddl.printer import format_list
from cxbridge.executive.problem.truth import DURATION
from cxbridge.history.plan_steps import PlannedAction
from cxbridge_planning.errors import PlanningError
from cxbridge_planning.objects import ObjectTable
from cxbridge_planning.validation.formulas import (
    AT_END,
    AT_START,
    OVER_ALL,
    Moment,
    describe_false_part,
    effect_changes,
    parts_at,
)
from cxbridge_planning.validation.world import Changes, WorldState

# greater than the rounding errors of times, and smaller than the differences between the times in plan files
SAME_TIME_S: Final = 1e-7
"""The maximum time between simultaneous happenings in seconds."""

TOLERANCE_S: Final = 0.001
"""The tolerance of durations in seconds, because plan files have three decimals."""


@dataclass(frozen=True, slots=True)
class PlanCheck:
    """The result of checking a plan.

    :param failure: why the plan is invalid; else empty.
    :param step: the number of the first impossible step, from 1; 0 if no step is known to be impossible, or
        if an action fails that was running before the plan.
    :param inconclusive_reason: why the check is inconclusive; else empty.
    """

    failure: str = ""
    step: int = 0
    inconclusive_reason: str = ""


class _StepError(Exception):
    """An impossible step.

    :param number: the number of the step; 0 or less for an action that was running before the plan.
    :param reason: why the step is impossible.
    :ivar step: the number for :class:`PlanCheck`, which has 0 for such actions.
    """

    def __init__(self, number: int, planned_action: PlannedAction, reason: str) -> None:
        super().__init__(f"{_describe_step(number, planned_action)}: {reason}")
        self.step = max(0, number)


@dataclass(slots=True)
class _Step:
    """A step with its action.

    :param binding: the objects of the action's parameters.
    :param start: the start in seconds after the plan's start.
    :param is_running: whether the action started before the check.
    :param start_moment: the moment of the start of a durative action, once it is executed.
    """

    number: int
    planned_action: PlannedAction
    action: ActionSchema
    binding: dict[str, str]
    start: float
    end: float
    is_running: bool = False
    start_moment: Moment | None = None

    @property
    def duration(self) -> float | None:
        return self.end - self.start if self.action.is_durative else None


class _Happening(NamedTuple):
    """The start or the end of a durative action, or an action without duration.

    :param time: the seconds after the plan's start.
    :param part: ``start`` or ``end``; empty for an action without duration.
    """

    time: float
    step: _Step
    part: str


def check_plan(
    domain: Domain,
    problem: Problem,
    actions: Iterable[PlannedAction],
    *,
    state: WorldState | None = None,
    running: Iterable[PlannedAction] = (),
    objects: ObjectTable | None = None,
) -> PlanCheck:
    """Check a plan against a problem.

    :param state: the initial state, by default the problem's.
    :param running: actions that have started; their ``start`` may be negative.
    :param objects: the objects by type, by default those of the problem.
    """
    checker = _Checker(
        domain,
        problem.goal,
        state or WorldState.from_problem(problem),
        objects or ObjectTable(domain, problem),
    )
    return checker.check(tuple(actions), tuple(running))


class _Checker:
    """Checks one plan.

    :param state: the state before the plan.
    """

    def __init__(self, domain: Domain, goal: Formula, state: WorldState, objects: ObjectTable) -> None:
        self._actions = {action.name: action for action in domain.actions}
        self._objects = objects
        self._goal = goal
        self._state = state
        self._unfinished_steps: list[_Step] = []  # durative steps between start and end

    def check(self, actions: Sequence[PlannedAction], running: Sequence[PlannedAction]) -> PlanCheck:
        try:
            # running actions have the numbers 0, -1, ...: errors name them by their text alone
            steps = [
                self._make_step(-number, action, is_running=True) for number, action in enumerate(running)
            ]
            steps += [self._make_step(number, action) for number, action in enumerate(actions, start=1)]
            happenings = sorted(self._happenings(steps), key=lambda happening: happening.time)
            for group in _group_simultaneous(happenings):
                self._execute(group)
            false_part = describe_false_part(self._goal, {}, Moment(self._state, self._objects))
        except _StepError as error:
            return PlanCheck(str(error), error.step)
        except (PlanningError, PddlError) as error:
            return PlanCheck(inconclusive_reason=str(error))
        return PlanCheck(f"the goal is not reached: {false_part}" if false_part else "")

    def _make_step(self, number: int, planned_action: PlannedAction, *, is_running: bool = False) -> _Step:
        """Return a step of a plan.

        :raises _StepError: if the action does not exist, or the objects do not suit its parameters.
        """

        def step_error(reason: str) -> _StepError:
            return _StepError(number, planned_action, reason)

        action = self._actions.get(planned_action.name)
        if action is None:
            raise step_error("there is no such action")
        names = names_of(action.parameters)
        if len(names) != len(planned_action.arguments):
            raise step_error(f"{action.name} takes {len(names)} objects, not {len(planned_action.arguments)}")
        binding = dict(zip(names, planned_action.arguments, strict=True))
        for group in action.parameters:
            allowed_objects = self._objects.of_types(group.types)
            for name in group.names:
                if binding[name] not in allowed_objects:
                    kind = " or ".join(group.types) or "object"
                    raise step_error(f"?{name} must be of type {kind}, which {binding[name]} is not")
        start, duration = planned_action.start or 0.0, planned_action.duration or 0.0
        return _Step(number, planned_action, action, binding, start, start + duration, is_running=is_running)

    def _happenings(self, steps: Sequence[_Step]) -> Iterator[_Happening]:
        """Yield the happenings of the steps.

        In a plan without times, the steps get consecutive times.
        """
        is_timed = any(step.planned_action.start is not None for step in steps)
        next_start = 0.0
        for step in steps:
            if not is_timed:
                step.start, step.end = next_start, next_start + (step.planned_action.duration or 1.0)
                next_start = step.end + 1.0  # a gap, because simultaneous happenings may interfere
            if step.action.is_durative:
                yield from (_Happening(step.start, step, "start"), _Happening(step.end, step, "end"))
            else:
                yield _Happening(step.start, step, "")

    def _execute(self, happenings: Sequence[_Happening]) -> None:
        """Execute simultaneous happenings."""
        state_before = self._state
        executed_happenings = [
            (happening, *self._execute_happening(happening, state_before)) for happening in happenings
        ]
        _refuse_interference(executed_happenings)
        for _, _, changes in executed_happenings:
            # all steps have computed their numbers from the same state: simultaneous changes add up
            numbers = {
                ground: value + self._state.numbers.get(ground, 0.0) - state_before.numbers.get(ground, 0.0)
                for ground, value in changes.numbers.items()
            }
            self._state = self._state.after(replace(changes, numbers=numbers))
        for happening, _, _ in executed_happenings:
            if happening.part == "start":
                self._unfinished_steps.append(happening.step)
            elif happening.part == "end":
                self._unfinished_steps.remove(happening.step)
        for step in self._unfinished_steps:
            self._require(step, list(parts_at(step.action.condition, OVER_ALL)), self._state)

    def _execute_happening(self, happening: _Happening, state: WorldState) -> tuple[set[Ground], Changes]:
        """Return the facts and functions that a happening reads, and its changes.

        :raises _StepError: if a condition is false, or the duration is impossible.
        """
        step, action = happening.step, happening.step.action
        moment = Moment(state, self._objects, step.duration, step.start_moment)
        is_start = happening.part == "start"
        # an action without duration has its conditions at the start and its effects at the end
        conditions = list(parts_at(action.condition, AT_END if happening.part == "end" else AT_START))
        reads = set[Ground]()
        if is_start:
            step.start_moment = moment
        # the executive applies all effects of an action after its end. So the facts lack the effects that a
        # running action had at its start: these effects are applied here, too
        if not step.is_running or happening.part == "end":  # conditions of a running action held at its start
            self._require(step, conditions, state)
            if is_start and action.duration is not None and step.planned_action.duration is not None:
                _check_duration(step, action.duration, moment)
            reads = set[Ground]().union(*moment.reads_of(conditions, step.binding))
            if is_start:  # the start also needs the facts that must be true from now on
                true_reads, _other_reads = moment.reads_of(parts_at(action.condition, OVER_ALL), step.binding)
                reads |= true_reads
        return reads, effect_changes(action.effect, step.binding, moment, AT_START if is_start else AT_END)

    def _require(self, step: _Step, conditions: Iterable[Formula], state: WorldState) -> None:
        """Raise ``_StepError`` if a condition of a step is false in a state."""
        moment = Moment(state, self._objects, step.duration, step.start_moment)
        for condition in conditions:
            false_part = describe_false_part(condition, step.binding, moment)
            if false_part:
                raise _StepError(step.number, step.planned_action, false_part)


def _group_simultaneous(happenings: Sequence[_Happening]) -> Iterator[list[_Happening]]:
    """Yield groups of simultaneous happenings.

    :param happenings: sorted by time.
    """
    group: list[_Happening] = []
    for happening in happenings:
        if group and happening.time - group[0].time > SAME_TIME_S:
            yield group
            group = []
        group.append(happening)
    if group:
        yield group


def _refuse_interference(executed_happenings: Sequence[tuple[_Happening, set[Ground], Changes]]) -> None:
    """Refuse simultaneous happenings if one changes a fact that another reads or changes differently.

    :param executed_happenings: each happening with the facts and functions that it reads, and its changes.
    :raises _StepError: for the second of two such happenings.
    """
    for (first, first_reads, first_changes), (second, second_reads, second_changes) in combinations(
        executed_happenings, 2
    ):
        conflicts = (
            first_reads & second_changes.written
            | second_reads & first_changes.written
            | first_changes.adds & second_changes.deletes
            | first_changes.deletes & second_changes.adds
        )
        if conflicts:
            name, arguments = min(conflicts)  # the smallest, so that the error is reproducible
            raise _StepError(
                second.step.number,
                second.step.planned_action,
                f"at {second.time:g} s this action and "
                f"{_format_action(first.step.planned_action)} both affect {format_list(name, *arguments)}; "
                "begin one of the two actions later",
            )


def _check_duration(step: _Step, constraint: Formula, moment: Moment) -> None:
    """Check the constraint on ``?duration`` within the tolerance.

    :raises _StepError: if the duration of the step is impossible.
    """
    duration = step.duration or 0.0
    for part in (*parts_at(constraint, AT_START), *parts_at(constraint, AT_END)):
        limit = None
        match part:
            # a bound of ?duration has a limit; any other constraint is checked like a condition
            case TermComparison(operator=sign, left=Variable(name=name), right=right) if name == DURATION:
                limit = moment.known_state().number(right, step.binding)
        if limit is None:
            requirement_text = describe_false_part(part, step.binding, moment)
            is_violated = bool(requirement_text)
        else:
            is_too_long = sign in ("=", "<=", "<") and duration > limit + TOLERANCE_S
            is_violated = is_too_long or (sign in ("=", ">=", ">") and duration < limit - TOLERANCE_S)
            requirement_text = f"the domain requires {'' if sign == '=' else f'{sign} '}{limit:g}"
        if is_violated:
            reason = f"it takes {duration:g} s, but {requirement_text}"
            raise _StepError(step.number, step.planned_action, reason)


def _format_action(planned_action: PlannedAction) -> str:
    return format_list(planned_action.name, *planned_action.arguments)


def _describe_step(number: int, planned_action: PlannedAction) -> str:
    """Return the start of an error about a step; see :class:`_StepError`."""
    return (
        f"step {number}, {_format_action(planned_action)}"
        if number > 0
        else f"{_format_action(planned_action)}, running"
    )
