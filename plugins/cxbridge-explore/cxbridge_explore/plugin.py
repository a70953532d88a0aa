"""The rows that this plug-in adds to tables; see docs/plugins.md."""

from __future__ import annotations

from cxbridge.plugins import Row

API = 1

# The tables that this plug-in defines in `cxbridge_explore.game.kinds`.
HOOKS = ("EXPLORED_GAMES", "PLAYED_GAMES")

CHECKS = (Row("explore", "cxbridge_explore.check"),)
COMMANDS = (
    Row("explore", "cxbridge_explore.cli.explore", section="Explore"),
    Row("game", "cxbridge_explore.cli.game", section="Test"),
    Row("sweep", "cxbridge_explore.cli.sweep", section="Test"),
)

MEMBERS = (
    Row("cx.explore", "cxbridge_explore.members:explore"),
    Row("run.assert_properties", "cxbridge_explore.members:assert_properties"),
)
