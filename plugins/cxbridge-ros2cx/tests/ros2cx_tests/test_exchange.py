"""Masters and executors exchange the messages of the thesis' recordings here, one by one."""

from __future__ import annotations

import dataclasses
import json
import re
from collections.abc import Iterable, Sequence

import pytest
from msgspec import structs

from cxbridge.cli.main import main
from cxbridge.history.exchange import Exchange, SkillMessage
from ros2cx_tests.rows import run
from ros2cx_tests.test_recordings import DATA, RECORDINGS, options
from tests.support import needs_ros2cx, needs_shared

pytestmark = needs_ros2cx

TWO = ("move=cxbridge_ros2cx.executors:ThesisDummyExecutor",) * 2
SANE_TWO = ("move=cxbridge_ros2cx.executors:DummyExecutor",) * 2
EXECUTORS_SAY = ("RESPONSE", "FEEDBACK", "FINISH")


def exchanged(
    spec: str, overlay: str | None = None, executors: tuple[str, ...] = (), *, original: bool = True
) -> list[SkillMessage]:
    """The messages of a run of ours."""
    chosen = options(spec, None, executors)
    files = [DATA / name for name in (overlay, "original.yaml" if original else None) if name]
    watched = run(dataclasses.replace(chosen, config=tuple(files)))
    return [message for message, _ in Exchange().read(watched.messages)]


def recorded(name: str) -> list[SkillMessage]:
    """The messages of a recording."""
    found = []
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
            found.append(SkillMessage(0, params=tuple(row["params"]), **{name: row[name] for name in names}))
    return found


def plain(messages: Iterable[SkillMessage]) -> list[SkillMessage]:
    """Without times and requests, which only ours record; ids by the order in which they appear."""
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


def by_sender(messages: Sequence[SkillMessage]) -> dict[str, list[SkillMessage]]:
    """What each node has sent, in order: all that a third node can know of the order on a topic.

    The master confirms in the order in which it gets to know of answers, so that order is left out.
    """
    sent: dict[str, list[SkillMessage]] = {}
    for message in messages:
        sender = message.node_id if message.type in EXECUTORS_SAY else "master"
        sent.setdefault(sender, []).append(message)
    sent["master"].sort(key=lambda m: (m.params, ["REQUEST", "CONFIRM", "CANCEL"].index(m.type), m.node_id))
    return sent


@needs_shared
@pytest.mark.parametrize(
    ("recording", "spec", "overlay", "executors"),
    [
        ("nav2", "test-nav2", "nav2.yaml", ()),
        ("nav2-fixed", "fixed", "fixed.yaml", ()),
        ("two-executors", "fixed", "two-executors.yaml", TWO),
        ("skill", "test-skill", None, ()),
        ("cancel", "cancel", "cancel.yaml", (f"move={DATA / 'slow.py'}:Slow",)),
        ("fail", "fixed", "fixed.yaml", (f"move={DATA / 'door.py'}:Door",)),
        ("no-plan", "test-nav2", "no-plan.yaml", ()),
        ("tree", "tree", "tree.yaml", ()),
    ],
)
def test_the_messages_are_those_of_the_recording(recording, spec, overlay, executors):
    there, ours = plain(recorded(recording)), plain(exchanged(spec, overlay, executors))
    assert bool(there) == (recording not in ("no-plan", "tree"))
    if there:
        assert by_sender(ours) == by_sender(there)
    else:
        assert ours == []
    assert_causal(ours)


def assert_causal(messages: Sequence[SkillMessage]) -> None:
    """No executor answers before the question, and none begins before it is confirmed."""
    asked: set[tuple[str, ...]] = set()
    confirmed: set[tuple[str, tuple[str, ...]]] = set()
    for message in messages:
        if message.type == "REQUEST":
            asked.add(message.params)
        elif message.type == "CONFIRM":
            confirmed.add((message.node_id, message.params))
        elif message.type == "RESPONSE":
            assert message.params in asked
        else:
            assert (message.node_id, message.params) in confirmed


FIGURE = [
    ("REQUEST", "the master", "the skill, its parameters, the agent's id"),
    ("RESPONSE", "first", "it implements the action, is idle, tells its id"),
    ("RESPONSE", "second", ""),
    ("CONFIRM", "first", "the master decides to confirm ..."),
    ("REJECT", "second", "... or to reject"),
    *[("FEEDBACK", "first", "while it executes")] * 4,
    ("FINISH", "first", "how it ended"),
]
"""The exchange of figure 6 (Skill Execution Sequence), with two executors; the thesis lists its steps."""


def roles(messages: Sequence[SkillMessage]) -> list[tuple[str, str]]:
    names = {"executor 0": "first", "executor 1": "second", "master 0": "the master"}
    return [(message.type, names[message.node_id]) for message in plain(messages)]


def test_the_exchange_of_one_action_with_two_executors_is_that_of_the_figure():
    messages = exchanged("test-skill", executors=SANE_TWO, original=False)
    assert roles(messages) == [(kind, who) for kind, who, _ in FIGURE]
    assert {m.params for m in messages} == {("tb3", "shelf", "cap_station")}
    assert (messages[-1].success, messages[-1].progress, messages[-1].status) == (True, 1.0, "completed")


def test_a_cancelled_action_ends_with_cancel_and_finish():
    messages = exchanged("cancel", "cancel.yaml", SANE_TWO, original=False)
    kinds = roles(messages)
    assert kinds[:5] == [(kind, who) for kind, who, _ in FIGURE[:5]]
    assert kinds[-2:] == [("CANCEL", "first"), ("FINISH", "first")]
    assert (messages[-1].success, messages[-1].status) == (False, "CANCELLED")


def printed(arguments, capsys):
    capsys.readouterr()
    with pytest.raises(SystemExit) as ended:
        main(arguments)
    assert ended.value.code == 0
    return capsys.readouterr().out.splitlines()


def test_the_command_prints_the_exchange(tmp_path, capsys):
    trace = tmp_path / "run.mcap"
    run(dataclasses.replace(options("test-skill", executors=SANE_TWO), trace=trace))
    lines = printed(["trace", "exchange", str(trace)], capsys)
    assert re.fullmatch(
        r" +0\.000  REQUEST   move_gen\d+ -> all: move tb3 shelf cap_station, agent default", lines[0]
    )
    assert [line.split()[1] for line in lines] == [kind for kind, _, _ in FIGURE]
    rows = [json.loads(line) for line in printed(["trace", "exchange", "--json", str(trace)], capsys)]
    assert rows[-1]["params"] == ["tb3", "shelf", "cap_station"]
    assert (rows[-1]["type"], rows[-1]["success"]) == ("FINISH", True)


def test_a_request_with_names_and_a_mapping_is_printed_whole(tmp_path):
    from cxbridge.events import InterfaceMessage
    from cxbridge.trace.exchange import exchange_lines

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
    again = structs.replace(event, uid="SkillExecutorInterface::f")
    late = InterfaceMessage(
        5, "SkillBoardInterface::B", "FinishMessage", 2, "e", "queued", {"master": 9, "executor": "f"}
    )
    answered = {"epoch": 1, "master": 7, "executor": "e"}
    early = InterfaceMessage(0, "SkillBoardInterface::B", "ResponseMessage", 3, "e", "queued", answered)
    assert list(exchange_lines([early, event, again, late])) == [
        "    0.000  REQUEST   B-7 -> all: say text=hi, agent r1, mapped to say{}",
        "    0.000  RESPONSE  B-7 <- e",
        "    0.000  FINISH    B-9 <- f: failure 0%",
    ]
