"""The feature ``skill-board``: skills of several robots, called from CLIPS. See docs/skill-board.md.

The skill board passes requests for skills to executors: robots and simulators. A request becomes a fact
``skill-board-action`` with its state, an executor a fact ``skill-board-executor``. The board reports changes
at any time; the rule ``skill-board-read`` updates the facts once in each loop.

The protocols describe the part of the skill board (:mod:`cxbridge.skiller.board`) that this feature uses,
because this package must not import the Skiller.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Any, Protocol

from cxbridge.errors import CxbridgeError
from cxbridge.events import Logger
from cxbridge.executive.feature import Feature
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.executive.host.facts.held import HeldFact
from cxbridge.executive.host.values import FALSE, TRUE, Symbol, Value


class SkillAction(Protocol):
    """A request for a skill, with its state."""

    @property
    def number(self) -> int:
        """The id of the request."""

    @property
    def skill(self) -> str:
        """The name of the skill."""

    @property
    def agent(self) -> str:
        """The agent that executes the skill."""

    @property
    def state(self) -> str:
        """ASKING, CONFIRMED, RUNNING, CANCELLING, SUCCEEDED, FAILED or CANCELLED."""

    @property
    def is_over(self) -> bool:
        """Whether the state is final."""

    @property
    def executor(self) -> str:
        """The id of the executor; empty while the executor is unknown."""

    @property
    def progress(self) -> float:
        """The progress from 0 to 1."""

    @property
    def feedback(self) -> str:
        """The last message of the executor about the skill; empty before the first one."""

    @property
    def error(self) -> str:
        """The reason for a failure; empty without a failure."""


class Executor(Protocol):
    """A robot or simulator that executes skills."""

    @property
    def id(self) -> str: ...

    @property
    def agent(self) -> str:
        """The agent of the executor."""

    @property
    def skills(self) -> tuple[str, ...]: ...

    @property
    def state(self) -> str:
        """IDLE, RESERVED or BUSY."""


class SkillBoard(Protocol):
    """The skill board."""

    @property
    def version(self) -> int:
        """A number that changes with the executors or their states."""

    @property
    def executors(self) -> Iterable[Executor]: ...

    def request(
        self, skill: str, parameters: Mapping[str, Any], agent: str, on_change: Callable[[SkillAction], None]
    ) -> SkillAction:
        """Request a skill.

        :param on_change: called after each change of the action.
        :raises SkillError: if the request is impossible.
        """

    def request_string(
        self, skill_string: str, agent: str, on_change: Callable[[SkillAction], None]
    ) -> SkillAction:
        """Request a skill by its skill string.

        :raises SkillError: if the skill string is invalid or the request is impossible.
        """

    def cancel(self, number: int) -> bool:
        """Cancel an action; return False if it is unknown, over or being cancelled already."""


@dataclass
class _SkillBoardContext:
    """The feature's state in one environment.

    :ivar changed_actions: the actions that have changed since the last update of the facts, by number.
    :ivar open_numbers: the numbers of the actions without a final state.
    :ivar action_facts: the facts of the open actions, by number.
    :ivar board_version: the board's version at the last update; -1 without a board.
    :ivar executors: the executors with their facts, by id.
    """

    env: ClipsEnvironment
    log: Logger
    changed_actions: dict[int, SkillAction] = field(default_factory=dict)
    open_numbers: set[int] = field(default_factory=set)
    action_facts: dict[int, HeldFact] = field(default_factory=dict)
    board_version: int = -1
    executors: dict[str, tuple[Executor, HeldFact]] = field(default_factory=dict)

    def queue_change(self, action: SkillAction) -> None:
        """Let the next update of the facts include an action."""
        self.changed_actions[action.number] = action


_TEMPLATES = (
    """(deftemplate skill-board-action "A request to the skill board for a skill."
         (slot id (type INTEGER)) (slot skill (type SYMBOL)) (slot agent (type STRING))
         (slot state (type SYMBOL)
           (allowed-values ASKING CONFIRMED RUNNING CANCELLING SUCCEEDED FAILED CANCELLED))
         (slot executor (type STRING)) (slot progress (type FLOAT)) (slot feedback (type STRING))
         (slot error (type STRING)))""",
    """(deftemplate skill-board-executor "An executor of an agent's skills."
         (slot id (type STRING)) (slot agent (type STRING)) (multislot skills (type SYMBOL))
         (slot state (type SYMBOL) (allowed-values IDLE RESERVED BUSY)))""",
)
# the salience lets this rule fire before rules without a salience, which then match the present state
_READ_RULE = "(defrule skill-board-read (declare (salience 1000)) (time $?) => (skill-board-read))"


class SkillBoardFeature(Feature):
    """Provides the ``skill-board-*`` functions.

    :param find_board: returns the skill board; None without a skill board.
    """

    name = "skill-board"

    def __init__(self, find_board: Callable[[], SkillBoard | None]) -> None:
        self._find_board = find_board
        self._contexts: dict[str, _SkillBoardContext] = {}

    def init_context(self, env: ClipsEnvironment) -> None:
        context = _SkillBoardContext(env, env.bus.logger(f"SkillBoardCLIPS|{env.name}"))
        self._contexts[env.name] = context
        functions: tuple[tuple[str, Callable[..., Value], int, str], ...] = (
            ("skill-board-request", partial(self._request, context), 4, "*;sy;m;m;sy"),
            ("skill-board-call", partial(self._call, context), 2, "*;s;sy"),
            ("skill-board-cancel", self._cancel, 1, "*;l"),
            ("skill-board-read", partial(self._read, context), 0, "*"),
        )
        for name, function, argument_count, types in functions:
            env.define(name, function, argument_count, types=types)
        for construct in (*_TEMPLATES, _READ_RULE):
            env.build(construct)

    def context_destroyed(self, env: ClipsEnvironment) -> None:
        """Cancel the environment's requests."""
        for number in sorted(self._contexts.pop(env.name).open_numbers):
            self._cancel(number)

    def _request(
        self,
        context: _SkillBoardContext,
        skill: str,
        names: tuple[Value, ...],
        values: tuple[Value, ...],
        agent: str,
    ) -> int:
        if len(names) != len(values):
            context.log.error(f"{skill} has {len(names)} parameter names, but {len(values)} values")
            return 0
        parameters = {str(name): _json_value(value) for name, value in zip(names, values, strict=True)}
        return self._start_request(
            context, lambda board: board.request(str(skill), parameters, str(agent), context.queue_change)
        )

    def _call(self, context: _SkillBoardContext, skill_string: str, agent: str) -> int:
        return self._start_request(
            context, lambda board: board.request_string(str(skill_string), str(agent), context.queue_change)
        )

    def _start_request(self, context: _SkillBoardContext, ask: Callable[[SkillBoard], SkillAction]) -> int:
        """Make a request; return the number of the action, or 0 without a board or for a refused request."""
        board = self._find_board()
        if board is None:
            context.log.error("there is no skill board at present")
            return 0  # the numbers of actions start at 1
        try:
            action = ask(board)
        except CxbridgeError as error:
            context.log.error(str(error))
            return 0
        context.open_numbers.add(action.number)
        context.queue_change(action)
        return action.number

    def _cancel(self, number: int) -> Value:
        board = self._find_board()
        return TRUE if board is not None and board.cancel(number) else FALSE

    def _read(self, context: _SkillBoardContext) -> None:
        """Update the facts of actions and executors."""
        # the board may report further changes during the update: these wait for the next loop
        changed_actions, context.changed_actions = context.changed_actions, {}
        for number, action in changed_actions.items():
            self._assert_action(context, number, action)
        board = self._find_board()
        version = -1 if board is None else board.version
        if version != context.board_version:
            context.board_version = version
            self._assert_executors(context, () if board is None else board.executors)

    @staticmethod
    def _assert_action(context: _SkillBoardContext, number: int, action: SkillAction) -> None:
        env = context.env
        previous = context.action_facts.pop(number, None)
        if previous is not None:
            previous.retract()
        fact = HeldFact.make(
            env,
            "skill-board-action",
            {
                "id": number,
                "skill": Symbol(action.skill),
                "agent": action.agent,
                "state": Symbol(action.state),
                "executor": action.executor,
                "progress": float(action.progress),
                "feedback": action.feedback,
                "error": action.error,
            },
        )
        if action.is_over:
            context.open_numbers.discard(number)
            if fact is not None:
                fact.release()  # rules retract the fact of an action that is over
        elif fact is not None:
            context.action_facts[number] = fact

    @staticmethod
    def _assert_executors(context: _SkillBoardContext, executors: Iterable[Executor]) -> None:
        current = {executor.id: executor for executor in executors}
        for executor_id, (executor, fact) in list(context.executors.items()):
            if current.get(executor_id) != executor:
                fact.retract()
                del context.executors[executor_id]
        for executor_id, executor in current.items():
            if executor_id in context.executors:
                continue
            new_fact = HeldFact.make(
                context.env,
                "skill-board-executor",
                {
                    "id": executor_id,
                    "agent": executor.agent,
                    "skills": tuple(Symbol(skill) for skill in executor.skills),
                    "state": Symbol(executor.state),
                },
            )
            if new_fact is not None:
                context.executors[executor_id] = (executor, new_fact)


def _json_value(value: Value) -> Any:
    """Return the JSON value of a CLIPS value.

    TRUE and FALSE become booleans, other symbols strings, multifields lists.
    """
    if isinstance(value, tuple):
        return [_json_value(item) for item in value]
    if isinstance(value, Symbol) and value in (TRUE, FALSE):
        return value == TRUE
    return str(value) if isinstance(value, str) else value
