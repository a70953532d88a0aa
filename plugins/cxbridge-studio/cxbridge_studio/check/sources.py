"""Reads the rules and the source files of a scenario without running it.

The rules explain recordings that contain no CLIPS files.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from cxbridge.events import Event, SourceRead
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.run.options import RunOptions
from cxbridge.trace.sourcing import emit_configuration
from cxbridge_studio.check.agent import Agent, find_agent_names
from cxbridge_studio.check.domain_calls import find_domain_calls
from cxbridge_studio.constructs import read_rule_texts
from cxbridge_studio.explain.rules.constructs import Constructs, TextFile
from cxbridge_studio.explain.rules.environment import read_rulebook, restore_sources, take_snapshot
from cxbridge_studio.explain.rules.snapshot import Rulebook, Snapshot


class ScenarioRules:
    """The rules of a scenario's files, a source of rules for ``RecordedEvidence``.

    :param env: the environment that has loaded the files.
    :param folders: the folders that the agent searches for CLIPS files.
    """

    def __init__(self, env: ClipsEnvironment, folders: tuple[object, ...]) -> None:
        self._env = env
        self._folders = folders
        # The values of global variables are unknown before a run, so the expressions in their definitions
        # take the place of the values.
        self._globals = Constructs(_read_texts(env.loader.files)).global_texts

    def read_rulebook(self) -> Rulebook:
        return read_rulebook(self._env, self._folders)

    def take_snapshot(self, rule: str, env: str, time_us: int) -> Snapshot:
        """Return a snapshot of a rule, without facts."""
        rule_snapshot = take_snapshot(self._env, rule, max_facts=0)
        return replace(
            rule_snapshot,
            env=env,
            time_us=time_us,
            facts=(),
            globals={},
            global_texts=self._globals if rule_snapshot.globals else {},
            agenda=None,
            clips_counts=(),
            uncopied_count=0,
            halt_reason="",
        )

    def read_rule_texts(self) -> Mapping[str, str]:
        """Return the texts of the defrules by name."""
        return restore_sources(read_rule_texts(self._env))


@contextmanager
def load_scenario_rules(options: RunOptions, env: str | None = None) -> Iterator[ScenarioRules]:
    """Load a scenario without running it and yield its rules.

    :param env: the name of the environment, which is the name of the agent in a scenario with several agents.
    """
    options.check()
    if env is not None and options.agent is None and env in find_agent_names(options):
        options = replace(options, agent=env)
    with Agent(options) as agent:
        yield ScenarioRules(agent.env, agent.context.paths.clips_dirs)


def read_scenario_sources(options: RunOptions) -> list[SourceRead]:
    """Return the source files of a scenario in the order of reading.

    No rule fires, so files whose names rules compute are missing.
    """
    options.check()
    sources: list[SourceRead] = []

    def keep_source(event: Event) -> None:
        if isinstance(event, SourceRead):
            sources.append(event)

    with Agent(options, keep_source) as agent:
        emit_configuration(agent.context.bus, agent.config)
        for path in dict.fromkeys(call.path for call in find_domain_calls(agent) if call.path is not None):
            agent.context.bus.emit_source("pddl", "", str(path), path.read_bytes(), kind="domain")
    return sources


def _read_texts(files: list[Path]) -> list[TextFile]:
    return [TextFile(str(file), file.read_text("utf-8", "surrogateescape")) for file in dict.fromkeys(files)]
