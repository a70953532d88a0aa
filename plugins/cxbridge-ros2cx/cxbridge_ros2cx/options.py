"""Command-line options for agents of the ROS 2 executive."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Final

import typer

from cxbridge.errors import CxbridgeError
from cxbridge.file_access import is_readable_file
from cxbridge.run.options import PluginOptions, RunOptions

_PARAMETERS: Final = (b"ros__parameters", b"environments")
_NODE_PACKAGE: Final = "cx_clips_env_manager"
# folders that may contain the node's package in checkouts, workspaces and installations
_LEVELS: Final = ("", "*/", "*/*/", "share/", "install/share/", f"install/{_NODE_PACKAGE}/share/")

_SUFFIXES: Final = (".yaml", ".yml")


def is_todays(options: RunOptions) -> bool:
    """Return whether the options name an agent of today's executive.

    Such an agent is a parameter file of a node with environments, or a checkout of today's executive.
    """
    return _names_parameters(options.scenario) or _has_todays_package(options.option("ros2cx"))


def _has_todays_package(folder: Path | None) -> bool:
    """Return whether a checkout or workspace has the node of today's executive, not that of 2021."""
    patterns = (f"{level}{_NODE_PACKAGE}/package.xml" for level in _LEVELS)
    return folder is not None and any(any(folder.glob(pattern)) for pattern in patterns)


def _names_parameters(file: Path | None) -> bool:
    if file is None or file.suffix not in _SUFFIXES or not is_readable_file(str(file)):
        return False
    data = file.read_bytes()
    return all(part in data for part in _PARAMETERS)


@dataclass(frozen=True, kw_only=True)
class Ros2CxOptions(PluginOptions):
    """Options for a checkout and the executors of its actions."""

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
            help="With --ros2cx: the executor of an action, FILE.py:CLASS; a dummy by default. Repeatable.",
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

    hash_order: Annotated[
        bool,
        typer.Option(
            "--hash-order",
            help="With parameters of clips_manager: activate environments in the order of a C++ hash table.",
        ),
    ] = False

    def check(self, options: RunOptions) -> None:  # noqa: ARG002 - the check needs no options of other groups
        if self.executors and self.ros2cx is None:
            raise CxbridgeError(
                "--executor goes with --ros2cx only",
                hint="other scenarios name their executors in the configuration, below skill-board",
            )
