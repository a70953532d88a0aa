"""`cxbridge check`: mistakes of an agent, without running it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cxbridge.cli.console import say_text
from cxbridge.errors import CxbridgeError

TEXT = "text"


def check(  # noqa: PLR0913, PLR0917 - a command has as many options as it has
    scenario: Annotated[
        Path | None,
        typer.Argument(
            metavar="[PATH]", help="A scenario, as for run; by default this folder.", show_default=False
        ),
    ] = None,
    spec: Annotated[
        str | None, typer.Option(help="The spec; the configuration's by default.", show_default=False)
    ] = None,
    config: Annotated[
        list[Path] | None, typer.Option(help="A configuration file on top. Repeatable.", show_default=False)
    ] = None,
    fawkes_dir: Annotated[
        Path | None, typer.Option(help="A Fawkes checkout, as for run.", show_default=False)
    ] = None,
    ros2cx: Annotated[
        Path | None, typer.Option(help="A checkout of the CX for ROS 2, as for run.", show_default=False)
    ] = None,
    core: Annotated[str | None, typer.Option(help="builtin or fawkes.", show_default=False)] = None,
    clips_dir: Annotated[list[Path] | None, typer.Option(help="A folder of CLIPS files. Repeatable.")] = None,
    interface_dir: Annotated[
        list[Path] | None, typer.Option(help="A folder of interface definitions. Repeatable.")
    ] = None,
    skill_dir: Annotated[list[Path] | None, typer.Option(help="A folder of Lua skills. Repeatable.")] = None,
    skiller: Annotated[
        str, typer.Option(metavar="lua|simulator|none|URL", help="Who executes skills; lua: check them.")
    ] = "lua",
    form: Annotated[
        str, typer.Option("--format", metavar="text|json|sarif|github", help="How findings are printed.")
    ] = TEXT,
    as_json: Annotated[bool, typer.Option("--json", help="The same as --format json.")] = False,
    explain: Annotated[
        str, typer.Option(metavar="CODE", help="Explain a code, e.g. CX201, and exit.", show_default=False)
    ] = "",
) -> int:
    """Check an agent without running it.

    It reads configuration, CLIPS files, PDDL domain, action mapping and skills as a run does, and reports
    each mistake once, where it was made. A comment silences a finding: ; cx-check: ignore CODE REASON.

    Exit status: 0 no error; 1 errors; 2 bad usage.

    Example: cxbridge check scenarios/courier --format github
    """
    from cxbridge.check.checks import codes
    from cxbridge.check.findings import Severity
    from cxbridge.check.formats import FORMATS
    from cxbridge.check.run import check as find
    from cxbridge.run.options import RunOptions

    if explain:
        known = codes()
        if explain not in known:
            raise CxbridgeError(f"there is no code '{explain}'", hint=f"there are: {', '.join(known)}")
        code = known[explain]
        say_text(f"{code.name} ({code.severity.value}): {code.title}\n\n{code.explanation}")
        return 0
    form = "json" if as_json else form
    if form not in FORMATS:
        raise CxbridgeError(f"--format cannot be '{form}'", hint=f"use one of: {', '.join(FORMATS)}")
    here = Path() if scenario is None and fawkes_dir is None and ros2cx is None else scenario
    options = RunOptions(
        scenario=here,
        spec=spec,
        config=tuple(config or ()),
        fawkes_dir=fawkes_dir,
        ros2cx=ros2cx,
        core=core,
        clips_dirs=tuple(clips_dir or ()),
        interface_dirs=tuple(interface_dir or ()),
        skill_dirs=tuple(skill_dir or ()),
        skiller=skiller,
        clock="real" if "://" in skiller else "virtual",
    )
    findings = find(options)
    if text := FORMATS[form](findings):
        say_text(text)
    return int(any(finding.code.severity is Severity.ERROR for finding in findings))
