"""What ``cxbridge new --from-ros2cx`` begins from: parameters of today's executive, or a checkout of 2021."""

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
    """An agent of the executive for ROS 2, which stays where it is."""

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
        """Return files that name the checkout, or the parameter file and the packages."""
        assert self.from_ros2cx is not None  # or another template is chosen
        place = self.from_ros2cx.absolute()
        if place.is_file():
            return _around_parameters(name, place, self.ros2cx and self.ros2cx.absolute())
        if self.ros2cx is not None:
            raise CxbridgeError("--ros2cx goes with the parameters of an agent", file=place)
        return read_template(
            _TEMPLATES / "thesis", words_of_checkout(name, place, make_options(None, ros2cx=place))
        )


def _around_parameters(name: str, parameters: Path, packages: Path | None) -> dict[str, str]:
    options = make_options(parameters, ros2cx=packages)
    if not is_todays(options):
        raise CxbridgeError(
            "this file has no parameters of clips_manager",
            file=parameters,
            hint="its ros__parameters name environments",
        )
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
