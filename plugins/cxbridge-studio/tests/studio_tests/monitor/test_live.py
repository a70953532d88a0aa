"""A daemon as the monitor sees it."""

from __future__ import annotations

import re
import time
from collections.abc import Iterator
from typing import Any
from unittest.mock import Mock

import pytest

from cxbridge.daemon.client import request
from cxbridge.errors import BlackBoardError, CxbridgeError
from cxbridge_studio.monitor import live
from cxbridge_studio.monitor.live import DaemonSource
from cxbridge_studio.monitor.snapshot import MAX_ROWS, ViewQuery
from tests.daemon.test_daemon import WAIT_S, connected, running
from tests.run.mini import write_scenario

AGENT = "(defrule begin (executive-initialized) (not (goal)) => (assert (goal (id G) (class MINI))))"
"""A goal that does not change."""


def until(take_snapshot, condition):
    """Look until the condition holds, and return the snapshot."""
    for _ in range(WAIT_S * 20):
        seen = take_snapshot()
        if condition(seen):
            return seen
        time.sleep(0.01)
    return pytest.fail("it did not come")


@pytest.fixture(name="daemon", scope="module")
def _daemon(tmp_path_factory):
    folder = tmp_path_factory.mktemp("daemon")
    scenario = write_scenario(folder / "mini", agent=AGENT)
    settings = (("fawkes/enable", False), ("zmq/endpoints", [f"ipc://{folder}/bb"]))
    with running(config=scenario, settings=settings) as (daemon, _, _):
        yield daemon


@pytest.fixture(name="source")
def _source(daemon) -> Iterator[DaemonSource]:
    source = DaemonSource("robot", lambda: connected(daemon))
    yield source
    source.close()


def test_what_is_seen(source):
    seen = until(
        lambda: source.take_snapshot(ViewQuery()), lambda seen: seen.goals and "running" in seen.head
    )
    pattern = r"running · up \d+\.\d s( \(.+ clock\))? · loop [\d,]+ at \d+ Hz"
    until(lambda: source.take_snapshot(ViewQuery()), lambda seen: re.fullmatch(pattern, seen.head))
    assert seen.goals[0][:4] == ("executive", "G", "MINI", "nil")
    assert seen.environments == ["executive"]
    assert any(row[0] == "DaemonInterface::cxbridge" for row in seen.interfaces.rows)
    assert (seen.stop, seen.progress, seen.facts.rows, seen.fields.rows) == ("", None, (), ())
    assert source.take_snapshot(ViewQuery(filter_text="no such goal")).goals == []
    assert len(source.take_snapshot(ViewQuery(filter_text="mini")).goals) == 1
    last = seen.log[-1].number
    assert last == max(line.number for line in seen.log)


def test_values_of_an_interface(source):
    query = ViewQuery(pane="interfaces", interface="DaemonInterface::cxbridge")
    assert dict(source.take_snapshot(query).fields.rows)["state"] == "RUNNING"
    assert source.take_snapshot(ViewQuery()).fields.rows == ()
    note = source.take_snapshot(ViewQuery(pane="interfaces", interface="NoType::x")).fields.note
    assert "'NoType' not found" in note


def test_breakpoints_steps_and_where_it_stands(source):
    query = ViewQuery()
    assert source.execute_command("break rule:*").startswith("breakpoint ")
    seen = until(lambda: source.take_snapshot(query), lambda seen: seen.stop)
    assert seen.stop.startswith("rules stopped before rule ")
    assert "(breakpoint " in seen.stop
    ((number, spec),) = seen.breakpoints.rows
    assert spec == "rule:*"
    source.execute_command(f"delete {number}")
    assert source.take_snapshot(query).breakpoints.rows == []
    source.execute_command("step loop")
    until(lambda: source.take_snapshot(query), lambda seen: "at the end of the loop" in seen.stop)
    source.execute_command("resume")
    until(lambda: source.take_snapshot(query), lambda seen: not seen.stop)
    for wrong in ("break", "break nonsense", "delete x", "step sideways", "dance"):
        with pytest.raises(CxbridgeError):
            source.execute_command(wrong)


def test_the_agenda_of_rules_that_stand(source):
    query = ViewQuery(pane="agenda")
    source.execute_command("break rule:*")
    seen = until(lambda: source.take_snapshot(query), lambda seen: seen.stop and seen.agenda.rows)
    assert seen.stop.endswith(f"next: {seen.agenda.rows[0][1]}")
    source.execute_command(f"delete {seen.breakpoints.rows[0][0]}")
    source.execute_command("resume")


def test_thousands_of_facts_are_searched_in_steps(source, daemon, tmp_path):
    file = tmp_path / "many.clp"
    file.write_text("(loop-for-count (?n 1 2000) (assert (many ?n)))\n")
    with connected(daemon) as board:
        request(board, "env-load", WAIT_S, env="executive", file=str(file), batch=True)
    query = ViewQuery(pane="facts")
    seen = until(lambda: source.take_snapshot(query), lambda seen: len(seen.facts.rows) == MAX_ROWS)
    assert seen.facts.note == f"the first {MAX_ROWS}: / finds further facts"
    assert len({index for index, _ in seen.facts.rows}) == MAX_ROWS
    found = until(
        lambda: source.take_snapshot(ViewQuery(pane="facts", filter_text="many 1999")),
        lambda seen: seen.facts.rows,
    )
    assert [row[1] for row in found.facts.rows] == ["(many 1999)"]
    unknown_env = source.take_snapshot(ViewQuery(pane="facts", env="other"))
    assert "no CLIPS environment 'other'" in unknown_env.facts.note


def test_less_is_asked_for_when_an_answer_is_too_long(monkeypatch):
    request = Mock(side_effect=[CxbridgeError("the reply is too long")] * 2 + [{}, {}])
    monkeypatch.setattr(live, "request", request)
    source = DaemonSource("robot", Mock())
    for _ in range(2):
        source._request_state("")
    assert [call.kwargs["goals"] for call in request.mock_calls] == [1000, 500, 250, 250]


def test_a_daemon_that_goes_and_comes_back(tmp_path):
    scenario = write_scenario(tmp_path / "mini", agent=AGENT)
    settings = (("fawkes/enable", False), ("zmq/endpoints", [f"ipc://{tmp_path}/bb"]))
    daemons: list[Any] = []
    source = DaemonSource("robot", lambda: connected(daemons[-1]))
    for _ in range(2):
        with running(config=scenario, settings=settings) as (daemon, _, _):
            daemons.append(daemon)
            seen = until(lambda: take_snapshot(source), lambda seen: seen is not None and seen.goals)
            numbers = [line.number for line in seen.log]
            assert numbers == sorted(set(numbers))
        until(lambda: take_snapshot(source), lambda seen: seen is None)
    source.close()


def take_snapshot(source):
    """Look; None without a daemon."""
    try:
        return source.take_snapshot(ViewQuery())
    except BlackBoardError:
        return None
