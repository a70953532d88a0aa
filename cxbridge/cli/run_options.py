"""The options by which a run or a daemon gets to the executive that it has."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

FawkesDir = Annotated[
    Path | None,
    typer.Option(help="A Fawkes checkout; its files are used unchanged.", show_default=False),
]
Ros2CxDir = Annotated[
    Path | None,
    typer.Option(
        metavar="DIR",
        help="A checkout of ros2-clips-executive (2021); its files are used unchanged.",
        show_default=False,
    ),
]
Executors = Annotated[
    list[str] | None,
    typer.Option(
        metavar="ACTION=CLASS",
        help="With --ros2cx: who executes an action, as FILE.py:CLASS; a dummy by default. Repeatable.",
    ),
]
Core = Annotated[
    str | None,
    typer.Option(
        help="builtin or fawkes: whose CX core; by default that of --fawkes-dir or --ros2cx, if given.",
        show_default=False,
    ),
]

InterfaceDirs = Annotated[
    list[Path] | None, typer.Option(help="A folder of interface XML files. Repeatable.")
]

SkillDirs = Annotated[list[Path] | None, typer.Option(help="A folder with Lua skills. Repeatable.")]

Log = Annotated[Path | None, typer.Option(help="Write a log in the layout of Fawkes'.")]

BBLog = Annotated[Path | None, typer.Option(help="Write files as Fawkes' bblogger does into this folder.")]

Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Log errors only.")]

Verbose = Annotated[bool, typer.Option("--verbose", "-v", help="Log everything.")]
