"""The tables of this plug-in; docs/plugins.md describes them."""

from __future__ import annotations

from cxbridge.plugins import Row

API = 1

COMPONENTS = (
    # Only an agent has rules to explain, and only clients ask.
    Row(
        "explainer",
        "cxbridge_studio.explain.component:Explainer",
        lambda context: bool(context.spec) and context.has_clients,
    ),
)
EXPLAINERS = (Row("studio", "cxbridge_studio.explainer"),)
OPTIONS = (Row("break", "cxbridge_studio.options:BreakOptions"),)
OPERATIONS = (
    Row("debugger", "cxbridge_studio.operations.debugger"),
    Row("environments", "cxbridge_studio.operations.environments"),
    Row("facts", "cxbridge_studio.operations.facts"),
    Row("features", "cxbridge_studio.operations.features"),
    Row("state", "cxbridge_studio.operations.state"),
)
COMMANDS = (
    Row("bb hz", "cxbridge_studio.cli.bb_rates:hz"),
    Row("check", "cxbridge_studio.cli.check", section="Run"),
    Row("coverage", "cxbridge_studio.cli.coverage", section="Record and compare"),
    Row("dap", "cxbridge_studio.cli.dap", section="Look"),
    Row("daemon break", "cxbridge_studio.cli.daemon_break:breaks"),
    Row("daemon step", "cxbridge_studio.cli.daemon_break:step"),
    Row("env", "cxbridge_studio.cli.env", section="Look"),
    Row("format", "cxbridge_studio.cli.format", section="Edit"),
    Row("lsp", "cxbridge_studio.cli.lsp", section="Edit"),
    Row("monitor", "cxbridge_studio.cli.monitor", section="Look"),
    Row("skill graph", "cxbridge_studio.cli.skill:graph"),
    Row("skill monitor", "cxbridge_studio.cli.skill:monitor"),
    Row("trace repair", "cxbridge_studio.cli.trace_repair:repair", section="Commands"),
    Row("why", "cxbridge_studio.cli.why", section="Look"),
)
