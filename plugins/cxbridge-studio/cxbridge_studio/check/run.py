"""Runs the checks on a scenario, a CLIPS file or a PDDL file."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from cxbridge.clock import VirtualClock
from cxbridge.errors import CxbridgeError
from cxbridge.events import EventBus
from cxbridge.run.options import RunOptions
from cxbridge.run.paths import SCENARIO_FILE
from cxbridge.run.source import CLIPS_SUFFIX
from cxbridge_studio.check.agent import MAX_FOLDERS, Agent, agents, folders_around, has_commands
from cxbridge_studio.check.findings import PROGRAM, Finding, Severity, SourcePlace, of_error
from cxbridge_studio.check.pddl_files import SUFFIX, findings_of
from cxbridge_studio.check.silence import without_silenced
from cxbridge_studio.check.stubbed_environment import StubbedEnvironment
from cxbridge_studio.check.table import findings


def check(options: RunOptions, *, errors_only: bool = False, portable: bool = False) -> list[Finding]:
    """Return the mistakes in a scenario's agents, each once.

    :param options: the options of a run; recording and time are ignored.
    :param errors_only: skip warnings and notes.
    :param portable: also report code that Fawkes does not accept.
    """
    options.check()
    file = options.scenario
    if file is not None and file.suffix == SUFFIX and file.is_file():
        return without_silenced(findings_of(file))
    if file is not None and file.suffix == CLIPS_SUFFIX and file.is_file():
        return _of_file(options, file.resolve(), errors_only=errors_only, portable=portable)
    return without_silenced(_found(options, errors_only=errors_only, portable=portable))


def _found(options: RunOptions, *, errors_only: bool, portable: bool) -> list[Finding]:
    unique_findings: dict[Finding, None] = {}
    try:
        for name in agents(options):
            with Agent(replace(options, agent=name)) as agent:
                unique_findings.update(
                    dict.fromkeys(findings(agent, errors_only=errors_only, portable=portable))
                )
    except CxbridgeError as error:
        unique_findings[of_error(error)] = None
    return list(unique_findings)


def _of_file(options: RunOptions, file: Path, *, errors_only: bool, portable: bool) -> list[Finding]:
    """Return the mistakes in a CLIPS file, as part of the surrounding agent or as an agent alone."""
    for folder in file.parents[:MAX_FOLDERS]:
        scenario = folder / SCENARIO_FILE
        if scenario.is_file():
            around = replace(options, scenario=folder)
            with suppress(CxbridgeError), Agent(replace(around, agent=agents(around)[0])) as agent:
                if any(each.path.resolve() == file for each in agent.files):
                    file_findings = _found(around, errors_only=errors_only, portable=portable)
                    here = (each for each in file_findings if Path(each.place.file).resolve() == file)
                    return without_silenced(here)
    file_findings = _found(options, errors_only=errors_only, portable=portable)
    if any(each.code.severity is Severity.ERROR for each in file_findings) and _is_program(file):
        file_findings = [each for each in file_findings if each.code.severity is not Severity.ERROR]
        hint = "run it with CLIPS, or give its facts and rules names that the core does not have"
        file_findings.append(
            Finding(PROGRAM, SourcePlace(str(file)), "the names are those of the CX core", hint)
        )
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
