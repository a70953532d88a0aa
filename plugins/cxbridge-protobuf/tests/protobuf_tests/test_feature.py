"""The functions and facts of the feature `protobuf`."""

from __future__ import annotations

import socket
from functools import partial

import pytest

from cxbridge.config import Configuration
from cxbridge.config.checkouts import Checkouts
from cxbridge.errors import ClipsError
from cxbridge.events import Level
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.executive.host.values import ExternalAddress, Symbol
from cxbridge.executive.manager import EnvironmentManager
from cxbridge_protobuf.feature import ProtobufFeature
from cxbridge_protobuf.frames import Frame, encode_frame
from cxbridge_protobuf.settings import ProtobufSettings
from protobuf_tests.conftest import PROTOS, WAIT
from tests.blackboard.zmq.support import eventually
from tests.support import free_port

REPORT, ORDER = "test_msgs.Report", "test_msgs.Order"
NULL = ExternalAddress(0)


@pytest.fixture
def feature():
    return ProtobufFeature(ProtobufSettings((PROTOS,)))


@pytest.fixture
def pb(bus, feature, log):
    """An environment with the feature."""
    manager = EnvironmentManager(bus, [feature])
    env = manager.create("executive")
    assert manager.request("executive", "protobuf") == "TRUE"
    yield env
    manager.close()


@pytest.fixture
def raw_client(pb):
    """A bare socket that is connected to the environment's server."""
    port = free_port()
    pb.call("pb-server-enable", port)
    with socket.create_connection(("127.0.0.1", port), timeout=WAIT) as client:
        yield client


def wait_for_facts(feature, env: ClipsEnvironment, relation, count=1):
    """Run loops without rules until a relation has ``count`` facts, and return the facts' slots."""

    def has_arrived():
        feature.before_run(env)
        return len(list(env.facts(relation))) >= count

    eventually(has_arrived)
    return [slots for _, _, slots in env.facts(relation)]


def set_and_get(env, field, text):
    """Set a field of a new Report to a value in CLIPS' syntax; return the field's value."""
    env.build(f"(deffunction probe (?m) (pb-set-field ?m {field} {text}) (pb-field-value ?m {field}))")
    message = env.call("pb-create", REPORT)
    return env.call("probe", message)


# --- message types and messages


def test_create_of_unknown_type_returns_null(pb, log):
    assert pb.call("pb-create", "test_msgs.Nothing") == NULL
    assert log.texts(Level.WARN) == ["Cannot create message of type test_msgs.Nothing: Unknown message type"]


def test_type_of_subfolder_can_be_registered(bus, tmp_path):
    (tmp_path / "sub").mkdir()
    (tmp_path / "top.proto").write_text('syntax = "proto2";\nimport "sub/far.proto";\n')
    (tmp_path / "sub" / "far.proto").write_text(
        'syntax = "proto2";\nmessage Far { enum CompType { COMP_ID = 1; MSG_TYPE = 2; } }\n'
    )
    manager = EnvironmentManager(bus, [ProtobufFeature(ProtobufSettings((tmp_path,)))])
    env = manager.create("executive")
    manager.request("executive", "protobuf")
    assert env.call("pb-register-type", "Far") == "TRUE"
    manager.close()


def test_reference_shares_message_beyond_destruction(pb):
    message = pb.call("pb-create", ORDER)
    reference = pb.call("pb-ref", message)
    assert reference != message
    pb.call("pb-set-field", reference, "id", 5)
    assert pb.call("pb-field-value", message, "id") == 5
    pb.call("pb-destroy", message)
    assert pb.call("pb-field-value", reference, "id") == 5
    assert pb.call("pb-ref", message) == NULL


# --- fields


def test_fields_have_names_types_and_labels(pb):
    message = pb.call("pb-create", REPORT)
    names = pb.call("pb-field-names", message)
    assert names[:3] == ("robot", "d", "f")
    text = (
        "d=DOUBLE f=FLOAT i64=INT64 u64=UINT64 i32=INT32 x64=FIXED64 x32=FIXED32 b=BOOL robot=STRING "
        "place=MESSAGE raw=BYTES u32=UINT32 colour=ENUM sx32=SFIXED32 sx64=SFIXED64 s32=SINT32 s64=SINT64 "
        "nothing=DOES-NOT-EXIST"
    )
    kinds = dict(pair.split("=") for pair in text.split())
    assert {name: pb.call("pb-field-type", message, name) for name in kinds} == kinds
    labels = {"robot": "REQUIRED", "d": "OPTIONAL", "numbers": "REPEATED", "nothing": "DOES-NOT-EXIST"}
    assert {name: pb.call("pb-field-label", message, name) for name in labels} == labels
    lists = {"robot": "FALSE", "numbers": "TRUE", "counts": "TRUE", "nothing": "FALSE"}
    assert {name: pb.call("pb-field-is-list", message, name) for name in lists} == lists


def test_functions_report_invalid_message(pb):
    assert pb.call("pb-field-names", NULL) == ()
    for function in ("pb-field-type", "pb-field-label", "pb-field-value"):
        assert pb.call(function, NULL, "x") == Symbol("INVALID-MESSAGE")
    for function in ("pb-has-field", "pb-field-is-list"):
        assert pb.call(function, NULL, "x") == Symbol("FALSE")
    assert pb.call("pb-field-list", NULL, "x") == ("INVALID-MESSAGE",)
    pb.call("pb-set-field", NULL, "x", 1)
    pb.call("pb-add-list", NULL, "x", 1)


@pytest.mark.parametrize(
    ("field", "text", "value"),
    [
        ("d", "1.5", 1.5),
        ("d", "2", 2.0),
        ("f", "0.25", 0.25),
        ("i64", "-9223372036854775808", -(2**63)),
        ("u64", "-1", -1),
        ("x64", "7", 7),
        ("i32", "-3", -3),
        ("i32", "3.9", 3),
        ("u32", "4294967295", 2**32 - 1),
        ("x32", "5", 5),
        ("sx32", "-5", -5),
        ("sx64", "-6", -6),
        ("s32", "-7", -7),
        ("s64", "-8", -8),
        ("b", "TRUE", Symbol("TRUE")),
        ("b", '"TRUE"', Symbol("TRUE")),
        ("b", "yes", Symbol("FALSE")),
        ("robot", '"R 1"', "R 1"),
        ("robot", "R2", "R2"),
        ("colour", "GREEN", Symbol("GREEN")),
        ("colour", '"RED"', Symbol("RED")),
    ],
)
def test_field_returns_set_value(pb, field, text, value):
    result = set_and_get(pb, field, text)
    assert (result, type(result)) == (value, type(value))


@pytest.mark.parametrize(
    ("field", "text", "problem"),
    [
        ("nothing", "1", "Could not find field nothing"),
        ("i32", "4294967296", "Failed to set field i32 of test_msgs.Report"),
        ("u32", "-1", "Failed to set field u32 of test_msgs.Report"),
        ("i32", '"one"', "Failed to set field i32 of test_msgs.Report: one is not a number"),
        ("d", "one", "Failed to set field d of test_msgs.Report: one is not a number"),
        ("robot", "7", "Failed to set field robot of test_msgs.Report: 7 is not a STRING or SYMBOL"),
        ("colour", "BLUE", "test_msgs.Report: cannot set invalid enum value 'BLUE' on 'colour'"),
        ("place", "7", "Failed to set field place of test_msgs.Report: the value is not a valid message"),
        ("numbers", "7", "Failed to set field numbers of test_msgs.Report: it is a list"),
    ],
)
def test_invalid_value_is_not_set(pb, log, field, text, problem):
    message = pb.call("pb-create", REPORT)
    pb.build(f"(deffunction probe (?m) (pb-set-field ?m {field} {text}))")
    assert pb.call("probe", message) is None
    assert log.texts(Level.WARN)[0].startswith(problem)
    assert pb.call("pb-tostring", message) == ""


@pytest.mark.parametrize(
    ("field", "text", "problem"),
    [
        ("nothing", "1", ["Could not find field nothing"]),
        ("numbers", "one", ["Failed to add field numbers of test_msgs.Report: one is not a number"]),
        ("robot", "R1", ["Failed to add field robot of test_msgs.Report: it is not a list"]),
        ("colours", "BLUE", []),
        ("raws", "x", []),
    ],
)
def test_invalid_value_is_not_added(pb, log, field, text, problem):
    message = pb.call("pb-create", REPORT)
    pb.build(f"(deffunction probe (?m) (pb-add-list ?m {field} {text}))")
    assert pb.call("probe", message) is None
    assert log.texts(Level.WARN) == problem
    assert pb.call("pb-tostring", message) == ""


@pytest.mark.parametrize(
    ("field", "texts", "values"),
    [
        ("numbers", "1 -2", (1, -2)),
        ("bigs", "1 -1", (1, -1)),
        ("reals", "1.5 2", (1.5, 2.0)),
        ("names", '"a b" c', ("a b", "c")),
        ("colours", "RED GREEN", (Symbol("RED"), Symbol("GREEN"))),
        ("flags", "TRUE no", (Symbol("TRUE"), Symbol("FALSE"))),
    ],
)
def test_list_returns_added_values(pb, field, texts, values):
    message = pb.call("pb-create", REPORT)
    adds = " ".join(f"(pb-add-list ?m {field} {text})" for text in texts.replace("a b", "a\0b").split(" "))
    pb.build(f"(deffunction probe (?m) {adds})".replace("\0", " "))
    pb.call("probe", message)
    result = pb.call("pb-field-list", message, field)
    assert (result, [type(each) for each in result]) == (values, [type(each) for each in values])


def test_list_of_single_or_missing_field(pb, log):
    message = pb.call("pb-create", ORDER)
    assert pb.call("pb-field-list", message, "nothing") == ("DOES-NOT-EXIST",)
    assert pb.call("pb-field-list", message, "id") == ("NOT-SET",)
    pb.call("pb-set-field", message, "id", 3)
    assert pb.call("pb-field-list", message, "id") == (3,)
    with pytest.raises(ClipsError):
        pb.call("pb-field-value", pb.call("pb-create", REPORT), "numbers")
    assert "pb-field-list" in log.texts(Level.ERROR)[0]


def test_unset_or_unknown_field_is_warning(pb, log):
    message = pb.call("pb-create", REPORT)
    assert pb.call("pb-field-value", message, "robot") == Symbol("NOT-SET")
    assert pb.call("pb-field-value", message, "nothing") == Symbol("DOES-NOT-EXIST")
    pb.call("pb-field-value", NULL, "robot")
    assert log.texts(Level.WARN) == [
        "Field robot of test_msgs.Report not set",
        "Field nothing of test_msgs.Report does not exist",
        "Invalid message when getting robot",
    ]


def test_nested_message_is_copied_and_consumed(pb):
    report, place = pb.call("pb-create", REPORT), pb.call("pb-create", "test_msgs.Place")
    empty = pb.call("pb-field-value", report, "place")
    assert pb.call("pb-tostring", empty) == ""
    for x in (1.0, 2.0):
        place = pb.call("pb-create", "test_msgs.Place")
        pb.call("pb-set-field", place, "x", x)
        pb.call("pb-add-list", report, "places", place)
        assert pb.call("pb-field-type", place, "x") == "INVALID-MESSAGE"
    first, second = pb.call("pb-field-list", report, "places")
    pb.call("pb-set-field", report, "place", first)
    copy = pb.call("pb-field-value", report, "place")
    assert pb.call("pb-field-value", copy, "x") == 1.0
    pb.call("pb-set-field", copy, "x", 9.0)
    assert pb.call("pb-field-value", pb.call("pb-field-value", report, "place"), "x") == 1.0
    assert pb.call("pb-field-value", second, "x") == 2.0


def test_nested_message_of_wrong_type_is_refused(pb, log):
    report = pb.call("pb-create", REPORT)
    pb.call("pb-set-field", report, "place", pb.call("pb-create", ORDER))
    assert log.texts(Level.WARN) == [
        "Failed to set field place of test_msgs.Report: it takes test_msgs.Place, not test_msgs.Order"
    ]


def test_maps_are_lists_of_entries(pb):
    report = pb.call("pb-create", REPORT)
    entry = pb.call("pb-create", "test_msgs.Report.CountsEntry")
    pb.call("pb-set-field", entry, "key", "a")
    pb.call("pb-set-field", entry, "value", 7)
    pb.call("pb-add-list", report, "counts", entry)
    entry = pb.call("pb-create", "test_msgs.Report.WhereEntry")
    place = pb.call("pb-create", "test_msgs.Place")
    pb.call("pb-set-field", place, "x", 3.0)
    pb.call("pb-set-field", entry, "key", "b")
    pb.call("pb-set-field", entry, "value", place)
    pb.call("pb-add-list", report, "where", entry)
    (result,) = pb.call("pb-field-list", report, "counts")
    assert (pb.call("pb-field-value", result, "key"), pb.call("pb-field-value", result, "value")) == ("a", 7)
    (result,) = pb.call("pb-field-list", report, "where")
    assert pb.call("pb-field-value", pb.call("pb-field-value", result, "value"), "x") == 3.0


def test_bytes_have_placeholder_value(pb, feature):
    report = pb.call("pb-create", REPORT)
    feature._states["executive"]._find_message(report).raw = b"\0\1"
    feature._states["executive"]._find_message(report).raws.append(b"\0")
    pb.call("pb-set-field", report, "raw", "x")
    assert pb.call("pb-field-value", report, "raw") == "bytes"
    assert pb.call("pb-field-list", report, "raws") == (Symbol("BYTES"),)


def test_functions_accept_value_that_is_no_message(pb, log):
    pb.build("(deffunction probe (?x) (pb-destroy ?x) (pb-send 1 ?x) (pb-field-value ?x a))")
    assert pb.call("probe", 7) == "INVALID-MESSAGE"
    assert pb.faults == []


@pytest.mark.parametrize(
    ("function", "arguments", "problem"),
    [
        ("pb-create", (7,), "pb-create: argument 1 must be STRING or SYMBOL, not 7"),
        ("pb-connect", ("host", "x"), "pb-connect: argument 2 must be INTEGER, not 'x'"),
        ("pb-peer-create", ("127.0.0.1", 4444.5), "pb-peer-create: argument 2 must be INTEGER, not 4444.5"),
    ],
)
def test_argument_of_wrong_type_is_error_of_rules(pb, log, function, arguments, problem):
    # CLIPS does not check the types of variables
    names = " ".join(f"?a{number}" for number in range(len(arguments)))
    pb.build(f"(deffunction probe ({names}) ({function} {names}))")
    with pytest.raises(ClipsError):
        pb.call("probe", *arguments)
    assert problem in log.texts(Level.ERROR)
    assert pb.faults == []


# --- connections


def create_order(env, number=5):
    message = env.call("pb-create", ORDER)
    env.call("pb-set-field", message, "id", number)
    return message


def test_server_asserts_facts_and_sends_messages(pb, feature, log):
    port = free_port()
    pb.call("pb-server-enable", port)
    pb.call("pb-server-enable", port)
    with socket.create_connection(("127.0.0.1", port), timeout=WAIT) as raw_client:
        client_port = raw_client.getsockname()[1]
        (connected,) = wait_for_facts(feature, pb, "protobuf-server-client-connected")
        client, host, from_port = connected["implied"]
        assert (host, type(host), from_port) == ("127.0.0.1", Symbol, client_port)
        raw_client.sendall(encode_frame(Frame(3000, 2, b"\x08\x05")) + encode_frame(Frame(7, 8, b"")))
        (failed,) = wait_for_facts(feature, pb, "protobuf-server-receive-failed")
        assert failed == {
            "comp-id": 7,
            "msg-type": 8,
            "rcvd-via": "STREAM",
            "rcvd-from": ("127.0.0.1", client_port),
            "client-id": client,
            "message": "Message type 7:8 not registered",
        }
        (result,) = wait_for_facts(feature, pb, "protobuf-msg")
        pointer = result.pop("ptr")
        assert result == {
            "type": ORDER,
            "comp-id": 3000,
            "msg-type": 2,
            "rcvd-via": "STREAM",
            "rcvd-from": ("127.0.0.1", client_port),
            "rcvd-at": result["rcvd-at"],
            "client-type": "SERVER",
            "client-id": client,
        }
        assert pb.call("pb-field-value", pointer, "id") == 5
        pb.call("pb-send", client, create_order(pb, 6))
        assert raw_client.recv(100) == encode_frame(Frame(3000, 2, b"\x08\x06"))
    wait_for_facts(feature, pb, "protobuf-server-client-disconnected")
    pb.call("pb-server-disable")
    with pytest.raises(OSError):
        socket.create_connection(("127.0.0.1", port), timeout=WAIT).close()
    assert not log.texts(Level.WARN, Level.ERROR)


def test_unhandled_facts_and_messages_are_removed(pb, feature, raw_client, log):
    raw_client.sendall(encode_frame(Frame(3000, 2, b"\x08\x05")) + encode_frame(Frame(7, 8, b"")))
    wait_for_facts(feature, pb, "protobuf-server-receive-failed")
    pb.run()
    assert not list(pb.facts("protobuf-msg"))
    assert not list(pb.facts("protobuf-server-receive-failed"))
    assert not feature._states["executive"]._messages
    assert any("Protobuf server rcv fail for 7:8" in text for text in log.texts())


def test_reference_of_rule_keeps_message(pb, feature, raw_client):
    pb.build("(defglobal ?*kept* = 0)")
    pb.build("(defrule keep (protobuf-msg (ptr ?p)) => (bind ?*kept* (pb-ref ?p)))")
    raw_client.sendall(encode_frame(Frame(3000, 2, b"\x08\x05")))
    wait_for_facts(feature, pb, "protobuf-msg")
    pb.run()
    assert pb.call("pb-field-value", pb.eval("?*kept*"), "id") == 5


def test_client_asserts_facts_and_sends_messages(pb, feature, log):
    with socket.create_server(("127.0.0.1", 0)) as server:
        server.settimeout(WAIT)
        port = server.getsockname()[1]
        client = pb.call("pb-connect", "127.0.0.1", port)
        assert client == 1
        accepted, _ = server.accept()
        with accepted:
            (connected,) = wait_for_facts(feature, pb, "protobuf-client-connected")
            assert connected["implied"] == (client,)
            pb.call("pb-send", client, create_order(pb))
            assert accepted.recv(100) == encode_frame(Frame(3000, 2, b"\x08\x05"))
            accepted.sendall(encode_frame(Frame(7, 8, b"")) + encode_frame(Frame(3000, 2, b"")))
            (result,) = wait_for_facts(feature, pb, "protobuf-msg")
            assert (result["client-type"], result["rcvd-from"]) == ("CLIENT", ("", 0))
            (failed,) = wait_for_facts(feature, pb, "protobuf-receive-failed")
            assert (failed["client-id"], failed["rcvd-via"]) == (client, "STREAM")
            assert len(failed["rcvd-from"]) == 2
        wait_for_facts(feature, pb, "protobuf-client-disconnected")
    pb.call("pb-send", client, create_order(pb))
    assert log.texts(Level.WARN) == [
        "Failed to send message of type test_msgs.Order: Cannot send while not connected"
    ]
    pb.call("pb-disconnect", client)
    pb.call("pb-send", client, create_order(pb))
    assert pb.call("pb-connect", "127.0.0.1", 0) == 0


def test_send_without_valid_message_is_warning(pb, log):
    pb.call("pb-send", 1, NULL)
    pb.call("pb-broadcast", 1, NULL)
    pb.call("pb-send", 77, pb.call("pb-create", "test_msgs.Place"))
    assert log.texts(Level.WARN) == [
        "Cannot send to 1: invalid message",
        "Cannot send broadcast: invalid message",
        "Failed to send message of type test_msgs.Place: Message does not have CompType enum",
    ]


PEERS = {
    "pb-peer-create-local": (),
    "pb-peer-create-local-crypto": ("randomkey", "aes-256-cbc"),
}


@pytest.mark.parametrize(("function", "crypto"), PEERS.items(), ids=PEERS)
def test_peers_assert_facts_of_messages(pb, feature, function, crypto):
    first_port, second_port = free_port(socket.SOCK_DGRAM), free_port(socket.SOCK_DGRAM)
    first = pb.call(function, "127.0.0.1", first_port, second_port, *crypto)
    second = pb.call(function, "127.0.0.1", second_port, first_port, *crypto)
    assert (first, second) == (1, 2)
    pb.call("pb-broadcast", first, create_order(pb))
    pb.call("pb-send", second, create_order(pb))
    messages = wait_for_facts(feature, pb, "protobuf-msg", 2)
    assert sorted(result["client-id"] for result in messages) == [first, second]
    assert {result["rcvd-via"] for result in messages} == {"BROADCAST"}
    assert pb.call("pb-is-broadcast", messages[0]["rcvd-via"]) == "TRUE"
    assert pb.call("pb-is-broadcast", Symbol("STREAM")) == "FALSE"
    pb.call("pb-peer-destroy", first)
    pb.call("pb-peer-destroy", first)
    pb.call("pb-broadcast", first, create_order(pb))


@pytest.mark.parametrize("secret", ["", "randomkey"])
def test_peer_receives_on_single_port(pb, feature, log, secret):
    port = free_port(socket.SOCK_DGRAM)
    if secret:
        peer = pb.call("pb-peer-create-crypto", "127.0.0.1", port, secret, "aes-128-cbc")
        pb.call("pb-peer-setup-crypto", peer, "", "")
    else:
        peer = pb.call("pb-peer-create", "127.0.0.1", port)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        sender.sendto(encode_frame(Frame(3000, 2, b"")), ("127.0.0.1", port))
        (result,) = wait_for_facts(feature, pb, "protobuf-msg")
    assert result["client-type"] == "PEER"
    assert peer == result["client-id"]


def test_invalid_peer_is_error(pb, log):
    assert pb.call("pb-peer-create", "127.0.0.1", 0) == 0
    assert pb.call("pb-peer-create-local", "127.0.0.1", 70_000, 0) == 0
    assert pb.call("pb-peer-create-crypto", "127.0.0.1", 4444, "key", "rot13") == 0
    peer = pb.call("pb-peer-create", "127.0.0.1", free_port(socket.SOCK_DGRAM))
    pb.call("pb-peer-setup-crypto", peer, "key", "rot13")
    pb.call("pb-peer-setup-crypto", 99, "key", "rot13")
    texts = log.texts(Level.ERROR)
    assert len(texts) == 3
    assert "no port 70000" in texts[0]
    assert "no cipher 'rot13'" in texts[1]
    assert f"peer {peer}" in texts[2]


def test_invalid_datagram_is_in_log(pb, feature, log):
    port = free_port(socket.SOCK_DGRAM)
    pb.call("pb-peer-create", "127.0.0.1", port)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        sender.sendto(b"garbage", ("127.0.0.1", port))
        sender.sendto(encode_frame(Frame(3000, 2, b"")), ("127.0.0.1", port))
    wait_for_facts(feature, pb, "protobuf-msg")
    assert "too short for a frame" in log.texts(Level.WARN)[0]


# --- configuration


def settings(text, folder):
    expand = partial(Checkouts().expand, placeholders={"BASEDIR": "/base"}, base=folder)
    return ProtobufSettings.from_config(Configuration.from_text(text, "test.yaml"), expand)


def test_settings_come_from_configuration(tmp_path):
    loaded = settings("clips-protobuf: {proto-dirs: ['@BASEDIR@/msgs', near], server-address: '*'}", tmp_path)
    assert [str(folder) for folder in loaded.folders] == ["/base/msgs", f"{tmp_path}/near"]
    assert loaded.server_address == "*"
    assert settings("a: 1", tmp_path) == ProtobufSettings()
