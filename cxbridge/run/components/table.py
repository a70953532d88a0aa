"""The table of components that runs and daemons have, in the order of their start."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from cxbridge.ros2.fawkes_keys import has_ours
from cxbridge.run.components.component import (
    ComponentEntry,
    ComponentError,
    InstalledComponent,
    installed_components,
)
from cxbridge.run.context import init_mentions
from cxbridge.run.remote_skiller import is_url
from cxbridge.run.skillers import SkillerSettings, skiller_settings

if TYPE_CHECKING:
    from cxbridge.run.context import RunContext

_PACKAGE = "cxbridge.run.components"


def local_skillers(context: RunContext) -> tuple[SkillerSettings, ...]:
    """Return the Skillers that this process has to make.

    :raises ConfigError: when the configuration of one makes no sense.
    """
    kind = context.options.skiller
    if kind == "none" or is_url(kind):
        return ()
    served = () if context.skill_board is None else context.skill_board.skillers
    return skiller_settings(context.config, kind, served)


def _speaks(context: RunContext) -> bool:
    return any(item.kind == "lua" for item in local_skillers(context))


def _plans_by_blackboard(context: RunContext) -> bool:
    """Whether the spec's initialisation waits for Fawkes' planning plugins."""
    return (
        bool(context.spec)
        and context.paths.ros2cx is None
        and init_mentions(context.config, context.spec, "pddl-init")
    )


ENVIRONMENT: Final = (
    ComponentEntry(
        "skiller",
        f"{_PACKAGE}.remote_skiller:RemoteSkillers",
        lambda context: is_url(context.options.skiller),
    ),
    ComponentEntry("speech", f"{_PACKAGE}.speech:Speech", _speaks),
    ComponentEntry("skiller", f"{_PACKAGE}.skillers:Skillers", lambda context: bool(local_skillers(context))),
    ComponentEntry(
        "skill-board",
        f"{_PACKAGE}.skill_board:SkillBoardComponent",
        lambda context: context.skill_board is not None,
    ),
    ComponentEntry(
        "ros2-performers",
        f"{_PACKAGE}.ros2_performers:Ros2Performers",
        lambda context: bool(context.config.keys("/ros2/performers")),
    ),
    ComponentEntry(
        "ros2-experts",
        f"{_PACKAGE}.ros2_experts:Ros2Experts",
        lambda context: bool(context.config.keys(context.experts.section)),
    ),
    ComponentEntry(
        "ros2-interfaces",
        f"{_PACKAGE}.ros2_interfaces:Ros2Interfaces",
        lambda context: bool(context.config.keys("/ros2/interfaces")),
    ),
    ComponentEntry(
        "ros2-skiller",
        f"{_PACKAGE}.ros2_skiller:Ros2Skiller",
        lambda context: bool(context.config.keys("/ros2/skiller")),
    ),
    ComponentEntry(
        "ros2-tf",
        f"{_PACKAGE}.ros2_transforms:Ros2Transforms",
        lambda context: has_ours(context.config, "/ros2/tf"),
    ),
)
"""The executive's environment; the recording has its place in a replay."""

PLANNING: Final = ComponentEntry("planning", f"{_PACKAGE}.planning:PlanningPlugins", _plans_by_blackboard)
EXECUTIVE: Final = ComponentEntry(
    "executive", f"{_PACKAGE}.executive:ExecutiveComponent", lambda context: bool(context.spec)
)


def needed_components(
    context: RunContext,
    *more: ComponentEntry,
    replayed: bool = False,
) -> list[ComponentEntry | InstalledComponent]:
    """Return what a run or daemon needs, in the order of the start.

    :param more: what begins before the others.
    :param replayed: whether a recording stands for the environment, and for what installed components do.
    :raises CxbridgeError: when the configuration makes no sense, or an installed component cannot be used.
    """
    entries: list[ComponentEntry | InstalledComponent] = [*more]
    entries += () if replayed else ENVIRONMENT
    entries.append(PLANNING)
    entries += () if replayed else installed_components()
    entries.append(EXECUTIVE)
    needed = [entry for entry in entries if entry.is_needed(context)]
    names = [entry.name for entry in needed]
    for name in names:
        if names.count(name) > 1:
            raise ComponentError(
                f"two components are called '{name}'", hint="remove the package that brings the second one"
            )
    return needed
