"""The component that answers questions of clients: the loop copies the evidence, a thread explains it."""

from __future__ import annotations

import json
import threading
from collections.abc import Mapping
from copy import copy
from typing import TYPE_CHECKING, Any, Final

from cxbridge.clock import MICROSECONDS
from cxbridge.daemon.board import EXPLAIN_ID, EXPLAIN_TYPE, OWNER
from cxbridge.daemon.daemon import Daemon
from cxbridge.errors import ClipsError, CxbridgeError
from cxbridge.events import Event, FactChange, InterfaceWrite, PlannerCall, RuleFired
from cxbridge.executive.executive import ENVIRONMENT
from cxbridge.executive.host.constructs import rule_texts
from cxbridge.history.transitions import TRANSITION_TYPES
from cxbridge.mainloop import Hook
from cxbridge.run.components.component import Component
from cxbridge_studio.explain.evidence import History
from cxbridge_studio.explain.goal_rules import makers
from cxbridge_studio.explain.goal_story import FACT_TEMPLATES, MOST_FACTS
from cxbridge_studio.explain.live import CopiedEvidence
from cxbridge_studio.explain.rules.environment import fact_slots, rulebook, take

if TYPE_CHECKING:
    from cxbridge.executive.host.environment import ClipsEnvironment
    from cxbridge.run.agent import Run
    from cxbridge_studio.explain.evidence import Evidence
    from cxbridge_studio.explain.rules.snapshot import Snapshot

MOST_QUESTIONS: Final = 4  # length of the message queue

MOST_STEPS: Final = 10_000  # number of transitions, and of firings, kept to explain goals

# The interface's string field, without the final zero byte.
_ANSWER_BYTES: Final = 262_143


class Explainer(Component):
    """Component that answers one question at a time."""

    hooks = (Hook.PRE_LOOP,)
    steady = True
    description = "Explains rules and goals"

    def __init__(self, context: Run) -> None:
        # The interface's class is made from its XML definition at run time, so it has no static type.
        self._interface: Any = context.board.open_for_writing(
            EXPLAIN_TYPE, EXPLAIN_ID, owner=OWNER, queue_limit=MOST_QUESTIONS
        )
        self._context = context
        self._is_daemon = isinstance(context, Daemon)
        self._start_us = context.clock.start_us
        self._history = History(context.name or ENVIRONMENT, MOST_STEPS, MOST_STEPS, self._facts_of)
        # Subscribe to firings only if a recording produces them anyway.
        options = context.options
        recorded = options.trace is not None and options.trace_level != "transitions"
        # the page of a run asks why, and the run has the time of the world: firings and facts cost little
        watched = not self._is_daemon and context.has_clients
        self._history.rules_known = recorded or options.log is not None or watched
        types: list[type[Event]] = [*TRANSITION_TYPES, PlannerCall, InterfaceWrite]
        types += [RuleFired] if self._history.rules_known else []
        types += [FactChange] if watched or (recorded and options.trace_level == "facts") else []
        context.bus.subscribe(self._history.take, *types)
        self._thread: threading.Thread | None = None
        self._answer: str | None = None
        self._msgid = 0

    @property
    def _environment(self) -> ClipsEnvironment | None:
        thinking = self._context.thinking
        return None if thinking is None else thinking.executive.env

    def loop(self) -> None:
        """Publish a finished answer and take the next question."""
        if self._thread is None and self._interface.msgq_empty():
            return
        if self._thread is not None:
            if self._thread.is_alive() or self._answer is None:
                return
            self._thread.join()
            self._thread = None
            self._publish(self._answer)
        message = self._interface.msgq_pop() if self._interface.valid else None
        if message is not None:
            self._begin(message)

    def close(self) -> None:
        """Wait for the answer in progress."""
        self._context.bus.unsubscribe(self._history.take)
        if self._thread is not None:
            self._thread.join()
            self._thread = None
        self._context.board.close(self._interface)

    def _begin(self, message: Any) -> None:
        name, kind, rules = str(message.name), str(message.kind), int(message.rules)
        self._msgid, self._answer = message.id, None
        env = self._environment
        if env is None:
            error = CxbridgeError("the executive is not running now", hint="see 'cxbridge daemon status'")
            self._publish(_refusal(error))
            return
        evidence = self._copy(env, name, kind)
        self._thread = threading.Thread(
            target=self._work, args=(evidence, name, kind, rules), name="explain", daemon=True
        )
        self._thread.start()

    def _copy(self, env: ClipsEnvironment, name: str, kind: str) -> Evidence:
        """Copy the evidence about a rule or about goals, so that the loop can continue."""
        now_us = self._context.clock.now_us()
        agent = f"{self._context.spec} in the daemon" if self._is_daemon else self._context.spec
        where = f"{agent}, {(now_us - self._start_us) / MICROSECONDS:.3f} s after its start"
        times_us = self._start_us, now_us
        return copy_evidence(
            env, self._context.paths.clips_dirs, name, kind, where, times_us, self._copy_history()
        )

    def _copy_history(self) -> History:
        copied = copy(self._history)
        copied.steps = self._history.steps.copy()
        copied.firings = self._history.firings.copy()
        copied.lives = {index: copy(life) for index, life in self._history.lives.items()}
        return copied

    def _facts_of(self, template: str) -> list[Mapping[str, str]]:
        """Return facts while rules fire; called in the thread of the rules."""
        env = self._environment
        return [] if env is None else fact_slots(env, template, MOST_FACTS)

    def _work(self, evidence: Evidence, name: str, kind: str, rules: int) -> None:
        try:
            text = _answer(evidence, name, kind, rules)
        except CxbridgeError as error:
            text = _refusal(error)
        except Exception as error:  # noqa: BLE001 - no question may end a daemon
            text = _refusal(CxbridgeError(f"a fault of cxbridge: {type(error).__name__}: {error}"))
        self._answer = text

    def _publish(self, text: str) -> None:
        if self._interface.valid:
            self._interface.msgid = self._msgid
            self._interface.answer = text
            self._interface.write()


def copy_evidence(
    env: ClipsEnvironment,
    folders: tuple[object, ...],
    name: str,
    kind: str,
    where: str,
    times_us: tuple[int, int],
    history: History,
) -> CopiedEvidence:
    """Copy the evidence about a rule or about goals from an environment.

    :param folders: the folders of the agent's CLIPS files.
    :param name: the rule, goal or goal class in the question.
    :param kind: ``rule``, ``goal``, or empty for either.
    """
    snapshots: dict[str, Snapshot | ClipsError] = {}
    facts: dict[str, list[Mapping[str, str]]] = {}
    texts: dict[str, str] = {}
    with env.lock:
        book = rulebook(env, folders)
        if kind != "goal" and name in book.rules:
            snapshots[name] = _take(env, name)
        else:
            texts = rule_texts(env)
            # If the goal does not exist, the report explains the rule that formulates it.
            snapshots = {rule: _take(env, rule) for rule in makers(texts, name)[:1]}
            for template in FACT_TEMPLATES:
                facts[template] = fact_slots(env, template, MOST_FACTS)
    return CopiedEvidence(where, times_us, history, book, snapshots, facts, texts)


def _take(env: ClipsEnvironment, rule: str) -> Snapshot | ClipsError:
    try:
        return take(env, rule, MOST_FACTS)
    except ClipsError as error:
        return error


def _answer(evidence: Evidence, name: str, kind: str, rules: int) -> str:
    """Return the report as JSON."""
    from cxbridge_studio.explain.answer import explain  # noqa: PLC0415 - not in the loop, and only when asked

    answer = explain(evidence, name, kind, rules)
    text = json.dumps({"lines": answer.lines, "data": answer.plain})
    if len(text) > _ANSWER_BYTES:
        raise CxbridgeError("the answer is too long", hint="ask about one goal: its id, or CLASS#NUMBER")
    return text


def _refusal(error: CxbridgeError) -> str:
    return json.dumps({"error": error.message, "hint": error.hint})
