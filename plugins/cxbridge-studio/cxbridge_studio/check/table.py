"""The table of checks: modules with ``CODES`` and ``check(agent)``, those of the studio and of plug-ins."""

from __future__ import annotations

from collections.abc import Iterator
from types import ModuleType
from typing import Final

from cxbridge.plugins import Table, rows_of_modules
from cxbridge_studio.check import checks
from cxbridge_studio.check.agent import Agent
from cxbridge_studio.check.findings import INPUT, PROGRAM, Code, Finding, Severity

CHECKS: Final[Table[ModuleType]] = Table(
    "CHECKS",
    lambda loaded: hasattr(loaded, "CODES") and hasattr(loaded, "check"),
    "a module with CODES and check(agent)",
    *rows_of_modules(checks),
)
"""The checks of agents. A plug-in adds a module; docs/plugins.md describes it."""

_PORTABLE: Final = ".portable"
"""The module whose findings are made on demand."""


def modules() -> list[ModuleType]:
    """Return the modules with checks: those of the studio, then those of plug-ins."""
    return [CHECKS.load(row) for row in CHECKS.rows]


def codes() -> dict[str, Code]:
    """Return all codes by their names."""
    found = [INPUT, PROGRAM, *(code for module in modules() for code in module.CODES)]
    return {code.name: code for code in sorted(found, key=lambda code: code.name)}


def findings(agent: Agent, *, errors_only: bool = False, portable: bool = False) -> Iterator[Finding]:
    """Yield what all checks find in an agent, in the order of files and lines.

    :param errors_only: no warnings and notes, and no work for them.
    :param portable: also what Fawkes does not take.
    """
    needed = [
        module
        for module in modules()
        if not errors_only or any(code.severity is Severity.ERROR for code in module.CODES)
        if portable or not module.__name__.endswith(_PORTABLE)
    ]
    found = dict.fromkeys(
        finding
        for module in needed
        for finding in module.check(agent)
        if not errors_only or finding.code.severity is Severity.ERROR
    )
    order = {str(file.path): number for number, file in enumerate(agent.files)}
    yield from sorted(
        found, key=lambda each: (order.get(each.place.file, -1), each.place.file, each.place.line)
    )
