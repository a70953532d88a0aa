"""Evidence from a recording: events up to a moment, the facts then, and the recorded CLIPS files.

The recording is read once, up to the moment. Its rules come from the files that it contains, or from a
scenario that the user names.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Final, Protocol

import cxbridge.executive
from cxbridge.clock import MICROSECONDS
from cxbridge.errors import TraceError
from cxbridge.events import (
    Event,
    FactChange,
    GoalTransition,
    InterfaceMessage,
    InterfaceWrite,
    Level,
    LogLine,
    PlanActionTransition,
    PlannerCall,
    RuleFired,
    SkillStatus,
)
from cxbridge.executive.host.loading import Diagnostic
from cxbridge.printing import short_path
from cxbridge.trace.formats.base import Run
from cxbridge.trace.sources import building_steps
from cxbridge_studio.agent.condition import patterns
from cxbridge_studio.agent.rule import parse_rule
from cxbridge_studio.explain.evidence import Evidence, History, NoFactsError
from cxbridge_studio.explain.rules.constructs import Constructs, TextFile
from cxbridge_studio.explain.rules.recorded_facts import rows_of
from cxbridge_studio.explain.rules.snapshot import MAX_FACTS, Rulebook, Snapshot
from cxbridge_studio.recorded_state import EnvironmentFacts

_CONSTRUCT_ROLES = ("clips", "construct")  # the roles of recorded sources that have constructs
_ENVIRONMENT_TYPES = (FactChange, RuleFired, GoalTransition, PlanActionTransition, PlannerCall, SkillStatus)
EXECUTIVE = "executive"  # the name of the executive's environment, unless the user names another
MAX_DIAGNOSTICS: Final = 1000  # limit of the diagnostics of an environment: the first are kept

_CORE = Path(cxbridge.executive.__file__).parent / "clips"
_COMPONENT = re.compile(r"CLIPS \((.+)\)")
# A diagnostic such as "agent.clp:12: defrule go is not defined: missing parenthesis [PRNTUTIL2]".
# Look for the end first: otherwise each colon is tried as the one after the file, in quadratic time.
_DIAGNOSTIC = re.compile(
    r"(?=.* \[\w+\]\Z)(.+?)(?::(\d{1,9}))?: (?:(def\w+ \S++) is not defined: )?(.*) \[(\w+)\]", re.DOTALL
)


class RuleSource(Protocol):
    """A source of rules without facts: files, or an environment that has not run."""

    def rulebook(self) -> Rulebook: ...

    def snapshot(self, rule: str, env: str, time_us: int) -> Snapshot:
        """Return a rule without facts."""

    def rule_texts(self) -> Mapping[str, str]:
        """Return the text of all defrules by name."""


class RecordedDiagnostics:
    """The loader's diagnostics in the log of a recording: no event but the log line has them."""

    def __init__(self) -> None:
        self._by_env: dict[str, list[Diagnostic]] = {}

    def take(self, event: LogLine) -> None:
        """Keep a log line if it is a diagnostic of the loader."""
        env = _COMPONENT.fullmatch(event.component)
        match = _DIAGNOSTIC.fullmatch(event.text) if event.level in (Level.WARN, Level.ERROR) else None
        if env is None or match is None:
            return
        diagnostics = self._by_env.setdefault(env[1], [])
        if len(diagnostics) < MAX_DIAGNOSTICS:
            file, line, construct, message, code = match.groups()
            diagnostics.append(Diagnostic(file, int(line) if line else None, construct or "", code, message))

    def of(self, env: str) -> list[Diagnostic]:
        """Return the diagnostics about the files of an environment."""
        return self._by_env.get(env, [])


class _PastEvents:
    """The events of a recording up to a moment.

    :param at_s: the seconds since the start of the run; None for its end.
    :ivar is_cut: whether the recording continues after the moment.
    """

    def __init__(self, run: Run, at_s: float | None) -> None:
        self.histories: dict[str, History] = {}
        self.facts = EnvironmentFacts()
        self.diagnostics = RecordedDiagnostics()
        self.is_cut = False
        start_us, now_us = run.start_us, None
        for event in run:
            start_us = event.time_us if start_us is None else start_us
            now_us = event.time_us if now_us is None else now_us
            if at_s is not None and event.time_us > start_us + at_s * MICROSECONDS:
                self.is_cut = True
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
        if isinstance(event, _ENVIRONMENT_TYPES):
            if event.env not in self.histories:
                facts_of = partial(self.facts.slots, event.env)
                self.histories[event.env] = History(event.env, facts_of=facts_of)
            self.histories[event.env].take(event)
        elif isinstance(event, LogLine):
            self.diagnostics.take(event)
        elif isinstance(event, InterfaceWrite | InterfaceMessage):
            # The transitions show which environment a Skiller serves, so every history gets the event.
            for history in self.histories.values():
                history.take(event)


class RecordedEvidence(Evidence):
    """The evidence of a recording about a moment.

    :param run: the recording, read once up to the moment.
    :param at_s: the seconds since the start of the run; None for its end.
    :param env: the CLIPS environment; None for the executive's, or the only one.
    :param rules: the source of rules; None for the files attached to the recording.
    :raises TraceError: if the recording cannot be read, or has no such environment.
    """

    def __init__(
        self, run: Run, at_s: float | None, env: str | None, rules: RuleSource | None = None
    ) -> None:
        past = _PastEvents(run, at_s)
        self.env = env = _choose_environment(env, set(past.histories), run.path)
        self._tables = past.facts
        self._facts = past.facts.by_env.get(env)
        self._templates_with_facts = past.facts.templates.get(env, set())
        self._path = run.path
        self._rules = rules
        self._run = run
        self._diagnostics = past.diagnostics
        history = past.histories.setdefault(env, History(env))
        seconds = (past.now_us - past.start_us) / MICROSECONDS
        is_cut = past.is_cut and at_s is not None
        when = f"at {at_s:.3f} s" if is_cut else f"at its end, {seconds:.3f} s"
        super().__init__(f"{short_path(run.path)} {when}", past.start_us, past.now_us, history)
        self.is_moment = at_s is not None
        if not past.is_cut:
            self.ending = _ending(run.metadata())
        self.notes += [f"{run.path}: {note}" for note in run.notes]

    def _source(self) -> RuleSource:
        if self._rules is None:
            steps = building_steps(self._run, self.env, self.now_us)
            texts = ((step.name, step.data) for step in steps if step.role in _CONSTRUCT_ROLES)
            files = [
                TextFile(name, data.decode("utf-8", "surrogateescape"))
                for name, data in texts
                if data is not None
            ]
            if not files:
                raise TraceError(
                    "this recording has no CLIPS files with it, so its rules are not known",
                    file=self._path,
                    hint="name the scenario that was run, or with --fawkes-dir the Fawkes that wrote the log",
                )
            folders = agent_folders((file.name, file.text) for file in files)
            self._rules = Constructs(files, self._diagnostics.of(self.env), folders)
        return self._rules

    def rulebook(self) -> Rulebook:
        return self._source().rulebook()

    def snapshot(self, rule: str) -> Snapshot:
        """Return a rule with the facts of the moment."""
        if self._facts is None:
            raise NoFactsError(
                "this recording has no facts",
                file=self._path,
                hint="record with --trace-level facts; Fawkes needs clips-executive/debug/enable",
            )
        snapshot = self._source().snapshot(rule, self.env, self.now_us)
        names = {pattern.template for pattern in patterns(parse_rule(snapshot.text).ces)}
        changes = [fact for fact in self._facts.values() if snapshot.all_facts or fact.template in names]
        for name in sorted(names - self._templates_with_facts):
            self.notes.append(f"no fact of '{name}' was recorded: there was none, or it was not watched")
        if len(changes) > MAX_FACTS:
            return replace(snapshot, too_many=len(changes))
        templates, rows = rows_of(changes, snapshot.templates)
        if not snapshot.all_facts:
            templates = {name: template for name, template in templates.items() if name in names}
        if len(rows) < len(changes):
            self.notes.append(f"{len(changes) - len(rows)} facts of the recording cannot be read")
        return replace(snapshot, templates=templates, facts=tuple(rows))

    def rule_texts(self) -> Mapping[str, str]:
        try:
            return self._source().rule_texts()
        except TraceError:
            return {}

    def has_facts_of(self, template: str) -> bool:
        """Return whether facts of a deftemplate were recorded."""
        return template in self._templates_with_facts

    def slots_of(self, template: str) -> list[Mapping[str, str]]:
        return self._tables.slots(self.env, template)


def _ending(metadata: Mapping[str, str]) -> str:
    """Return how a run ended; empty if its goals ended the run, or the recording does not tell."""
    status, reason = metadata.get("status", ""), metadata.get("reason", "")
    # Status 0 or 1 means that the goals were over, and have completed or failed.
    return f"the run ended with status {status}: {reason}" if status.isdigit() and int(status) > 1 else ""


def _choose_environment(env: str | None, names: set[str], path: Path) -> str:
    if env is None:
        return next(iter(names)) if len(names) == 1 else EXECUTIVE
    if env not in names:
        hint = f"there are: {', '.join(sorted(names)) or 'none'}"
        raise TraceError(f"there is no CLIPS environment '{env}' in it", file=path, hint=hint)
    return env


def agent_folders(files: Iterable[tuple[str, str]]) -> list[str]:
    """Return the folders of an agent's files whose content equals the recorded content.

    :param files: the paths and the recorded texts. A path alone does not open a folder: the recording may
        come from a stranger.
    """
    folders: dict[str, None] = {}
    for name, text in files:
        path = Path(name)
        if not path.is_absolute() or path.is_relative_to(_CORE) or str(path.parent) in folders:
            continue
        try:
            data = text.encode("utf-8", "surrogateescape")
            # The size first: a stranger's path may lead to a device or to a huge file.
            if path.is_file() and path.stat().st_size == len(data) and path.read_bytes() == data:
                folders[str(path.parent)] = None
        except (OSError, ValueError):
            continue
    return list(folders)
