"""Reads the rules and the source files of a scenario without running it.

The rules explain recordings that contain no CLIPS files.
"""

from __future__ import annotations

from dataclasses import replace

from cxbridge.events import Event, SourceRead
from cxbridge.run.options import RunOptions
from cxbridge.trace.source_records import emit_configuration
from cxbridge_studio.check.agent import Agent, find_agent_names
from cxbridge_studio.check.domain_calls import find_domain_files
from cxbridge_studio.explain.rules.constructs import Constructs, TextFile


def load_scenario_rules(options: RunOptions, env: str | None = None) -> Constructs:
    """Load a scenario without running it and return the constructs of its files.

    :param env: the name of the environment, which is the name of the agent in a scenario with several agents;
        None, or another name, for the agent of the options.
    """
    options.check()
    if env is not None and options.agent is None and env in find_agent_names(options):
        options = replace(options, agent=env)
    with Agent(options) as agent:
        loader = agent.env.loader
        files = [
            TextFile(str(file), file.read_text("utf-8", "surrogateescape"))
            for file in dict.fromkeys(loader.files)
        ]
        return Constructs(files, loader.diagnostics, tuple(map(str, agent.context.paths.clips_dirs)))


def read_scenario_sources(options: RunOptions) -> list[SourceRead]:
    """Return the source files of a scenario in the order of reading.

    No rule fires, so files whose names rules compute are missing.
    """
    options.check()
    sources: list[Event] = []
    with Agent(options, sources.append) as agent:
        emit_configuration(agent.context.bus, agent.config)
        for path in find_domain_files(agent):
            agent.context.bus.emit_source("pddl", "", str(path), path.read_bytes(), kind="domain")
    return [source for source in sources if isinstance(source, SourceRead)]
