"""Runs the checks on a scenario, a CLIPS file or a PDDL file.

A comment silences findings in the same line and in the next line: ``cx-check: ignore CODE REASON``.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Final

from cxbridge.clock import VirtualClock
from cxbridge.errors import CxbridgeError
from cxbridge.events import EventBus
from cxbridge.run.options import RunOptions
from cxbridge.run.paths import SCENARIO_FILE
from cxbridge.run.source import CLIPS_SUFFIX
from cxbridge_studio.check.agent import MAX_FOLDERS, Agent, agents, folders_around, has_commands
from cxbridge_studio.check.findings import PROGRAM, Finding, Severity, SourcePlace, of_error
from cxbridge_studio.check.pddl_files import SUFFIX, findings_of
from cxbridge_studio.check.stubbed_environment import StubbedEnvironment
from cxbridge_studio.check.table import findings

_SILENCING_COMMENT: Final = re.compile(r"[;#-]\s*cx-check: ignore (?P<codes>CX\d+(?:, ?CX\d+)*)\s+\S")


def check(options: RunOptions, *, errors_only: bool = False, portable: bool = False) -> list[Finding]:
    """Return the findings for a scenario's agents, a CLIPS file or a PDDL file, each once.

    :param options: the options of a run; those about recording and time have no effect.
    :param errors_only: whether to skip warnings and notes.
    :param portable: whether to report code that Fawkes does not accept.
    :raises CxbridgeError: if the options contradict each other.
    """
    options.check()
    file = options.scenario
    if file is not None and file.suffix == SUFFIX and file.is_file():
        return without_silenced(findings_of(file))
    if file is not None and file.suffix == CLIPS_SUFFIX and file.is_file():
        return _of_file(options, file.resolve(), errors_only=errors_only, portable=portable)
    return without_silenced(_of_agents(options, errors_only=errors_only, portable=portable))


def _of_agents(options: RunOptions, *, errors_only: bool, portable: bool) -> list[Finding]:
    """Return the findings for all agents of a scenario; an error of loading is the last finding."""
    unique_findings: dict[Finding, None] = {}  # the agents of a scenario share files
    try:
        for name in agents(options):
            with Agent(replace(options, agent=name)) as agent:
                agent_findings = findings(agent, errors_only=errors_only, portable=portable)
                unique_findings |= dict.fromkeys(agent_findings)
    except CxbridgeError as error:
        unique_findings[of_error(error)] = None
    return list(unique_findings)


def _of_file(options: RunOptions, file: Path, *, errors_only: bool, portable: bool) -> list[Finding]:
    """Return the findings in a CLIPS file, as a part of the surrounding agent or as an agent alone."""
    for folder in file.parents[:MAX_FOLDERS]:
        scenario = folder / SCENARIO_FILE
        if scenario.is_file():
            scenario_options = replace(options, scenario=folder)
            first_agent = replace(scenario_options, agent=agents(scenario_options)[0])
            # A scenario that cannot be read, or does not load the file, gives no findings for the file.
            with suppress(CxbridgeError), Agent(first_agent) as agent:
                if any(loaded.path.resolve() == file for loaded in agent.files):
                    all_findings = _of_agents(scenario_options, errors_only=errors_only, portable=portable)
                    return without_silenced(
                        finding for finding in all_findings if Path(finding.place.file).resolve() == file
                    )
    file_findings = _of_agents(options, errors_only=errors_only, portable=portable)
    without_errors = [finding for finding in file_findings if finding.code.severity is not Severity.ERROR]
    # Errors in a file that CLIPS loads alone are conflicts with the names of the core.
    if len(without_errors) < len(file_findings) and _is_program(file):
        hint = "run it with CLIPS, or give its facts and rules names that the core does not have"
        message = "the names are those of the CX core"
        file_findings = [*without_errors, Finding(PROGRAM, SourcePlace(str(file)), message, hint)]
    return without_silenced(file_findings)


def _is_program(file: Path) -> bool:
    """Return whether CLIPS loads a file without the executive's core."""
    env = StubbedEnvironment("program", EventBus(VirtualClock()))
    try:
        env.folders = folders_around(file)
        (env.loader.batch if has_commands(file) else env.loader.load)(str(file))
        return not env.loader.diagnostics
    finally:
        env.destroy()


def without_silenced(findings: Iterable[Finding]) -> list[Finding]:
    """Return the findings that no comment silences; a comment without a reason silences nothing."""
    lines_of = cache(_lines)  # a file is read once for all its findings
    return [finding for finding in findings if not _is_silenced(finding, lines_of(finding.place.file))]


def _is_silenced(finding: Finding, lines: list[str]) -> bool:
    number = finding.place.line
    # The comment stands in the line of the finding, or in the line above.
    return any(
        finding.code.name in re.split(r", ?", match["codes"])
        for line in lines[max(number - 2, 0) : number]
        if (match := _SILENCING_COMMENT.search(line))
    )


def _lines(file: str) -> list[str]:
    """Return the lines of a file; empty if it cannot be read."""
    try:
        return Path(file).read_text("utf-8", "surrogateescape").splitlines()
    except (OSError, ValueError):
        return []
