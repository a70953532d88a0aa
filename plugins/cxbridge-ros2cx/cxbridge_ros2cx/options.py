"""Command-line options for agents of the two executives for ROS 2."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Final

import typer

from cxbridge.errors import CxbridgeError
from cxbridge.file_access import is_readable_file
from cxbridge.run.options import PluginOptions, RunOptions

_FILE_MARKS: Final = (b"ros__parameters", b"environments")  # both are in each parameter file of the node
_NODE_PACKAGE: Final = "cx_clips_env_manager"
# patterns of the folders that contain the node's package in checkouts, workspaces and installations
_PARENT_PATTERNS: Final = ("", "*/", "*/*/", "share/", "install/share/", f"install/{_NODE_PACKAGE}/share/")

_SUFFIXES: Final = (".yaml", ".yml")


def is_clips_manager_agent(options: RunOptions) -> bool:
    """Return whether the options name an agent of the ROS 2 CX, carologistics/clips_executive.

    Such an agent is a parameter file of its node ``clips_manager``. A checkout of the ROS 2 CX counts, too,
    so that the error about the missing parameter file names the right executive.
    """
    return _is_clips_manager_file(options.scenario) or _has_clips_manager_package(options.option("ros2cx"))


def _has_clips_manager_package(folder: Path | None) -> bool:
    """Return whether a checkout or workspace has the node's package, which ros2-clips-executive lacks."""
    return folder is not None and any(
        any(folder.glob(f"{parent}{_NODE_PACKAGE}/package.xml")) for parent in _PARENT_PATTERNS
    )


def _is_clips_manager_file(file: Path | None) -> bool:
    if file is None or file.suffix not in _SUFFIXES or not is_readable_file(str(file)):
        return False
    content = file.read_bytes()
    return all(mark in content for mark in _FILE_MARKS)


@dataclass(frozen=True, kw_only=True)
class Ros2CxOptions(PluginOptions):
    """Options for a checkout, the executors of its actions, and the environments of ``clips_manager``."""

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
            help="With --ros2cx: execute an action with FILE.py:CLASS; by default with a dummy. Repeatable.",
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
                "--executor requires --ros2cx",
                hint="other scenarios name their executors in the configuration, below skill-board",
            )
