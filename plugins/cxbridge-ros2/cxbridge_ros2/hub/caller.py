"""The calling side: an executor of the skill board whose skills are executed by performers of a hub.

The caller behaves like the originals, except where they hang. REQUEST is repeated until a performer answers.
One performer is confirmed, all other performers are rejected, also after the end. A performer whose RESPONSE
was lost waits forever and answers no REQUEST: it is rejected. A performer that vanishes or restarts is a
failure.
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

RETRY_S: Final = 1.0
"""Seconds between REQUESTs without an answer, as in PlanSys2."""

SILENCE_S: Final = 5.0
"""Seconds after the last sign of life of a performer until it counts as gone."""

_OF_SKILL: Final = ("action", "arguments", "mapped", "timeout", "patience")
_DEAF: Final = 2  # unanswered REQUESTs of a performer that reports to be ready
_NOT_RUNNING: Final = 2  # signs of life of a performer without the confirmed action
_REMEMBERED: Final = 100  # REQUESTs whose late RESPONSEs are rejected


class HubSkill(Struct, frozen=True):
    """The configuration of a skill.

    :param action: its name on the hub.
    :param arguments: texts, which may have parameters of the skill in them; None: all parameters, in order.
    :param mapped: the skill string that the action is mapped to; None: the parameter ``mapped_action``.
    """

    action: str
    arguments: list[Any] | None
    mapped: str | None
    timeout_s: float
    patience_s: float


class _OpenRequest:
    """An action that was asked for, until it is over.

    :ivar performer: who was confirmed; empty before.
    :ivar feedback: its last FEEDBACK; None: none has come.
    :ivar end: its FINISH.
    :ivar idle_signs: how often it has said, one after the other, that it does not execute anything.
    """

    def __init__(self, request: Word) -> None:
        self.request = request
        self.performer = ""
        self.feedback: Word | None = None
        self.end: Word | None = None
        self.idle_signs = 0


class _Performer(Struct):
    """The state of a performer as far as known.

    :ivar life_us: when its last sign of life came; 0: none has come.
    :ivar answer_us: when its last RESPONSE came, to anybody.
    """

    sign: Sign
    life_us: int = 0
    answer_us: int = 0


class HubSkills(RosExecutor):
    """Has performers on a hub execute skills. Derive from it, and name the protocol."""

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
        self._ours: dict[Key, str] = {}
        """Our open request, and the execution that waits for it."""
        self._performers: dict[str, _Performer] = {}

    @classmethod
    def skills_with(cls, settings: Mapping[str, Any]) -> tuple[str, ...]:
        """Return the skills that are configured; see the base class."""
        return tuple(_configured(nested(settings)))

    @property
    def topic(self) -> str:
        """The hub."""
        return f"{self.node_settings.namespace}{self.protocol.topic}"

    def start(self) -> None:
        """Join the domain and the hub: performers know us before we ask."""
        namespace = self.node_settings.namespace
        self._hub = Hub(self.join(), self.protocol, namespace, self._take_word, self._signed)

    def close(self) -> None:
        """Leave the hub and the domain."""
        if self._hub is not None:
            self._hub.close()
        super().close()

    def execute(self, call: SkillCall) -> Steps:
        """Have a skill executed; see the base class."""
        known = self._known[call.skill]
        key = Key(known.action, _arguments(known, call), self._agent_id)
        mapped = str(call.get(MAPPED_ACTION, "") if known.mapped is None else fill(known.mapped, call, {}))
        asked = _OpenRequest(Word(WordKind.REQUEST, call.name or self._name, key, mapped))
        return (
            yield from self.within(known.timeout_s, f"{key} on {self.topic}", self._perform(known, asked))
        )

    def _agent(self) -> str:
        if "agent-id" in self.settings and not self.protocol.has_agents:
            raise ConfigError(f"{type(self).__name__} has no setting 'agent-id': its messages name no robot")
        return self.setting("agent-id", "")

    # --- steps --------------------------------------------------------------------------------------------

    def _perform(self, known: HubSkill, asked: _OpenRequest) -> Generator[Any, None, Progress]:
        self._asked = asked
        try:
            yield from self._deal(known, asked)
            yield from self._follow(asked)
        finally:
            self._asked = None
            if asked.performer and asked.end is None:
                self._say(WordKind.CANCEL, asked.performer, asked.request.key)
        assert asked.end is not None  # else it is still followed
        if not asked.end.success:
            words = asked.end.status or f"{asked.performer} has failed"
            raise SkillFailedError(words, progress=asked.end.progress)
        return Progress(1.0, asked.end.status)

    def _deal(self, known: HubSkill, asked: _OpenRequest) -> Generator[None, None, None]:
        """Ask until a performer has answered."""
        key, start_us, requests = asked.request.key, self.clock.now_us(), 0
        while True:
            self.poll()
            if asked.performer:
                return
            waited_us = self.clock.now_us() - start_us
            if waited_us > known.patience_s * MICROSECONDS:
                raise SkillFailedError(f"no performer of {key} answers on {self.topic}")
            if waited_us >= requests * RETRY_S * MICROSECONDS:
                if requests >= _DEAF:
                    self._reject_deaf(key)
                self._request(asked.request)
                requests += 1
            yield

    def _request(self, request: Word) -> None:
        self._ours.pop(request.key, None)  # the last one is last
        self._ours[request.key] = request.node
        while len(self._ours) > _REMEMBERED:
            del self._ours[next(iter(self._ours))]
        assert self._hub is not None  # skills are executed after the start
        self._hub.say(request)

    def _reject_deaf(self, key: Key) -> None:
        """Free those that say they are ready and do not answer: we may have lost their RESPONSE."""
        now_us = self.clock.now_us()
        recent_us = now_us - round(_DEAF * RETRY_S * MICROSECONDS)
        for name, performer in self._performers.items():
            is_ready = performer.sign.life == Life.READY and performer.life_us > recent_us
            if is_ready and performer.sign.action == key.action and performer.answer_us < recent_us:
                self._say(WordKind.REJECT, name, key)

    def _follow(self, asked: _OpenRequest) -> Generator[Progress | None, None, None]:
        feedback: Word | None = None
        since_us = self.clock.now_us()
        while True:
            self.poll()
            if asked.end is not None:
                return
            self._check(asked, since_us)
            if asked.feedback is feedback:
                yield None
                continue
            feedback = asked.feedback
            if feedback is not None:
                yield Progress(feedback.progress, feedback.status)

    def _check(self, asked: _OpenRequest, since_us: int) -> None:
        """Fail when the performer is not there any more, or does something else."""
        performer = self._performers.get(asked.performer)
        if performer is None or not performer.life_us:
            return  # it gives no signs of life: only the time-out helps
        if asked.idle_signs >= _NOT_RUNNING:
            raise SkillFailedError(
                f"{asked.performer} does not perform it any more: it was restarted, or stopped"
            )
        silent_us = self.clock.now_us() - max(performer.life_us, since_us)
        if silent_us > SILENCE_S * MICROSECONDS:
            raise SkillFailedError(f"the performer {asked.performer} has vanished")

    # --- the hub ------------------------------------------------------------------------------------------

    def _say(self, kind: WordKind, node: str, key: Key) -> None:
        assert self._hub is not None  # nothing is received, and no skill executed, before the start
        mapped = self._asked.request.mapped if self._asked is not None and kind is WordKind.CONFIRM else ""
        self._hub.say(Word(kind, node, key, mapped))

    def _take_word(self, word: Word) -> None:
        """Take a word of anybody, ourselves included."""
        if word.kind == WordKind.REQUEST:
            if self._ours.get(word.key) != word.node:
                self._ours.pop(word.key, None)
        elif word.kind == WordKind.RESPONSE:
            self._answered(word)
        asked = self._asked
        if asked is None or (word.node, word.key) != (asked.performer, asked.request.key) or asked.end:
            return
        if word.kind == WordKind.FEEDBACK:
            asked.feedback, asked.idle_signs = word, 0
            performer = self._known_performer(word)
            performer.life_us = self.clock.now_us() if performer.life_us else 0
        elif word.kind == WordKind.FINISH:
            asked.end = word

    def _answered(self, word: Word) -> None:
        self._known_performer(word).answer_us = self.clock.now_us()
        if word.key not in self._ours:
            return  # the answer to another caller
        asked = self._asked
        if asked is not None and asked.request.key == word.key and not asked.performer:
            asked.performer = word.node
            self._say(WordKind.CONFIRM, word.node, word.key)
        else:
            self._say(WordKind.REJECT, word.node, word.key)

    def _known_performer(self, word: Word) -> _Performer:
        sign = Sign(word.node, word.key.action, Life.NOT_READY)
        return self._performers.setdefault(word.node, _Performer(sign))

    def _signed(self, sign: Sign) -> None:
        performer = self._performers.setdefault(sign.node, _Performer(sign))
        performer.sign, performer.life_us = sign, self.clock.now_us()
        asked = self._asked
        if asked is not None and asked.performer == sign.node:
            asked.idle_signs = 0 if sign.life == Life.RUNNING else asked.idle_signs + 1


def _configured(settings: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return the settings of each skill: a list names those that have none."""
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
    """Return the arguments of a call: all are texts on a hub.

    :raises SkillError: when one has no form as text.
    """
    if known.arguments is None:
        values = [value for name, value in call.parameters.items() if name != MAPPED_ACTION]
    else:
        values = [fill(each, call, {}) for each in known.arguments]
    for value in values:
        if isinstance(value, list | Mapping):
            raise SkillError(f"{call.skill}: {value!r} is no argument of an action")
    return tuple(str(value) for value in values)
