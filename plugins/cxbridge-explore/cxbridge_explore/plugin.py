"""The extensions of this plug-in; see docs/plugins.md.

Each :class:`~cxbridge.plugins.Row` names an extension, and the module or ``module:object`` that cxbridge
imports when the extension is used.
"""

from __future__ import annotations

from cxbridge.plugins import Row

API = 1  # version of the plug-in interface

# Tables to which other plug-ins add kinds of games; `cxbridge_explore.game.kinds` defines them.
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
