"""Changes of facts as the recordings of the thesis' system have them, of a recording and of a run of ours."""

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
    "skill-read-information",  # once a tick: how many ticks there are is a matter of time
    "executive-load-config",  # these two come before the configuration says that rules are watched
    "executive-enable-debug",
}
"""Rules whose firings are not compared."""

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
    """A change: what kind of thing, which one, from what to what, by which rule."""

    kind: str
    key: str
    change: str
    rule: str


def recorded(file: Path, kinds: Iterable[str] = KINDS) -> list[Row]:
    """The changes of a ``transitions.txt``, with gensym's names counted."""
    rows = []
    for line in file.read_text().splitlines():
        match = _LINE.match(line)
        assert match, line
        if match["kind"] in kinds:
            words = match["rest"].split()
            size = _KEY_WORDS.get(match["kind"])
            if size is None:  # a fact comes or goes as a whole: "new true", "-> (retracted)"
                size = len(words) - 2
            rows.append(Row(match["kind"], " ".join(words[:size]), " ".join(words[size:]), match["rule"]))
    return _counted(rows)


def _counted(rows: Iterable[Row]) -> list[Row]:
    """Gensym's numbers, by the order in which they appear."""
    names: dict[str, str] = {}

    def count(text: str) -> str:
        return _GENSYM.sub(lambda match: names.setdefault(match[0], f"gen<{len(names) + 1}>"), text)

    return [row._replace(key=count(row.key), change=count(row.change)) for row in rows]


@dataclass
class Watched:
    """The actions of our run."""

    result: RunResult
    rows: list[Row]
    fired: list[str]
    messages: list[InterfaceMessage] = field(default_factory=list)
    log: list[LogLine] = field(default_factory=list)


def run(options: RunOptions) -> Watched:
    """Run, and note the changes of facts and the messages of the skill board."""
    changes = _Changes()
    messages: list[InterfaceMessage] = []
    log: list[LogLine] = []

    def hear(event: Event) -> None:
        assert isinstance(event, LogLine)
        log.append(event)

    def note(event: Event) -> None:
        assert isinstance(event, InterfaceMessage)
        messages.append(event)

    def attach(agent: Run) -> None:
        changes.watch(agent)
        agent.bus.subscribe(note, InterfaceMessage)
        agent.bus.subscribe(hear, LogLine)

    result = run_scenario(options, None, attach)
    return Watched(result, changes.rows(), changes.fired, messages, log)


class _Changes:
    """Pairs the retracts and asserts of a rule: that is how CLIPS modifies a fact."""

    def __init__(self) -> None:
        self._rows: list[Row | None] = []
        self._gone: dict[tuple[str, str], tuple[int, str]] = {}
        self._rule = ""
        self.fired: list[str] = []

    def watch(self, agent: Run) -> None:
        watcher = agent.executive.env.watcher
        agent.bus.subscribe(self._fired, RuleFired)
        watcher.set_hooks()
        for template, slots in _SLOTS.items():
            watcher.follow(template, self._added, slots)
            watcher.follow_retractions(template, self._removed, slots)

    def rows(self) -> list[Row]:
        return _counted(row for row in self._rows if row is not None)

    def _fired(self, event: Event) -> None:
        assert isinstance(event, RuleFired)
        self._rule = event.rule
        if event.rule not in NOT_COMPARED:
            self.fired.append(event.rule)
        self._gone.clear()

    def _added(self, template: str, slots: dict[str, str]) -> None:
        key, state = _state(template, slots)
        index, old = self._gone.pop((template, key), (None, None))
        if index is not None:
            self._rows[index] = None
        if old != state:
            change = f"new {state}" if old is None else f"{old} -> {state}"
            self._rows.append(Row(template, key, change, self._rule))

    def _removed(self, template: str, slots: dict[str, str]) -> None:
        key, state = _state(template, slots)
        self._gone[template, key] = len(self._rows), state
        self._rows.append(Row(template, key, "-> (retracted)", self._rule))


def _state(template: str, slots: dict[str, str]) -> tuple[str, str]:
    """Key and state of a fact, as the recorder wrote them."""
    if template == "goal":
        more = [slots["outcome"] if slots["outcome"] != "UNKNOWN" else "", slots["error"]]
        return slots["id"], " ".join(text for text in (slots["mode"], *more) if text)
    if template == "plan-action":
        executable = " exec" if slots["executable"] == "TRUE" else ""
        return f"{slots['goal-id']} {slots['plan-id']} {slots['id']}", slots["state"] + executable
    if template == "skill":
        return slots["id"], slots["status"]
    return f"{slots['name']} {slots['param-values']}".strip(), "true"
