"""The templates of ``cxbridge new --from-ros2cx``: parameters of today's executive, or a checkout of 2021."""

from __future__ import annotations

import json
import shlex
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Final

import typer

from cxbridge.errors import CxbridgeError
from cxbridge.run.program.plain_options import make_options
from cxbridge.run.source import source_of
from cxbridge.testing.new_project import Template, read_template, words_of_checkout
from cxbridge_ros2cx.options import is_todays

_TEMPLATES: Final = Path(__file__).parent / "templates"


@dataclass(frozen=True, kw_only=True)
class Ros2CxTemplate(Template):
    """An agent of the ROS 2 executive, whose files stay in place."""

    from_ros2cx: Annotated[
        Path | None,
        typer.Option(
            metavar="PARAMS|DIR",
            help="Begin from parameters of clips_manager, or a checkout of ros2-clips-executive (2021).",
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
        """Return files that refer to the checkout, or to the parameter file and the packages."""
        assert self.from_ros2cx is not None  # without this option, another template is chosen
        source_path = self.from_ros2cx.absolute()
        if source_path.is_file():
            return _files_for_parameters(name, source_path, self.ros2cx and self.ros2cx.absolute())
        if self.ros2cx is not None:
            raise CxbridgeError("--ros2cx goes with the parameters of an agent", file=source_path)
        return read_template(
            _TEMPLATES / "thesis",
            words_of_checkout(name, source_path, make_options(None, ros2cx=source_path)),
        )


def _files_for_parameters(name: str, parameters: Path, packages: Path | None) -> dict[str, str]:
    options = make_options(parameters, ros2cx=packages)
    if not is_todays(options):
        raise CxbridgeError(
            "this file has no parameters of clips_manager",
            file=parameters,
            hint="its ros__parameters name environments",
        )
    # errors about the agent belong before the files are written
    options.check()
    source_of(options).load_configuration()
    arguments = [str(parameters), *(("--ros2cx", str(packages)) if packages else ())]
    words = {
        "@NAME@": name,
        "@PARAMS@": str(parameters),
        "@PARAMS_NAME@": parameters.name,
        "@PARAMS_TEXT@": json.dumps(str(parameters)),
        "@DIR_TEXT@": json.dumps(str(packages or "")),
        "@DIR_JSON@": json.dumps(packages and str(packages)),
        "@ARGUMENTS@": shlex.join(arguments),
    }
    return read_template(_TEMPLATES / "node", words)
