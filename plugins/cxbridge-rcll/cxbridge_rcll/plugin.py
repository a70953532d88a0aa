"""The tables of this plug-in; docs/plugins.md describes them."""

from __future__ import annotations

from cxbridge.plugins import Row

API = 1

EXPLORED_GAMES = (Row("rcll", "cxbridge_rcll.options:ExploredLeague"),)
PLAYED_GAMES = (Row("rcll", "cxbridge_rcll.options:PlayedLeague"),)
