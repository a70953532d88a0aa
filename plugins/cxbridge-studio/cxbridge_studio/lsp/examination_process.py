"""The child process that examines an agent: it runs ``cxbridge check`` and lists functions and deftemplates.

``python -m cxbridge_studio.lsp.examination_process`` reads options as JSON from standard input, and writes an
:class:`~cxbridge_studio.lsp.knowledge.AgentKnowledge` as JSON. The server itself never loads CLIPS. So the
server answers at any time, and a file that crashes CLIPS only ends this process.
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
from cxbridge.run.program.plain_options import options_from_json
from cxbridge.trace.formats.registry import open_run
from cxbridge_studio.check.agent import Agent, find_agent_names
from cxbridge_studio.check.run import check
from cxbridge_studio.explain.coverage.model import RecordedUse
from cxbridge_studio.lsp.knowledge import AgentKnowledge, FunctionInfo

_FUNCTION_LIST_CALLS = ("(get-function-list)", "(get-deffunction-list *)", "(get-defgeneric-list *)")
# The loader replaces `modify` of goals in the built-in core by this function.
REWRITTEN_MODIFY = "cx-modify-goal"


def make_run_options(option_values: Mapping[str, Any]) -> RunOptions:
    """Return the options of a run from JSON values. An empty value stands for an unset setting of an editor.

    :raises CxbridgeError: if an option is unknown or invalid.
    """
    set_values = {name: value for name, value in option_values.items() if value not in ("", [])}
    options = options_from_json(set_values)
    options.check()
    return options


def examine(options: RunOptions) -> AgentKnowledge:
    """Examine the first agent, but include the findings of all agents.

    :raises CxbridgeError: if the agent's configuration cannot be read.
    """
    findings = [finding.to_json() for finding in check(options)]
    with Agent(replace(options, agent=find_agent_names(options)[0])) as agent:
        # The deftemplates come first: listing the functions loads features, which define further ones.
        slots = {
            name: agent.eval_words(f"(deftemplate-slot-names {name})") for name in sorted(agent.deftemplates)
        }
        return AgentKnowledge(
            dict(_list_functions(agent)),
            slots,
            findings,
            frozenset(str(file.path.resolve()) for file in agent.files),
            reads_as_fawkes=reads_as_fawkes(agent.config),
        )


def count_firings(recording: Path) -> dict[str, int]:
    """Return the number of firings by rule in a recording; only those before its first error."""
    recorded_use = RecordedUse()
    with suppress(CxbridgeError, OSError):
        recorded_use.add(open_run(recording), ENVIRONMENT)
    return dict(recorded_use.firings)


def _list_functions(agent: Agent) -> Iterator[tuple[str, FunctionInfo]]:
    """Yield the functions of CLIPS, of the host and of all features that can be loaded, each with its name.

    The functions that the agent's files define are left out. A name may come twice; the last counts.
    """
    defined_names = {
        construct.name
        for file in agent.files
        for construct in file.constructs
        if construct.kind in ("deffunction", "defgeneric")
    }
    # CLIPS lists deffunctions and defgenerics separately, and the host defines some.
    for names in map(agent.eval_words, _FUNCTION_LIST_CALLS):
        for name in map(without_module, names):
            if name not in defined_names:
                yield name, FunctionInfo()
    yield REWRITTEN_MODIFY, FunctionInfo()
    for feature in agent.manager.features:
        with suppress(CxbridgeError):  # a feature whose dependencies are missing cannot be loaded
            agent.manager.request(agent.env.name, feature)
    feature_functions = agent.manager.feature_functions(agent.env.name)
    owners = {name: feature for feature, names in feature_functions.items() for name in names}
    for name in agent.env.udfs.names:
        yield name, FunctionInfo(*agent.env.udfs.signature(name), owners.get(name, ""), is_python=True)


def main() -> None:
    """Read the options from standard input and write the result to standard output."""
    output = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # the output of checks and of CLIPS goes to stderr from here on, not into the result
    options = msgspec.json.decode(sys.stdin.buffer.read())
    recording = options.pop("recording")
    try:
        knowledge = examine(make_run_options(options))
    except CxbridgeError as error:
        knowledge = AgentKnowledge(error=str(error))
    if recording:
        counts, name = count_firings(Path(recording)), Path(recording).name
        knowledge = msgspec.structs.replace(knowledge, firings=counts, recording=name)
    with output:
        output.write(msgspec.json.encode(knowledge))


if __name__ == "__main__":
    main()
