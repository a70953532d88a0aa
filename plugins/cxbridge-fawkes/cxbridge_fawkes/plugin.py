"""The plug-in's tables, described in docs/plugins.md."""

from __future__ import annotations

from cxbridge.plugins import Row, always, in_daemon

API = 1  # version of the plug-in interface

COMMANDS = (Row("gateway", "cxbridge_fawkes.cli.gateway", section="Run"),)
COMPONENTS = (
    Row("fawkes", "cxbridge_fawkes.daemon_server:FawkesServerComponent", in_daemon("fawkes"), early=always),
    Row(
        "remote-skiller",
        "cxbridge_fawkes.remote_skiller:RemoteSkillerComponent",
        lambda run: run.options.has_remote_skiller,
    ),
)
FORMATS = (Row("bblogger", "cxbridge_fawkes.bblogger"), Row("csv", "cxbridge_fawkes.csv"))
OPTIONS = (Row("fawkes", "cxbridge_fawkes.options:FawkesOptions"),)
SETTINGS = (Row("fawkes", "cxbridge_fawkes.settings:FawkesSettings"),)
TRANSPORTS = (Row("fawkes", "cxbridge_fawkes.network.transport:FawkesTransport"),)
