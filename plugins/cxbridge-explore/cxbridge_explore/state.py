"""The state of a run at a choice point as a value, and its digest. Equal states have equal futures.

The state is the facts and globals of the agents, their blackboards, and the state of skills and properties.
In the value, times are relative to now, and generated names (``gen12``) and message ids are numbered by their
first occurrence. If a part of the state is hidden, such as that of an executor in Python, the state is
not compared with other states.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Hashable, Mapping
from hashlib import blake2b
from typing import TYPE_CHECKING, Final

from clips._clips import lib

from cxbridge.clock import MICROSECONDS, VIRTUAL_EPOCH_US, split_us
from cxbridge.executive.host.capi import NULL, decode, items_of
from cxbridge.executive.host.values import Symbol
from cxbridge_studio.constructs import read_rule_texts

if TYPE_CHECKING:
    from cxbridge.blackboard.local import LocalBlackBoard
    from cxbridge.executive.host.environment import ClipsEnvironment
    from cxbridge.executive.host.values import Value
    from cxbridge.run.agent import Run
    from cxbridge_explore.playing import ExploredRun
    from cxbridge_explore.worlds.points import ChoicePoint

# Features whose state is in facts or on the blackboard, never changes, or is hidden from rules, such as the
# blocked edges of navgraph.
_STATELESS_FEATURES: Final = frozenset(
    {"blackboard", "config", "redefine-warning", "pddl-parser", "navgraph", "motor-switch"}
)

_GENERATED_NAME: Final = re.compile(r"gen\d+")
_EPOCH_S: Final = VIRTUAL_EPOCH_US // MICROSECONDS
# A number counts as a time if it is less than this many seconds after the epoch of the virtual clock. The
# limit is chosen freely: 116 days, longer than a run.
_MAX_RUN_S: Final = 10_000_000

_MESSAGE_ID_SLOTS: Final = frozenset({"msgid", "msg-id"})
# The word after each opening parenthesis in CLIPS code: the names of called functions, and further words.
_CALLED_FUNCTION: Final = re.compile(r"\(([^\s()\"]+)")

# Seconds after which the CX core requests control of a Skiller again (`skills-calls.clp`).
_CONTROL_RETRY_S: Final = 3.0

# Computes the digest of the state at a choice point. Returns the digest and an empty text; or an empty digest
# and the reason why the state cannot be compared. Both are empty if states are not compared at all.
ComputeDigest = Callable[["ChoicePoint"], tuple[bytes, str]]


def make_digest_function(run: ExploredRun, *, merges_states: bool) -> ComputeDigest:
    """Return the function that computes the digests of a run's states.

    :param merges_states: whether states are compared at all.
    """
    return StateReader(run).compute_digest if merges_states else lambda _: (b"", "")


class HiddenStateError(Exception):
    """A part of the run's state is hidden, so that the state cannot be compared."""


class StateReader:
    """Reads the state of a run, at the choice points of the run and of its forked copies."""

    def __init__(self, run: ExploredRun) -> None:
        self._run = run
        # empty if the agents have no hidden state; None until the first choice point, when they are loaded
        self._hidden_reason: str | None = None

    def compute_digest(self, point: ChoicePoint) -> tuple[bytes, str]:
        """Return the digest of the state at a choice point; see :data:`ComputeDigest`."""
        if self._hidden_reason is None:
            self._hidden_reason = next(
                (reason for agent in self._agents for reason in _list_hidden_reasons(agent)), ""
            )
        if self._hidden_reason:
            return b"", self._hidden_reason
        try:
            state = self._read_state(point)
        except HiddenStateError as error:
            return b"", str(error)
        return blake2b(repr(state).encode("utf-8", "surrogatepass"), digest_size=16).digest(), ""

    @property
    def _agents(self) -> tuple[Run, ...]:
        return self._run.assembly.agents

    def _read_state(self, point: ChoicePoint) -> Hashable:
        normalizer = _Normalizer(self._run.assembly.clock.now_us())
        world_state = self._run.state()
        if world_state is None:
            raise HiddenStateError(
                "the progress of the world's events or of the skill board's executors is not visible"
            )
        return (
            normalizer.normalize(point.subject),
            tuple(_read_agent_state(agent, normalizer) for agent in self._agents),
            normalizer.normalize(world_state),
            normalizer.normalize(self._run.property_watch.state()),
        )


class _Normalizer:
    """Replaces values that differ between runs without an effect: times, generated names, message ids.

    Rules only compare generated names and message ids with each other, so numbers can replace them.

    :param now_us: the time to which times are relative.
    """

    def __init__(self, now_us: int) -> None:
        self._now_us = now_us
        self._now_s = now_us / MICROSECONDS
        self._numbered_names: dict[str, str] = {}
        self._message_numbers: dict[int, int] = {}
        self._numbered_skills: dict[str, str] = {}

    def number_skill(self, skill: str, message_id: object) -> None:
        """Record the id of a fact ``skill``, which ends with a message id, for numbering."""
        id_suffix = f"-{message_id}"
        if isinstance(message_id, int) and skill.endswith(id_suffix):
            number = self._message_numbers.setdefault(message_id, len(self._message_numbers))
            self._numbered_skills[skill] = f"{skill.removesuffix(id_suffix)}-#{number}"

    def blur_last_try(self, slots: dict[str, Value], retry_s: float) -> None:
        """Replace a time in ``last-try`` that is older than ``retry_s``: rules test only whether it is."""
        match slots["last-try"]:
            case (int() as last_s, int() as microseconds):
                age_us = self._now_us - last_s * MICROSECONDS - microseconds
                if age_us > retry_s * MICROSECONDS:
                    slots["last-try"] = Symbol("long-ago")

    def normalize(self, value: object) -> Hashable:
        """Return a value with relative times, and with numbers in place of generated names.

        Values of types that facts do not have are represented by their :func:`repr`.
        """
        if isinstance(value, str):
            value = self._numbered_skills.get(value, value)
            return _GENERATED_NAME.sub(self._rename, value) if "gen" in value else str(value)
        if isinstance(value, int | float):
            return ("time", round(value - self._now_s, 6)) if self._is_time(value) else value
        if isinstance(value, frozenset | set):
            # sorted before, too, since generated names are numbered by their first occurrence
            return "set", tuple(sorted(repr(self.normalize(item)) for item in sorted(value, key=repr)))
        if isinstance(value, tuple | list):
            return self._normalize_sequence(value)
        return repr(value)

    def _normalize_sequence(self, values: tuple[object, ...] | list[object]) -> Hashable:
        """Return the values of a sequence. A pair of seconds and microseconds becomes one time."""
        items: list[Hashable] = []
        position = 0
        while position < len(values):
            match values[position : position + 2]:
                case [int() as seconds, int() as microseconds] if (
                    self._is_time(seconds) and 0 <= microseconds < MICROSECONDS
                ):
                    items.append(("time", seconds * MICROSECONDS + microseconds - self._now_us))
                    position += 2
                case _:
                    items.append(self.normalize(values[position]))
                    position += 1
        return tuple(items)

    @staticmethod
    def _is_time(value: float) -> bool:
        return 0 <= value - _EPOCH_S < _MAX_RUN_S

    def normalize_slots(self, values: Mapping[str, object]) -> Hashable:
        """Return the normalised values of the slots of a fact, or of the fields of an interface.

        Numbers replace message ids other than 0, which stands for no message.
        """
        return tuple(
            self._message_numbers.setdefault(value, len(self._message_numbers))
            if name in _MESSAGE_ID_SLOTS and isinstance(value, int) and value
            else self.normalize(value)
            for name, value in values.items()
        )

    def _rename(self, match: re.Match[str]) -> str:
        return self._numbered_names.setdefault(match[0], f"gen#{len(self._numbered_names)}")


def _read_agent_state(agent: Run, normalizer: _Normalizer) -> Hashable:
    """Return the state of an agent and its blackboard.

    :raises HiddenStateError: if rules fire, a planner works, or messages wait.
    """
    env, goals = agent.executive.env, agent.executive.goals
    if env.is_firing or env.has_activations(1):
        raise HiddenStateError("a choice was made while rules fired")
    if agent.executive.is_planning:
        raise HiddenStateError("a planner was working")
    facts = list(env.facts())
    for _, template, slots in facts:
        if template == "skill":
            normalizer.number_skill(str(slots["id"]), slots["msgid"])
        elif template == "skiller-control":
            normalizer.blur_last_try(slots, _CONTROL_RETRY_S)
    return (
        tuple((template, normalizer.normalize_slots(slots)) for _, template, slots in facts),
        _read_globals(env, normalizer),
        (env.quit_requested, env.is_ended, bool(env.faults), agent.executive.skills.has_running_skill),
        # whether goals have finished, and whether a goal has failed: both decide the verdict on the run
        (bool(goals.outcome_counts), goals.outcome_counts.total() > goals.outcome_counts["COMPLETED"]),
        _read_board_state(agent.board, normalizer),
    )


def _read_globals(env: ClipsEnvironment, normalizer: _Normalizer) -> Hashable:
    global_names = map(decode, map(lib.DefglobalName, items_of(lib.GetNextDefglobal, env.c_env)))
    return tuple((name, normalizer.normalize(env.eval(f"?*{name}*"))) for name in global_names)


def _read_board_state(board: LocalBlackBoard, normalizer: _Normalizer) -> Hashable:
    """Return the state of the interfaces.

    :raises HiddenStateError: if messages wait for their handling.
    """
    interfaces = []
    for memory in board.memories():
        info, instances = memory.info(), memory.instances()
        # At a choice about a skill, the Skiller handles the message that calls it.
        handled_count = 1 if memory.type == "SkillerInterface" else 0
        waiting_count = max((instance.msgq_size() for instance in instances if instance.is_writer), default=0)
        if waiting_count > handled_count:
            raise HiddenStateError(f"messages to {memory.uid} waited")
        unread_flags = tuple(instance.version_read != memory.version for instance in instances)
        block: Hashable = (
            normalizer.normalize(split_us(info.timestamp_us)),
            normalizer.normalize_slots(memory.values()),
        )
        if waiting_count:  # the Skiller is about to write all fields, and its state is that of the skills
            block = None
        interfaces.append((memory.uid, info.writer, info.readers, unread_flags, block))
    return tuple(interfaces)


def _list_hidden_reasons(agent: Run) -> list[str]:
    """Return the reasons why the states of an agent cannot be compared."""
    env = agent.executive.env
    reasons = [
        f"the feature {name} has a hidden state"
        for name in agent.manager.loaded_features(env.name)
        if name not in _STATELESS_FEATURES
    ]
    if agent.additions.features:
        reasons.append("a program's own features have a hidden state")
    if lib.GetNextInstance(env.c_env, NULL) != NULL:
        reasons.append("the agent has instances of COOL")
    drawing_functions = _find_drawing_functions(env)
    reasons += [
        f"rule {name} draws random numbers"
        for name, rule_text in read_rule_texts(env).items()
        if drawing_functions.intersection(_CALLED_FUNCTION.findall(rule_text))
    ]
    return reasons


def _find_drawing_functions(env: ClipsEnvironment) -> set[str]:
    """Return the functions that draw random numbers, directly or through other functions."""
    calls_by_function: dict[str, set[str]] = {}
    for function in items_of(lib.GetNextDeffunction, env.c_env):
        text = lib.DeffunctionPPForm(function)
        called_functions = set(_CALLED_FUNCTION.findall("" if text == NULL else decode(text)))
        calls_by_function[decode(lib.DeffunctionName(function))] = called_functions
    drawing_functions = {"random", "seed"}
    # repeat, since the callers of added functions draw, too
    while (
        callers := {name for name, called in calls_by_function.items() if called & drawing_functions}
        - drawing_functions
    ):
        drawing_functions |= callers
    return drawing_functions
