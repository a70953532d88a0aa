"""The features of the original by their plugin classes."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from cxbridge.blackboard import BlackBoard
from cxbridge.config import Configuration
from cxbridge.errors import ConfigError
from cxbridge.executive.feature import Feature
from cxbridge.executive.features.pddl_parser import PddlParserFeature
from cxbridge.executive.features.redefine_warning import RedefineWarningFeature
from cxbridge.executive.planning.settings import PlannerSettings
from cxbridge_ros2cx.blackboard import Ros2CxBlackboardFeature
from cxbridge_ros2cx.confvals import ParametersFeature
from cxbridge_ros2cx.parameters import FeatureEntry
from cxbridge_ros2cx.plansys2 import Plansys2Feature
from cxbridge_ros2cx.settings import Ros2CxSettings
from cxbridge_ros2cx.skill_execution import PretendingSkills, SkillExecutionFeature

if TYPE_CHECKING:
    from cxbridge.executive.host.environment import ClipsEnvironment
    from cxbridge.executive.planning import PlanningService

CONFIG_FEATURE = ParametersFeature.name
REDEFINE_FEATURE = "redefine_warning_feature"


class MockFeature(Feature):
    """The feature of the original's tests: resets the environment and asserts ``(b (name NAME))``."""

    def __init__(self, name: str) -> None:
        self.name = name

    def init_context(self, env: ClipsEnvironment) -> None:
        env.eval("(reset)")
        env.assert_string(f"(b (name {self.name}))")
        env.run()


@dataclass(frozen=True, slots=True)
class Ros2CxFeatureContext:
    """The parts of the features.

    :param config: the configuration of the run.
    :param folder: the folder of the parameter files.
    :param board: the blackboard.
    :param skills: returns the skill board; None before it exists.
    :param on_removal: called when an ended skill is removed.
    :param make_planning: returns the planning service of an environment; None for planners.
    :param original: whether the original's defects are repeated.
    """

    config: Configuration
    folder: Path
    board: BlackBoard
    skills: Callable[[], PretendingSkills | None]
    on_removal: Callable[[], None] = lambda: None
    make_planning: Callable[[str], PlanningService] | None = None
    original: bool = False


def make_features(context: Ros2CxFeatureContext, entries: Iterable[FeatureEntry]) -> list[Feature]:
    """Return the two permanent features and those of the parameter files."""
    parser = PddlParserFeature()
    redefine = RedefineWarningFeature()
    redefine.name = REDEFINE_FEATURE

    def plansys2(name: str) -> Feature:
        settings = PlannerSettings.from_config(context.config)
        exact = Ros2CxSettings.of(context.config).original
        return Plansys2Feature(name, settings, parser.domain_of, context.make_planning, exact=exact)

    def pddl_parser(name: str) -> Feature:
        parser.name = name
        return parser

    def skill_execution(name: str) -> Feature:
        return SkillExecutionFeature(name, context.skills, context.on_removal, original=context.original)

    def blackboard(name: str) -> Feature:
        original = Ros2CxSettings.of(context.config).original
        return Ros2CxBlackboardFeature(name, context.board, original=original)

    plugins: dict[str, Callable[[str], Feature]] = {
        "cx::Plansys2Feature": plansys2,
        "cx::ClipsPddlParserFeature": pddl_parser,
        "cx::SkillExecutionFeature": skill_execution,
        "cx::BlackboardFeature": blackboard,
        "cx::MockFeature": MockFeature,
    }
    exact = Ros2CxSettings.of(context.config).original
    features: list[Feature] = [ParametersFeature(context.config, context.folder, exact=exact), redefine]
    for entry in entries:
        make = plugins.get(entry.plugin)
        if make is None:
            raise ConfigError(
                f"there is no plugin '{entry.plugin}' for the feature '{entry.name}'",
                file=entry.file,
                line=entry.line,
                hint=f"there are: {', '.join(plugins)}",
            )
        features.append(make(entry.name))
    return features
