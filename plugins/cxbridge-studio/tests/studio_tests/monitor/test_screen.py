"""The screen of the monitor with the pilot of textual."""

from __future__ import annotations

from dataclasses import replace

import pytest

pytest.importorskip("textual")

from textual.widgets import Input, Static

from cxbridge_studio.monitor.layout import HelpScreen
from cxbridge_studio.monitor.screen import make_monitor_app
from cxbridge_studio.monitor.snapshot import GoalRow, LogRow, Table
from cxbridge_studio.monitor.widgets import GoalTree, LogLines, RowTable
from studio_tests.monitor.scripted import GOALS, SNAPSHOT, ScriptedSource, list_labels, run_script


def read_text(app, name):
    return str(app.query_one(f"#{name}", Static).render())


def read_rows(app, name):
    table = app.query_one(f"#{name}", RowTable)
    return [[str(cell) for cell in table.get_row_at(number)] for number in range(table.row_count)]


def test_screen_shows_goals_and_panes():
    source = ScriptedSource()

    async def script(app, pilot, until):
        assert list_labels(app.query_one(GoalTree)) == [
            "▶ DISPATCHED root (TOP)",
            "  ✗ FAILED kid (TALK) FINISHED no voice",
            "○ FORMULATED other (MOVE)",
        ]
        assert read_text(app, "status") == "robot: running"
        assert read_text(app, "story-text") == "kid (TALK) FAILED: no voice"
        await pilot.press("2")
        await until(lambda: read_rows(app, "actions") == [["kid", "1", "say", '"[hi]"', "RUNNING"]])
        for key, name in enumerate(("skills", "interfaces", "facts", "agenda", "breakpoints"), 3):
            await pilot.press(str(key))
            expected = [list(row) for row in getattr(SNAPSHOT, name).rows]
            await until(lambda name=name, expected=expected: read_rows(app, name) == expected)
            await until(lambda name=name: source.query.pane == name)
        await pilot.press("8")
        log = app.query_one("#log", LogLines)
        await until(lambda: [line.text.strip() for line in log.lines] == ["W Daemon: mind the [step]"])

    run_script(make_monitor_app(source), script)
    assert source.closed


def test_goal_tree_follows_changes_and_keeps_cursor():
    source = ScriptedSource()

    async def script(app, pilot, until):
        tree = app.query_one(GoalTree)
        await pilot.press("down", "down")
        assert tree.item_at_cursor.id == "kid"
        source.change(
            goals=(GoalRow("executive", "new", "TOP", "nil", "SELECTED", "UNKNOWN", ""), *GOALS[:2])
        )
        await until(lambda: "○ SELECTED new (TOP)" in list_labels(tree))
        assert len(list_labels(tree)) == 3
        await until(lambda: tree.item_at_cursor is not None and tree.item_at_cursor.id == "kid")
        source.change(
            goals=(GOALS[0]._replace(mode="FINISHED"), GOALS[1]), stop="rules stopped before rule x"
        )
        await until(lambda: list_labels(tree)[0] == "· FINISHED root (TOP)")
        source.change(omitted_goal_count=5)
        await until(lambda: "5 more goals" in read_text(app, "status"))
        await until(lambda: read_text(app, "message") == "rules stopped before rule x")
        circle = [GoalRow("executive", a, "X", b, "SELECTED", "UNKNOWN", "") for a, b in ("ab", "ba")]
        source.change(goals=circle)
        await until(lambda: len(list_labels(tree)) == 2)

    run_script(make_monitor_app(source), script)


def test_keys_for_daemon_send_commands():
    source = ScriptedSource()

    async def script(app, pilot, until):
        await pilot.press("p", "r", "s", "l", "t", "left", "7", "d")
        await until(lambda: len(source.commands) == 6)
        assert source.commands == ["pause", "resume", "step rule", "step loop", "step transition", "delete 3"]
        await pilot.press("n")
        await until(lambda: source.query.env == "second")
        await until(lambda: "environment: second" in read_text(app, "status"))
        await pilot.press("n")
        await until(lambda: source.query.env == "executive")
        await pilot.press("question_mark")
        await until(lambda: isinstance(app.screen, HelpScreen))
        await pilot.press("escape")
        await until(lambda: not isinstance(app.screen, HelpScreen))
        await pilot.press("q")

    run_script(make_monitor_app(source), script)


def test_prompt_begins_with_breakpoint_for_selected_row():
    source = ScriptedSource()
    cases = {
        "b": "break ",
        "down down b": "break goal:TALK:",
        "2 b": "break action:say:",
        "6 b": "break rule:talk",
        "colon": "",
    }

    async def script(app, pilot, until):
        field = app.query_one("#prompt", Input)
        for keys, prompt_text in cases.items():
            await pilot.press(*keys.split())
            assert field.value == prompt_text
            assert field.has_focus
            await pilot.press("x", "enter")
            assert not field.has_focus
            if keys == "b":
                app.query_one(GoalTree).focus()
        await until(lambda: source.commands == [f"{prompt_text}x" for prompt_text in cases.values()])

    run_script(make_monitor_app(source), script)


def test_escape_leaves_prompt_and_filter():
    source = ScriptedSource()

    async def script(app, pilot, until):
        await pilot.press("slash", *"talk", "enter")
        await until(lambda: source.query.filter_text == "talk")
        await pilot.press("colon", *"pause", "escape")
        assert not app.query_one("#prompt").has_focus
        assert source.query.filter_text == "talk"
        await until(lambda: "filter: talk" in read_text(app, "status"))
        await pilot.press("escape")
        await until(lambda: source.query.filter_text == "")
        assert source.commands == []

    run_script(make_monitor_app(source), script)


def test_values_of_interface_at_cursor_are_shown():
    source = ScriptedSource()

    async def script(app, pilot, until):
        await pilot.press("4", "down")
        await until(lambda: source.query.interface == "T::a")
        source.change(fields=Table([("x", "1"), ("text", '"' + "a" * 300 + '"')]))
        await until(lambda: read_rows(app, "fields")[:1] == [["x", "1"]])
        assert read_rows(app, "fields")[1][1].endswith("a ...")

    run_script(make_monitor_app(source), script)


def test_note_has_whole_fact_at_cursor_and_number_of_hidden_facts():
    async def script(app, pilot, until):
        await pilot.press("5", "down")
        await until(lambda: read_text(app, "facts-note") == "f-2 (b (n 1))\n7 more facts: / finds them")

    run_script(make_monitor_app(ScriptedSource()), script)


def test_cursor_stays_at_row_after_changed_rows():
    source = ScriptedSource()

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

    run_script(make_monitor_app(source), script)


def test_keys_for_recording_scrub_in_each_pane():
    source = ScriptedSource(replace(SNAPSHOT, progress=0.5, stop="goal root"), is_live=False)

    async def script(app, pilot, until):
        assert read_text(app, "message").endswith("goal root")
        await pilot.press(*["left", "right", "shift+left", "shift+right", "home", "end"])
        await pilot.press(*["6", "left", "home", "comma", "full_stop"])
        expected = ["event -1", "event 1", "transition -1", "transition 1", "begin", "end"]
        expected += ["event -1", "begin", "transition -1", "transition 1"]
        await until(lambda: source.commands == expected)
        assert app.query_one("#events", RowTable).cursor_row == 1
        await pilot.press("j", *"12.5", "left", "left", "home", "end", "enter")
        await until(lambda: source.commands[-1] == "jump 12.5")
        await pilot.press("p", "s", "d")
        assert len(source.commands) == len(expected) + 1

    run_script(make_monitor_app(source), script)


def test_log_follows_position_in_recording():
    lines = [LogRow(number, "I", f"line {number}") for number in range(5)]
    source = ScriptedSource(replace(SNAPSHOT, log=lines), is_live=False)

    async def script(app, pilot, until):
        log = app.query_one("#log", LogLines)
        await pilot.press("7")
        for count in (5, 2, 3, 0):
            source.change(log=lines[:count])
            expected = [f"line {number}" for number in range(count)]
            await until(lambda expected=expected: [line.text.strip() for line in log.lines] == expected)

    run_script(make_monitor_app(source), script)


def test_screen_fits_80_columns(monkeypatch):
    monkeypatch.setenv("NO_COLOR", "1")

    async def script(app, pilot, until):
        assert app.screen.has_class("narrow")
        assert app.query_one("#panes").region.y > app.query_one(GoalTree).region.y
        assert app.query_one("#panes").region.width == 80
        assert app.query_one("#story").region.height >= 8
        await pilot.resize_terminal(140, 40)
        await until(lambda: not app.screen.has_class("narrow"))

    run_script(make_monitor_app(ScriptedSource()), script, size=(80, 24))


def test_errors_of_source_and_commands_are_shown():
    source = ScriptedSource()

    async def script(app, pilot, until):
        source.answer = "breakpoint 4"
        await pilot.press("s")
        await until(lambda: read_text(app, "message") == "breakpoint 4")
        source.error = "refused"
        await pilot.press("s")
        await until(lambda: read_text(app, "message") == "refused: try again")
        await until(lambda: read_text(app, "status") == "robot: refused")
        source.error = ""
        await until(lambda: read_text(app, "status") == "robot: running")
        source.fault = True
        await until(lambda: "an internal error of cxbridge: ZeroDivisionError" in read_text(app, "status"))

    run_script(make_monitor_app(source), script)


def test_selected_goal_replaces_legend():
    async def script(app, pilot, until):
        await until(lambda: len(list_labels(app.query_one(GoalTree))) == 3)
        assert read_text(app, "legend").startswith("○ waiting ▶ running")
        await pilot.press("down", "down")
        await until(lambda: read_text(app, "legend") == "kid (TALK): FINISHED FAILED  [no voice]")

    run_script(make_monitor_app(ScriptedSource()), script)
