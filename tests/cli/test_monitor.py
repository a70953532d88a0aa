"""The monitor's screen, driven by textual's pilot; and on a daemon."""

from __future__ import annotations

import asyncio
import sys
import threading

import pytest

from cxbridge.cli.main import invoke
from cxbridge.cli.monitor import DaemonSource
from cxbridge.errors import CxbridgeError
from tests.app.mini import write_scenario
from tests.app.test_daemon import WAIT_S, connected, running

pytest.importorskip("textual")

from textual.widgets import DataTable, Input, RichLog, Static, Tree

from cxbridge.cli.monitor_app import MonitorApp

GOALS = [
    ["root", "TOP", "nil", "DISPATCHED", "UNKNOWN", ""],
    ["kid", "TALK", "root", "FINISHED", "FAILED", "no voice"],
    ["other", "MOVE", "nil", "FORMULATED", "UNKNOWN", ""],
]


class Scripted:
    """A source that tells what a test has put there."""

    def __init__(self):
        self.goals = GOALS
        self.where = None
        self.log = [[1, "W", "Daemon", "mind the [step]"]]
        self.done = []
        self.error = ""
        self.looked = threading.Semaphore(0)

    def look(self, since):
        self.looked.release()
        if self.error:
            raise CxbridgeError(self.error)
        return {
            "status": {"state": "RUNNING"},
            "where": self.where,
            "state": {
                "goals": self.goals,
                "more_goals": 0,
                "actions": [["kid", "P", "1", "say", '"[hi]"', "RUNNING"]],
                "skills": [["Skiller", "say{}", "S_RUNNING"]],
                "log": [line for line in self.log if line[0] > since],
            },
            "interfaces": [("SkillerInterface::Skiller", "skiller", "2")],
        }

    def do(self, what):
        self.done.append(what)


def labels(tree):
    """The labels below the root, two blanks for each level."""
    found = []

    def walk(node, depth):
        for child in node.children:
            found.append("  " * depth + str(child.label))
            walk(child, depth + 1)

    walk(tree.root, 0)
    return found


def drive(source, script):
    """Run a script with the screen; it is given the screen, the pilot and what waits for something."""

    async def main():
        app = MonitorApp(source, "tcp://robot")
        async with app.run_test(size=(120, 40)) as pilot:

            async def until(condition):
                for _ in range(WAIT_S * 50):
                    if condition():
                        return
                    await pilot.pause(0.02)
                pytest.fail("it did not come")

            await until(lambda: app.query_one("#interfaces", DataTable).row_count)
            await script(app, pilot, until)

    asyncio.run(asyncio.wait_for(main(), 60))


def status(app):
    return str(app.query_one("#status", Static).render())


def test_it_shows_goals_actions_skills_interfaces_and_the_log():
    async def script(app, pilot, until):
        assert labels(app.query_one("#goals", Tree)) == [
            "DISPATCHED  root (TOP)",
            "  FINISHED FAILED  kid (TALK)  no voice",
            "FORMULATED  other (MOVE)",
        ]
        actions = app.query_one("#actions", DataTable)
        assert [str(cell) for cell in actions.get_row_at(0)] == ["kid", "1", "say", '"[hi]"', "RUNNING"]
        assert str(app.query_one("#skills", DataTable).get_row_at(0)[2]) == "S_RUNNING"
        assert status(app) == "tcp://robot: running"
        log = app.query_one("#log", RichLog)
        app.query_one("TabbedContent").active = "pane-log"
        await until(lambda: log.lines)
        assert "W Daemon: mind the [step]" in log.lines[0].text
        assert len(log.lines) == 1

    drive(Scripted(), script)


def test_it_follows_changes_and_keeps_its_place():
    source = Scripted()

    async def script(app, pilot, until):
        tree = app.query_one("#goals", Tree)
        await pilot.press("down", "down")
        assert tree.cursor_node.data == "kid"
        source.where = {"reason": "before rule x"}
        source.goals = [["new", "TOP", "nil", "SELECTED", "UNKNOWN", ""], *GOALS[:2]]
        await until(lambda: "SELECTED  new (TOP)" in labels(tree))
        assert len(labels(tree)) == 3
        await until(lambda: tree.cursor_node is not None and tree.cursor_node.data == "kid")
        assert status(app) == "tcp://robot: running, rules stopped before rule x"
        source.goals = [
            ["a", "X", "b", "SELECTED", "UNKNOWN", ""],
            ["b", "X", "a", "SELECTED", "UNKNOWN", ""],
        ]
        await until(lambda: len(labels(tree)) == 2)

    drive(source, script)


def test_keys():
    source = Scripted()

    async def script(app, pilot, until):
        await pilot.press("p", "r", "s", "l", "t")
        await until(lambda: len(source.done) == 5)
        assert source.done == ["pause", "resume", "rule", "loop", "transition"]
        await pilot.press("q")

    drive(source, script)


def test_the_filter_keeps_what_is_above():
    async def script(app, pilot, until):
        tree = app.query_one("#goals", Tree)
        await pilot.press("slash", *"talk")
        await until(lambda: len(labels(tree)) == 2)
        assert "root" in labels(tree)[0]
        assert app.query_one("#interfaces", DataTable).row_count == 0
        await pilot.press("enter")
        assert app.query_one("#filter", Input).value == "talk"
        assert "filter: talk" in status(app)
        await pilot.press("escape")
        await until(lambda: len(labels(tree)) == 3)

    drive(Scripted(), script)


def test_a_daemon_that_goes_is_told_and_it_may_come_back():
    source = Scripted()

    async def script(app, pilot, until):
        source.error = "nobody there"
        await until(lambda: status(app) == "tcp://robot: nobody there")
        source.error = ""
        await until(lambda: status(app) == "tcp://robot: running")

    drive(source, script)


def test_a_daemon(tmp_path):
    scenario = write_scenario(tmp_path / "mini")
    settings = (("fawkes/enable", False), ("zmq/endpoints", [f"ipc://{tmp_path}/bb"]))
    with running(config=scenario, settings=settings) as (daemon, _, _), connected(daemon) as board:
        source = DaemonSource(board)
        seen = source.look(0)
        assert seen["status"]["state"] == "RUNNING"
        assert seen["state"]["goals"][0][:3] == ["G", "MINI", "nil"]
        assert any(row[0] == "DaemonInterface::cxbridge" for row in seen["interfaces"])
        last = seen["state"]["log"][-1][0]
        assert all(line[0] > last for line in source.look(last)["state"]["log"])
        source.do("loop")
        source.do("resume")
        source.do("pause")
        assert source.look(0)["status"]["state"] == "PAUSED"


def test_without_textual_it_is_said(monkeypatch, capsys):
    monkeypatch.delitem(sys.modules, "cxbridge.cli.monitor_app")
    monkeypatch.setitem(sys.modules, "textual", None)
    monkeypatch.setitem(sys.modules, "textual.app", None)
    assert invoke(["monitor"]) == 2
    assert "cxbridge[monitor]" in capsys.readouterr().err
