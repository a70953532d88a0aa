"""The plug-in's tables, described in docs/plugins.md."""

from __future__ import annotations

from cxbridge.plugins import Row

API = 1  # version of the plug-in interface

COMMANDS = (Row("mcp", "cxbridge_mcp.cli.mcp", section="Look"),)
