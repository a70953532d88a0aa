"""Skills on the skill board that end as somebody says: a script, a simulation of failures, a chosen world."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import closing
from typing import TYPE_CHECKING, Any

from cxbridge.clock import MICROSECONDS
from cxbridge.skiller.board.executor import Progress, SkillExecutor, SkillFailedError, Steps
from cxbridge.skiller.board.protocol import SkillCall
from cxbridge.skiller.simulation.estimators import Outcome
from cxbridge.skiller.skillstring import SkillStringCall
from cxbridge.skiller.status import Status

if TYPE_CHECKING:
    from cxbridge.clock import Clock
    from cxbridge.skiller.simulation.faults import FailureInjector


def as_string_call(call: SkillCall) -> SkillStringCall:
    """Return a call on the board as a Skiller has it."""
    args: dict[str | int, Any] = {int(k) if k.isdigit() else k: v for k, v in call.parameters.items()}
    return SkillStringCall(call.skill, args)


def ending_as(
    outcome: Outcome | None,
    executor: SkillExecutor,
    call: SkillCall,
    then: Callable[[], object] | None = None,
) -> Steps:
    """Yield the steps of a call that ends in a given way.

    What succeeds only takes its time. What fails is executed until it does: a robot is halfway by then.

    :param outcome: None: as the executor ends it.
    :param then: called at the end, unless the executor fails by itself.
    """
    said = None
    if outcome is None:
        said = yield from executor.execute(call)
    elif outcome.status is Status.S_FINAL:
        yield from _wait(executor.clock, outcome.seconds)
    else:
        yield from _until(executor, call, outcome.seconds)
    if then is not None:
        then()
    if outcome is not None and outcome.status is not Status.S_FINAL:
        raise SkillFailedError(outcome.error)
    return said


def _until(executor: SkillExecutor, call: SkillCall, seconds: float) -> Steps:
    """Yield the steps of an executor until so many seconds have passed; nothing new when it ends before."""
    clock = executor.clock
    start_us = clock.now_us()
    end_us = start_us + round(seconds * MICROSECONDS)
    with closing(executor.execute(call)) as steps:
        for said in steps:
            if clock.now_us() >= end_us:
                return
            yield said
    while clock.now_us() < end_us:
        yield None


def _wait(clock: Clock, seconds: float) -> Steps:
    """Yield how far a skill is that does nothing but takes its time; a step at least, as all skills."""
    start_us, needed_us = clock.now_us(), seconds * MICROSECONDS
    yield 0.0
    while (passed_us := clock.now_us() - start_us) < needed_us:
        yield passed_us / needed_us


class FailingExecution:
    """Executes skills, and lets them fail as the configuration of the simulator says.

    :param failures: those of each agent, made when it has its first call.
    """

    def __init__(self, failures: Callable[[str], FailureInjector]) -> None:
        self._make = failures
        self._failures: dict[str, FailureInjector] = {}

    def __call__(self, executor: SkillExecutor, call: SkillCall) -> Steps:
        """Return the steps of a call that begins."""
        if call.agent not in self._failures:
            self._failures[call.agent] = self._make(call.agent)
        failure = self._failures[call.agent].struck(as_string_call(call))
        steps = executor.execute(call)
        return steps if failure is None else _failing(steps, failure.after, failure.error)


def _failing(steps: Steps, share: float, error: str) -> Steps:
    """Yield the steps of an executor until it says that it has done its share, or ends; then fail."""
    with closing(steps):
        for said in steps:
            fraction = said.fraction if isinstance(said, Progress) else said
            if fraction is not None and share < 1 and fraction >= share:
                break
            yield said
    raise SkillFailedError(error)
