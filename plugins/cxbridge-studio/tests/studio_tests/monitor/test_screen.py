"""The monitor's screen, driven by textual's pilot."""

from __future__ import annotations

from dataclasses import replace

import pytest

pytest.importorskip("textual")

from textual.widgets import Input, Static

from cxbridge_studio.monitor.layout import HelpScreen
from cxbridge_studio.monitor.screen import make_monitor_app
from cxbridge_studio.monitor.snapshot import GoalRow, LogRow, Table
from cxbridge_studio.monitor.widgets import GoalTree, LogLines, RowTable
from studio_tests.monitor.scripted import GOALS, SNAPSHOT, Scripted, drive, labels


def text(app, name):
    return str(app.query_one(f"#{name}", Static).render())


def rows(app, name):
    table = app.query_one(f"#{name}", RowTable)
    return [[str(cell) for cell in table.get_row_at(number)] for number in range(table.row_count)]


def test_goals_and_panes():
    source = Scripted()

    async def script(app, pilot, until):
        assert labels(app.query_one(GoalTree)) == [
            "▶ DISPATCHED root (TOP)",
            "  ✗ FAILED kid (TALK) FINISHED no voice",
            "○ FORMULATED other (MOVE)",
        ]
        assert text(app, "status") == "robot: running"
        assert text(app, "story-text") == "kid (TALK) FAILED: no voice"
        await pilot.press("2")
        await until(lambda: rows(app, "actions") == [["kid", "1", "say", '"[hi]"', "RUNNING"]])
        for key, name in enumerate(("skills", "interfaces", "facts", "agenda", "breakpoints"), 3):
            await pilot.press(str(key))
            wanted = [list(row) for row in getattr(SNAPSHOT, name).rows]
            await until(lambda name=name, wanted=wanted: rows(app, name) == wanted)
            await until(lambda name=name: source.query.pane == name)
        await pilot.press("8")
        log = app.query_one("#log", LogLines)
        await until(lambda: [line.text.strip() for line in log.lines] == ["W Daemon: mind the [step]"])

    drive(make_monitor_app(source), script)
    assert source.closed


def test_it_follows_changes_and_keeps_its_place():
    source = Scripted()

    async def script(app, pilot, until):
        tree = app.query_one(GoalTree)
        await pilot.press("down", "down")
        assert tree.item_at_cursor.id == "kid"
        source.change(
            goals=(GoalRow("executive", "new", "TOP", "nil", "SELECTED", "UNKNOWN", ""), *GOALS[:2])
        )
        await until(lambda: "○ SELECTED new (TOP)" in labels(tree))
        assert len(labels(tree)) == 3
        await until(lambda: tree.item_at_cursor is not None and tree.item_at_cursor.id == "kid")
        source.change(
            goals=(GOALS[0]._replace(mode="FINISHED"), GOALS[1]), stop="rules stopped before rule x"
        )
        await until(lambda: labels(tree)[0] == "· FINISHED root (TOP)")
        source.change(more_goals=5)
        await until(lambda: "5 more goals" in text(app, "status"))
        await until(lambda: text(app, "said") == "rules stopped before rule x")
        circle = [GoalRow("executive", a, "X", b, "SELECTED", "UNKNOWN", "") for a, b in ("ab", "ba")]
        source.change(goals=circle)
        await until(lambda: len(labels(tree)) == 2)

    drive(make_monitor_app(source), script)


def test_keys_of_a_daemon():
    source = Scripted()

    async def script(app, pilot, until):
        await pilot.press("p", "r", "s", "l", "t", "left", "7", "d")
        await until(lambda: len(source.done) == 6)
        assert source.done == ["pause", "resume", "step rule", "step loop", "step transition", "delete 3"]
        await pilot.press("n")
        await until(lambda: source.query.env == "second")
        await until(lambda: "environment: second" in text(app, "status"))
        await pilot.press("n")
        await until(lambda: source.query.env == "executive")
        await pilot.press("question_mark")
        await until(lambda: isinstance(app.screen, HelpScreen))
        await pilot.press("escape")
        await until(lambda: not isinstance(app.screen, HelpScreen))
        await pilot.press("q")

    drive(make_monitor_app(source), script)


def test_commands_begin_with_what_is_chosen():
    source = Scripted()
    cases = {
        "b": "break ",
        "down down b": "break goal:TALK:",
        "2 b": "break action:say:",
        "6 b": "break rule:talk",
        "colon": "",
    }

    async def script(app, pilot, until):
        field = app.query_one("#prompt", Input)
        for keys, typed in cases.items():
            await pilot.press(*keys.split())
            assert field.value == typed
            assert field.has_focus
            await pilot.press("x", "enter")
            assert not field.has_focus
            if keys == "b":
                app.query_one(GoalTree).focus()
        await until(lambda: source.done == [f"{typed}x" for typed in cases.values()])

    drive(make_monitor_app(source), script)


def test_what_is_typed_can_be_left():
    source = Scripted()

    async def script(app, pilot, until):
        await pilot.press("slash", *"talk", "enter")
        await until(lambda: source.query.filter_text == "talk")
        await pilot.press("colon", *"pause", "escape")
        assert not app.query_one("#prompt").has_focus
        assert source.query.filter_text == "talk"
        await until(lambda: "filter: talk" in text(app, "status"))
        await pilot.press("escape")
        await until(lambda: source.query.filter_text == "")
        assert source.done == []

    drive(make_monitor_app(source), script)


def test_values_of_the_interface_under_the_cursor():
    source = Scripted()

    async def script(app, pilot, until):
        await pilot.press("4", "down")
        await until(lambda: source.query.interface == "T::a")
        source.change(fields=Table([("x", "1"), ("text", '"' + "a" * 300 + '"')]))
        await until(lambda: rows(app, "fields")[:1] == [["x", "1"]])
        assert rows(app, "fields")[1][1].endswith("a ...")

    drive(make_monitor_app(source), script)


def test_notes_tell_what_is_not_shown_and_all_of_the_fact_under_the_cursor():
    async def script(app, pilot, until):
        await pilot.press("5", "down")
        await until(lambda: text(app, "facts-note") == "f-2 (b (n 1))\n7 more facts: / finds them")

    drive(make_monitor_app(Scripted()), script)


def test_rows_that_come_and_go_leave_the_cursor_where_it_was():
    source = Scripted()

    async def script(app, pilot, until):
        table = app.query_one("#facts", RowTable)
        await pilot.press("5", "down")
        source.change(facts=Table([("f-0", "(z)"), ("f-1", "(a)"), ("f-2", "(b (n 2))")]))
        await until(lambda: table.row_count == 3)
        assert table.item_at_cursor[0] == "f-2"
        source.change(facts=Table([("f-0", "(z)")]))
        await until(lambda: table.row_count == 1)
        assert table.item_at_cursor[0] == "f-0"
        source.change(facts=Table())
        await until(lambda: table.row_count == 0)
        assert table.item_at_cursor is None

    drive(make_monitor_app(source), script)


def test_keys_of_a_recording_scrub_wherever_the_cursor_is():
    source = Scripted(replace(SNAPSHOT, progress=0.5, stop="goal root"), is_live=False)

    async def script(app, pilot, until):
        assert text(app, "said").endswith("goal root")
        await pilot.press(*["left", "right", "shift+left", "shift+right", "home", "end"])
        await pilot.press(*["6", "left", "home", "comma", "full_stop"])
        wanted = ["event -1", "event 1", "transition -1", "transition 1", "begin", "end"]
        wanted += ["event -1", "begin", "transition -1", "transition 1"]
        await until(lambda: source.done == wanted)
        assert app.query_one("#events", RowTable).cursor_row == 1
        await pilot.press("j", *"12.5", "left", "left", "home", "end", "enter")
        await until(lambda: source.done[-1] == "jump 12.5")
        await pilot.press("p", "s", "d")
        assert len(source.done) == len(wanted) + 1

    drive(make_monitor_app(source), script)


def test_the_log_goes_back_with_a_recording():
    lines = [LogRow(number, "I", f"line {number}") for number in range(5)]
    source = Scripted(replace(SNAPSHOT, log=lines), is_live=False)

    async def script(app, pilot, until):
        log = app.query_one("#log", LogLines)
        await pilot.press("7")
        for count in (5, 2, 3, 0):
            source.change(log=lines[:count])
            wanted = [f"line {number}" for number in range(count)]
            await until(lambda wanted=wanted: [line.text.strip() for line in log.lines] == wanted)

    drive(make_monitor_app(source), script)


def test_it_fits_80_columns(monkeypatch):
    monkeypatch.setenv("NO_COLOR", "1")

    async def script(app, pilot, until):
        assert app.screen.has_class("narrow")
        assert app.query_one("#panes").region.y > app.query_one(GoalTree).region.y
        assert app.query_one("#panes").region.width == 80
        assert app.query_one("#story").region.height >= 8
        await pilot.resize_terminal(140, 40)
        await until(lambda: not app.screen.has_class("narrow"))

    drive(make_monitor_app(Scripted()), script, size=(80, 24))


def test_errors_of_the_source_and_of_commands_are_shown():
    source = Scripted()

    async def script(app, pilot, until):
        source.answer = "breakpoint 4"
        await pilot.press("s")
        await until(lambda: text(app, "said") == "breakpoint 4")
        source.error = "refused"
        await pilot.press("s")
        await until(lambda: text(app, "said") == "refused: try again")
        await until(lambda: text(app, "status") == "robot: refused")
        source.error = ""
        await until(lambda: text(app, "status") == "robot: running")
        source.fault = True
        await until(lambda: "an internal error of cxbridge: ZeroDivisionError" in text(app, "status"))

    drive(make_monitor_app(source), script)


def test_the_legend_gives_way_to_the_goal_that_is_chosen():
    async def script(app, pilot, until):
        await until(lambda: len(labels(app.query_one(GoalTree))) == 3)
        assert text(app, "legend").startswith("○ waiting ▶ running")
        await pilot.press("down", "down")
        await until(lambda: text(app, "legend") == "kid (TALK): FINISHED FAILED  [no voice]")

    drive(make_monitor_app(Scripted()), script)
