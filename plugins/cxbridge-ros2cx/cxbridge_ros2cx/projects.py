"""The template of ``cxbridge new --from-ros2cx``: a project around an agent of the ROS 2 CX.

The agent is a parameter file of the node ``clips_manager``.
"""

from __future__ import annotations

import json
import shlex
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Final

import typer

from cxbridge.errors import CxbridgeError
from cxbridge.run.program.plain_options import options_from_keywords
from cxbridge.run.source import source_of
from cxbridge.testing.new_project import Template, read_template
from cxbridge_ros2cx.options import is_clips_manager_agent

_TEMPLATES: Final = Path(__file__).parent / "templates"


@dataclass(frozen=True, kw_only=True)
class Ros2CxTemplate(Template):
    """The template of a project that refers to an agent for ROS 2, whose files stay in place."""

    from_ros2cx: Annotated[
        Path | None,
        typer.Option(
            metavar="PARAMS",
            help="Begin from parameters of clips_manager.",
            show_default=False,
        ),
    ] = None
    ros2cx: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="With --from-ros2cx PARAMS: the checkout or workspace with the packages of the agent.",
            show_default=False,
        ),
    ] = None

    def files(self, name: str) -> Mapping[str, str]:
        """Return the text of each project file by its path."""
        assert self.from_ros2cx is not None  # without this option, another template is chosen
        return _read_node_template(name, self.from_ros2cx.absolute(), self.ros2cx and self.ros2cx.absolute())


def _read_node_template(name: str, parameter_file: Path, package_folder: Path | None) -> dict[str, str]:
    """Return the text of each project file by its path, with the placeholders replaced.

    :raises CxbridgeError: if the file has no parameters of ``clips_manager``, or the agent is invalid.
    """
    options = options_from_keywords(parameter_file, ros2cx=package_folder)
    if not is_clips_manager_agent(options):
        raise CxbridgeError(
            "this file has no parameters of clips_manager",
            file=parameter_file,
            hint="the ros__parameters of clips_manager name environments",
        )
    # an invalid agent is an error before any file of the project is written
    options.check()
    source_of(options).load_configuration()
    # Placeholders with _TEXT are for strings of Python or JSON, with _JSON for a string or null in JSON.
    # @ARGUMENTS@ is for a shell, and the remaining placeholders are for plain text.
    replacements = {
        "@NAME@": name,
        "@PARAMS@": str(parameter_file),
        "@PARAMS_NAME@": parameter_file.name,
        "@PARAMS_TEXT@": json.dumps(str(parameter_file)),
        "@DIR_TEXT@": json.dumps(str(package_folder or "")),
        "@DIR_JSON@": json.dumps(package_folder and str(package_folder)),
        "@ARGUMENTS@": shlex.join(
            (str(parameter_file), *(("--ros2cx", str(package_folder)) if package_folder else ()))
        ),
    }
    return read_template(_TEMPLATES / "node", replacements)
