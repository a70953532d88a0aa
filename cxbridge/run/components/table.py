"""The table of components that runs and daemons have, in the order of their start."""

from __future__ import annotations

from itertools import combinations
from typing import Any, Final

from cxbridge.plugins import Row, Table, two_of_a_name
from cxbridge.run.components.component import is_component
from cxbridge.run.skillers import SkillerSettings, skiller_settings
from cxbridge.run.specs import init_mentions

EXECUTIVE: Final = "executive"
PLANNING: Final = "planning"
_PACKAGE = "cxbridge.run.components"


RECORDER: Final = Row("recorder", f"{_PACKAGE}.recorder:RecorderComponent")
"""The recorder; a run has it outside of all other components, a daemon in its own table."""


def local_skillers(run: Any) -> tuple[SkillerSettings, ...]:
    """Return the Skillers that this process has to make.

    :raises ConfigError: when the configuration of one is wrong.
    """
    kind = run.options.skiller
    if kind == "none" or run.options.has_remote_skiller:
        return ()
    served = () if run.skill_board is None else run.skill_board.skillers
    return skiller_settings(run.config, kind, served)


def _speaks(run: Any) -> bool:
    return any(item.kind == "lua" for item in local_skillers(run))


def _plans_by_blackboard(run: Any) -> bool:
    """Whether the spec's initialisation waits for Fawkes' planning plugins."""
    return (
        bool(run.spec)
        and run.source.has_fawkes_configuration
        and init_mentions(run.config, run.spec, "pddl-init")
    )


COMPONENTS: Final[Table[type[Any]]] = Table(
    "COMPONENTS",
    is_component,
    "a subclass of cxbridge.run.components.component.Component",
    Row(
        "skiller",
        f"{_PACKAGE}.remote_skiller:RemoteSkillers",
        lambda run: run.options.has_remote_skiller,
    ),
    Row("speech", f"{_PACKAGE}.skillers:Speech", _speaks),
    Row("skiller", f"{_PACKAGE}.skillers:Skillers", lambda run: bool(local_skillers(run))),
    Row(
        "skill-board",
        f"{_PACKAGE}.skillers:SkillBoardComponent",
        lambda run: run.skill_board is not None,
    ),
    Row(PLANNING, f"{_PACKAGE}.planning:PlanningPlugins", _plans_by_blackboard),
    Row(EXECUTIVE, f"{_PACKAGE}.executive:ExecutiveComponent", lambda run: bool(run.spec)),
)
"""The components of runs and daemons, in the order of their start; the executive is the last."""


def needed_components(run: Any, *daemon: Row, replayed: bool = False) -> list[Row]:
    """Return the components that a run or daemon needs, in the order of their start.

    :param daemon: components that only daemons have; they start first.
    :param replayed: whether a recording replaces the environment and the components of plug-ins.
    :raises CxbridgeError: when the configuration is wrong, or two components have the same name.
    """
    executive = COMPONENTS.find(EXECUTIVE)
    others = [
        row for row in COMPONENTS.rows if row is not executive and (not replayed or row.name == PLANNING)
    ]
    wanted = [row for row in (*others, executive) if row.needed(run)]
    wanted.sort(key=lambda row: not row.early(run))
    needed = [*(row for row in daemon if row.needed(run)), *wanted]
    for first, second in combinations(needed, 2):
        if first.name == second.name:
            raise two_of_a_name(COMPONENTS.hook, first, second)
    return needed
