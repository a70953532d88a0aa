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
from cxbridge_studio.check.agent import (
    MAX_PARENT_FOLDERS,
    Agent,
    find_agent_names,
    find_search_folders,
    needs_batch,
)
from cxbridge_studio.check.findings import (
    CONFLICTING_PROGRAM,
    Finding,
    Severity,
    SourcePlace,
    make_error_finding,
)
from cxbridge_studio.check.pddl_files import PDDL_SUFFIX, check_pddl_file
from cxbridge_studio.check.stubbed_environment import StubbedEnvironment
from cxbridge_studio.check.table import run_checks

# A comment of CLIPS or PDDL (;), YAML (#) or Lua (--), with a reason after the codes.
_SILENCING_COMMENT: Final = re.compile(r"[;#-]\s*cx-check: ignore (?P<codes>CX\d+(?:, ?CX\d+)*)\s+\S")


def check(options: RunOptions, *, errors_only: bool = False, portable: bool = False) -> list[Finding]:
    """Return the findings for a scenario's agents, a CLIPS file or a PDDL file, each once.

    :param options: the options of a run; those about recording and time have no effect.
    :param errors_only: whether to skip the warnings and notes of the checks of agents.
    :param portable: whether to report code of agents that Fawkes does not accept.
    :raises CxbridgeError: if the options contradict each other.
    """
    options.check()
    file = options.scenario
    if file is not None and file.suffix == PDDL_SUFFIX and file.is_file():
        return drop_silenced_findings(check_pddl_file(file))
    if file is not None and file.suffix == CLIPS_SUFFIX and file.is_file():
        return _check_clips_file(options, file.resolve(), errors_only=errors_only, portable=portable)
    return drop_silenced_findings(_check_agents(options, errors_only=errors_only, portable=portable))


def _check_agents(options: RunOptions, *, errors_only: bool, portable: bool) -> list[Finding]:
    """Return the findings for all agents of a scenario; last, an error that prevents loading."""
    unique_findings: dict[Finding, None] = {}  # agents of a scenario may share files, and thus findings
    try:
        for name in find_agent_names(options):
            with Agent(replace(options, agent=name)) as agent:
                agent_findings = run_checks(agent, errors_only=errors_only, portable=portable)
                unique_findings |= dict.fromkeys(agent_findings)
    except CxbridgeError as error:
        unique_findings[make_error_finding(error)] = None
    return list(unique_findings)


def _check_clips_file(options: RunOptions, file: Path, *, errors_only: bool, portable: bool) -> list[Finding]:
    """Return the findings in a CLIPS file.

    The file is checked as a part of the scenario in a folder above, if the first agent of the scenario loads
    the file, or else as a separate agent.
    """
    for folder in file.parents[:MAX_PARENT_FOLDERS]:
        scenario = folder / SCENARIO_FILE
        if scenario.is_file():
            scenario_options = replace(options, scenario=folder)
            # A scenario that cannot be read, or does not load the file, gives no findings for the file.
            with (
                suppress(CxbridgeError),
                Agent(replace(scenario_options, agent=find_agent_names(scenario_options)[0])) as agent,
            ):
                if any(loaded_file.path.resolve() == file for loaded_file in agent.files):
                    all_findings = _check_agents(scenario_options, errors_only=errors_only, portable=portable)
                    return drop_silenced_findings(
                        finding for finding in all_findings if Path(finding.place.file).resolve() == file
                    )
    file_findings = _check_agents(options, errors_only=errors_only, portable=portable)
    findings_without_errors = [
        finding for finding in file_findings if finding.code.severity is not Severity.ERROR
    ]
    # If CLIPS loads the file alone without a mistake, the errors are conflicts with the names of the core.
    if len(findings_without_errors) < len(file_findings) and _is_program(file):
        conflict = Finding(
            CONFLICTING_PROGRAM,
            SourcePlace(str(file)),
            "the file defines names of the CX core, so an agent cannot load it",
            "run it with CLIPS, or give its facts and rules names that the core does not have",
        )
        file_findings = [*findings_without_errors, conflict]
    return drop_silenced_findings(file_findings)


def _is_program(file: Path) -> bool:
    """Return whether CLIPS loads a file without the executive's core, and without a mistake."""
    env = StubbedEnvironment("program", EventBus(VirtualClock()))
    try:
        env.folders = find_search_folders(file)
        (env.loader.batch if needs_batch(file) else env.loader.load)(str(file))
        return not env.loader.diagnostics
    finally:
        env.destroy()


def drop_silenced_findings(findings: Iterable[Finding]) -> list[Finding]:
    """Return the findings that no comment silences. A comment without a reason silences nothing."""
    read_lines = cache(_read_lines)  # a file is read once for all its findings
    return [finding for finding in findings if not _is_silenced(finding, read_lines(finding.place.file))]


def _is_silenced(finding: Finding, lines: list[str]) -> bool:
    """Return whether a comment in the line of a finding, or in the line above, silences the finding."""
    line_number = finding.place.line
    return any(
        finding.code.name in re.split(r", ?", match["codes"])
        for line in lines[max(line_number - 2, 0) : line_number]
        if (match := _SILENCING_COMMENT.search(line))
    )


def _read_lines(file: str) -> list[str]:
    """Return the lines of a file; empty if it cannot be read, or the finding names no file."""
    try:
        return Path(file).read_text("utf-8", "surrogateescape").splitlines()
    except (OSError, ValueError):
        return []
