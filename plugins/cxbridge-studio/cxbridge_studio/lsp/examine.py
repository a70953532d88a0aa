"""The child process that examines an agent: runs the complete check, and lists functions and deftemplates.

``python -m cxbridge_studio.lsp.examine`` reads options as JSON from standard input and writes an
:class:`~cxbridge_studio.lsp.knowledge.AgentKnowledge` as JSON. The server itself does not load CLIPS, so that
it stays responsive, and a file that crashes CLIPS ends only this process.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import msgspec

from cxbridge.clipstext.syntax import without_module
from cxbridge.errors import CxbridgeError
from cxbridge.executive.executive import ENVIRONMENT
from cxbridge.executive.features.pddl_parser import reads_as_fawkes
from cxbridge.run.options import RunOptions
from cxbridge.run.program.plain_options import plain_options
from cxbridge.trace.formats.registry import open_run
from cxbridge_studio.check.agent import Agent, find_agent_names
from cxbridge_studio.check.run import check
from cxbridge_studio.explain.coverage.model import RecordedUse
from cxbridge_studio.lsp.knowledge import AgentKnowledge, FunctionInfo

_FUNCTION_LISTS = ("(get-function-list)", "(get-deffunction-list *)", "(get-defgeneric-list *)")
REWRITTEN_MODIFY = (
    "cx-modify-goal"  # the loader replaces `modify` of goals in the built-in core by this function
)


def run_options(plain: Mapping[str, Any]) -> RunOptions:
    """Return the options of a run from JSON values; empty values are those of unset editor settings.

    :raises CxbridgeError: if an option is unknown or wrong.
    """
    options = plain_options({name: value for name, value in plain.items() if value not in ("", [])})
    options.check()
    return options


def examine(options: RunOptions) -> AgentKnowledge:
    """Examine the first agent; the findings are those of all agents."""
    try:
        findings = [finding.to_json() for finding in check(options)]
        name = find_agent_names(options)[0]
        with Agent(replace(options, agent=name)) as agent:
            templates = dict(_templates(agent))
            functions = dict(_functions(agent))
            loaded = [str(file.path.resolve()) for file in agent.files]
            as_fawkes = reads_as_fawkes(agent.config)
    except CxbridgeError as error:
        return AgentKnowledge(error=str(error))
    return AgentKnowledge(functions, templates, findings, loaded, reads_as_fawkes=as_fawkes)


def firings(run: Path) -> dict[str, int]:
    """Return the number of firings by rule in a recording; empty if the recording cannot be read."""
    use = RecordedUse()
    with suppress(CxbridgeError, OSError):
        use.add(open_run(run), ENVIRONMENT)
    return dict(use.firings)


def _templates(agent: Agent) -> Iterator[tuple[str, list[str]]]:
    for name in sorted(agent.deftemplates):
        yield name, agent.eval_words(f"(deftemplate-slot-names {name})")


def _functions(agent: Agent) -> Iterator[tuple[str, FunctionInfo]]:
    """Yield the functions of CLIPS, the host and the requested features, then those of other features."""
    defined = {
        construct.name
        for file in agent.files
        for construct in file.constructs
        if construct.kind in ("deffunction", "defgeneric")
    }
    for names in map(agent.eval_words, _FUNCTION_LISTS):  # the host defines some functions as deffunctions
        for name in map(without_module, names):
            if name not in defined:
                yield name, FunctionInfo()
    yield REWRITTEN_MODIFY, FunctionInfo()
    for feature in agent.manager.features:
        with suppress(CxbridgeError):  # without its dependencies, a feature has no known functions
            agent.manager.request(agent.env.name, feature)
    feature_functions = agent.manager.feature_functions(agent.env.name)
    owners = {name: feature for feature, names in feature_functions.items() for name in names}
    for name in agent.env.udfs.names:
        yield name, FunctionInfo(*agent.env.udfs.signature(name), owners.get(name, ""), is_python=True)


def main() -> None:
    """Read the options from standard input and write the result to standard output."""
    output = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # the output of checks and of CLIPS must not mix with the result
    options = msgspec.json.decode(sys.stdin.buffer.read())
    recording = options.pop("recording", "")
    try:
        knowledge = examine(run_options(options))
    except CxbridgeError as error:
        knowledge = AgentKnowledge(error=str(error))
    if recording:
        counts, name = firings(Path(recording)), Path(recording).name
        knowledge = msgspec.structs.replace(knowledge, firings=counts, recording=name)
    with output:
        output.write(msgspec.json.encode(knowledge))


if __name__ == "__main__":
    main()
