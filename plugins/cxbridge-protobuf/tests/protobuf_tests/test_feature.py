"""The feature `protobuf` as rules see it."""

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
def stranger(pb):
    """A client that has connected to the server of the environment by hand."""
    port = free_port()
    pb.call("pb-server-enable", port)
    with socket.create_connection(("127.0.0.1", port), timeout=WAIT) as client:
        yield client


def arrive(feature, env: ClipsEnvironment, relation, count=1):
    """Let loops pass until this many facts of a relation came; rules do not run."""

    def there():
        feature.before_run(env)
        return len(list(env.facts(relation))) >= count

    eventually(there)
    return [slots for _, _, slots in env.facts(relation)]


def set_and_get(env, field, text):
    """Set a field of a new Report to CLIPS' value of the text; return the field's value."""
    env.build(f"(deffunction probe (?m) (pb-set-field ?m {field} {text}) (pb-field-value ?m {field}))")
    message = env.call("pb-create", REPORT)
    return env.call("probe", message)


# --- message types and messages


def test_create_of_an_unknown_type(pb, log):
    assert pb.call("pb-create", "test_msgs.Nothing") == NULL
    assert log.texts(Level.WARN) == ["Cannot create message of type test_msgs.Nothing: Unknown message type"]


def test_a_type_of_a_subfolder_is_registered_by_hand(bus, tmp_path):
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


def test_a_reference_is_the_same_message_and_lives_on(pb):
    message = pb.call("pb-create", ORDER)
    other = pb.call("pb-ref", message)
    assert other != message
    pb.call("pb-set-field", other, "id", 5)
    assert pb.call("pb-field-value", message, "id") == 5
    pb.call("pb-destroy", message)
    assert pb.call("pb-field-value", other, "id") == 5
    assert pb.call("pb-ref", message) == NULL


# --- fields


def test_what_is_told_of_fields(pb):
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


def test_what_is_told_of_no_message(pb):
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
def test_a_value_that_is_set_is_the_value_one_gets(pb, field, text, value):
    got = set_and_get(pb, field, text)
    assert (got, type(got)) == (value, type(value))


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
def test_a_value_that_cannot_be_set_changes_nothing(pb, log, field, text, problem):
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
def test_a_value_that_cannot_be_added_changes_nothing(pb, log, field, text, problem):
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
def test_lists(pb, field, texts, values):
    message = pb.call("pb-create", REPORT)
    adds = " ".join(f"(pb-add-list ?m {field} {text})" for text in texts.replace("a b", "a\0b").split(" "))
    pb.build(f"(deffunction probe (?m) {adds})".replace("\0", " "))
    pb.call("probe", message)
    got = pb.call("pb-field-list", message, field)
    assert (got, [type(each) for each in got]) == (values, [type(each) for each in values])


def test_a_list_of_a_field_that_is_none(pb, log):
    message = pb.call("pb-create", ORDER)
    assert pb.call("pb-field-list", message, "nothing") == ("DOES-NOT-EXIST",)
    assert pb.call("pb-field-list", message, "id") == ("NOT-SET",)
    pb.call("pb-set-field", message, "id", 3)
    assert pb.call("pb-field-list", message, "id") == (3,)
    with pytest.raises(ClipsError):
        pb.call("pb-field-value", pb.call("pb-create", REPORT), "numbers")
    assert "pb-field-list" in log.texts(Level.ERROR)[0]


def test_fields_that_are_not_set(pb, log):
    message = pb.call("pb-create", REPORT)
    assert pb.call("pb-field-value", message, "robot") == Symbol("NOT-SET")
    assert pb.call("pb-field-value", message, "nothing") == Symbol("DOES-NOT-EXIST")
    pb.call("pb-field-value", NULL, "robot")
    assert log.texts(Level.WARN) == [
        "Field robot of test_msgs.Report not set",
        "Field nothing of test_msgs.Report does not exist",
        "Invalid message when getting robot",
    ]


def test_messages_in_messages_are_copied_and_used_up(pb):
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


def test_a_message_of_another_type_is_refused(pb, log):
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
    (got,) = pb.call("pb-field-list", report, "counts")
    assert (pb.call("pb-field-value", got, "key"), pb.call("pb-field-value", got, "value")) == ("a", 7)
    (got,) = pb.call("pb-field-list", report, "where")
    assert pb.call("pb-field-value", pb.call("pb-field-value", got, "value"), "x") == 3.0


def test_bytes_are_only_named(pb, feature):
    report = pb.call("pb-create", REPORT)
    feature._states["executive"]._find_message(report).raw = b"\0\1"
    feature._states["executive"]._find_message(report).raws.append(b"\0")
    pb.call("pb-set-field", report, "raw", "x")
    assert pb.call("pb-field-value", report, "raw") == "bytes"
    assert pb.call("pb-field-list", report, "raws") == (Symbol("BYTES"),)


def test_things_that_are_no_messages_are_no_messages(pb, log):
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
def test_a_value_of_the_wrong_type_is_told_as_the_users_mistake(pb, log, function, arguments, problem):
    # CLIPS itself does not check the types of variables
    names = " ".join(f"?a{number}" for number in range(len(arguments)))
    pb.build(f"(deffunction probe ({names}) ({function} {names}))")
    with pytest.raises(ClipsError):
        pb.call("probe", *arguments)
    assert problem in log.texts(Level.ERROR)
    assert pb.faults == []


# --- connections


def order(env, number=5):
    message = env.call("pb-create", ORDER)
    env.call("pb-set-field", message, "id", number)
    return message


def test_the_server_and_its_facts(pb, feature, log):
    port = free_port()
    pb.call("pb-server-enable", port)
    pb.call("pb-server-enable", port)
    with socket.create_connection(("127.0.0.1", port), timeout=WAIT) as stranger:
        local = stranger.getsockname()[1]
        (connected,) = arrive(feature, pb, "protobuf-server-client-connected")
        client, host, from_port = connected["implied"]
        assert (host, type(host), from_port) == ("127.0.0.1", Symbol, local)
        stranger.sendall(encode_frame(Frame(3000, 2, b"\x08\x05")) + encode_frame(Frame(7, 8, b"")))
        (failed,) = arrive(feature, pb, "protobuf-server-receive-failed")
        assert failed == {
            "comp-id": 7,
            "msg-type": 8,
            "rcvd-via": "STREAM",
            "rcvd-from": ("127.0.0.1", local),
            "client-id": client,
            "message": "Message type 7:8 not registered",
        }
        (got,) = arrive(feature, pb, "protobuf-msg")
        pointer = got.pop("ptr")
        assert got == {
            "type": ORDER,
            "comp-id": 3000,
            "msg-type": 2,
            "rcvd-via": "STREAM",
            "rcvd-from": ("127.0.0.1", local),
            "rcvd-at": got["rcvd-at"],
            "client-type": "SERVER",
            "client-id": client,
        }
        assert pb.call("pb-field-value", pointer, "id") == 5
        pb.call("pb-send", client, order(pb, 6))
        assert stranger.recv(100) == encode_frame(Frame(3000, 2, b"\x08\x06"))
    arrive(feature, pb, "protobuf-server-client-disconnected")
    pb.call("pb-server-disable")
    with pytest.raises(OSError):
        socket.create_connection(("127.0.0.1", port), timeout=WAIT).close()
    assert not log.texts(Level.WARN, Level.ERROR)


def test_what_nobody_wants_is_cleaned_up(pb, feature, stranger, log):
    stranger.sendall(encode_frame(Frame(3000, 2, b"\x08\x05")) + encode_frame(Frame(7, 8, b"")))
    arrive(feature, pb, "protobuf-server-receive-failed")
    pb.run()
    assert not list(pb.facts("protobuf-msg"))
    assert not list(pb.facts("protobuf-server-receive-failed"))
    assert not feature._states["executive"]._messages
    assert any("Protobuf server rcv fail for 7:8" in text for text in log.texts())


def test_a_rule_that_takes_a_reference_keeps_the_message(pb, feature, stranger):
    pb.build("(defglobal ?*kept* = 0)")
    pb.build("(defrule keep (protobuf-msg (ptr ?p)) => (bind ?*kept* (pb-ref ?p)))")
    stranger.sendall(encode_frame(Frame(3000, 2, b"\x08\x05")))
    arrive(feature, pb, "protobuf-msg")
    pb.run()
    assert pb.call("pb-field-value", pb.eval("?*kept*"), "id") == 5


def test_a_client_and_its_facts(pb, feature, log):
    with socket.create_server(("127.0.0.1", 0)) as server:
        server.settimeout(WAIT)
        port = server.getsockname()[1]
        client = pb.call("pb-connect", "127.0.0.1", port)
        assert client == 1
        accepted, _ = server.accept()
        with accepted:
            (connected,) = arrive(feature, pb, "protobuf-client-connected")
            assert connected["implied"] == (client,)
            pb.call("pb-send", client, order(pb))
            assert accepted.recv(100) == encode_frame(Frame(3000, 2, b"\x08\x05"))
            accepted.sendall(encode_frame(Frame(7, 8, b"")) + encode_frame(Frame(3000, 2, b"")))
            (got,) = arrive(feature, pb, "protobuf-msg")
            assert (got["client-type"], got["rcvd-from"]) == ("CLIENT", ("", 0))
            (failed,) = arrive(feature, pb, "protobuf-receive-failed")
            assert (failed["client-id"], failed["rcvd-via"]) == (client, "STREAM")
            assert len(failed["rcvd-from"]) == 2
        arrive(feature, pb, "protobuf-client-disconnected")
    pb.call("pb-send", client, order(pb))
    assert log.texts(Level.WARN) == [
        "Failed to send message of type test_msgs.Order: Cannot send while not connected"
    ]
    pb.call("pb-disconnect", client)
    pb.call("pb-send", client, order(pb))
    assert pb.call("pb-connect", "127.0.0.1", 0) == 0


def test_sending_no_message(pb, log):
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
def test_peers_and_their_facts(pb, feature, function, crypto):
    one, two = free_port(socket.SOCK_DGRAM), free_port(socket.SOCK_DGRAM)
    first = pb.call(function, "127.0.0.1", one, two, *crypto)
    second = pb.call(function, "127.0.0.1", two, one, *crypto)
    assert (first, second) == (1, 2)
    pb.call("pb-broadcast", first, order(pb))
    pb.call("pb-send", second, order(pb))
    messages = arrive(feature, pb, "protobuf-msg", 2)
    assert sorted(got["client-id"] for got in messages) == [first, second]
    assert {got["rcvd-via"] for got in messages} == {"BROADCAST"}
    assert pb.call("pb-is-broadcast", messages[0]["rcvd-via"]) == "TRUE"
    assert pb.call("pb-is-broadcast", Symbol("STREAM")) == "FALSE"
    pb.call("pb-peer-destroy", first)
    pb.call("pb-peer-destroy", first)
    pb.call("pb-broadcast", first, order(pb))


@pytest.mark.parametrize("secret", ["", "randomkey"])
def test_a_peer_on_one_port(pb, feature, log, secret):
    port = free_port(socket.SOCK_DGRAM)
    if secret:
        peer = pb.call("pb-peer-create-crypto", "127.0.0.1", port, secret, "aes-128-cbc")
        pb.call("pb-peer-setup-crypto", peer, "", "")
    else:
        peer = pb.call("pb-peer-create", "127.0.0.1", port)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.sendto(encode_frame(Frame(3000, 2, b"")), ("127.0.0.1", port))
        (got,) = arrive(feature, pb, "protobuf-msg")
    assert got["client-type"] == "PEER"
    assert peer == got["client-id"]


def test_peers_that_cannot_be(pb, log):
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


def test_what_strangers_did_is_in_the_log(pb, feature, log):
    port = free_port(socket.SOCK_DGRAM)
    pb.call("pb-peer-create", "127.0.0.1", port)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.sendto(b"rubbish", ("127.0.0.1", port))
        other.sendto(encode_frame(Frame(3000, 2, b"")), ("127.0.0.1", port))
    arrive(feature, pb, "protobuf-msg")
    assert "too short for a frame" in log.texts(Level.WARN)[0]


# --- configuration


def settings(text, folder):
    expand = partial(Checkouts().expand, placeholders={"BASEDIR": "/base"}, base=folder)
    return ProtobufSettings.from_config(Configuration.from_text(text, "test.yaml"), expand)


def test_the_settings(tmp_path):
    read = settings("clips-protobuf: {proto-dirs: ['@BASEDIR@/msgs', near], server-address: '*'}", tmp_path)
    assert [str(folder) for folder in read.folders] == ["/base/msgs", f"{tmp_path}/near"]
    assert read.server_address == "*"
    assert settings("a: 1", tmp_path) == ProtobufSettings()
