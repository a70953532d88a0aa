"""The features of the thesis' executive, ros2-clips-executive (2021).

The parameter file ``cx_params.yaml`` lists features, each with the C++ class of its plugin. The classes that
:func:`make_features` knows have stand-ins in Python.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

from cxbridge.blackboard import BlackBoard
from cxbridge.config import Configuration
from cxbridge.errors import ConfigError
from cxbridge.executive.feature import Feature
from cxbridge.executive.features.blackboard import BlackBoardFeature
from cxbridge.executive.features.config import RedefineWarningFeature
from cxbridge.executive.features.pddl_parser import PddlParserFeature
from cxbridge_planning.feature.base import MakeService
from cxbridge_planning.service.service import PlanningService
from cxbridge_planning.settings import PlannerSettings
from cxbridge_ros2cx.confvals import ConfvalFeature
from cxbridge_ros2cx.parameters import FeatureEntry
from cxbridge_ros2cx.plansys2 import PlanSys2Feature
from cxbridge_ros2cx.settings import Ros2CxSettings
from cxbridge_ros2cx.skill_board_client import SkillBoardClient
from cxbridge_ros2cx.skill_execution import SkillExecutionFeature

REDEFINE_FEATURE = "redefine_warning_feature"


def make_features(
    entries: Iterable[FeatureEntry],
    config: Configuration,
    board: BlackBoard,
    get_skill_board: Callable[[], SkillBoardClient | None],
    on_skill_removed: Callable[[], None] = lambda: None,
    make_planning: MakeService = lambda _env: PlanningService(),
) -> list[Feature]:
    """Return ``config_feature``, ``redefine_warning_feature``, and the features that the parameters list.

    :param get_skill_board: returns the skill board; None before the skill board exists.
    :param on_skill_removed: called when an ended skill is removed.
    :param make_planning: returns the planning service of an environment.
    :raises ConfigError: if the plugin of an entry is unknown.
    """
    parser, redefine_warning = PddlParserFeature(), RedefineWarningFeature()
    redefine_warning.name = REDEFINE_FEATURE
    feature_makers: dict[str, Callable[[], Feature]] = {  # by plugin
        # plans are for the domain that the parser feature has parsed last
        "cx::Plansys2Feature": lambda: PlanSys2Feature(
            PlannerSettings.from_config(config), parser.domain_of, make_planning
        ),
        "cx::ClipsPddlParserFeature": lambda: parser,
        "cx::SkillExecutionFeature": lambda: SkillExecutionFeature(
            get_skill_board,
            on_skill_removed,
            repeats_defects=Ros2CxSettings.from_config(config).repeats_defects,
        ),
        # as in the thesis' executive, facts of interfaces live for one run of the rules
        "cx::BlackboardFeature": lambda: BlackBoardFeature(board, retract_early=True),
    }
    features: list[Feature] = [ConfvalFeature(config), redefine_warning]
    for entry in entries:
        if entry.plugin not in feature_makers:
            raise ConfigError(
                f"there is no plugin '{entry.plugin}' for the feature '{entry.name}'",
                file=entry.file,
                line=entry.line,
                hint=f"use one of: {', '.join(feature_makers)}",
            )
        features.append(feature_makers[entry.plugin]())
        features[-1].name = entry.name
    return features
