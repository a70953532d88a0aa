"""The executions of a skill board's executors, in the form of skills of Skillers."""

from __future__ import annotations

from cxbridge.events import InterfaceMessage
from cxbridge.history.exchange import Exchange, SkillMessage, agent_of
from cxbridge.history.keeping import cut
from cxbridge.history.model import SkillExecution

_RUNNING, _FINAL, _FAILED = "S_RUNNING", "S_FINAL", "S_FAILED"


class BoardExecutions:
    """Builds a call from each execution and its feedback.

    :param limit: the maximal number of calls.
    """

    def __init__(self, limit: int) -> None:
        self._limit = limit
        self._exchange = Exchange()
        self._running: dict[tuple[str, str], tuple[SkillExecution, str, int]] = {}
        self.calls: list[SkillExecution] = []
        self.lost = 0

    def take(self, event: InterfaceMessage, here: tuple[int, int]) -> None:
        """Process a message of a run."""
        env = agent_of(event)
        for message, _master in self._exchange.take(event):
            key = env, message.node_id
            if message.type == "CONFIRM":
                self._start_call(message, env, event.msgid, here)
            elif key not in self._running or self._running[key][0].request != message.request:
                continue  # a busy executor refuses other requests
            elif message.type == "FEEDBACK":
                call, summary, count = self._running[key]
                self._running[key] = call, summary, count + 1
                last = f"{message.progress:.0%} {message.status}".rstrip()
                call.skill_string = cut(f"{summary}: {count + 1} times feedback, the last: {last}")
            elif message.type == "FINISH":
                call, _what, _count = self._running.pop(key)
                call.end = here
                call.status = _FINAL if message.success else _FAILED
                call.error = "" if message.success else message.status

    def _start_call(self, message: SkillMessage, env: str, msgid: int, here: tuple[int, int]) -> None:
        summary = f"{' '.join((message.action, *message.params))} of {message.agent_id or 'no agent'}"
        call = SkillExecution(
            env, message.node_id, cut(summary), msgid, here, None, _RUNNING, request=message.request
        )
        before = self._running.get((env, message.node_id))
        if before is not None:  # the executor restarted, or the reply was lost
            before[0].end, before[0].status = here, "stopped"
        self._running[env, message.node_id] = call, summary, 0
        if len(self.calls) < self._limit:
            self.calls.append(call)
        else:
            self.lost += 1
