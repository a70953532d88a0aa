"""`cxbridge doctor`: checks of the installation, and commands to install missing parts."""

from __future__ import annotations

from typing import Annotated

import typer

from cxbridge.cli.console import say_result


def doctor(
    as_json: Annotated[bool, typer.Option("--json", help="Print the findings as JSON.")] = False,
) -> int:
    """Check the installed packages, plug-ins and programs, and print how to install the missing ones.

    Exit status: 0 everything required works; 1 something required is missing or does not work.

    Example: cxbridge doctor
    """
    from cxbridge.cli.health import run_checks

    findings = run_checks()
    lines = (line for finding in findings for line in finding.to_lines())
    say_result([finding.to_json() for finding in findings], lines, as_json=as_json)
    return 0 if all(finding.fine or not finding.required for finding in findings) else 1
