"""The table of check modules, from the studio and from plug-ins."""

from __future__ import annotations

from collections.abc import Iterator
from types import ModuleType
from typing import Final

from cxbridge.plugins import Table, make_module_rows
from cxbridge_studio.check import checks
from cxbridge_studio.check.agent import Agent
from cxbridge_studio.check.findings import CONFLICTING_PROGRAM, UNREADABLE_AGENT, Code, Finding, Severity

# The check modules. Plug-ins add rows; docs/plugins.md describes how.
CHECKS: Final[Table[ModuleType]] = Table(
    "CHECKS",
    lambda module: hasattr(module, "CODES") and hasattr(module, "check"),
    "a module with CODES and check(agent)",
    *make_module_rows(checks),
)

# The end of the name of the module that runs only with `--portable`.
_PORTABLE_SUFFIX: Final = ".portable"


def load_check_modules() -> list[ModuleType]:
    """Return the check modules: those of the studio, then those of plug-ins."""
    return [CHECKS.load_target(row) for row in CHECKS.rows]


def load_codes() -> dict[str, Code]:
    """Return the codes of all check modules by name, in the order of the names."""
    all_codes = [
        # These two mistakes prevent loading the agent, so no check module can report them.
        UNREADABLE_AGENT,
        CONFLICTING_PROGRAM,
        *(code for module in load_check_modules() for code in module.CODES),
    ]
    return {code.name: code for code in sorted(all_codes, key=lambda code: code.name)}


def run_checks(agent: Agent, *, errors_only: bool = False, portable: bool = False) -> Iterator[Finding]:
    """Yield the findings of all checks about an agent, in the order of loaded files and of lines.

    :param errors_only: whether to skip warnings and notes.
    :param portable: whether to report code that Fawkes does not accept.
    """
    needed_modules = [
        module
        for module in load_check_modules()
        if not errors_only or any(code.severity is Severity.ERROR for code in module.CODES)
        if portable or not module.__name__.endswith(_PORTABLE_SUFFIX)
    ]
    unique_findings = dict.fromkeys(
        finding
        for module in needed_modules
        for finding in module.check(agent)
        if not errors_only or finding.code.severity is Severity.ERROR
    )
    load_numbers = {str(file.path): number for number, file in enumerate(agent.files)}

    def sort_key(finding: Finding) -> tuple[int, str, int]:
        # Files that CLIPS does not load, such as the configuration, come first.
        return load_numbers.get(finding.place.file, -1), finding.place.file, finding.place.line

    yield from sorted(unique_findings, key=sort_key)
