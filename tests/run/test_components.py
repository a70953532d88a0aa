"""A component of a plug-in in a daemon: the example of docs/plugins.md."""

from __future__ import annotations

import pytest

from cxbridge.daemon.daemon import Daemon
from cxbridge.daemon.options import DaemonOptions
from cxbridge.plugins import PluginError
from cxbridge.run.components.manager import State
from tests.daemon.test_daemon import QUIET, running
from tests.plugins import example, forget, install

SILENT = (*QUIET, ("skiller", "none"))
UID = ("SwitchInterface", "Heartbeat")


TABLES = """
from cxbridge.plugins import Row

API = 1
COMPONENTS = (Row("heartbeat", "greeter.component:Heartbeat"){more})
"""


@pytest.fixture
def plugin(tmp_path, monkeypatch):
    """Installs the component of docs/plugins.md, and other rows."""

    def write(*rows):
        more = "".join(f", Row({name!r}, {target!r})" for name, target in rows)
        files = {"component.py": example()["component.py"], "plugin.py": TABLES.format(more=more or ",")}
        install(tmp_path / "site", monkeypatch, "greeter", files)

    yield write
    forget("greeter")


def components(daemon):
    return {status.name: status.state for status in daemon.component_statuses()}


def test_daemon_manages_component_of_plug_in(plugin):
    plugin()
    with running(settings=SILENT) as (daemon, _, outcome):
        assert components(daemon)["heartbeat"] is State.ACTIVE
        assert daemon.board.list(*UID)[0].has_writer
    assert outcome == [0]
    daemon = Daemon(DaemonOptions(settings=SILENT))
    daemon.lifecycle.startup()
    daemon.lifecycle.change_component("heartbeat", "deactivate")
    assert daemon.board.list(*UID)[0].has_writer
    daemon.lifecycle.stop_component("heartbeat")
    assert not daemon.board.list(*UID)
    daemon.lifecycle.start_component("heartbeat")
    assert [node.description for node in daemon.lifecycle.nodes if not node.steady] == ["Counts loops"]
    daemon.lifecycle.shutdown()


@pytest.mark.parametrize(
    ("row", "message"),
    [
        (("broken", "nowhere:Nothing"), "ModuleNotFoundError"),
        (("broken", "greeter.component:Hook"), "is not a subclass"),
    ],
)
def test_unusable_component_is_an_error_at_start(plugin, row, message):
    plugin(row)
    with pytest.raises(PluginError, match=message):
        Daemon(DaemonOptions(settings=SILENT))
