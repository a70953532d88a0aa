"""The plug-in's tables, described in docs/plugins.md."""

from __future__ import annotations

from cxbridge.plugins import Row

API = 1

EXPLORED_GAMES = (Row("rcll", "cxbridge_rcll.options:ExploredLeague"),)
PLAYED_GAMES = (Row("rcll", "cxbridge_rcll.options:PlayedLeague"),)
