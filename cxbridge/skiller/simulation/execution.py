"""Skills on the skill board whose end is decided: by a script, a simulation of failures, a chosen world."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import closing
from typing import TYPE_CHECKING, Any

from cxbridge.clock import MICROSECONDS
from cxbridge.skiller.board.executor import Progress, SkillExecutor, SkillFailedError, Steps
from cxbridge.skiller.board.protocol import SkillCall
from cxbridge.skiller.simulation.deciders import Deciders, Outcome
from cxbridge.skiller.skillstring import SkillStringCall

if TYPE_CHECKING:
    from cxbridge.clock import Clock


def as_string_call(call: SkillCall) -> SkillStringCall:
    """Return a call on the board as a Skiller has it."""
    args: dict[str | int, Any] = {int(k) if k.isdigit() else k: v for k, v in call.parameters.items()}
    return SkillStringCall(call.skill, args)


def ending_as(outcome: Outcome | None, executor: SkillExecutor, call: SkillCall) -> Steps:
    """Yield the steps of a call that ends in a given way.

    A skill that succeeds only takes its time. A skill that fails is executed until it does: a robot is
    halfway by then.

    :param outcome: None: as the executor ends it.
    """
    if outcome is None:
        return (yield from executor.execute(call))
    said = None
    if outcome.seconds is None and not outcome.failed:
        said = yield from executor.execute(call)
    elif outcome.seconds is None:
        yield from _share_of(executor.execute(call), outcome.share)
    elif outcome.failed:
        yield from _until(executor, call, outcome.seconds)
    else:
        yield from _wait(executor.clock, outcome.seconds)
    if outcome.then is not None:
        outcome.then()
    if outcome.failed:
        raise SkillFailedError(outcome.error)
    return said


def _until(executor: SkillExecutor, call: SkillCall, seconds: float) -> Steps:
    """Yield the steps of an executor until this many seconds have passed; nothing new when it ends before."""
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


class DecidedExecution:
    """Executes skills of the skill board, and lets them end as deciders say.

    :param make: makes the deciders of an agent when it has its first call.
    """

    def __init__(self, make: Callable[[str], Deciders]) -> None:
        self._make = make
        self._deciders: dict[str, Deciders] = {}

    def __call__(self, executor: SkillExecutor, call: SkillCall) -> Steps:
        """Return the steps of a call that begins."""
        if call.agent not in self._deciders:
            self._deciders[call.agent] = self._make(call.agent)
        decision = self._deciders[call.agent].decide(as_string_call(call))
        return ending_as(None if decision is None else decision.outcome, executor, call)


def _share_of(steps: Steps, share: float) -> Steps:
    """Yield the steps of an executor until it says that it has done its share, or ends."""
    with closing(steps):
        for said in steps:
            fraction = said.fraction if isinstance(said, Progress) else said
            if fraction is not None and share < 1 and fraction >= share:
                break
            yield said
