"""The performing side: executes requests of a hub with the skills of an agent of our skill board.

The performer behaves like the originals, except where they hang: a REQUEST that arrives while no executor is
free is answered when one is, a RESPONSE that may be lost is repeated, one that is neither confirmed nor
rejected reserves no executor permanently, and a late CONFIRM is still carried out.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import partial
from typing import Any, Final, Protocol

from msgspec import Struct

from cxbridge.clock import MICROSECONDS, Clock
from cxbridge.closing import Closing
from cxbridge.errors import ConfigError, CxbridgeError, SkillError
from cxbridge.events import Logger
from cxbridge.history.exchange import MAPPED_ACTION
from cxbridge.rights import right_of_frame
from cxbridge.skiller.board.master import Master
from cxbridge.skiller.board.protocol import ExecutorState, MasterState, SkillCall
from cxbridge.skiller.board.service import calls_of
from cxbridge.skiller.board.watch import ExecutorInfo
from cxbridge.skiller.mapping import ActionSkillMapping
from cxbridge_ros2.executor import NodeSettings
from cxbridge_ros2.hub.hub import Hub
from cxbridge_ros2.hub.words import HubProtocol, Key, Life, Sign, Word, WordKind
from cxbridge_ros2.node import Node

RESERVE_S: Final = 2.0
"""Seconds from RESPONSE to CONFIRM or REJECT; then the executor is free again."""

REPEAT_S: Final = 0.5
"""Seconds until a RESPONSE without a subscriber is repeated: the caller may have joined just now."""

SIGN_S: Final = 1.0
"""Seconds between signs of life."""

_OF_SKILL: Final = ("parameters", "call")
_MAPPED: Final = "mapped"


class BoardCalls(Protocol):
    """The skill board; see :class:`~cxbridge.skiller.board.service.LocalSkillCalls`."""

    @property
    def executors(self) -> Iterable[ExecutorInfo]:
        """The executors that exist."""

    def ask(
        self,
        skill: str,
        parameters: Mapping[str, Any],
        agent: str,
        on_change: Callable[[Master], None],
        name: str = "",
    ) -> Master:
        """Have a skill executed."""

    def stop(self, number: int) -> bool:
        """Cancel an action."""


class ServedAction(Struct, frozen=True):
    """The configuration of an action that is performed.

    :param parameters: the skill's names for the arguments; empty: ``1``, ``2`` and so on.
    :param call: a template of a skill string, as in action mappings; ``mapped``: the skill string that the
        REQUEST has; empty: the skill that is called as the action.
    """

    action: str
    parameters: tuple[str, ...] = ()
    call: str = ""

    @classmethod
    def of(cls, action: str, value: Any, protocol: HubProtocol) -> ServedAction:
        """Read the settings of an action.

        :raises ConfigError: when they are invalid.
        """
        if not isinstance(value, Mapping):
            raise ConfigError(
                f"the action {action} has settings, not {value!r}", hint="e.g. {parameters: [to]}"
            )
        for key in value:
            if key not in _OF_SKILL:
                hint = f"it has: {', '.join(_OF_SKILL)}"
                raise ConfigError(f"the action {action} has no setting '{key}'", hint=hint)
        names, call = value.get("parameters", []), str(value.get("call", ""))
        if call == _MAPPED and not protocol.has_agents:
            raise ConfigError(
                f"the action {action} cannot call '{_MAPPED}': {protocol.name} has no mapped actions"
            )
        mapping = ActionSkillMapping({action: call})
        if call and call != _MAPPED and (doubts := mapping.check()):
            raise ConfigError(f"the call of the action {action}: {doubts[0][1]}")
        return cls(action, tuple(map(str, names if isinstance(names, list) else [names])), call)

    def call_of(self, word: Word, arguments: tuple[str, ...], agent: str) -> SkillCall:
        """Return the skill that a REQUEST is for.

        :raises SkillError: when it does not fit.
        """
        if self.parameters and len(arguments) != len(self.parameters):
            raise SkillError(
                f"{word.key} has {len(arguments)} arguments, {self.action} has {len(self.parameters)}"
            )
        names = self.parameters or tuple(str(number) for number in range(1, len(arguments) + 1))
        values: dict[str, str] = dict(zip(names, arguments, strict=True))
        if not self.call:
            mapped = {MAPPED_ACTION: word.mapped} if word.mapped else {}
            return SkillCall(self.action, agent, values | mapped, word.node)
        text = word.mapped if self.call == _MAPPED else self._mapped(values)
        calls = calls_of(text, agent)
        if len(calls) != 1:
            raise SkillError(f"{word.key} maps to '{text}', which is not one skill")
        return SkillCall(calls[0].skill, agent, calls[0].parameters, word.node)

    def _mapped(self, values: Mapping[str, str]) -> str:
        found = ActionSkillMapping({self.action: self.call}).map(self.action, values)
        if not found.text:
            raise SkillError(found.messages[0][1])
        return found.text

    @property
    def skill(self) -> str:
        """The skill, as far as the configuration says; empty: REQUESTs say it."""
        return "" if self.call == _MAPPED else re.split(r"[{(]", self.call)[0].strip() or self.action


class PerformerSettings(Struct, frozen=True):
    """Performers on one hub.

    :param agent: whose skills these are.
    :param agent_id: what words call that robot.
    :param name: the prefix of the performers' node names; the action follows.
    :param actions: the actions that they perform.
    """

    protocol: HubProtocol
    agent: str
    agent_id: str
    name: str
    actions: tuple[ServedAction, ...]
    node: NodeSettings


class _Job:
    """A RESPONSE and its execution, until the end.

    :ivar deadline_us: until when it must be confirmed.
    :ivar repeat_us: when RESPONSE is sent once more; 0: not, for another performer was confirmed.
    :ivar master: None until CONFIRM.
    """

    def __init__(self, request: Word, node: str, call: SkillCall | str) -> None:
        self.request = request
        self.node = node
        self.call = call
        """The skill call; a text: the reason why there is none."""
        self.deadline_us = 0
        self.repeat_us = 0
        self.master: Master | None = None
        self.is_cancelled = False
        self.said: tuple[float, str] | None = None


class HubPerformer(Closing):
    """Serves a hub.

    :param skills: returns the skill board; None while there is none.
    :param node: polled in each loop, and not closed.
    :raises Ros2Error: for a namespace that there is not.
    """

    def __init__(
        self,
        settings: PerformerSettings,
        skills: Callable[[], BoardCalls | None],
        node: Node,
        clock: Clock,
        log: Logger,
    ) -> None:
        self._protocol = settings.protocol
        self._actions = {each.action: each for each in settings.actions}
        self._nodes = {re.sub(r"\W", "_", f"{settings.name}_{action}"): action for action in self._actions}
        self._agent, self._agent_id = settings.agent, settings.agent_id
        self._skills, self._node, self._clock, self._log = skills, node, clock, log
        self._wanted: dict[Key, tuple[Word, int]] = {}
        """REQUESTs without an answer, each with the time until which an answer is useful."""
        self._jobs: dict[Key, _Job] = {}
        self._next_sign_us = 0
        self._hub = Hub(node, settings.protocol, settings.node.namespace, self._take_word)
        self.topic = self._hub.topic

    @property
    def running(self) -> bool:
        """Whether something is being executed."""
        return any(job.master is not None for job in self._jobs.values())

    @property
    def served(self) -> set[str]:
        """The skills that it serves, as far as the configuration says."""
        return {each.skill for each in self._actions.values()}

    def loop(self) -> None:
        """Receive words, answer them, and publish signs of life."""
        self._node.poll()
        now_us = self._clock.now_us()
        for key, (_, until_us) in list(self._wanted.items()):
            if now_us > until_us:
                del self._wanted[key]
            else:
                self._answer(key)
        for key, job in list(self._jobs.items()):
            if job.master is not None:
                continue
            if now_us > job.deadline_us:
                self._log.debug(f"{job.node}: no caller has confirmed {key}")
                del self._jobs[key]
            elif 0 < job.repeat_us <= now_us:
                self._respond(job)
        if now_us >= self._next_sign_us:
            self._next_sign_us = now_us + round(SIGN_S * MICROSECONDS)
            for node, action in self._nodes.items():
                self._hub.give_sign(Sign(node, action, self._life(action)), now_us)

    def close(self) -> None:
        """Stop all executions, report that, and leave the hub."""
        jobs, self._jobs = self._jobs, {}
        for job in jobs.values():
            if job.master is not None:
                self._stop(job.master)
                self._finish(job, success=False, status=f"the performer {job.node} was shut down")
        self._hub.close()

    # --- words of other nodes -----------------------------------------------------------------------------

    def _take_word(self, word: Word) -> None:
        key = word.key
        if key.action not in self._actions or key.agent != self._agent_id:
            return
        if word.kind == WordKind.REQUEST:
            # until the next REQUEST for the key, or until the caller has given up
            until_us = self._clock.now_us() + round(self._protocol.wanted_s * MICROSECONDS)
            self._wanted[key] = word, until_us
            self._answer(key)
            return
        is_ours = self._nodes.get(word.node) == key.action
        job = self._jobs.get(key)
        if word.kind == WordKind.CONFIRM:
            self._wanted.pop(key, None)
            if is_ours and (job is None or job.master is None):
                self._begin(job or self._job(word))
            elif job is not None:
                job.repeat_us = 0
        elif not is_ours or job is None:
            return
        elif word.kind in (WordKind.REJECT, WordKind.CANCEL) and job.master is None:
            del self._jobs[key]
        elif word.kind == WordKind.CANCEL and job.master is not None:
            job.is_cancelled = True
            self._stop(job.master)

    def _answer(self, key: Key) -> None:
        """Answer a REQUEST, if an executor is free."""
        word, _ = self._wanted[key]
        job = self._jobs.get(key)
        if job is None:
            job = self._job(word)
            if isinstance(job.call, SkillCall) and not self._is_free(job.call.skill):
                return
            self._jobs[key] = job
        elif job.master is not None:
            return
        # else it is asked again: our answer may be lost
        del self._wanted[key]
        job.deadline_us = self._clock.now_us() + round(RESERVE_S * MICROSECONDS)
        self._respond(job)

    def _respond(self, job: _Job) -> None:
        job.repeat_us = self._clock.now_us() + round(REPEAT_S * MICROSECONDS)
        self._hub.say(Word(WordKind.RESPONSE, job.node, job.request.key, job.request.mapped))

    def _job(self, word: Word) -> _Job:
        served = self._actions[word.key.action]
        node = next(node for node, action in self._nodes.items() if action == word.key.action)
        call: SkillCall | str
        try:
            call = served.call_of(word, self._protocol.arguments_of(word.key), self._agent)
        except CxbridgeError as error:
            call = error.message  # for the caller
        return _Job(word, node, call)

    def _stop(self, master: Master) -> None:
        skills = self._skills()
        if skills is not None:
            skills.stop(master.number)

    def _executors(self, skill: str) -> Iterator[ExecutorInfo]:
        """Yield the agent's executors that know a skill; of all when it has no name."""
        skills = self._skills()
        for info in () if skills is None else skills.executors:
            if info.agent == self._agent and (not skill or skill in info.skills):
                yield info

    def _is_free(self, skill: str) -> bool:
        """Whether an executor is free and not promised to a caller."""
        able = sum(info.state is ExecutorState.IDLE for info in self._executors(skill))
        promised = sum(
            job.master is None or job.master.state is MasterState.ASKING for job in self._jobs.values()
        )
        return able > promised

    def _life(self, action: str) -> Life:
        if any(job.request.key.action == action and job.master is not None for job in self._jobs.values()):
            return Life.RUNNING
        may = self._node.rights.allow(right_of_frame("ros2-performers", "word"))
        able = may and any(True for _ in self._executors(self._actions[action].skill))
        return Life.READY if able else Life.NOT_READY

    # --- what becomes of it -------------------------------------------------------------------------------

    def _begin(self, job: _Job) -> None:
        self._jobs[job.request.key] = job
        call = job.call
        try:
            if isinstance(call, str):
                raise SkillError(call)
            skills = self._skills()
            if skills is None:
                raise SkillError("there is no skill board")
            changed = partial(self._changed, job)
            job.master = skills.ask(call.skill, call.parameters, call.agent, changed, call.name)
        except CxbridgeError as error:
            self._over(job, success=False, status=error.message)

    def _changed(self, job: _Job, master: Master) -> None:
        """Pass on what happens to a skill."""
        if self._jobs.get(job.request.key) is not job:
            return  # it was shut down
        if master.state is MasterState.SUCCEEDED:
            self._over(job, success=True, status=master.feedback, progress=master.progress)
        elif master.is_over:
            why = master.error or f"{master.skill} was cancelled"
            self._over(job, success=False, status=why, progress=master.progress)
        elif master.state is MasterState.RUNNING and job.said != (master.progress, master.feedback):
            job.said = (master.progress, master.feedback)
            request, (progress, status) = job.request, job.said
            self._hub.say(
                Word(
                    WordKind.FEEDBACK, job.node, request.key, request.mapped, progress=progress, status=status
                )
            )

    def _over(self, job: _Job, *, success: bool, status: str, progress: float = 0.0) -> None:
        del self._jobs[job.request.key]
        self._finish(job, success=success, status=status, progress=progress)

    def _finish(self, job: _Job, *, success: bool, status: str, progress: float = 0.0) -> None:
        request = job.request
        finish = Word(WordKind.FINISH, job.node, request.key, request.mapped, success, progress, status)
        word = self._protocol.after_cancel(finish) if job.is_cancelled else finish
        if word is not None:
            self._hub.say(word)
