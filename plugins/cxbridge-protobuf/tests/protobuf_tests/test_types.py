"""Message types from .proto files."""

from __future__ import annotations

import pytest

from cxbridge.errors import ProtobufError
from cxbridge_protobuf.frames import Frame
from cxbridge_protobuf.types import MessageTypes, make_frame, message_numbers
from protobuf_tests.conftest import PROTOS
from tests.support import ROBOTINO_DIR


def read_types(*folders):
    problems: list[str] = []
    types = MessageTypes(problems.append)
    types.add_folders(folders)
    return types, problems


def test_types_with_numbers_are_registered(types):
    report = types.create("test_msgs.Report")
    report.robot = "r2"
    frame = make_frame(report)
    assert (frame.component, frame.type) == (3000, 1)
    assert types.parse(frame) == report


@pytest.mark.parametrize(
    ("name", "problem"),
    [
        ("test_msgs.Report", "Message type 3000:1 already registered"),
        ("test_msgs.Place", "CompType"),
        ("test_msgs.Nothing", "Unknown message type"),
    ],
)
def test_invalid_type_cannot_be_registered(types, name, problem):
    with pytest.raises(ProtobufError, match=problem):
        types.register(name)


@pytest.mark.parametrize(
    ("frame", "problem"),
    [
        (Frame(3000, 9, b""), "Message type 3000:9 not registered"),
        (Frame(3000, 1, b"\xff\xff"), "Failed to parse"),
        (Frame(3000, 1, b""), "required"),
    ],
)
def test_invalid_frame_is_no_message(types, frame, problem):
    with pytest.raises(ProtobufError, match=problem):
        types.parse(frame)


def test_message_without_required_fields_cannot_be_sent(types):
    with pytest.raises(ProtobufError, match="robot"):
        make_frame(types.create("test_msgs.Report"))


def test_broken_file_is_problem_with_line(tmp_path):
    (tmp_path / "broken.proto").write_text('syntax = "proto2";\nmessage M {\n  optional strin name = 1;\n}\n')
    types, problems = read_types(tmp_path, PROTOS)
    (problem,) = problems
    assert "broken.proto:3" in problem
    assert types.create("test_msgs.Order").DESCRIPTOR.name == "Order"


@pytest.mark.parametrize(
    ("numbers", "names", "expected"),
    [("1", "AB", "1:2 already registered"), ("70000", "A", "invalid COMP_ID")],
)
def test_duplicate_or_large_numbers_are_refused(tmp_path, numbers, names, expected):
    body = f"{{ enum CompType {{ COMP_ID = {numbers}; MSG_TYPE = 2; }} }}"
    messages = "\n".join(f"message {name} {body}" for name in names)
    (tmp_path / "some.proto").write_text(f'syntax = "proto2";\n{messages}\n')
    _, (problem,) = read_types(tmp_path)
    assert expected in problem


def test_missing_folder_is_problem(tmp_path):
    _, problems = read_types(tmp_path / "nowhere")
    assert "nowhere" in problems[0]


def test_folder_imports_from_second_folder(tmp_path):
    for name, folder in (("common.proto", "one"), ("report.proto", "two")):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / name).write_text((PROTOS / name).read_text())
    types, problems = read_types(tmp_path / "one", tmp_path / "two")
    assert not problems
    assert types.create("test_msgs.Place").DESCRIPTOR.full_name == "test_msgs.Place"


@pytest.mark.skipif(ROBOTINO_DIR is None, reason="ROBOTINO_DIR names no checkout of the RCLL agent")
def test_messages_of_league_are_registered():
    assert ROBOTINO_DIR is not None
    types, problems = read_types(ROBOTINO_DIR / "src/agents/llsf2013/msgs")
    assert not problems
    beacon = types.create("llsf_msgs.BeaconSignal")
    assert message_numbers(beacon.DESCRIPTOR) == (2000, 1)
