"""The features of ros2-clips-executive (2021) by plugin class, as ``cx_params.yaml`` lists them."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from cxbridge.blackboard import BlackBoard
from cxbridge.config import Configuration
from cxbridge.errors import ConfigError
from cxbridge.executive.feature import Feature
from cxbridge.executive.features.config import RedefineWarningFeature
from cxbridge.executive.features.pddl_parser import PddlParserFeature
from cxbridge.executive.planning.settings import PlannerSettings
from cxbridge_ros2cx.blackboard import Ros2CxBlackboardFeature
from cxbridge_ros2cx.confvals import ParametersFeature
from cxbridge_ros2cx.parameters import FeatureEntry
from cxbridge_ros2cx.plansys2 import Plansys2Feature
from cxbridge_ros2cx.settings import Ros2CxSettings
from cxbridge_ros2cx.skill_execution import SkillExecutionFeature
from cxbridge_ros2cx.skills import Ros2CxSkills

if TYPE_CHECKING:
    from cxbridge.executive.features.planning_base import MakeService
    from cxbridge.executive.host.environment import ClipsEnvironment

REDEFINE_FEATURE = "redefine_warning_feature"


class MockFeature(Feature):
    """The feature for the tests of the original: resets the environment and asserts ``(b (name NAME))``."""

    def __init__(self, name: str) -> None:
        self.name = name

    def init_context(self, env: ClipsEnvironment) -> None:
        env.eval("(reset)")
        env.assert_string(f"(b (name {self.name}))")
        env.run()


def make_features(
    entries: Iterable[FeatureEntry],
    config: Configuration,
    folder: Path,
    board: BlackBoard,
    skills: Callable[[], Ros2CxSkills | None],
    on_removal: Callable[[], None] = lambda: None,
    make_planning: MakeService | None = None,
) -> list[Feature]:
    """Return the two permanent features and those of the parameter files.

    :param folder: the folder of the parameter files.
    :param skills: returns the skill board; None before it exists.
    :param on_removal: called when an ended skill is removed.
    :param make_planning: returns the planning service of an environment; None for a service with cxbridge's
        planners.
    """
    original = Ros2CxSettings.of(config).original
    parser, redefine = PddlParserFeature(), RedefineWarningFeature()
    redefine.name = REDEFINE_FEATURE

    def pddl_parser(name: str) -> Feature:
        # one parser: the feature plansys2 takes the domain from it, under whatever name it is listed
        parser.name = name
        return parser

    def plansys2(name: str) -> Feature:
        settings = PlannerSettings.from_config(config)
        return Plansys2Feature(name, settings, parser.domain_of, make_planning, exact=original)

    plugins: dict[str, Callable[[str], Feature]] = {
        "cx::Plansys2Feature": plansys2,
        "cx::ClipsPddlParserFeature": pddl_parser,
        "cx::SkillExecutionFeature": partial(SkillExecutionFeature, skills, on_removal, original=original),
        "cx::BlackboardFeature": partial(Ros2CxBlackboardFeature, board, original=original),
        "cx::MockFeature": MockFeature,
    }
    features: list[Feature] = [ParametersFeature(config, folder, exact=original), redefine]
    for entry in entries:
        if entry.plugin not in plugins:
            raise ConfigError(
                f"there is no plugin '{entry.plugin}' for the feature '{entry.name}'",
                file=entry.file,
                line=entry.line,
                hint=f"there are: {', '.join(plugins)}",
            )
        features.append(plugins[entry.plugin](entry.name))
    return features
