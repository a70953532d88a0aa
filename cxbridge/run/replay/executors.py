"""An executor of the skill board that repeats a recording."""

from __future__ import annotations

from collections.abc import Callable

from cxbridge.run.replay.divergence import Divergence, Expectation
from cxbridge.run.replay.script import Execution, ExecutorScript, call_text
from cxbridge.skiller.board import Progress, SkillCall, SkillExecutor, SkillFailedError, Steps
from cxbridge.skiller.board.executor import ExecutorContext

_FAILED = "FAILED"


class RecordedExecutor(SkillExecutor):
    """Executes skills as long, and with the outcome, as recorded.

    :param script: its recorded work.
    :param start_us: when the recorded run began; the run's clock begins there, too.
    :param whole: whether the recorded run had come to its end.
    :param report: called for the first skill that is not the recorded one.
    """

    def __init__(
        self,
        context: ExecutorContext,
        script: ExecutorScript,
        *,
        start_us: int,
        whole: bool,
        report: Callable[[Divergence], None],
    ) -> None:
        super().__init__(context)
        self.skills = script.skills
        writer = f"SkillExecutorInterface::{script.name}"
        self.expected = Expectation(writer, script.executions, start_us, whole=whole, report=report)

    def idle(self) -> None:
        """See whether the next skill is overdue."""
        self.expected.check(self.clock.now_us())

    def execute(self, call: SkillCall) -> Steps:
        """Do the recorded work."""
        execution = self.expected.next
        begin_us = self.clock.now_us()
        known = execution.parameters if execution is not None else None
        same = known is None or known == dict(call.parameters)
        if execution is None or execution.skill != call.skill or not same:
            self.expected.refuse(call_text(call.skill, call.parameters), begin_us)
            raise SkillFailedError("the recording does not have this")
        self.expected.meet(begin_us)
        return self._steps(execution, begin_us)

    def _steps(self, execution: Execution, begin_us: int) -> Steps:
        published = 0
        while True:
            since_us = self.clock.now_us() - begin_us
            if execution.ends_itself and since_us >= (execution.duration_us or 0):
                break
            said = None
            while published < len(execution.feedback) and execution.feedback[published][0] <= since_us:
                _, fraction, text = execution.feedback[published]
                said = Progress(fraction, text)
                published += 1
            yield said
        if execution.outcome == _FAILED:
            raise SkillFailedError(execution.error)
