"""The messages between masters and executors, compared with the thesis' recordings."""

from __future__ import annotations

import dataclasses
import json
import re
from collections.abc import Iterable, Sequence

import pytest
from msgspec import structs

from cxbridge.cli.main import main
from cxbridge.history.exchange import ExchangeReader, SkillMessage
from ros2cx_tests.rows import run
from ros2cx_tests.test_recordings import DATA, RECORDINGS, make_options
from tests.support import needs_ros2cx, needs_shared

pytestmark = needs_ros2cx

TWO_EXECUTORS = ("move=cxbridge_ros2cx.executors:ThesisDummyExecutor",) * 2
TWO_SANE_EXECUTORS = ("move=cxbridge_ros2cx.executors:DummyExecutor",) * 2
EXECUTOR_MESSAGES = ("RESPONSE", "FEEDBACK", "FINISH")


def run_exchange(
    spec: str, overlay: str | None = None, executors: tuple[str, ...] = (), *, original: bool = True
) -> list[SkillMessage]:
    """Run a spec, and return the messages."""
    run_options = make_options(spec, None, executors)
    files = [DATA / name for name in (overlay, "original.yaml" if original else None) if name]
    observed = run(dataclasses.replace(run_options, config=tuple(files)))
    return [message for message, _ in ExchangeReader().read(observed.messages)]


def read_recording(name: str) -> list[SkillMessage]:
    """Return the messages of a recording."""
    messages = []
    for line in (RECORDINGS / name / "messages.jsonl").read_text().splitlines():
        row = json.loads(line)
        if row.get("topic") == "skill_board":
            names = (
                "type",
                "node_id",
                "action",
                "agent_id",
                "mapped_action",
                "status",
                "success",
                "progress",
            )
            messages.append(
                SkillMessage(0, params=tuple(row["params"]), **{name: row[name] for name in names})
            )
    return messages


def normalise(messages: Iterable[SkillMessage]) -> list[SkillMessage]:
    """Remove times and requests, which the recordings lack, and number the ids in order of appearance."""
    names: dict[str, str] = {}

    def count(message: SkillMessage) -> str:
        kind = "master" if message.type == "REQUEST" else "executor"
        return names.setdefault(message.node_id, f"{kind} {sum(n.startswith(kind) for n in names.values())}")

    return [
        dataclasses.replace(
            message,
            time_us=0,
            request="",
            node_id=count(message),
            agent_id="" if message.agent_id == "default" else message.agent_id,
            progress=round(message.progress, 6),
        )
        for message in messages
    ]


def group_by_sender(messages: Sequence[SkillMessage]) -> dict[str, list[SkillMessage]]:
    """Group messages by sender, because a topic keeps only the order of each sender.

    The order of the confirmations of a master depends on the arrival of responses, so they are sorted.
    """
    sent: dict[str, list[SkillMessage]] = {}
    for message in messages:
        sender = message.node_id if message.type in EXECUTOR_MESSAGES else "master"
        sent.setdefault(sender, []).append(message)
    sent["master"].sort(key=lambda m: (m.params, ["REQUEST", "CONFIRM", "CANCEL"].index(m.type), m.node_id))
    return sent


@needs_shared
@pytest.mark.parametrize(
    ("recording", "spec", "overlay", "executors"),
    [
        ("nav2", "test-nav2", "nav2.yaml", ()),
        ("nav2-fixed", "fixed", "fixed.yaml", ()),
        ("two-executors", "fixed", "two-executors.yaml", TWO_EXECUTORS),
        ("skill", "test-skill", None, ()),
        ("cancel", "cancel", "cancel.yaml", (f"move={DATA / 'slow.py'}:Slow",)),
        ("fail", "fixed", "fixed.yaml", (f"move={DATA / 'door.py'}:Door",)),
        ("no-plan", "test-nav2", "no-plan.yaml", ()),
        ("tree", "tree", "tree.yaml", ()),
    ],
)
def test_messages_equal_recorded_messages(recording, spec, overlay, executors):
    expected, ours = normalise(read_recording(recording)), normalise(run_exchange(spec, overlay, executors))
    assert bool(expected) == (recording not in ("no-plan", "tree"))
    if expected:
        assert group_by_sender(ours) == group_by_sender(expected)
    else:
        assert ours == []
    assert_causal(ours)


def assert_causal(messages: Sequence[SkillMessage]) -> None:
    """Assert that each response follows its request, and each execution its confirmation."""
    requested: set[tuple[str, ...]] = set()
    confirmed: set[tuple[str, tuple[str, ...]]] = set()
    for message in messages:
        if message.type == "REQUEST":
            requested.add(message.params)
        elif message.type == "CONFIRM":
            confirmed.add((message.node_id, message.params))
        elif message.type == "RESPONSE":
            assert message.params in requested
        else:
            assert (message.node_id, message.params) in confirmed


FIGURE = [
    ("REQUEST", "the master", "the skill, its parameters, the agent's id"),
    ("RESPONSE", "first", "the executor implements the action, is idle, and sends its id"),
    ("RESPONSE", "second", ""),
    ("CONFIRM", "first", "the master decides to confirm ..."),
    ("REJECT", "second", "... or to reject"),
    *[("FEEDBACK", "first", "during the execution")] * 4,
    ("FINISH", "first", "the end of the action"),
]
"""The exchange of figure 6 (Skill Execution Sequence) of the thesis, with two executors."""


def find_roles(messages: Sequence[SkillMessage]) -> list[tuple[str, str]]:
    names = {"executor 0": "first", "executor 1": "second", "master 0": "the master"}
    return [(message.type, names[message.node_id]) for message in normalise(messages)]


def test_exchange_with_two_executors_equals_figure():
    messages = run_exchange("test-skill", executors=TWO_SANE_EXECUTORS, original=False)
    assert find_roles(messages) == [(kind, role) for kind, role, _ in FIGURE]
    assert {m.params for m in messages} == {("tb3", "shelf", "cap_station")}
    assert (messages[-1].success, messages[-1].progress, messages[-1].status) == (True, 1.0, "completed")


def test_cancelled_action_ends_with_cancel_and_finish():
    messages = run_exchange("cancel", "cancel.yaml", TWO_SANE_EXECUTORS, original=False)
    kinds = find_roles(messages)
    assert kinds[:5] == [(kind, role) for kind, role, _ in FIGURE[:5]]
    assert kinds[-2:] == [("CANCEL", "first"), ("FINISH", "first")]
    assert (messages[-1].success, messages[-1].status) == (False, "CANCELLED")


def run_command(arguments, capsys):
    capsys.readouterr()
    with pytest.raises(SystemExit) as ended:
        main(arguments)
    assert ended.value.code == 0
    return capsys.readouterr().out.splitlines()


def test_command_prints_exchange(tmp_path, capsys):
    trace = tmp_path / "run.mcap"
    run(dataclasses.replace(make_options("test-skill", executors=TWO_SANE_EXECUTORS), trace=trace))
    lines = run_command(["trace", "exchange", str(trace)], capsys)
    assert re.fullmatch(
        r" +0\.000  REQUEST   move_gen\d+ -> all: move tb3 shelf cap_station, agent default", lines[0]
    )
    assert [line.split()[1] for line in lines] == [kind for kind, _, _ in FIGURE]
    rows = [json.loads(line) for line in run_command(["trace", "exchange", "--json", str(trace)], capsys)]
    assert rows[-1]["params"] == ["tb3", "shelf", "cap_station"]
    assert (rows[-1]["type"], rows[-1]["success"]) == ("FINISH", True)


def test_named_parameters_and_mapping_of_request_are_printed(tmp_path):
    from cxbridge.events import InterfaceMessage
    from cxbridge.trace.exchange_lines import exchange_lines

    values = {
        "board": "B",
        "epoch": 1,
        "master": 7,
        "agent": "r1",
        "skill": "say",
        "name": "",
        "parameters": '{"text":"hi","mapped_action":"say{}"}',
    }
    event = InterfaceMessage(0, "SkillExecutorInterface::e", "RequestMessage", 1, "B", "queued", values)
    second_request = structs.replace(event, uid="SkillExecutorInterface::f")
    unknown_finish = InterfaceMessage(
        5, "SkillBoardInterface::B", "FinishMessage", 2, "e", "queued", {"master": 9, "executor": "f"}
    )
    response_values = {"epoch": 1, "master": 7, "executor": "e"}
    response = InterfaceMessage(
        0, "SkillBoardInterface::B", "ResponseMessage", 3, "e", "queued", response_values
    )
    assert list(exchange_lines([response, event, second_request, unknown_finish])) == [
        "    0.000  REQUEST   B-7 -> all: say text=hi, agent r1, mapped to say{}",
        "    0.000  RESPONSE  B-7 <- e",
        "    0.000  FINISH    B-9 <- f: failure 0%",
    ]
