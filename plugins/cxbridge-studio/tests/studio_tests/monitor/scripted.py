"""The screen of the monitor with a scripted source."""

from __future__ import annotations

import asyncio
from dataclasses import replace

import pytest

from cxbridge.errors import CxbridgeError
from cxbridge_studio.monitor.snapshot import GoalRow, LogRow, MonitorSnapshot, Table, ViewQuery

WAIT_S = 60

GOALS = (
    GoalRow("executive", "root", "TOP", "nil", "DISPATCHED", "UNKNOWN", ""),
    GoalRow("executive", "kid", "TALK", "root", "FINISHED", "FAILED", "no voice"),
    GoalRow("executive", "other", "MOVE", "nil", "FORMULATED", "UNKNOWN", ""),
)
SNAPSHOT = MonitorSnapshot(
    "running",
    goals=GOALS,
    actions=Table([("kid", "1", "say", '"[hi]"', "RUNNING")]),
    skills=Table([("Skiller", "say{}", "S_RUNNING")]),
    interfaces=Table([("SkillerInterface::Skiller", "skiller", "2"), ("T::a", "me", "1")]),
    facts=Table([("f-1", "(a)"), ("f-2", "(b (n 1))")], "7 more facts: / finds them"),
    agenda=Table([("10", "talk", "f-1,*")]),
    breakpoints=Table([("3", "goal:TALK")]),
    events=Table([("0.000", "goal", "root"), ("1.000", "rule", "talk")], selected=1),
    log=(LogRow(1, "W", "W Daemon: mind the [step]"),),
    environments=("executive", "second"),
    story=("kid (TALK) FAILED: no voice",),
)


class ScriptedSource:
    """A source that returns ``snapshot``, or raises ``error``."""

    name = "robot"
    period_s = 0.05

    def __init__(self, snapshot=SNAPSHOT, *, is_live=True):
        self.snapshot = snapshot
        self.is_live = is_live
        self.error = ""
        self.fault = False
        self.commands: list[str] = []
        self.query = ViewQuery()
        self.answer = ""
        self.closed = False

    def take_snapshot(self, query):
        self.query = query
        if self.error:
            raise CxbridgeError(self.error)
        if self.fault:
            raise ZeroDivisionError
        return self.snapshot

    def execute_command(self, command):
        self.commands.append(command)
        if self.error:
            raise CxbridgeError(self.error, hint="try again")
        return self.answer

    def close(self):
        self.closed = True

    def change(self, **members):
        self.snapshot = replace(self.snapshot, **members)


def list_labels(tree):
    """Return the labels below the root without padding, indented by two blanks for each level."""

    def walk(node, indent):
        for child in node.children:
            yield indent + " ".join(str(child.label).split())
            yield from walk(child, indent + "  ")

    return list(walk(tree.root, ""))


def run_script(app, script, size=(120, 40)):
    """Run a script with the app, the pilot, and a function that waits for a condition."""

    app.animation_level = "none"  # each key waits for the end of animations

    async def main():
        async with app.run_test(size=size) as pilot:

            async def until(condition):
                for _ in range(WAIT_S * 50):
                    if condition():
                        return
                    await pilot.pause(0.02)
                pytest.fail("the condition did not become true")

            await until(lambda: app.snapshot.head != "...")
            await pilot.pause()
            await script(app, pilot, until)

    asyncio.run(asyncio.wait_for(main(), 240))
