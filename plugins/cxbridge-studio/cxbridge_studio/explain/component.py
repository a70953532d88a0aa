"""The component that explains rules and goals to the clients of a daemon, or of a run on the web page.

A question is a message of ExplainInterface. The loop copies the evidence, which takes milliseconds; a thread
explains the copy, which may take seconds; the loop writes the explanation to the interface.
"""

from __future__ import annotations

import json
import threading
from collections.abc import Mapping
from copy import copy
from typing import TYPE_CHECKING, Any, Final

from cxbridge.clock import MICROSECONDS
from cxbridge.daemon.daemon import Daemon
from cxbridge.daemon.interfaces import EXPLAIN_ID, EXPLAIN_TYPE, OWNER
from cxbridge.errors import ClipsError, CxbridgeError
from cxbridge.events import Event, FactChange, InterfaceWrite, PlannerCall, RuleFired
from cxbridge.executive.executive import ENVIRONMENT
from cxbridge.history.transitions import TRANSITION_TYPES
from cxbridge.mainloop import Hook
from cxbridge.run.components.component import Component
from cxbridge_studio.constructs import read_rule_texts
from cxbridge_studio.explain.evidence import Evidence, History
from cxbridge_studio.explain.goal_rules import find_formulating_rules
from cxbridge_studio.explain.goal_story import FACT_TEMPLATES, MAX_COPIED_FACTS
from cxbridge_studio.explain.rules.environment import (
    read_fact_slots,
    read_rulebook,
    restore_sources,
    take_snapshot,
)
from cxbridge_studio.explain.rules.snapshot import Rulebook, Snapshot

if TYPE_CHECKING:
    from cxbridge.executive.host.environment import ClipsEnvironment
    from cxbridge.run.agent import Run

MAX_QUESTIONS: Final = 4  # the length of the interface's message queue, chosen freely

# The limit of the transitions, and of the firings, that are kept to explain goals: lower than for a
# recording, because a daemon runs for weeks.
MAX_DAEMON_STEPS: Final = 10_000

_MAX_ANSWER_BYTES: Final = 262_143  # the answer's string field has 256 KiB, with the final zero byte


class Explainer(Component):
    """The component of a daemon, or of a run on the web page, that answers one question at a time."""

    hooks = (Hook.PRE_LOOP,)
    steady = True
    description = "Explains rules and goals"

    def __init__(self, context: Run) -> None:
        # The class of the interface is made from XML at run time, so it has no static type.
        self._interface: Any = context.board.open_for_writing(
            EXPLAIN_TYPE, EXPLAIN_ID, owner=OWNER, queue_limit=MAX_QUESTIONS
        )
        self._context = context
        self._is_daemon = isinstance(context, Daemon)
        self._start_us = context.clock.start_us
        self._history = History(
            context.name or ENVIRONMENT, MAX_DAEMON_STEPS, MAX_DAEMON_STEPS, self._find_facts
        )
        # A subscription makes the environment format firings and facts, which takes time. A daemon subscribes
        # only if a recording or a log needs these events anyway. A run on the web page has the time: the page
        # shows it at the speed of the real clock.
        options = context.options
        is_recorded = options.trace is not None and options.trace_level != "transitions"
        is_on_page = not self._is_daemon and context.has_clients
        has_facts = is_on_page or (is_recorded and options.trace_level == "facts")
        self._history.has_firings = is_recorded or options.log is not None or is_on_page
        types: list[type[Event]] = [*TRANSITION_TYPES, PlannerCall, InterfaceWrite]
        types += [RuleFired] if self._history.has_firings else []
        types += [FactChange] if has_facts else []
        context.bus.subscribe(self._history.add_event, *types)
        self._thread: threading.Thread | None = None
        self._answer: str | None = None  # written by the thread
        self._msgid = 0

    @property
    def _environment(self) -> ClipsEnvironment | None:
        thinking = self._context.thinking
        return None if thinking is None else thinking.executive.env

    def loop(self) -> None:
        """Publish a finished answer and take the next question."""
        if self._thread is not None:
            if self._thread.is_alive() or self._answer is None:
                return
            self._thread = None
            self._publish(self._answer)
        if self._interface.valid and not self._interface.msgq_empty():
            self._begin_answer(self._interface.msgq_pop())

    def close(self) -> None:
        """Wait for the answer in progress."""
        self._context.bus.unsubscribe(self._history.add_event)
        if self._thread is not None:
            self._thread.join()
        self._context.board.close(self._interface)

    def _begin_answer(self, message: Any) -> None:
        self._msgid, self._answer = message.id, None
        env = self._environment
        if env is None:
            error = CxbridgeError("the executive is not running now", hint="see 'cxbridge daemon status'")
            self._publish(_error_to_json(error))
            return
        name, kind, context = str(message.name), str(message.kind), self._context
        start_us, now_us = self._start_us, context.clock.now_us()
        agent = f"{context.spec} in the daemon" if self._is_daemon else context.spec
        where = f"{agent}, {(now_us - start_us) / MICROSECONDS:.3f} s after its start"
        evidence = copy_evidence(
            env, context.paths.clips_dirs, name, kind, where, (start_us, now_us), self._copy_history()
        )
        self._thread = threading.Thread(
            target=self._set_answer,
            args=(evidence, name, kind, int(message.rules)),
            name="explain",
            daemon=True,
        )
        self._thread.start()

    def _copy_history(self) -> History:
        """Return a copy that the thread can read while the run adds events."""
        history = copy(self._history)
        history.steps = self._history.steps.copy()
        history.firings = self._history.firings.copy()
        # The lives are copied, too, because the end of a fact is written into its life later.
        history.fact_lives = {index: copy(life) for index, life in self._history.fact_lives.items()}
        return history

    def _find_facts(self, template: str) -> list[Mapping[str, str]]:
        """Return the facts of a deftemplate. The history calls this while rules fire, in their thread."""
        env = self._environment
        return [] if env is None else read_fact_slots(env, template, MAX_COPIED_FACTS)

    def _set_answer(self, evidence: Evidence, name: str, kind: str, rule_count: int) -> None:
        """Set the answer. This is the function of the thread."""
        try:
            self._answer = _explain_to_json(evidence, name, kind, rule_count)
        except CxbridgeError as error:
            self._answer = _error_to_json(error)
        except Exception as error:  # noqa: BLE001 - no question may end a daemon
            text = f"an internal error of cxbridge: {type(error).__name__}: {error}"
            self._answer = _error_to_json(CxbridgeError(text))

    def _publish(self, text: str) -> None:
        if self._interface.valid:
            self._interface.msgid = self._msgid
            self._interface.answer = text
            self._interface.write()


class CopiedEvidence(Evidence):
    """A copy of the evidence, to be explained while the run continues.

    :param times_us: the start of the run, and the moment to explain.
    :param snapshots: the copies of the rules in question by name, or the errors that copying raised.
    :param facts: the slots of the facts, by deftemplate.
    :param texts: the defrules by name, as the environment prints them.
    """

    def __init__(
        self,
        where: str,
        times_us: tuple[int, int],
        history: History,
        rulebook: Rulebook,
        snapshots: Mapping[str, Snapshot | ClipsError],
        facts: Mapping[str, list[Mapping[str, str]]],
        texts: Mapping[str, str],
    ) -> None:
        super().__init__(where, *times_us, history)
        self._rulebook = rulebook
        self._snapshots = snapshots
        self._facts = facts
        self._texts = texts

    def read_rulebook(self) -> Rulebook:
        return self._rulebook

    def take_snapshot(self, rule: str) -> Snapshot:
        snapshot = self._snapshots.get(rule)
        if isinstance(snapshot, Snapshot):
            return snapshot
        raise snapshot or ClipsError(f"the rule '{rule}' was not copied")

    def read_fact_slots(self, template: str) -> list[Mapping[str, str]]:
        return self._facts.get(template, [])

    def read_rule_texts(self) -> Mapping[str, str]:
        # The texts are restored here, in the thread: restoring hundreds of rules would stop the loop.
        return restore_sources(self._texts)


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
    :param kind: one of :data:`.answer.KINDS`, or empty to try a rule and a goal.
    :param where: the source and the moment in words.
    :param times_us: the start of the run, and the moment to explain.
    """
    facts: dict[str, list[Mapping[str, str]]] = {}
    texts: dict[str, str] = {}
    with env.lock:
        rulebook = read_rulebook(env, folders)
        rules = [name]
        if kind == "goal" or name not in rulebook.rules:
            texts = read_rule_texts(env)
            # If the goal does not exist, the report explains the rule that formulates it.
            rules = find_formulating_rules(texts, name)[:1]
            facts = {
                template: read_fact_slots(env, template, MAX_COPIED_FACTS) for template in FACT_TEMPLATES
            }
        snapshots = {rule: _try_snapshot(env, rule) for rule in rules}
    return CopiedEvidence(where, times_us, history, rulebook, snapshots, facts, texts)


def _try_snapshot(env: ClipsEnvironment, rule: str) -> Snapshot | ClipsError:
    try:
        return take_snapshot(env, rule, MAX_COPIED_FACTS)
    except ClipsError as error:
        return error


def _explain_to_json(evidence: Evidence, name: str, kind: str, rule_count: int) -> str:
    """Return the report as JSON.

    :raises CxbridgeError: if the name is unknown, its state cannot be explained, or the report is too long.
    """
    # The import takes long: it waits for the first question, and runs in the thread, not in the loop.
    from cxbridge_studio.explain.answer import explain  # noqa: PLC0415

    explanation = explain(evidence, name, kind, rule_count)
    text = json.dumps({"lines": explanation.lines, "data": explanation.json_report})
    if len(text) > _MAX_ANSWER_BYTES:  # `dumps` writes ASCII: a character is a byte
        raise CxbridgeError("the reply is too long", hint="ask about one goal: its id, or CLASS#NUMBER")
    return text


def _error_to_json(error: CxbridgeError) -> str:
    return json.dumps({"error": error.message, "hint": error.hint})
