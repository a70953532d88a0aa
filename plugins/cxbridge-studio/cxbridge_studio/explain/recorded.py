"""Evidence from a recording: events up to a time, facts at that time, and constructs from files."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Protocol

from cxbridge.clipstext.condition import patterns
from cxbridge.clock import MICROSECONDS
from cxbridge.errors import TraceError
from cxbridge.events import (
    Event,
    FactChange,
    GoalTransition,
    InterfaceMessage,
    InterfaceWrite,
    LogLine,
    PlanActionTransition,
    PlannerCall,
    RuleFired,
    SkillStatus,
)
from cxbridge.history.state import EnvironmentFacts
from cxbridge.printing import short_path
from cxbridge.trace.formats.base import Run
from cxbridge.trace.sources import building_steps
from cxbridge_studio.agent.rule import parse_rule
from cxbridge_studio.explain.evidence import Evidence, History, NoFactsError
from cxbridge_studio.explain.recorded_diagnostics import Refusals, agent_folders
from cxbridge_studio.explain.rules.constructs import Constructs, TextFile
from cxbridge_studio.explain.rules.recorded_facts import rows_of
from cxbridge_studio.explain.rules.snapshot import MAX_FACTS, Rulebook, Snapshot

_TEXTS = ("clips", "construct")
_WITH_ENV = (FactChange, RuleFired, GoalTransition, PlanActionTransition, PlannerCall, SkillStatus)
EXECUTIVE = "executive"


class RuleSource(Protocol):
    """A source of rules without facts: files, or an environment that has not run."""

    def rulebook(self) -> Rulebook: ...

    def snapshot(self, rule: str, env: str, time_us: int) -> Snapshot:
        """Return a rule without facts."""

    def rule_texts(self) -> Mapping[str, str]:
        """Return the text of all defrules by name."""


class _PastEvents:
    """The events of a recording up to a moment.

    :param at_s: seconds since the start of the run; None for its end.
    :ivar cut: whether the recording continues after the moment.
    """

    def __init__(self, run: Run, at_s: float | None) -> None:
        self.histories: dict[str, History] = {}
        self.facts = EnvironmentFacts()
        self.refusals = Refusals()
        self.cut = False
        start_us, now_us = run.start_us, None
        for event in run:
            start_us = event.time_us if start_us is None else start_us
            now_us = event.time_us if now_us is None else now_us
            if at_s is not None and event.time_us > start_us + at_s * MICROSECONDS:
                self.cut = True
                break
            now_us = max(now_us, event.time_us)
            self._take(event)
        if start_us is None or now_us is None:
            raise TraceError("this recording has no events", file=run.path)
        self.start_us: int = start_us
        self.now_us: int = now_us

    def _take(self, event: Event) -> None:
        if isinstance(event, FactChange):
            self.facts.take(event)
        if isinstance(event, _WITH_ENV):
            if event.env not in self.histories:
                reads = partial(self.facts.slots, event.env)
                self.histories[event.env] = History(event.env, facts_of=reads)
            self.histories[event.env].take(event)
        elif isinstance(event, LogLine):
            self.refusals.take(event)
        elif isinstance(event, InterfaceWrite | InterfaceMessage):
            # The transitions show which environment a Skiller serves, so every history gets the event.
            for each in self.histories.values():
                each.take(event)


class RecordedEvidence(Evidence):
    """The evidence of a recording about a moment.

    :param run: the recording, read once up to the moment.
    :param at_s: seconds since the start of the run; None for its end.
    :param env: the CLIPS environment; None for the executive's, or the only one.
    :param rules: the source of rules; None for the files attached to the recording.
    :raises TraceError: if the recording cannot be read, or has no such environment.
    """

    def __init__(
        self, run: Run, at_s: float | None, env: str | None, rules: RuleSource | None = None
    ) -> None:
        past = _PastEvents(run, at_s)
        start_us, now_us, facts, histories = past.start_us, past.now_us, past.facts, past.histories
        chosen = _choose(env, set(histories), run.path)
        self.env = chosen
        self._tables = facts
        self._facts = facts.by_env.get(chosen)
        self._seen = facts.templates.get(chosen, set())
        self._path = run.path
        self._rules = rules
        self._run = run
        self._refusals = past.refusals
        history = histories.setdefault(chosen, History(chosen))
        seconds = (now_us - start_us) / MICROSECONDS if at_s is None else at_s
        when = (
            f"at {seconds:.3f} s" if past.cut else f"at its end, {(now_us - start_us) / MICROSECONDS:.3f} s"
        )
        super().__init__(f"{short_path(run.path)} {when}", start_us, now_us, history)
        self.is_moment = at_s is not None
        if not past.cut:
            self.ending = _ending(run.metadata())
        self.notes += [f"{run.path}: {note}" for note in run.notes]

    def _source(self) -> RuleSource:
        if self._rules is None:
            steps = building_steps(self._run, self.env, self.now_us)
            texts = ((step.name, step.data) for step in steps if step.role in _TEXTS)
            files = [
                TextFile(name, data.decode("utf-8", "surrogateescape"))
                for name, data in texts
                if data is not None
            ]
            if not files:
                raise TraceError(
                    "this recording has no CLIPS files with it, so its rules are not known",
                    file=self._path,
                    hint="name the scenario that was run, or with --fawkes-dir the Fawkes whose log it is",
                )
            folders = agent_folders((file.name, file.text) for file in files)
            self._rules = Constructs(files, self._refusals.of(self.env), folders)
        return self._rules

    def rulebook(self) -> Rulebook:
        return self._source().rulebook()

    def snapshot(self, rule: str) -> Snapshot:
        """Return a rule with the facts of the moment."""
        if self._facts is None:
            raise NoFactsError(
                "this recording has no facts",
                file=self._path,
                hint="record with --trace-level facts; a Fawkes needs clips-executive/debug/enable",
            )
        bare = self._source().snapshot(rule, self.env, self.now_us)
        wanted = {pattern.template for pattern in patterns(parse_rule(bare.text).ces)}
        changes = [c for c in self._facts.values() if bare.all_facts or c.template in wanted]
        for name in sorted(wanted - self._seen):
            self.notes.append(f"no fact of '{name}' was recorded: there was none, or it was not watched")
        if len(changes) > MAX_FACTS:
            return replace(bare, too_many=len(changes))
        templates, rows = rows_of(changes, bare.templates)
        if not bare.all_facts:
            templates = {name: template for name, template in templates.items() if name in wanted}
        if len(rows) < len(changes):
            self.notes.append(f"{len(changes) - len(rows)} facts of the recording cannot be read")
        return replace(bare, templates=templates, facts=tuple(rows))

    def rule_texts(self) -> Mapping[str, str]:
        try:
            return self._source().rule_texts()
        except TraceError:
            return {}

    def has_facts_of(self, template: str) -> bool:
        """Return whether facts of a deftemplate were recorded."""
        return template in self._seen

    def slots_of(self, template: str) -> list[Mapping[str, str]]:
        return self._tables.slots(self.env, template)


def _ending(metadata: Mapping[str, str]) -> str:
    """Return how a run ended that did not end by its goals; empty when the recording does not tell."""
    status, reason = metadata.get("status", ""), metadata.get("reason", "")
    return f"the run ended with status {status}: {reason}" if status.isdigit() and int(status) > 1 else ""


def _choose(env: str | None, names: set[str], path: Path) -> str:
    if env is None:
        return next(iter(names)) if len(names) == 1 else EXECUTIVE
    if env not in names:
        known = ", ".join(sorted(names)) or "none"
        raise TraceError(
            f"there is no CLIPS environment '{env}' in it", file=path, hint=f"there are: {known}"
        )
    return env
