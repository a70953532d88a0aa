"""Execution of calls on the skill board whose ends are decided: by a script, failures or a chosen world."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import closing
from typing import TYPE_CHECKING, Any

from cxbridge.clock import MICROSECONDS
from cxbridge.numbers import parse_decimal
from cxbridge.skiller.board.executor import Progress, SkillExecutor, SkillFailedError, Steps
from cxbridge.skiller.board.protocol import SkillCall
from cxbridge.skiller.simulation.deciders import Decider, Outcome, decide_outcome
from cxbridge.skiller.skillstring import SkillStringCall

if TYPE_CHECKING:
    from cxbridge.clock import Clock


def to_string_call(call: SkillCall) -> SkillStringCall:
    """Return a skill board's call as a skill string's call."""
    args: dict[str | int, Any] = {}
    for name, value in call.parameters.items():
        position = parse_decimal(name)
        args[name if position is None else position] = value
    return SkillStringCall(call.skill, args)


def decided_steps(outcome: Outcome | None, executor: SkillExecutor, call: SkillCall) -> Steps:
    """Yield the steps of a call with a decided end; return the final message of the executor, or None.

    :param outcome: the decided end; None: the executor decides.
    :raises SkillFailedError: at the end of the steps, if the decided end is a failure.
    """
    if outcome is None:
        return (yield from executor.execute(call))
    # a success without duration takes as long as the executor needs, a success with a duration only waits; a
    # failing skill is executed, so that its robot stops halfway
    message = None
    if outcome.seconds is None and not outcome.is_failure:
        message = yield from executor.execute(call)
    elif outcome.seconds is None:
        yield from _partial_steps(executor.execute(call), outcome.share)
    elif outcome.is_failure:
        yield from _timed_steps(executor, call, outcome.seconds)
    else:
        yield from _waiting_steps(executor.clock, outcome.seconds)
    if outcome.then is not None:
        outcome.then()
    if outcome.is_failure:
        raise SkillFailedError(outcome.error)
    return message


def _partial_steps(steps: Steps, share: float) -> Steps:
    """Yield the steps of an executor up to a share of the reported progress."""
    with closing(steps):
        for progress in steps:
            fraction = progress.fraction if isinstance(progress, Progress) else progress
            # with the share 1 the skill fails after its last step, even if an earlier step has progress 1
            if fraction is not None and share < 1 and fraction >= share:
                break
            yield progress


def _timed_steps(executor: SkillExecutor, call: SkillCall, seconds: float) -> Steps:
    """Yield the steps of an executor, then steps without progress, until some seconds have passed."""
    clock = executor.clock
    start_us = clock.now_us()
    end_us = start_us + round(seconds * MICROSECONDS)
    with closing(executor.execute(call)) as steps:
        for progress in steps:
            if clock.now_us() >= end_us:
                return
            yield progress
    while clock.now_us() < end_us:
        yield None


def _waiting_steps(clock: Clock, seconds: float) -> Steps:
    """Yield the progress of a waiting skill, at least once."""
    start_us, duration_us = clock.now_us(), seconds * MICROSECONDS
    yield 0.0
    while (passed_us := clock.now_us() - start_us) < duration_us:
        yield passed_us / duration_us


class DecidedExecution:
    """Executes skills of the skill board with the ends that deciders choose.

    :param make_deciders: makes the deciders of an agent, at the first call of the agent.
    """

    def __init__(self, make_deciders: Callable[[str], Sequence[Decider]]) -> None:
        self._make_deciders = make_deciders
        self._deciders: dict[str, Sequence[Decider]] = {}

    def __call__(self, executor: SkillExecutor, call: SkillCall) -> Steps:
        """Return the steps of a starting call."""
        if call.agent not in self._deciders:
            self._deciders[call.agent] = self._make_deciders(call.agent)
        return decided_steps(decide_outcome(self._deciders[call.agent], to_string_call(call)), executor, call)
