"""The plug-in's tables, described in docs/plugins.md."""

from __future__ import annotations

from typing import Any

from cxbridge.plugins import Row, configured

API = 1  # version of the plug-in interface

HOOKS = ("PLANNERS",)  # the table to which other plug-ins add planners


def _plans_by_blackboard(run: Any) -> bool:
    """Return whether the spec waits for Fawkes' planning plugins."""
    from cxbridge.run.specs import init_mentions  # noqa: PLC0415 - each command imports this module

    return (
        bool(run.spec)
        and run.source.has_fawkes_configuration
        and init_mentions(run.config, run.spec, "pddl-init")
    )


COMMANDS = (Row("plan", "cxbridge_planning.cli.plan", section="Run"),)
COMPONENTS = (
    # in a replay, the component answers the messages of rules: the recording lacks its robot memory
    Row(
        "planning",
        "cxbridge_planning.fawkes.component:PlanningPlugins",
        _plans_by_blackboard,
        in_replays=True,
    ),
)
FEATURES = (Row("planner", "cxbridge_planning.feature.planner:make_feature", early=configured("/planner")),)
PLANNERS = (
    Row("pyperplan", "cxbridge_planning.engines.pyperplan:PyperplanPlanner"),
    Row("aries", "cxbridge_planning.engines.unified:aries"),
    Row("tamer", "cxbridge_planning.engines.unified:tamer"),
    Row("fast-downward", "cxbridge_planning.engines.command:fast_downward"),
    Row("enhsp", "cxbridge_planning.engines.command:enhsp"),
    Row("lpg", "cxbridge_planning.engines.command:lpg"),
    Row("ff", "cxbridge_planning.engines.command:ff"),
    Row("fd", "cxbridge_planning.engines.command:fd"),
    Row("popf", "cxbridge_planning.engines.command:popf"),
    Row("optic", "cxbridge_planning.engines.command:optic"),
)
