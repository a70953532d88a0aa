"""The source of the monitor for a daemon."""

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
"""An agent whose only goal does not change."""


def until(take_snapshot, condition):
    """Take snapshots until the condition holds; return the last snapshot."""
    for _ in range(WAIT_S * 20):
        snapshot = take_snapshot()
        if condition(snapshot):
            return snapshot
        time.sleep(0.01)
    return pytest.fail("the condition did not become true")


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


def test_snapshot_of_daemon(source):
    snapshot = until(
        lambda: source.take_snapshot(ViewQuery()),
        lambda snapshot: snapshot.goals and "running" in snapshot.head,
    )
    pattern = r"running · up \d+\.\d s( \(.+ clock\))? · loop [\d,]+ at \d+ Hz"
    until(lambda: source.take_snapshot(ViewQuery()), lambda snapshot: re.fullmatch(pattern, snapshot.head))
    assert snapshot.goals[0][:4] == ("executive", "G", "MINI", "nil")
    assert snapshot.environments == ["executive"]
    assert any(row[0] == "DaemonInterface::cxbridge" for row in snapshot.interfaces.rows)
    assert (snapshot.stop, snapshot.progress, snapshot.facts.rows, snapshot.fields.rows) == ("", None, (), ())
    assert source.take_snapshot(ViewQuery(filter_text="no such goal")).goals == []
    assert len(source.take_snapshot(ViewQuery(filter_text="mini")).goals) == 1
    last_number = snapshot.log[-1].number
    assert last_number == max(line.number for line in snapshot.log)


def test_values_of_interface_are_read(source):
    query = ViewQuery(pane="interfaces", interface="DaemonInterface::cxbridge")
    assert dict(source.take_snapshot(query).fields.rows)["state"] == "RUNNING"
    assert source.take_snapshot(ViewQuery()).fields.rows == ()
    note = source.take_snapshot(ViewQuery(pane="interfaces", interface="NoType::x")).fields.note
    assert "'NoType' not found" in note


def test_commands_set_breakpoints_and_steps(source):
    query = ViewQuery()
    assert source.execute_command("break rule:*").startswith("breakpoint ")
    snapshot = until(lambda: source.take_snapshot(query), lambda snapshot: snapshot.stop)
    assert snapshot.stop.startswith("rules stopped before rule ")
    assert "(breakpoint " in snapshot.stop
    ((number, spec),) = snapshot.breakpoints.rows
    assert spec == "rule:*"
    source.execute_command(f"delete {number}")
    assert source.take_snapshot(query).breakpoints.rows == []
    source.execute_command("step loop")
    until(lambda: source.take_snapshot(query), lambda snapshot: "at the end of the loop" in snapshot.stop)
    source.execute_command("resume")
    until(lambda: source.take_snapshot(query), lambda snapshot: not snapshot.stop)
    for command in ("break", "break nonsense", "delete x", "step sideways", "dance"):
        with pytest.raises(CxbridgeError):
            source.execute_command(command)


def test_agenda_of_stopped_rules_is_read(source):
    query = ViewQuery(pane="agenda")
    source.execute_command("break rule:*")
    snapshot = until(
        lambda: source.take_snapshot(query), lambda snapshot: snapshot.stop and snapshot.agenda.rows
    )
    assert snapshot.stop.endswith(f"next: {snapshot.agenda.rows[0][1]}")
    source.execute_command(f"delete {snapshot.breakpoints.rows[0][0]}")
    source.execute_command("resume")


def test_thousands_of_facts_are_searched(source, daemon, tmp_path):
    file = tmp_path / "many.clp"
    file.write_text("(loop-for-count (?n 1 2000) (assert (many ?n)))\n")
    with connected(daemon) as board:
        request(board, "env-load", WAIT_S, env="executive", file=str(file), batch=True)
    query = ViewQuery(pane="facts")
    snapshot = until(
        lambda: source.take_snapshot(query), lambda snapshot: len(snapshot.facts.rows) == MAX_ROWS
    )
    assert snapshot.facts.note == f"the first {MAX_ROWS}: / finds further facts"
    assert len({index for index, _ in snapshot.facts.rows}) == MAX_ROWS
    found = until(
        lambda: source.take_snapshot(ViewQuery(pane="facts", filter_text="many 1999")),
        lambda snapshot: snapshot.facts.rows,
    )
    assert [row[1] for row in found.facts.rows] == ["(many 1999)"]
    unknown_env = source.take_snapshot(ViewQuery(pane="facts", env="other"))
    assert "no CLIPS environment 'other'" in unknown_env.facts.note


def test_request_has_lower_limit_after_too_long_reply(monkeypatch):
    request = Mock(side_effect=[CxbridgeError("the reply is too long")] * 2 + [{}, {}])
    monkeypatch.setattr(live, "request", request)
    source = DaemonSource("robot", Mock())
    for _ in range(2):
        source._request_state("")
    assert [call.kwargs["goals"] for call in request.mock_calls] == [1000, 500, 250, 250]


def test_source_reconnects_to_restarted_daemon(tmp_path):
    scenario = write_scenario(tmp_path / "mini", agent=AGENT)
    settings = (("fawkes/enable", False), ("zmq/endpoints", [f"ipc://{tmp_path}/bb"]))
    daemons: list[Any] = []
    source = DaemonSource("robot", lambda: connected(daemons[-1]))
    for _ in range(2):
        with running(config=scenario, settings=settings) as (daemon, _, _):
            daemons.append(daemon)
            snapshot = until(
                lambda: take_snapshot_or_none(source),
                lambda snapshot: snapshot is not None and snapshot.goals,
            )
            numbers = [line.number for line in snapshot.log]
            assert numbers == sorted(set(numbers))
        until(lambda: take_snapshot_or_none(source), lambda snapshot: snapshot is None)
    source.close()


def take_snapshot_or_none(source):
    """Return a snapshot, or None without a daemon."""
    try:
        return source.take_snapshot(ViewQuery())
    except BlackBoardError:
        return None
