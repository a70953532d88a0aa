"""An executor of the skill board that replays a recording."""

from __future__ import annotations

from collections.abc import Callable

from cxbridge.run.replay.divergence import Divergence, Expectation
from cxbridge.run.replay.script import ExecutorScript, RecordedExecution, format_call
from cxbridge.skiller.board import Progress, SkillCall, SkillExecutor, SkillFailedError, Steps
from cxbridge.skiller.board.executor import ExecutorContext

_FAILED = "FAILED"


class RecordedExecutor(SkillExecutor):
    """Executes skills with the recorded durations and outcomes.

    :param start_us: the start of the recorded run, where the clock of this run starts, too.
    :param is_complete: whether the recording reaches the end of its run.
    :param report: receives each divergence, an overdue skill at each check.
    """

    def __init__(
        self,
        context: ExecutorContext,
        script: ExecutorScript,
        *,
        start_us: int,
        is_complete: bool,
        report: Callable[[Divergence], None],
    ) -> None:
        super().__init__(context)
        self.skills = script.skills
        self.expectation = Expectation(
            f"SkillExecutorInterface::{script.name}",
            script.executions,
            start_us,
            is_complete=is_complete,
            report=report,
        )

    def idle(self) -> None:
        """Check for an overdue skill."""
        self.expectation.check(self.clock.now_us())

    def execute(self, call: SkillCall) -> Steps:
        """Replay the recorded execution.

        :raises SkillFailedError: at once, unless the next recorded execution is of this call.
        """
        execution = self.expectation.expected
        begin_us = self.clock.now_us()
        # a recording without messages has no parameters, so any parameters match
        if (
            execution is None
            or execution.skill != call.skill
            or execution.parameters not in (None, dict(call.parameters))
        ):
            self.expectation.refuse(format_call(call.skill, call.parameters), begin_us)
            raise SkillFailedError("the recording has no such execution")
        self.expectation.meet(begin_us)
        return self._replay_steps(execution, begin_us)

    def _replay_steps(self, execution: RecordedExecution, begin_us: int) -> Steps:
        """Yield the recorded feedback at its times, and None in the other loops, until the recorded end.

        An execution that was cancelled, or whose end is not recorded, lasts until the master cancels it.

        :raises SkillFailedError: if the recorded execution failed.
        """
        published_count = 0
        while True:
            elapsed_us = self.clock.now_us() - begin_us
            if execution.ends_itself and elapsed_us >= (execution.duration_us or 0):
                break
            progress = None
            # of several recorded texts in one cycle, the last one is published, as on the recorded blackboard
            while (
                published_count < len(execution.feedback)
                and execution.feedback[published_count][0] <= elapsed_us  # the time of the feedback
            ):
                _, fraction, text = execution.feedback[published_count]
                progress = Progress(fraction, text)
                published_count += 1
            yield progress
        if execution.outcome == _FAILED:
            raise SkillFailedError(execution.error)
