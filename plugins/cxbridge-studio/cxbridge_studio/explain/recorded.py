"""Evidence from a recording: events up to a moment, the facts then, and the recorded CLIPS files.

The recording is read once, up to the moment. Its rules come from the files that it contains, or from a
scenario that the user names.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Final

from cxbridge.clock import MICROSECONDS
from cxbridge.errors import TraceError
from cxbridge.events import Event, FactChange, InterfaceMessage, InterfaceWrite, Level, LogLine
from cxbridge.executive.host.loading import Diagnostic
from cxbridge.printing import format_count, short_path
from cxbridge.trace.formats.base import Run
from cxbridge_studio.agent.condition import find_patterns
from cxbridge_studio.agent.rule import parse_rule
from cxbridge_studio.environment_sources import find_build_sources, make_unknown_environment_error
from cxbridge_studio.explain.evidence import ENVIRONMENT_EVENT_TYPES, Evidence, History, NoFactsError
from cxbridge_studio.explain.rules.constructs import Constructs, TextFile
from cxbridge_studio.explain.rules.recorded_facts import parse_rows
from cxbridge_studio.explain.rules.snapshot import MAX_FACTS, Rulebook, Snapshot
from cxbridge_studio.recorded_state import EnvironmentFacts

# As in cxbridge.executive.executive, whose import would make `cxbridge why` slower by a third.
EXECUTIVE_ENVIRONMENT: Final = "executive"
MAX_DIAGNOSTICS: Final = 1000  # the limit of the kept diagnostics of each environment

# The component of the log lines of a CLIPS environment.
_LOG_COMPONENT = re.compile(r"CLIPS \((.+)\)")
# A diagnostic such as "agent.clp:12: defrule go is not defined: missing parenthesis [PRNTUTIL2]". The
# lookahead rejects other lines at once: without it, each colon would be tried as the end of the file name, in
# quadratic time.
_LOGGED_DIAGNOSTIC = re.compile(
    r"(?=.* \[\w+\]\Z)(.+?)(?::(\d{1,9}))?: (?:(def\w+ \S++) is not defined: )?(.*) \[(\w+)\]", re.DOTALL
)


class _PastEvents:
    """The events of a recording up to one moment, by environment.

    :param at_s: the seconds since the start of the run; None for its end.
    :ivar diagnostics: the loader's messages about CLIPS files, from log lines: no other event has them.
    :ivar has_later_events: whether the recording continues after the moment.
    :raises TraceError: if the recording cannot be read, or has no events.
    """

    def __init__(self, run: Run, at_s: float | None) -> None:
        self.histories: dict[str, History] = {}
        self.facts = EnvironmentFacts()
        self.diagnostics: dict[str, list[Diagnostic]] = {}
        self.has_later_events = False
        # A recording may lack its start: then the first event counts. The present is the last event up to the
        # moment.
        start_us, now_us = run.start_us, None
        for event in run:
            start_us = event.time_us if start_us is None else start_us
            now_us = event.time_us if now_us is None else now_us
            if at_s is not None and event.time_us > start_us + at_s * MICROSECONDS:
                self.has_later_events = True
                break
            now_us = max(now_us, event.time_us)
            self._add_event(event)
        if start_us is None or now_us is None:
            raise TraceError("this recording has no events", file=run.path)
        self.start_us, self.now_us = start_us, now_us

    def _add_event(self, event: Event) -> None:
        if isinstance(event, FactChange):
            self.facts.add_change(event)
        if isinstance(event, ENVIRONMENT_EVENT_TYPES):
            if event.env not in self.histories:
                find_facts = partial(self.facts.read_slots, event.env)
                self.histories[event.env] = History(event.env, find_facts=find_facts)
            self.histories[event.env].add_event(event)
        elif isinstance(event, LogLine):
            self._add_diagnostic(event)
        elif isinstance(event, InterfaceWrite | InterfaceMessage):
            # The transitions show which environment a Skiller serves, so each history so far gets the event.
            for history in self.histories.values():
                history.add_event(event)

    def _add_diagnostic(self, event: LogLine) -> None:
        """Keep a log line if it is a message of the loader about a CLIPS file."""
        component_match = _LOG_COMPONENT.fullmatch(event.component)
        is_problem = event.level in (Level.WARN, Level.ERROR)
        line_match = _LOGGED_DIAGNOSTIC.fullmatch(event.text) if component_match and is_problem else None
        if component_match is None or line_match is None:
            return
        diagnostics = self.diagnostics.setdefault(component_match[1], [])
        if len(diagnostics) < MAX_DIAGNOSTICS:
            file, line, construct, message, code = line_match.groups()
            diagnostics.append(Diagnostic(file, int(line) if line else None, construct or "", code, message))


class RecordedEvidence(Evidence):
    """Evidence from a recording, as of a moment.

    :param run: the recording, read once up to the moment.
    :param at_s: the seconds since the start of the run; None for its end.
    :param env: the CLIPS environment; None for the executive's, or the only one.
    :param constructs: the constructs of a scenario; None for the files attached to the recording.
    :raises TraceError: if the recording cannot be read, has no events, or has no such environment.
    """

    def __init__(
        self, run: Run, at_s: float | None, env: str | None, constructs: Constructs | None = None
    ) -> None:
        self._past_events = past_events = _PastEvents(run, at_s)
        self._env = _choose_environment(env, set(past_events.histories), run.path)
        self._run = run
        self._constructs = constructs
        self.has_executive = bool(past_events.histories) or past_events.has_later_events
        history = past_events.histories.setdefault(self._env, History(self._env))
        end_s = (past_events.now_us - past_events.start_us) / MICROSECONDS
        has_later_events = past_events.has_later_events and at_s is not None
        time_text = f"at {at_s:.3f} s" if has_later_events else f"at its end, {end_s:.3f} s"
        super().__init__(
            f"{short_path(run.path)} {time_text}", past_events.start_us, past_events.now_us, history
        )
        self.is_time_chosen = at_s is not None
        if not past_events.has_later_events:
            self.ending = _describe_ending(run)
            if at_s is not None and at_s > round(end_s, 3):
                self.notes.append(f"the recording ends at {end_s:.3f} s, before --at {at_s:g}")
        self.notes += [f"{run.path}: {note}" for note in run.notes]

    def _load_constructs(self) -> Constructs:
        """Return the constructs of the run; the recorded files are parsed on first use.

        :raises TraceError: if the recording has no CLIPS files.
        """
        if self._constructs is None:
            files = [
                TextFile(step.name, content.decode("utf-8", "surrogateescape"))
                for step in find_build_sources(self._run, self._env, self.now_us)
                if step.role in ("clips", "construct") and (content := step.data) is not None
            ]
            if not files:
                raise TraceError(
                    "this recording contains no CLIPS files, so its rules are unknown",
                    file=self._run.path,
                    hint="name the scenario that was run, or with --fawkes-dir the checkout of the Fawkes "
                    "that wrote the log",
                )
            self._constructs = Constructs(files, self._past_events.diagnostics.get(self._env, ()))
        return self._constructs

    def read_rulebook(self) -> Rulebook:
        return self._load_constructs().rulebook

    def take_snapshot(self, rule: str) -> Snapshot:
        """Return a rule with the facts of the moment.

        :raises NoFactsError: if the recording has no facts.
        :raises TraceError: if the recording has no CLIPS files.
        :raises ClipsError: if there is no such rule, or it cannot be parsed.
        """
        recorded_facts = self._past_events.facts.by_env.get(self._env)
        if recorded_facts is None:
            raise NoFactsError(
                "this recording has no facts",
                file=self._run.path,
                hint="record with --trace-level facts; Fawkes needs clips-executive/debug/enable",
            )
        snapshot = self._load_constructs().take_snapshot(rule, self._env, self.now_us)
        matched_names = {pattern.template for pattern in find_patterns(parse_rule(snapshot.text).ces)}
        facts = [
            fact
            for fact in recorded_facts.values()
            if snapshot.needs_all_facts or fact.template in matched_names
        ]
        self.notes += [
            f"no fact of '{name}' was recorded: there was none, or it was not watched"
            for name in sorted(matched_names)
            if not self.has_facts(name)
        ]
        if len(facts) > MAX_FACTS:
            return replace(snapshot, uncopied_count=MAX_FACTS + 1)
        templates, rows = parse_rows(facts, snapshot.templates)
        if not snapshot.needs_all_facts:
            templates = {name: template for name, template in templates.items() if name in matched_names}
        if unreadable_count := len(facts) - len(rows):
            self.notes.append(f"{format_count(unreadable_count, 'fact')} of the recording cannot be read")
        return replace(snapshot, templates=templates, facts=tuple(rows))

    def read_rule_texts(self) -> Mapping[str, str]:
        try:
            return self._load_constructs().rule_texts
        except TraceError:
            return {}

    def has_facts(self, template: str) -> bool:
        """Return whether facts of a deftemplate were recorded."""
        return template in self._past_events.facts.templates.get(self._env, ())

    def read_fact_slots(self, template: str) -> list[Mapping[str, str]]:
        return self._past_events.facts.read_slots(self._env, template)


def _describe_ending(run: Run) -> str:
    """Return how a run ended; empty if its goals ended the run, or the recording does not tell."""
    status = run.exit_status() or 0
    reason = run.metadata().get("reason", "")
    # The text with which a run reports its time limit.
    if match := re.match(r"(?s)not over: (?P<goals>.+) after (?P<limit>[\d.e+]+ s)(?P<details>.*)", reason):
        goals_text = match["goals"] + match["details"]
        return f"the time limit of {match['limit']} ended the run, and goals are open: {goals_text}"
    # Status 0 or 1 means that all goals were over: they had completed or failed.
    return f"the run ended with status {status}: {reason}" if status > 1 else ""


def _choose_environment(env: str | None, names: set[str], path: Path) -> str:
    """Return the environment to explain: the named, the only one, or the executive's.

    :raises TraceError: if the recording has no environment of this name.
    """
    if env is None:
        return next(iter(names)) if len(names) == 1 else EXECUTIVE_ENVIRONMENT
    if env not in names:
        raise make_unknown_environment_error(env, names, path)
    return env
