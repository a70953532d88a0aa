"""The table of components of runs and daemons."""

from __future__ import annotations

from itertools import combinations
from typing import Any, Final

from cxbridge.plugins import PluginError, Row, Table, duplicate_error, package_hint
from cxbridge.run.components.component import is_component
from cxbridge.run.skillers import SkillerSettings, skiller_settings

EXECUTIVE: Final = "executive"
"""The component that runs the rules."""

REMOTE_SKILLER: Final = "remote-skiller"
"""The component of a plug-in that mirrors the Skiller of another blackboard."""

_PACKAGE = "cxbridge.run.components"


def local_skillers(run: Any) -> tuple[SkillerSettings, ...]:
    """Return the settings of the Skillers in this process.

    :raises ConfigError: if the configuration of a Skiller is wrong.
    """
    kind = run.options.skiller
    if kind == "none" or run.options.has_remote_skiller:
        return ()
    board_skillers = () if run.skill_board is None else run.skill_board.skillers
    return skiller_settings(run.config, kind, board_skillers)


def _speaks(run: Any) -> bool:
    """Return whether skills may speak: only Lua skills can."""
    return any(settings.kind == "lua" for settings in local_skillers(run))


COMPONENTS: Final[Table[type[Any]]] = Table(
    "COMPONENTS",
    is_component,
    "a subclass of cxbridge.run.components.component.Component",
    Row("speech", f"{_PACKAGE}.skillers:Speech", _speaks),  # before the skills that open its interface
    Row("skiller", f"{_PACKAGE}.skillers:Skillers", lambda run: bool(local_skillers(run))),
    Row(
        "skill-board",
        f"{_PACKAGE}.skill_board:SkillBoardComponent",
        lambda run: run.skill_board is not None,
    ),
    Row(EXECUTIVE, f"{_PACKAGE}.executive:ExecutiveComponent", lambda run: bool(run.spec)),
)
"""Components in start order. The executive is last, because its rules use all other components."""


def needed_components(run: Any, *daemon_rows: Row, is_replay: bool = False) -> list[Row]:
    """Return the needed components in start order.

    :param daemon_rows: components of daemons only; they start first.
    :param is_replay: whether a recording replaces Skillers, sensors and most components of plug-ins.
    :raises CxbridgeError: if the configuration is wrong, two components have the same name, or the plug-in
        for a remote Skiller is absent.
    """
    executive = COMPONENTS.find(EXECUTIVE)
    candidates = (
        row for row in COMPONENTS.rows if row is not executive and (not is_replay or row.in_replays)
    )
    rows = [row for row in (*candidates, executive) if row.needed(run)]
    if run.options.has_remote_skiller and REMOTE_SKILLER not in [row.name for row in COMPONENTS.rows]:
        raise PluginError(
            f"the Skiller at {run.options.skiller} cannot be used", hint=package_hint(REMOTE_SKILLER)
        )
    rows.sort(key=lambda row: not row.early(run))  # stable: the order of the table otherwise
    needed = [*(row for row in daemon_rows if row.needed(run)), *rows]
    for first, second in combinations(needed, 2):
        if first.name == second.name:
            raise duplicate_error(COMPONENTS.hook, first, second)
    return needed
