"""The plug-in's tables, described in docs/plugins.md."""

from __future__ import annotations

from cxbridge.plugins import Row, always, in_daemon

API = 1

COMMANDS = (
    Row("trace report", "cxbridge_web.cli.report", section="Commands"),
    Row("view", "cxbridge_web.cli.view", section="Look"),
)
COMPONENTS = (
    Row("foxglove", "cxbridge_web.servers.foxglove:FoxgloveComponent", in_daemon("foxglove"), early=always),
    Row("web", "cxbridge_web.servers.daemon_page:WebComponent", in_daemon("web"), early=always),
)
FORMATS = (Row("foxglove", "cxbridge_web.foxglove.writer"),)
OPTIONS = (
    Row("web", "cxbridge_web.options:WebOptions"),
    Row("foxglove", "cxbridge_web.options:FoxgloveOptions"),
)
SETTINGS = (
    Row("web", "cxbridge_web.settings:WebSettings"),
    Row("foxglove", "cxbridge_web.foxglove.settings:FoxgloveSettings"),
)
VIEWS = (
    Row("report", "cxbridge_web.report:report"),
    Row("document", "cxbridge_web.report:document_page"),
)
