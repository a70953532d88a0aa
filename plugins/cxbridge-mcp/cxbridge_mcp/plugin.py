"""The tables of this plug-in; docs/plugins.md describes them."""

from __future__ import annotations

from cxbridge.plugins import Row

API = 1

COMMANDS = (Row("mcp", "cxbridge_mcp.cli.mcp", section="Look"),)
