"""The features and the skill board of the executive for ROS 2, made from the context of a run or a daemon."""

from __future__ import annotations

from functools import partial

from cxbridge.executive.feature import Feature
from cxbridge.executive.features.blackboard import BlackBoardFeature
from cxbridge.executive.features.config import ConfigFeature
from cxbridge.executive.features.redefine_warning import RedefineWarningFeature
from cxbridge.ros2cx.checkout import Ros2CxCheckout
from cxbridge.ros2cx.features import Ros2CxFeatureContext, make_features
from cxbridge.ros2cx.parameters import load_features
from cxbridge.ros2cx.settings import Ros2CxSettings
from cxbridge.ros2cx.skills import Ros2CxSkills
from cxbridge.run.context import RunContext


def ros2cx_features(context: RunContext, checkout: Ros2CxCheckout) -> list[Feature]:
    """Return the features of the executive for ROS 2.

    :raises ConfigError: when the parameter files make no sense.
    """
    folder = checkout.parameters
    settings = Ros2CxSettings.of(context.config)
    blocks = iter(settings.removal_blocks)

    def on_removal() -> None:
        if context.refresh is not None:
            context.refresh.block(next(blocks, 0.0))

    skills = partial(ros2cx_skills, context)
    features = make_features(
        Ros2CxFeatureContext(
            context.config,
            folder,
            context.board,
            skills,
            on_removal,
            context.make_planning,
            settings.original,
        ),
        load_features(folder),
    )
    if not context.paths.builtin:
        return features
    ours = [BlackBoardFeature(context.board), ConfigFeature(context.config), RedefineWarningFeature()]
    named = {feature.name for feature in features}
    return [*(feature for feature in ours if feature.name not in named), *features]


def ros2cx_skills(context: RunContext) -> Ros2CxSkills | None:
    """Return the skill board of the executive for ROS 2; None while there is none."""
    service, skills = context.skills.service, context.skills.ros2cx
    if service is None or skills is not None:
        return skills
    assert context.skill_board is not None  # --ros2cx always has a skill board
    settings = Ros2CxSettings.of(context.config)
    context.skills.ros2cx = Ros2CxSkills(
        service,
        context.board,
        context.clock,
        context.bus,
        context.skill_board,
        original=settings.original,
        unsensed=settings.unsensed,
    )
    return context.skills.ros2cx
