"""`cxbridge doctor`: checks of the installed packages, and commands to install the missing ones."""

from __future__ import annotations

from typing import Annotated

import typer

from cxbridge.cli.console import say, say_json


def doctor(
    as_json: Annotated[bool, typer.Option("--json", help="print the findings as JSON")] = False,
) -> int:
    """Check the installed packages, and print how to install the missing ones.

    Exit status: 0 all packages that a run needs work; 1 a needed package is missing.

    Example: cxbridge doctor
    """
    from cxbridge.cli.health import run_checks

    findings = run_checks()
    if as_json:
        say_json([finding.to_json() for finding in findings], indent=2)
    else:
        for finding in findings:
            mark = "ok  " if finding.fine else ("MISSING" if finding.required else "absent")
            say(f"{mark:8}{finding.what}: {finding.detail}")
            if finding.remedy and not finding.fine:
                say(f"{'':8}  -> {finding.remedy}")
    return 0 if all(finding.fine or not finding.required for finding in findings) else 1
