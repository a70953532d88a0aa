"""The plug-in's tables, described in docs/plugins.md."""

from __future__ import annotations

from cxbridge.plugins import Row, configured

API = 1  # version of the plug-in interface

FEATURES = (
    Row("motor-switch", "cxbridge_rcll.motor_switch:make_feature", early=configured("/clips-motor-switch")),
)
EXPLORED_GAMES = (Row("rcll", "cxbridge_rcll.options:ExploredLeagueOptions"),)
PLAYED_GAMES = (Row("rcll", "cxbridge_rcll.options:PlayedLeagueOptions"),)
