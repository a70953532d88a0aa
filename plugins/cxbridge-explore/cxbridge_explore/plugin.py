"""The tables of this plug-in; docs/plugins.md describes them."""

from __future__ import annotations

from cxbridge.plugins import Row

API = 1

COMMANDS = (
    Row("explore", "cxbridge_explore.cli.explore"),
    Row("game", "cxbridge_explore.cli.game"),
    Row("sweep", "cxbridge_explore.cli.sweep"),
)
