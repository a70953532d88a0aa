"""The plug-in's tables, described in docs/plugins.md."""

from __future__ import annotations

from cxbridge.plugins import Row

API = 1

COMMANDS = (Row("plan", "cxbridge_planning.cli.plan", section="Run"),)
PLANNERS = (
    Row("aries", "cxbridge_planning.unified:aries"),
    Row("tamer", "cxbridge_planning.unified:tamer"),
    Row("fast-downward", "cxbridge_planning.command:fast_downward"),
    Row("enhsp", "cxbridge_planning.command:enhsp"),
    Row("lpg", "cxbridge_planning.command:lpg"),
    Row("ff", "cxbridge_planning.command:ff"),
    Row("fd", "cxbridge_planning.command:fd"),
    Row("popf", "cxbridge_planning.command:popf"),
    Row("optic", "cxbridge_planning.command:optic"),
)
