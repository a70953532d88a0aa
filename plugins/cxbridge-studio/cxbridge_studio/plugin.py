"""The tables of this plug-in; docs/plugins.md describes them."""

from __future__ import annotations

from cxbridge.plugins import Row

API = 1

COMPONENTS = (
    Row(
        "explainer",
        "cxbridge_studio.explain.answering:Explainer",
        lambda context: bool(context.spec) and context.has_clients,
    ),
)
EXPLAINERS = (Row("studio", "cxbridge_studio.explainer"),)
COMMANDS = (
    Row("check", "cxbridge_studio.cli.check"),
    Row("coverage", "cxbridge_studio.cli.coverage"),
    Row("dap", "cxbridge_studio.cli.dap"),
    Row("format", "cxbridge_studio.cli.format"),
    Row("lsp", "cxbridge_studio.cli.lsp"),
    Row("monitor", "cxbridge_studio.cli.monitor"),
    Row("trace planning", "cxbridge_studio.cli.trace_planning:planning"),
    Row("why", "cxbridge_studio.cli.why"),
)
