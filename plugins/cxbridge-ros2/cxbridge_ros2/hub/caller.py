"""The calling side: an executor of the skill board whose skills are executed by performers of a hub.

The caller behaves like the originals, except where they hang. It repeats REQUEST until a performer responds,
confirms one performer, and rejects all further ones, also after the end. A performer whose RESPONSE was lost
would wait forever, so it is rejected. A performer that vanishes or restarts is a failure.
"""

from __future__ import annotations

import secrets
from collections.abc import Generator, Mapping
from typing import Any, ClassVar, Final

from msgspec import Struct

from cxbridge.clock import MICROSECONDS
from cxbridge.errors import ConfigError, SkillError
from cxbridge.history.exchange import MAPPED_ACTION
from cxbridge.skiller.board import Progress, SkillCall, SkillFailedError, Steps
from cxbridge.skiller.board.executor import ExecutorContext
from cxbridge_ros2.executor import TIMEOUT_S, RosExecutor, nested, seconds_of
from cxbridge_ros2.hub.hub import Hub
from cxbridge_ros2.hub.words import HubProtocol, Key, Life, Sign, Word, WordKind
from cxbridge_ros2.skills import fill

RETRY_S: Final = 1.0  # seconds between REQUESTs without a response, as in PlanSys2

SILENCE_S: Final = 5.0  # seconds without a heartbeat until a performer counts as gone

_OF_SKILL: Final = ("action", "arguments", "mapped", "timeout", "patience")
_DEAF: Final = 2  # unanswered REQUESTs of a performer that reports READY
_NOT_RUNNING: Final = 2  # heartbeats of a performer without the confirmed action
_REMEMBERED: Final = 100  # REQUESTs whose late RESPONSEs are rejected


class HubSkill(Struct, frozen=True):
    """The configuration of a skill.

    :param action: its name on the hub.
    :param arguments: texts with parameters of the skill; None for all parameters in order.
    :param mapped: the skill string mapped to the action; None for the parameter ``mapped_action``.
    """

    action: str
    arguments: list[Any] | None
    mapped: str | None
    timeout_s: float
    patience_s: float


class _OpenRequest:
    """A requested action until its end.

    :ivar performer: the confirmed performer; empty before.
    :ivar feedback: the last FEEDBACK, or None.
    :ivar end: the FINISH, or None.
    :ivar idle_signs: the number of consecutive heartbeats without the action.
    """

    def __init__(self, request: Word) -> None:
        self.request = request
        self.performer = ""
        self.feedback: Word | None = None
        self.end: Word | None = None
        self.idle_signs = 0


class _Performer(Struct):
    """The known state of a performer.

    :ivar life_us: the time of the last heartbeat; 0 before the first.
    :ivar answer_us: the time of the last RESPONSE, to any caller.
    """

    sign: Sign
    life_us: int = 0
    answer_us: int = 0


class HubSkills(RosExecutor):
    """Executes skills through performers on a hub. Subclasses set the protocol."""

    protocol: ClassVar[HubProtocol]
    known_settings: ClassVar[tuple[str, ...]] = (*RosExecutor.known_settings, "agent-id")

    def __init__(self, context: ExecutorContext) -> None:
        super().__init__(context)
        self._agent_id = self._agent()
        self._known = {
            name: _skill(name, value, self.protocol) for name, value in _configured(self.settings).items()
        }
        if not self._known:
            raise ConfigError(f"{type(self).__name__} has no skills", hint="name them: skills: [move]")
        self.skills = tuple(self._known)
        self._name = f"cxbridge_{self.agent}_{secrets.token_hex(2)}"
        self._hub: Hub | None = None
        self._asked: _OpenRequest | None = None
        self._ours: dict[Key, str] = {}  # our recent requests: the node name of the execution by action
        self._performers: dict[str, _Performer] = {}

    @classmethod
    def skills_with(cls, settings: Mapping[str, Any]) -> tuple[str, ...]:
        return tuple(_configured(nested(settings)))

    @property
    def topic(self) -> str:
        return f"{self.node_settings.namespace}{self.protocol.topic}"

    def start(self) -> None:
        """Join the domain and the hub before the first request, so that performers know us."""
        namespace = self.node_settings.namespace
        self._hub = Hub(self.join(), self.protocol, namespace, self._take_word, self._signed)

    def close(self) -> None:
        if self._hub is not None:
            self._hub.close()
        super().close()

    def execute(self, call: SkillCall) -> Steps:
        known = self._known[call.skill]
        key = Key(known.action, _arguments(known, call), self._agent_id)
        mapped = str(call.get(MAPPED_ACTION, "") if known.mapped is None else fill(known.mapped, call, {}))
        open_request = _OpenRequest(Word(WordKind.REQUEST, call.name or self._name, key, mapped))
        return (
            yield from self.within(
                known.timeout_s, f"{key} on {self.topic}", self._perform(known, open_request)
            )
        )

    def _agent(self) -> str:
        if "agent-id" in self.settings and not self.protocol.has_agents:
            raise ConfigError(f"{type(self).__name__} has no setting 'agent-id': its messages name no robot")
        return self.setting("agent-id", "")

    # --- steps --------------------------------------------------------------------------------------------

    def _perform(self, known: HubSkill, open_request: _OpenRequest) -> Generator[Any, None, Progress]:
        self._asked = open_request
        try:
            yield from self._find_performer(known, open_request)
            yield from self._follow(open_request)
        finally:
            self._asked = None
            if open_request.performer and open_request.end is None:
                self._say(WordKind.CANCEL, open_request.performer, open_request.request.key)
        assert open_request.end is not None  # the loop ends only with a FINISH or an error
        if not open_request.end.success:
            words = open_request.end.status or f"{open_request.performer} has failed"
            raise SkillFailedError(words, progress=open_request.end.progress)
        return Progress(1.0, open_request.end.status)

    def _find_performer(self, known: HubSkill, open_request: _OpenRequest) -> Generator[None, None, None]:
        """Repeat the REQUEST until a performer has responded."""
        key, start_us, requests = open_request.request.key, self.clock.now_us(), 0
        while True:
            self.poll()
            if open_request.performer:
                return
            waited_us = self.clock.now_us() - start_us
            if waited_us > known.patience_s * MICROSECONDS:
                raise SkillFailedError(f"no performer of {key} answers on {self.topic}")
            if waited_us >= requests * RETRY_S * MICROSECONDS:
                if requests >= _DEAF:
                    self._reject_deaf(key)
                self._request(open_request.request)
                requests += 1
            yield

    def _request(self, request: Word) -> None:
        self._ours.pop(request.key, None)  # move the key to the end, as the most recent
        self._ours[request.key] = request.node
        while len(self._ours) > _REMEMBERED:
            del self._ours[next(iter(self._ours))]
        assert self._hub is not None  # skills are executed only after the start
        self._hub.say(request)

    def _reject_deaf(self, key: Key) -> None:
        """Reject performers that report READY but do not respond: their RESPONSE may be lost."""
        now_us = self.clock.now_us()
        recent_us = now_us - round(_DEAF * RETRY_S * MICROSECONDS)
        for name, performer in self._performers.items():
            is_ready = performer.sign.life == Life.READY and performer.life_us > recent_us
            if is_ready and performer.sign.action == key.action and performer.answer_us < recent_us:
                self._say(WordKind.REJECT, name, key)

    def _follow(self, open_request: _OpenRequest) -> Generator[Progress | None, None, None]:
        feedback: Word | None = None
        since_us = self.clock.now_us()
        while True:
            self.poll()
            if open_request.end is not None:
                return
            self._check(open_request, since_us)
            if open_request.feedback is feedback:
                yield None
                continue
            feedback = open_request.feedback
            if feedback is not None:
                yield Progress(feedback.progress, feedback.status)

    def _check(self, request: _OpenRequest, since_us: int) -> None:
        """Raise an error if the performer has vanished or does something else."""
        performer = self._performers.get(request.performer)
        if performer is None or not performer.life_us:
            return  # without heartbeats, only the time limit helps
        if request.idle_signs >= _NOT_RUNNING:
            raise SkillFailedError(
                f"{request.performer} does not perform it any more: it was restarted, or stopped"
            )
        silent_us = self.clock.now_us() - max(performer.life_us, since_us)
        if silent_us > SILENCE_S * MICROSECONDS:
            raise SkillFailedError(f"the performer {request.performer} has vanished")

    # --- the hub ------------------------------------------------------------------------------------------

    def _say(self, kind: WordKind, node: str, key: Key) -> None:
        assert self._hub is not None  # nothing is received, and no skill executed, before the start
        mapped = self._asked.request.mapped if self._asked is not None and kind is WordKind.CONFIRM else ""
        self._hub.say(Word(kind, node, key, mapped))

    def _take_word(self, word: Word) -> None:
        """Handle a message of any node, ourselves included."""
        if word.kind == WordKind.REQUEST:
            if self._ours.get(word.key) != word.node:
                self._ours.pop(word.key, None)
        elif word.kind == WordKind.RESPONSE:
            self._answered(word)
        open_request = self._asked
        if (
            open_request is None
            or (word.node, word.key) != (open_request.performer, open_request.request.key)
            or open_request.end
        ):
            return
        if word.kind == WordKind.FEEDBACK:
            open_request.feedback, open_request.idle_signs = word, 0
            performer = self._known_performer(word)
            performer.life_us = self.clock.now_us() if performer.life_us else 0
        elif word.kind == WordKind.FINISH:
            open_request.end = word

    def _answered(self, word: Word) -> None:
        self._known_performer(word).answer_us = self.clock.now_us()
        if word.key not in self._ours:
            return  # the response to another caller
        open_request = self._asked
        if open_request is not None and open_request.request.key == word.key and not open_request.performer:
            open_request.performer = word.node
            self._say(WordKind.CONFIRM, word.node, word.key)
        else:
            self._say(WordKind.REJECT, word.node, word.key)

    def _known_performer(self, word: Word) -> _Performer:
        sign = Sign(word.node, word.key.action, Life.NOT_READY)
        return self._performers.setdefault(word.node, _Performer(sign))

    def _signed(self, sign: Sign) -> None:
        performer = self._performers.setdefault(sign.node, _Performer(sign))
        performer.sign, performer.life_us = sign, self.clock.now_us()
        open_request = self._asked
        if open_request is not None and open_request.performer == sign.node:
            open_request.idle_signs = 0 if sign.life == Life.RUNNING else open_request.idle_signs + 1


def _configured(settings: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return the settings of each skill; a list names skills without settings."""
    skills = settings.get("skills", {})
    if isinstance(skills, Mapping):
        return skills
    return {str(name): {} for name in (skills if isinstance(skills, list) else [skills])}


def _skill(name: str, value: Any, protocol: HubProtocol) -> HubSkill:
    if not isinstance(value, Mapping):
        raise ConfigError(f"the skill {name} has settings, not {value!r}", hint="e.g. {timeout: 60}")
    known = [key for key in _OF_SKILL if key != "mapped" or protocol.has_agents]
    for key in value:
        if key not in known:
            raise ConfigError(f"the skill {name} has no setting '{key}'", hint=f"it has: {', '.join(known)}")
    arguments = value.get("arguments")
    if arguments is not None and not isinstance(arguments, list):
        arguments = [arguments]
    return HubSkill(
        action=str(value.get("action", name)),
        arguments=arguments,
        mapped=None if "mapped" not in value else str(value["mapped"]),
        timeout_s=seconds_of(name, "timeout", value.get("timeout", TIMEOUT_S)),
        patience_s=seconds_of(name, "patience", value.get("patience", protocol.patience_s)),
    )


def _arguments(known: HubSkill, call: SkillCall) -> tuple[str, ...]:
    if known.arguments is None:
        values = [value for name, value in call.parameters.items() if name != MAPPED_ACTION]
    else:
        values = [fill(each, call, {}) for each in known.arguments]
    for value in values:
        if isinstance(value, list | Mapping):
            raise SkillError(f"{call.skill}: {value!r} is no argument of an action")
    return tuple(str(value) for value in values)
