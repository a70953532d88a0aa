"""The options of commands for agents of the executive for ROS 2."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer

from cxbridge.errors import CxbridgeError
from cxbridge.file_access import is_readable_file

if TYPE_CHECKING:
    from cxbridge.run.options import RunOptions

_PARAMETERS: Final = (b"ros__parameters", b"environments")
_SUFFIXES: Final = (".yaml", ".yml")


def names_parameters(options: RunOptions) -> bool:
    """Return whether the options name a file with parameters of a node that has environments."""
    file = options.scenario
    if file is None or file.suffix not in _SUFFIXES or not is_readable_file(str(file)):
        return False
    data = file.read_bytes()
    return all(part in data for part in _PARAMETERS)


@dataclass(frozen=True, kw_only=True)
class Ros2CxOptions:
    """A checkout, and the executors of its actions."""

    ros2cx: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="A checkout of the CLIPS Executive for ROS 2, or a workspace; its files are used unchanged.",
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

    log_dir: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="With parameters of clips_manager: write the log of each environment as DIR/ENV.log.",
            show_default=False,
        ),
    ] = None

    def check(self) -> None:
        """Raise :class:`CxbridgeError` when an option of the group lacks another option."""
        if self.executors and self.ros2cx is None:
            raise CxbridgeError(
                "--executor goes with --ros2cx only",
                hint="other scenarios name their executors in the configuration, below skill-board",
            )
