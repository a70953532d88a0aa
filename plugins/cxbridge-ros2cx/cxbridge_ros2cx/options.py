"""The options of commands for agents of the executive for ROS 2."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from cxbridge.errors import CxbridgeError


@dataclass(frozen=True, kw_only=True)
class Ros2CxOptions:
    """A checkout, and the executors of its actions."""

    ros2cx: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="A checkout of ros2-clips-executive (2021); its files are used unchanged.",
            show_default=False,
        ),
    ] = None
    executors: Annotated[
        tuple[str, ...],
        typer.Option(
            "--executor",
            metavar="ACTION=CLASS",
            help="With --ros2cx: who executes an action, as FILE.py:CLASS; a dummy by default. Repeatable.",
        ),
    ] = ()

    def check(self) -> None:
        """Raise :class:`CxbridgeError` when an option of the group lacks another option."""
        if self.executors and self.ros2cx is None:
            raise CxbridgeError(
                "--executor goes with --ros2cx only",
                hint="other scenarios name their executors in the configuration, below skill-board",
            )
