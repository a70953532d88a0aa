"""Changes of facts in recordings of the thesis' system and in runs of cxbridge."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from cxbridge.events import Event, InterfaceMessage, LogLine, RuleFired
from cxbridge.run import RunOptions, run_scenario
from cxbridge.run.agent import Run
from cxbridge.run.result import RunResult

NOT_COMPARED = {
    "skill-read-information",  # fires in each tick, and the number of ticks varies
    "executive-load-config",  # fires, like the next rule, before the watch of rules is enabled
    "executive-enable-debug",
}
"""The rules whose firings are not compared."""

KINDS = ("goal", "plan-action", "skill", "domain-fact")
_LINE = re.compile(r"\s*[\d.]+ (?P<kind>\S+) (?P<rest>.*?)\s+\{(?P<rule>\S*)\} \[.*\]$")
_KEY_WORDS = {"goal": 1, "plan-action": 3, "skill": 1}
_GENSYM = re.compile(r"gen\d+")
_SLOTS = {
    "goal": ("id", "mode", "outcome", "error"),
    "plan-action": ("goal-id", "plan-id", "id", "state", "executable"),
    "skill": ("id", "status"),
    "domain-fact": ("name", "param-values"),
}


class Row(NamedTuple):
    """A change of a fact by a rule."""

    kind: str
    key: str
    change: str
    rule: str


def read_rows(file: Path, kinds: Iterable[str] = KINDS) -> list[Row]:
    """Return the changes in a ``transitions.txt``, with renumbered names of gensym."""
    rows = []
    for line in file.read_text().splitlines():
        match = _LINE.match(line)
        assert match, line
        if match["kind"] in kinds:
            words = match["rest"].split()
            size = _KEY_WORDS.get(match["kind"])
            if size is None:  # the change of a whole fact has two words: "new true", "-> (retracted)"
                size = len(words) - 2
            rows.append(Row(match["kind"], " ".join(words[:size]), " ".join(words[size:]), match["rule"]))
    return _number_gensyms(rows)


def _number_gensyms(rows: Iterable[Row]) -> list[Row]:
    """Renumber the names of gensym in the order of their appearance."""
    names: dict[str, str] = {}

    def number(text: str) -> str:
        return _GENSYM.sub(lambda match: names.setdefault(match[0], f"gen<{len(names) + 1}>"), text)

    return [row._replace(key=number(row.key), change=number(row.change)) for row in rows]


@dataclass
class ObservedRun:
    """The result, changes, firings and messages of a run."""

    result: RunResult
    rows: list[Row]
    fired: list[str]
    messages: list[InterfaceMessage] = field(default_factory=list)
    log: list[LogLine] = field(default_factory=list)


def run(options: RunOptions) -> ObservedRun:
    """Run, and record the changes of facts and the messages of the skill board."""
    changes = _Changes()
    messages: list[InterfaceMessage] = []
    log: list[LogLine] = []

    def record_log(event: Event) -> None:
        assert isinstance(event, LogLine)
        log.append(event)

    def record_message(event: Event) -> None:
        assert isinstance(event, InterfaceMessage)
        messages.append(event)

    def attach(agent: Run) -> None:
        changes.watch(agent)
        agent.bus.subscribe(record_message, InterfaceMessage)
        agent.bus.subscribe(record_log, LogLine)

    result = run_scenario(options, None, attach)
    return ObservedRun(result, changes.rows(), changes.fired, messages, log)


class _Changes:
    """Pairs the retracts and asserts of a rule, by which CLIPS modifies a fact."""

    def __init__(self) -> None:
        self._rows: list[Row | None] = []
        self._retracted: dict[tuple[str, str], tuple[int, str]] = {}
        self._rule = ""
        self.fired: list[str] = []

    def watch(self, agent: Run) -> None:
        watcher = agent.executive.env.watcher
        agent.bus.subscribe(self._on_rule, RuleFired)
        watcher.set_hooks()
        for template, slots in _SLOTS.items():
            watcher.follow(template, self._on_assert, slots)
            watcher.follow_retractions(template, self._on_retract, slots)

    def rows(self) -> list[Row]:
        return _number_gensyms(row for row in self._rows if row is not None)

    def _on_rule(self, event: Event) -> None:
        assert isinstance(event, RuleFired)
        self._rule = event.rule
        if event.rule not in NOT_COMPARED:
            self.fired.append(event.rule)
        self._retracted.clear()

    def _on_assert(self, template: str, slots: dict[str, str]) -> None:
        key, state = _format_state(template, slots)
        index, old = self._retracted.pop((template, key), (None, None))
        if index is not None:
            self._rows[index] = None
        if old != state:
            change = f"new {state}" if old is None else f"{old} -> {state}"
            self._rows.append(Row(template, key, change, self._rule))

    def _on_retract(self, template: str, slots: dict[str, str]) -> None:
        key, state = _format_state(template, slots)
        self._retracted[template, key] = len(self._rows), state
        self._rows.append(Row(template, key, "-> (retracted)", self._rule))


def _format_state(template: str, slots: dict[str, str]) -> tuple[str, str]:
    """Return the key and state of a fact in the format of the recorder."""
    if template == "goal":
        details = [slots["outcome"] if slots["outcome"] != "UNKNOWN" else "", slots["error"]]
        return slots["id"], " ".join(text for text in (slots["mode"], *details) if text)
    if template == "plan-action":
        executable = " exec" if slots["executable"] == "TRUE" else ""
        return f"{slots['goal-id']} {slots['plan-id']} {slots['id']}", slots["state"] + executable
    if template == "skill":
        return slots["id"], slots["status"]
    return f"{slots['name']} {slots['param-values']}".strip(), "true"
