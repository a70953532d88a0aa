"""`cxbridge run`: run a scenario headless, to its end."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cxbridge.cli.complete import scenarios
from cxbridge.cli.console import say_json
from cxbridge.cli.orderly import orderly
from cxbridge.cli.run_options import (
    BBLog,
    Core,
    Executors,
    FawkesDir,
    InterfaceDirs,
    Log,
    Quiet,
    Ros2CxDir,
    SkillDirs,
    Verbose,
)

if TYPE_CHECKING:
    from cxbridge.run.assembly import Assembly

_Scenario = Annotated[
    Path | None,
    typer.Argument(
        help="A folder with a scenario.yaml, or a Fawkes configuration file or folder. "
        "With --fawkes-dir: that checkout's configuration by default.",
        show_default=False,
        autocompletion=scenarios,
    ),
]


@orderly()
def run(  # noqa: PLR0913, PLR0917  a command has as many options as it has
    scenario: _Scenario = None,
    agent: Annotated[
        str | None,
        typer.Option(help="Run only this agent, of a scenario with several.", show_default=False),
    ] = None,
    spec: Annotated[str | None, typer.Option(help="The spec to run; the configuration's by default.")] = None,
    config: Annotated[
        list[Path] | None,
        typer.Option(
            help="A configuration file on top of the scenario's. Repeatable: each over those before it.",
            show_default=False,
        ),
    ] = None,
    fawkes_dir: FawkesDir = None,
    ros2cx: Ros2CxDir = None,
    executor: Executors = None,
    core: Core = None,
    clips_dir: Annotated[
        list[Path] | None, typer.Option(help="A folder of CLIPS files, searched first. Repeatable.")
    ] = None,
    interface_dir: InterfaceDirs = None,
    skill_dir: SkillDirs = None,
    clock: Annotated[
        str | None,
        typer.Option(
            help="virtual, real or scaled:N; virtual by default, real with a Skiller elsewhere.",
            show_default=False,
        ),
    ] = None,
    skiller: Annotated[
        str,
        typer.Option(
            metavar="lua|simulator|none|URL",
            help="Who executes skills; URL: the Skiller on the blackboard there, e.g. fawkes://robot:1910.",
        ),
    ] = "lua",
    speech: Annotated[
        str,
        typer.Option(
            metavar="off|on|FILE.wav|DIR/", help="Speak what skills say: to the speaker, or into sound files."
        ),
    ] = "off",
    timeout: Annotated[float, typer.Option(help="Seconds of the run's clock until it is given up.")] = 600.0,
    trace: Annotated[Path | None, typer.Option(help="Record the run to this mcap file.")] = None,
    trace_level: Annotated[str, typer.Option(help="transitions, rules or facts.")] = "transitions",
    trace_files: Annotated[
        bool, typer.Option(help="Attach the files of the run (configuration, CLIPS, ...) to --trace.")
    ] = True,
    log: Log = None,
    bblog: BBLog = None,
    replay: Annotated[
        list[Path] | None,
        typer.Option(
            metavar="RUN",
            help="Replay the environment of a recorded run, and check that it decides the same. Repeatable.",
        ),
    ] = None,
    replay_order: Annotated[
        str, typer.Option(metavar="total|partial", help="How its transitions are compared with the recorded.")
    ] = "total",
    breaks: Annotated[
        list[str] | None,
        typer.Option(
            "--break",
            metavar="SPEC",
            help="Stop there and take commands from stdin, e.g. rule:NAME, goal:CLASS:MODE. Repeatable.",
        ),
    ] = None,
    strict: Annotated[
        bool, typer.Option("--strict", help="A broken CLIPS construct is an error, exit status 2.")
    ] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print the result as JSON.")] = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> int:
    """Run a scenario headless, to its end.

    Exit status: 0 every root goal ended COMPLETED; 1 some ended FAILED or REJECTED; 2 bad input;
    3 the timeout passed; 4 a fault of the run itself; 130 interrupted. With --replay: 0 it decided the same;
    1 something else. See docs/replay.md. With --break: docs/debugging.md.
    """
    from cxbridge.cli.story import RunLog, RunStory
    from cxbridge.run import RunOptions, run_scenario

    options = RunOptions(
        scenario=scenario,
        agent=agent,
        spec=spec,
        config=tuple(config or ()),
        fawkes_dir=fawkes_dir,
        ros2cx=ros2cx,
        executors=tuple(executor or ()),
        core=core,
        clips_dirs=tuple(clips_dir or ()),
        interface_dirs=tuple(interface_dir or ()),
        skill_dirs=tuple(skill_dir or ()),
        clock=clock or ("real" if "://" in skiller else "virtual"),
        skiller=skiller,
        speech=speech,
        timeout=timeout,
        trace=trace,
        trace_level=trace_level,
        trace_files=trace_files,
        log=log,
        bblog=bblog,
        strict=strict,
        replay=tuple(replay or ()),
        replay_order=replay_order,
    )
    shown, story = RunLog(quiet=quiet, verbose=verbose), None
    followers = [shown.attach]
    if breaks:
        from cxbridge.cli.command_lines import CommandLines
        from cxbridge.cli.debug_prompt import DebugPrompt

        followers.append(DebugPrompt(breaks, CommandLines(), sys.stderr if as_json else sys.stdout).attach)
    if not as_json:
        story = RunStory(quiet=quiet)
        followers.append(story.attach)

    def attach(assembly: Assembly) -> None:
        for follow in followers:
            follow(assembly)

    result = run_scenario(options, shown, attach, interactive=bool(breaks))
    if story is None:
        say_json(result.as_dict(), indent=2)
    else:
        story.finish(result)
    return result.status
