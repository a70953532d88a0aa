"""The sources of a scenario, without running it, and its rules for facts of a recording."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from cxbridge.events import Event, SourceRead
from cxbridge.executive.host.constructs import rule_texts
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.run.options import RunOptions
from cxbridge.trace.sourcing import emit_configuration
from cxbridge_studio.check.agent import Agent, agents
from cxbridge_studio.explain.rules.constructs import Constructs, TextFile
from cxbridge_studio.explain.rules.environment import rulebook, take
from cxbridge_studio.explain.rules.rewritten import as_written
from cxbridge_studio.explain.rules.snapshot import Rulebook, Snapshot


class WrittenRules:
    """The rules of a scenario's files.

    :param env: the environment that has read them.
    """

    def __init__(self, env: ClipsEnvironment, folders: tuple[object, ...]) -> None:
        self._env = env
        self._folders = folders
        # the values of global variables are not known: functions that give them are not called
        self._globals = Constructs(_texts(env.loader.files)).global_texts

    def rulebook(self) -> Rulebook:
        """Return which rules there are."""
        return rulebook(self._env, self._folders)

    def snapshot(self, rule: str, env: str, time_us: int) -> Snapshot:
        """Return a rule without facts."""
        found = take(self._env, rule, most_facts=0)
        return replace(
            found,
            env=env,
            time_us=time_us,
            facts=(),
            globals={},
            global_texts=self._globals if found.globals else {},
            agenda=None,
            own_counts=(),
            too_many=0,
            halted="",
        )

    def rule_texts(self) -> Mapping[str, str]:
        """Return all defrules by name."""
        return as_written(rule_texts(self._env))


@contextmanager
def scenario_rules(options: RunOptions, env: str | None = None) -> Iterator[WrittenRules]:
    """Read the files of a scenario, and yield its rules; nothing of it is executed.

    :param env: whose rules, of several agents.
    :raises CxbridgeError: when the input is bad.
    """
    options.check()
    if env is not None and options.agent is None and env in agents(options):
        options = replace(options, agent=env)
    with Agent(options) as agent:
        yield WrittenRules(agent.env, agent.context.paths.clips_dirs)


def scenario_sources(options: RunOptions) -> list[SourceRead]:
    """Read the files of a scenario, and return them in the order in which they were read.

    Files whose names are computed by rules are not among them: no rule fires.

    :raises CxbridgeError: when the input is bad.
    """
    options.check()
    sources: list[SourceRead] = []

    def keep(event: Event) -> None:
        if isinstance(event, SourceRead):
            sources.append(event)

    with Agent(options, keep) as agent:
        emit_configuration(agent.context.bus, agent.config)
        for path in agent.domains:
            agent.context.bus.emit_source("pddl", "", str(path), path.read_bytes(), kind="domain")
    return sources


def _texts(files: list[Path]) -> list[TextFile]:
    return [TextFile(str(file), file.read_text("utf-8", "surrogateescape")) for file in dict.fromkeys(files)]
