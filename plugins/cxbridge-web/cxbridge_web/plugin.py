"""The tables of this plug-in; docs/plugins.md describes them."""

from __future__ import annotations

from cxbridge.plugins import Row

API = 1

COMMANDS = (
    Row("trace report", "cxbridge_web.cli.report", section="Commands"),
    Row("view", "cxbridge_web.cli.view", section="Look"),
)
