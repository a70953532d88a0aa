"""The state of a run at a choice point as a value: equal states have equal futures.

Times are relative to now. Generated names (``gen12``) and message ids are numbered by first occurrence. Runs
with a hidden part of their state are not compared.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Hashable, Iterator, Mapping
from hashlib import blake2b
from typing import TYPE_CHECKING, Final

from clips._clips import lib

from cxbridge.clock import MICROSECONDS, VIRTUAL_EPOCH_US, split_us
from cxbridge.executive.host.capi import NULL, CData, decode
from cxbridge.executive.host.values import Symbol
from cxbridge_studio.constructs import rule_texts

if TYPE_CHECKING:
    from cxbridge.blackboard.local import LocalBlackBoard
    from cxbridge.executive.host.environment import ClipsEnvironment
    from cxbridge.executive.host.values import Value
    from cxbridge.run.agent import Run
    from cxbridge_explore.playing import ExploredRun
    from cxbridge_explore.worlds.points import ChoicePoint

# The features without hidden state: their state is in facts or on the blackboard, or never changes.
_STATELESS_FEATURES: Final = frozenset(
    {"blackboard", "config", "redefine-warning", "pddl-parser", "navgraph", "motor-switch"}
)

_GENERATED: Final = re.compile(r"gen\d+")
_EPOCH_S: Final = VIRTUAL_EPOCH_US // MICROSECONDS
# A number counts as a time if it is at most this many seconds after the epoch of the virtual clock. No run is
# longer.
_MAX_RUN_S: Final = 10_000_000

_MESSAGE_IDS: Final = frozenset({"msgid", "msg-id"})
# The name after each opening parenthesis in CLIPS code, which includes the names of all called functions.
_CALLED: Final = re.compile(r"\(([^\s()\"]+)")


# After this time the core requests control of a Skiller again (`skills.clp`).
_REQUEST_AGAIN_S: Final = 3.0


# Returns the digest of the state at a choice point and an empty text; or an empty digest and the reason.
Digest = Callable[["ChoicePoint"], tuple[bytes, str]]


def state_digest(run: ExploredRun, *, merge: bool) -> Digest:
    """Return the digest function for a run.

    :param merge: whether states are compared at all.
    """
    return StateReader(run).digest if merge else lambda _: (b"", "")


class HiddenStateError(Exception):
    """A part of the run's state is hidden, so that the state cannot be compared."""


class StateReader:
    """Reads the state of a run, at the choices of the run and of its copies."""

    def __init__(self, run: ExploredRun) -> None:
        self._run = run
        self._hidden: str | None = None

    def digest(self, point: ChoicePoint) -> tuple[bytes, str]:
        """Return the digest of the state at a choice point; empty with the reason if a part is hidden."""
        if self._hidden is None:
            self._hidden = next((text for agent in self._agents for text in _hidden_state(agent)), "")
        if self._hidden:
            return b"", self._hidden
        try:
            state = self._state(point)
        except HiddenStateError as error:
            return b"", str(error)
        return blake2b(repr(state).encode("utf-8", "surrogatepass"), digest_size=16).digest(), ""

    @property
    def _agents(self) -> tuple[Run, ...]:
        return self._run.world.assembly.agents

    def _state(self, point: ChoicePoint) -> Hashable:
        world = self._run.world
        names = _Names(world.assembly.clock.now_us())
        skills, properties = world.state(), self._run.properties.state()
        if skills is None:
            raise HiddenStateError("the progress of the skill board's executors is not visible")
        if properties is None:
            raise HiddenStateError("a property has no state() to compare")
        return (
            names.plain(point.subject),
            tuple(_agent_state(agent, names) for agent in self._agents),
            names.plain(skills),
            names.plain(properties),
        )


class _Names:
    """Replaces names that are only compared with each other by numbers.

    :param now_us: the time to which times are relative.
    """

    def __init__(self, now_us: int) -> None:
        self._now_us = now_us
        self._now_s = now_us / MICROSECONDS
        self._generated: dict[str, str] = {}
        self._messages: dict[int, int] = {}
        self._skills: dict[str, str] = {}

    def number_skill(self, skill: str, message: object) -> None:
        """Record the id of a fact `skill`, which ends with the id of its message."""
        end = f"-{message}"
        if isinstance(message, int) and skill.endswith(end):
            number = self._messages.setdefault(message, len(self._messages))
            self._skills[skill] = f"{skill.removesuffix(end)}-#{number}"

    def blur_last_try(self, slots: dict[str, Value], seconds: float) -> None:
        """Replace an old time in ``last-try``: rules only test whether ``seconds`` have passed."""
        match slots["last-try"]:
            case (int() as last_s, int() as last_us):
                age_us = self._now_us - last_s * MICROSECONDS - last_us
                if age_us > seconds * MICROSECONDS:
                    slots["last-try"] = Symbol("long-ago")

    def plain(self, value: object) -> Hashable:
        """Return a value with relative times, and with numbers in place of generated names."""
        if isinstance(value, str):
            value = self._skills.get(value, value)
            return _GENERATED.sub(self._rename, value) if "gen" in value else str(value)
        if isinstance(value, int | float):
            return ("time", round(value - self._now_s, 6)) if self._is_time(value) else value
        if isinstance(value, frozenset | set):
            return "set", tuple(sorted(repr(self.plain(item)) for item in sorted(value, key=repr)))
        if isinstance(value, tuple | list):
            return self._sequence(value)
        return repr(value)

    def _sequence(self, values: tuple[object, ...] | list[object]) -> Hashable:
        """Return the values of a sequence. A pair of seconds and microseconds becomes one time."""
        items: list[Hashable] = []
        number = 0
        while number < len(values):
            match values[number : number + 2]:
                case [int() as seconds, int() as us] if self._is_time(seconds) and 0 <= us < MICROSECONDS:
                    items.append(("time", seconds * MICROSECONDS + us - self._now_us))
                    number += 2
                case _:
                    items.append(self.plain(values[number]))
                    number += 1
        return tuple(items)

    @staticmethod
    def _is_time(value: float) -> bool:
        return 0 <= value - _EPOCH_S < _MAX_RUN_S

    def slots(self, values: Mapping[str, object]) -> Hashable:
        """Return the slots of a fact, or the fields of an interface."""
        return tuple(
            self._messages.setdefault(value, len(self._messages))
            if name in _MESSAGE_IDS and isinstance(value, int) and value
            else self.plain(value)
            for name, value in values.items()
        )

    def _rename(self, match: re.Match[str]) -> str:
        return self._generated.setdefault(match[0], f"gen#{len(self._generated)}")


def _agent_state(agent: Run, names: _Names) -> Hashable:
    """Return the state of an agent and its blackboard.

    :raises HiddenStateError: if rules fire, a planner works, or messages wait.
    """
    env, goals = agent.executive.env, agent.executive.goals
    if env.is_firing or env.has_activations(1):
        raise HiddenStateError("a choice was made while rules fired")
    if any(slots["status"] == "RUNNING" for _, _, slots in env.facts("planner-call")):
        raise HiddenStateError("a planner was at work")
    facts = list(env.facts())
    for _, template, slots in facts:
        if template == "skill":
            names.number_skill(str(slots["id"]), slots["msgid"])
        elif template == "skiller-control":
            names.blur_last_try(slots, _REQUEST_AGAIN_S)
    return (
        tuple((template, names.slots(slots)) for _, template, slots in facts),
        _global_values(env, names),
        (env.quit_requested, env.is_ended, bool(env.faults), agent.executive.skills.running),
        # these decide the verdict on the run
        (bool(goals.outcome_counts), goals.outcome_counts.total() > goals.outcome_counts["COMPLETED"]),
        _board_state(agent.board, names),
    )


def _global_values(env: ClipsEnvironment, names: _Names) -> Hashable:
    variables = map(decode, map(lib.DefglobalName, _walk(env, lib.GetNextDefglobal)))
    return tuple((name, names.plain(env.eval(f"?*{name}*"))) for name in variables)


def _walk(env: ClipsEnvironment, next_item: Callable[[CData, CData], CData]) -> Iterator[CData]:
    """Yield the items of an environment.

    :param next_item: a function of CLIPS that returns the item after another one, or the first after NULL.
    """
    item = next_item(env.env, NULL)
    while item != NULL:
        yield item
        item = next_item(env.env, item)


def _board_state(board: LocalBlackBoard, names: _Names) -> Hashable:
    """Return the state of the interfaces.

    :raises HiddenStateError: if messages wait for their handling.
    """
    interfaces = []
    for memory in board.memories():
        info, instances = memory.info(), memory.instances()
        # At a choice about a skill, the Skiller handles the message that calls it.
        handled = 1 if memory.type == "SkillerInterface" else 0
        waiting = max((instance.msgq_size() for instance in instances if instance.is_writer), default=0)
        if waiting > handled:
            raise HiddenStateError(f"messages to {memory.uid} waited")
        unread = tuple(instance.version_read != memory.version for instance in instances)
        block: Hashable = names.plain(split_us(info.timestamp_us)), names.slots(memory.values())
        if waiting:
            block = None  # The Skiller is about to write all fields, and its state is included elsewhere.
        interfaces.append((memory.uid, info.writer, info.readers, unread, block))
    return tuple(interfaces)


def _hidden_state(agent: Run) -> list[str]:
    """Return the reasons why the states of an agent cannot be compared."""
    env = agent.executive.env
    reasons = [
        f"the feature {name} has a hidden state"
        for name in agent.manager.loaded_features(env.name)
        if name not in _STATELESS_FEATURES
    ]
    if agent.memory.is_open:
        reasons.append("the robot memory has a hidden state")
    if agent.additions.features:
        reasons.append("a program's own features have a hidden state")
    if lib.GetNextInstance(env.env, NULL) != NULL:
        reasons.append("the agent has instances of COOL")
    drawing = _drawing_functions(env)
    reasons += [
        f"rule {name} draws random numbers"
        for name, text in rule_texts(env).items()
        if drawing.intersection(_CALLED.findall(text))
    ]
    return reasons


def _drawing_functions(env: ClipsEnvironment) -> set[str]:
    """Return the functions that draw random numbers, directly or through other functions."""
    calls: dict[str, set[str]] = {}
    for function in _walk(env, lib.GetNextDeffunction):
        text = lib.DeffunctionPPForm(function)
        called = set(_CALLED.findall("" if text == NULL else decode(text)))
        calls[decode(lib.DeffunctionName(function))] = called
    drawing = {"random", "seed"}
    # add the callers of drawing functions until none is left
    while callers := {name for name, called in calls.items() if called & drawing} - drawing:
        drawing |= callers
    return drawing
