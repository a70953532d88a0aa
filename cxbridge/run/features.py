"""The features of this package for CLIPS environments, made from the context of a run or a daemon."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from cxbridge.executive.feature import Feature, LazyFeature
from cxbridge.executive.features.blackboard import BlackBoardFeature
from cxbridge.executive.features.config import ConfigFeature
from cxbridge.executive.features.pddl_parser import PddlParserFeature
from cxbridge.executive.features.redefine_warning import RedefineWarningFeature
from cxbridge.run.context import SKILL_BOARD, RunContext, SharedSkillBoard

if TYPE_CHECKING:
    from cxbridge.skiller.board.desk import SkillDesk


def package_features(context: RunContext) -> list[Feature | LazyFeature]:
    """Return the features of this package; those that not every agent asks for are imported when one does."""
    if context.paths.ros2cx is not None:
        from cxbridge.run.ros2cx_features import ros2cx_features  # noqa: PLC0415 - start-up time is a feature

        return [*ros2cx_features(context, context.paths.ros2cx)]
    pddl_parser = PddlParserFeature()
    retract_early = context.config.get_bool("/clips/retract-early", default=False)
    features: list[Feature | LazyFeature] = [
        BlackBoardFeature(context.board, retract_early=retract_early),
        ConfigFeature(context.config),
        RedefineWarningFeature(),
        pddl_parser,
        LazyFeature("robot_memory", partial(_robot_memory, context)),
        LazyFeature("tf", partial(_tf, context)),
        LazyFeature("navgraph", partial(_navgraph, context)),
    ]
    for name, section, make in (
        ("planner", "/planner", partial(_planner, context, pddl_parser)),
        ("protobuf", "/clips-protobuf", partial(_protobuf, context)),
        ("motor-switch", "/clips-motor-switch", partial(_motor_switch, context)),
    ):
        # what is configured is made now: a mistake in it is reported before anything runs
        features.append(make() if context.config.keys(section) else LazyFeature(name, make))
    if context.config.keys(SKILL_BOARD):
        from cxbridge.executive.features.skill_board import SkillBoardFeature  # noqa: PLC0415

        features.append(SkillBoardFeature(partial(_desk, context.skills)))
    return features


def _planner(context: RunContext, pddl_parser: PddlParserFeature) -> Feature:
    from cxbridge.executive.features.planner import PlannerFeature  # noqa: PLC0415
    from cxbridge.executive.planning.settings import PlannerSettings  # noqa: PLC0415

    settings = PlannerSettings.from_config(context.config)
    return PlannerFeature(settings, pddl_parser.domain_of, context.make_planning)


def _robot_memory(context: RunContext) -> Feature:
    from cxbridge.executive.features.robot_memory import LIBRARY, RobotMemoryFeature  # noqa: PLC0415

    return RobotMemoryFeature(context.memory, context.paths.robot_memory or LIBRARY, _placeholders(context))


def _protobuf(context: RunContext) -> Feature:
    from cxbridge.executive.features.protobuf import ProtobufFeature, ProtobufSettings  # noqa: PLC0415

    folder = context.paths.config_file.parent
    return ProtobufFeature(ProtobufSettings.from_config(context.config, _placeholders(context), folder))


def _tf(context: RunContext) -> Feature:
    from cxbridge.executive.features.tf import TfFeature  # noqa: PLC0415

    return TfFeature(context.board)


def _navgraph(context: RunContext) -> Feature:
    from cxbridge.executive.features.navgraph import NavGraphFeature  # noqa: PLC0415

    return NavGraphFeature(partial(context.navgraph.get, context.config, context.paths))


def _motor_switch(context: RunContext) -> Feature:
    from cxbridge.executive.features.motor_switch import MotorSwitchFeature  # noqa: PLC0415

    motor = context.config.get_str("/clips-motor-switch/interface-id", default="Robotino")
    return MotorSwitchFeature(context.board, motor)


def _placeholders(context: RunContext) -> dict[str, str]:
    """Return what placeholders stand for, without the ``@`` around their names."""
    return {name.strip("@"): folder for name, folder in context.paths.substitutions.items()}


def _desk(skills: SharedSkillBoard) -> SkillDesk | None:
    return None if skills.station is None else skills.station.desk
