"""Rights of clients are equal on every way in; the table has every operation."""

from __future__ import annotations

import http.client
import json
from collections.abc import Iterator
from contextlib import ExitStack, closing, contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any, get_args

import pytest

from cxbridge.blackboard import BlackBoard
from cxbridge.blackboard.errors import BlackBoardError
from cxbridge.blackboard.kit.errors import RemoteRefusalError
from cxbridge.blackboard.urls import open_blackboard
from cxbridge.blackboard.zmq.wire.frames import ClientFrame
from cxbridge.clock import RealClock
from cxbridge.daemon.client import ask_why, read_status, request
from cxbridge.daemon.interfaces import COMMANDS
from cxbridge.daemon.operations.table import verbs
from cxbridge.errors import ClipsError, ConfigError, CxbridgeError
from cxbridge.executive.host.facts.constants import parse_constant_fact, to_safe_values_text
from cxbridge.interfaces import InterfaceRegistry
from cxbridge.interfaces.registry import default_registry
from cxbridge.rights import FRAME_RIGHTS, MESSAGE_RIGHTS, Right, Rights, right_of_message
from tests.daemon.test_daemon import WAIT_S, running, settings
from tests.fawkes import ANY_PORT
from tests.run.mini import write_scenario
from tests.support import needs_plugin

if TYPE_CHECKING:
    from cxbridge_web.endpoint import Endpoint


HAS_WEB = find_spec("cxbridge_web") is not None

# A copy, so that no right changes by accident.
REST = {
    "POST /cxbridge/pause": Right.CONTROL,
    "POST /cxbridge/resume": Right.CONTROL,
    "POST /cxbridge/reset": Right.CONTROL,
    "POST /cxbridge/interrupt": Right.CONTROL,
    "POST /cxbridge/facts": Right.CONTROL,
    "PATCH /cxbridge/facts/{index}": Right.CONTROL,
    "DELETE /cxbridge/facts/{index}": Right.CONTROL,
    "POST /cxbridge/blackboard/{type}/{id+}/messages": Right.CONTROL,
    "POST /cxbridge/debugger/breakpoints": Right.CONTROL,
    "DELETE /cxbridge/debugger/breakpoints/{number}": Right.CONTROL,
    "DELETE /cxbridge/debugger/breakpoints": Right.CONTROL,
    "POST /cxbridge/debugger/step": Right.CONTROL,
    "POST /cxbridge/debugger/stop": Right.CONTROL,
    "POST /cxbridge/debugger/go-on": Right.CONTROL,
    "POST /cxbridge/environments": Right.CONTROL,
    "DELETE /cxbridge/environments/{env}": Right.CONTROL,
    "POST /cxbridge/environments/{env}/load": Right.PROGRAMS,
    "POST /cxbridge/environments/{env}/features": Right.CONTROL,
    "PUT /cxbridge/components/{component}": Right.CONTROL,
    "PUT /cxbridge/environments/{env}/watch": Right.CONTROL,
    "PUT /cxbridge/environments/{env}/log": Right.CONTROL,
    "POST /cxbridge/environments/{env}/eval": Right.PROGRAMS,
    "POST /skiller/call": Right.CONTROL,
    "DELETE /skiller/skills/{id}": Right.CONTROL,
    "PUT /plugins/{name}": Right.CONTROL,
}

ASK = {
    "break-list": Right.LOOK,
    "where": Right.LOOK,
    "state": Right.LOOK,
    "facts": Right.LOOK,
    "find-facts": Right.LOOK,
    "agenda": Right.LOOK,
    "env-list": Right.LOOK,
    "feature-list": Right.LOOK,
    "component-list": Right.LOOK,
    "break-add": Right.CONTROL,
    "break-remove": Right.CONTROL,
    "step": Right.CONTROL,
    "stop": Right.CONTROL,
    "go-on": Right.CONTROL,
    "assert": Right.CONTROL,
    "retract": Right.CONTROL,
    "modify": Right.CONTROL,
    "env-create": Right.CONTROL,
    "env-destroy": Right.CONTROL,
    "env-feature": Right.CONTROL,
    "component-change": Right.CONTROL,
    "env-watch": Right.CONTROL,
    "env-log": Right.CONTROL,
    "env-load": Right.PROGRAMS,
    "env-eval": Right.PROGRAMS,
}

TALKATIVE = """
(deftemplate battery (slot level) (multislot cells))
(deffacts begin (battery (level 3) (cells 1 2)))
"""


# -- the table


def endpoints() -> tuple[Endpoint, ...]:
    from cxbridge_web.endpoint_table import make_endpoint_table

    return make_endpoint_table().endpoints


def right_of_request(method: str, path: str, rights: Rights | None = None) -> Right:
    """The right that a request needs; an unknown request needs the highest right."""
    from cxbridge_web.endpoint import Endpoint

    known = {(endpoint.method, endpoint.path): endpoint for endpoint in endpoints()}
    unknown = Endpoint(method=method, path=path, handler=lambda _call: None, summary="")
    return known.get((method, path), unknown).needed_right(rights or Rights())


@needs_plugin("studio")
@needs_plugin("web")
def test_every_http_request_has_right():
    assert len(endpoints()) > 60
    needed = {
        f"{endpoint.method} {endpoint.path}": endpoint.needed_right(Rights()) for endpoint in endpoints()
    }
    assert {way: right for way, right in needed.items() if right is not Right.LOOK} == REST
    assert all(right is not Right.LOOK for way, right in needed.items() if not way.startswith("GET "))


@needs_plugin("studio")
def test_every_verb_has_right():
    assert dict(verbs()) == ASK


def test_every_frame_of_client_has_right():
    assert {kind.__name__.lower() for kind in get_args(ClientFrame)} == set(FRAME_RIGHTS["zmq"])


def test_every_message_of_blackboard_needs_right():
    looks = set()
    for name in default_registry().names():
        for message in default_registry().schema(name).messages:
            if right_of_message(name, message.name) is Right.LOOK:
                looks.add((name, message.name))
    assert looks == set(MESSAGE_RIGHTS)
    assert all(right_of_message("DaemonInterface", message) is Right.CONTROL for message in COMMANDS)


@needs_plugin("web")
def test_unknown_http_request_needs_highest_right():
    assert right_of_request("POST", "/new") is Right.PROGRAMS


def test_unknown_messages_and_frames_are_refused():
    assert right_of_message("NewInterface", "AnyMessage") is Right.CONTROL
    rights = Rights(control=False, programs=True)
    assert [right for right in Right if rights.allows(right)] == [Right.LOOK]


# -- the settings


@pytest.mark.parametrize(
    ("text", "programs"),
    [
        ("a: 1", True),
        ("cxbridge: {remote-control: false}", False),
        ("cxbridge: {remote-programs: false}", False),
        ("cxbridge: {zmq: {endpoints: ['tcp://0.0.0.0:1911']}}", False),
        ("cxbridge: {zmq: {endpoints: ['tcp://robot:1911', 'ipc:///tmp/x']}}", False),
        ("cxbridge: {zmq: {endpoints: ['ipc:///tmp/x', 'tcp://[::1]:1911']}}", True),
        ("cxbridge: {zmq: {endpoints: ['tcp://*:1911']}}", False),
        pytest.param("cxbridge: {web: {port: 0}}", True, marks=needs_plugin("web")),
        ("cxbridge: {zmq: {endpoints: ['ipc://@x'], insecure: true}}", False),
        pytest.param(
            "cxbridge: {foxglove: {host: 0.0.0.0, insecure: true}}", False, marks=needs_plugin("web")
        ),
        pytest.param("cxbridge: {foxglove: {port: 0}}", True, marks=needs_plugin("web")),
        pytest.param("ros2: {node: {transport: dds, reach: localhost}}", True, marks=needs_plugin("ros2")),
        pytest.param("ros2: {node: {transport: dds, reach: subnet}}", False, marks=needs_plugin("ros2")),
        pytest.param("ros2: {tf: {transport: dds, reach: subnet}}", False, marks=needs_plugin("ros2")),
        pytest.param("ros2: {tf: {use_tf2: true}}", True, marks=needs_plugin("ros2")),
        pytest.param("ros2: {clock: {transport: dds, reach: subnet}}", True, marks=needs_plugin("ros2")),
        pytest.param("ros2: {experts: {transport: rosbridge}}", False, marks=needs_plugin("ros2")),
        pytest.param(
            "ros2: {interfaces: {a: {reach: 'off'}, b: {reach: system_default}}}",
            False,
            marks=needs_plugin("ros2"),
        ),
        pytest.param("ros2: {performers: {hub: {reach: 'off'}}}", True, marks=needs_plugin("ros2")),
    ],
)
def test_programs_are_off_beyond_loopback(text, programs, monkeypatch):
    for name in ("CYCLONEDDS_URI", "ROS_LOCALHOST_ONLY", "ROS_AUTOMATIC_DISCOVERY_RANGE"):
        monkeypatch.delenv(name, raising=False)
    assert settings(text).rights.programs is programs


@needs_plugin("ros2")
def test_configuration_of_cyclone_dds_turns_programs_off(monkeypatch):
    monkeypatch.setenv("CYCLONEDDS_URI", "file:///there.xml")
    assert settings("ros2: {node: {transport: dds, reach: localhost}}").rights.programs is False


@pytest.mark.parametrize(
    "skiller",
    [
        "skiller: {mode: fawkes}",
        "skiller: {instances: {arm: {mode: fawkes}}}",
        "cxbridge/skiller: 'fawkes://robot'",
    ],
)
def test_evaluated_skill_string_is_program(skiller):
    """With ``mode: fawkes`` a client without the right for programs could send a program as skill string."""
    rights = settings(f"cxbridge/remote-programs: false\n{skiller}").rights
    with pytest.raises(CxbridgeError, match="ExecSkillMessage"):
        rights.check_message("SkillerInterface", "ExecSkillMessage")
    if HAS_WEB:
        assert right_of_request("POST", "/skiller/call", rights) is Right.PROGRAMS
    rights.check_message("SkillerInterface", "StopExecMessage")


def test_parsed_skill_string_is_no_program():
    rights = settings("cxbridge: {remote-programs: false}").rights
    rights.check_message("SkillerInterface", "ExecSkillMessage")
    if HAS_WEB:
        assert right_of_request("POST", "/skiller/call", rights) is Right.CONTROL


def test_programs_without_control_are_an_error():
    with pytest.raises(ConfigError, match="clients that may run programs must be able to change state"):
        settings("cxbridge: {remote-programs: true, remote-control: false}")


# -- a daemon on all ways in


@contextmanager
def served(tmp_path: Path, **given: bool) -> Iterator[tuple[Any, list[str], Path]]:
    """A daemon with all servers, its log, and the path of a file that only an attack makes."""
    config = write_scenario(tmp_path / "mini", agent=TALKATIVE)
    ways: Any = (
        ("zmq/endpoints", [f"ipc://{tmp_path}/bb"]),
        *ANY_PORT,
        *((("web/enable", True), ("web/port", 0)) if HAS_WEB else ()),
        *((name.replace("_", "-"), value) for name, value in given.items()),
    )
    with running(config=config, settings=ways) as (daemon, lines, _):
        yield daemon, lines, tmp_path / "MARKER"


def boards(daemon: Any, stack: ExitStack) -> list[BlackBoard]:
    """The daemon's blackboard over ZeroMQ and over Fawkes' port."""
    return [
        stack.enter_context(open_blackboard(url, InterfaceRegistry(), RealClock()))
        for url in daemon.endpoints
        if not url.startswith("http")
    ]


def rest(daemon: Any, method: str, path: str, body: object = None) -> tuple[int, str]:
    """Send a request over HTTP, without our client."""
    port = int(daemon.endpoints[-1].rpartition(":")[2])
    with closing(http.client.HTTPConnection("127.0.0.1", port, timeout=WAIT_S)) as connection:
        headers = {"Content-Type": "application/json"} if body is not None else {}
        connection.request(method, f"/api{path}", None if body is None else json.dumps(body), headers)
        reply = connection.getresponse()
        return reply.status, reply.read().decode()


def body_for(path: str, marker: Path) -> dict[str, Any]:
    return {
        "fact": f'(x (system "touch {marker}"))',
        "slots": {"level": f'(system "touch {marker}")'},
        "spec": f'rule:* if (system "touch {marker}")',
        "expression": f'(system "touch {marker}")',
        "file": str(marker),
        "what": "rule",
        "name": "x",
        "feature": "config",
        "item": "facts",
        "level": "info",
        "transition": "shutdown",
        "type": "Pause",
        "desired_state": "UNLOADED" if "plugins" in path else "LOADED",
        "skill_string": "say{text='x'}",
    }


@needs_plugin("studio")
def test_clients_without_control_change_no_state(tmp_path):
    with served(tmp_path, remote_control=False) as (daemon, _lines, marker), ExitStack() as stack:
        for way in REST if HAS_WEB else ():
            method, path = way.split()
            path = (
                path.replace("{type}/{id+}", "DaemonInterface/cxbridge")
                .replace("{env}", "executive")
                .replace("{index}", "1")
                .replace("{number}", "1")
                .replace("{name}", "executive")
                .replace("{id}", "active")
                .replace("{feature}", "config")
                .replace("{logger}", "log")
                .replace("{component}", "executive")
            )
            status, text = rest(daemon, method, path, body_for(path, marker))
            assert (status, "remote-control" in text) == (403, True), way
        for board in boards(daemon, stack):
            for verb, right in ASK.items():
                if right is not Right.LOOK:
                    with pytest.raises(CxbridgeError, match="refused"):
                        request(board, verb, WAIT_S, env="executive")
            with pytest.raises((RemoteRefusalError, BlackBoardError)):
                board.open_for_writing("TestInterface", "mine")
            with pytest.raises((RemoteRefusalError, BlackBoardError)):
                board.open_for_writing("SkillerInterface", "another")
            assert read_status(board)["state"] == "RUNNING"
            assert request(board, "env-list", WAIT_S)[0]["name"] == "executive"
            assert ask_why(board, "goal-retract", "rule", 1, WAIT_S)
        assert not daemon.board.list("TestInterface", "mine")
        assert daemon.state == "RUNNING"
        assert not marker.exists()


ATTACKS = (
    "(x (system M))",
    "(x =(system M))",
    "(x 1 2 (system M))",
    "(x ?(system M))",
    "(x (y (system M)))",
    "(battery (level (system M)))",
    "(battery (level =(system M)))",
    "(battery (level 1) (cells (create$ 1 (system M))))",
    "(battery (level ?*x*))",
    "(battery (level 1)) (x (system M))",
    "(battery (level 1)))(x (system M",
    "(battery (system M))",
    "(battery (implied (system M)))",
    "(x (implied M))",
    "(x 1) (system M)",
    "(time (system M))",
    '(x "a\\\\" (system M) "")',
    "(x 1);)\n(y (system M))",
    "((system M) 1)",
    "(x [y] (system M))",
    "(x `(system M))",
    "(x :(system M))",
    "(x ~(system M))",
    "(x &(system M))",
    "(x\0(system M))",
)
VALUES = (
    "(system M)",
    "=(system M)",
    "1) (system M",
    '"a" (system M)',
    "?*x*",
    "1;\n(system M)",
)


@needs_plugin("studio")
def test_texts_of_clients_without_programs_are_not_evaluated(tmp_path):
    with served(tmp_path, remote_programs=False) as (daemon, _lines, marker), ExitStack() as stack:
        evil = f'"touch {marker}"'
        ways = boards(daemon, stack)
        index = request(ways[0], "assert", WAIT_S, env="executive", fact="(battery (level 5))")
        for way in ways:
            for fact in ATTACKS:
                with pytest.raises(CxbridgeError):
                    request(way, "assert", WAIT_S, env="executive", fact=fact.replace("M", evil))
            for value in VALUES:
                slots = {"level": value.replace("M", evil)}
                with pytest.raises(CxbridgeError):
                    request(way, "modify", WAIT_S, env="executive", index=index, slots=slots)
            for verb, given in (
                ("env-eval", {"expression": f"(system {evil})"}),
                ("env-load", {"file": str(tmp_path / "mini" / "mini.clp")}),
                ("break-add", {"specs": [f"rule:* if (system {evil})"]}),
            ):
                with pytest.raises(CxbridgeError, match="refused"):
                    request(way, verb, WAIT_S, env="executive", **given)
            assert request(way, "break-add", WAIT_S, specs=["rule:time-retract"])
            assert request(
                way, "assert", WAIT_S, env="executive", fact='(battery (level 1) (cells a "b" -2.5))'
            )
        assert not marker.exists()


@needs_plugin("studio")
@needs_plugin("web")
def test_texts_of_http_requests_without_programs_are_not_evaluated(tmp_path):
    with served(tmp_path, remote_programs=False) as (daemon, _lines, marker):
        evil = f'"touch {marker}"'
        made = rest(daemon, "POST", "/cxbridge/facts", {"fact": "(battery (level 5))"})
        index = json.loads(made[1])["index"]
        for fact in ATTACKS:
            assert rest(daemon, "POST", "/cxbridge/facts", {"fact": fact.replace("M", evil)})[0] == 400, fact
        for value in VALUES:
            patch = {"slots": {"level": value.replace("M", evil)}}
            assert rest(daemon, "PATCH", f"/cxbridge/facts/{index}", patch)[0] == 400, value
        for path in ("environments/executive/eval", "environments/executive/load", "debugger/breakpoints"):
            status, text = rest(daemon, "POST", f"/cxbridge/{path}", body_for(path, marker))
            assert (status, "remote-programs" in text) == (403, True), path
        status = json.loads(rest(daemon, "GET", "/cxbridge/status")[1])
        assert (status["remote_control"], status["remote_programs"]) == (True, False)
        assert rest(daemon, "POST", "/cxbridge/pause", {})[0] == 200
        assert not marker.exists()


@needs_plugin("studio")
def test_expressions_of_clients_with_programs_are_evaluated(tmp_path):
    """The attacks of the tests above work with the right."""
    with served(tmp_path) as (daemon, _lines, marker), ExitStack() as stack:
        fact = f"(x (system \"touch '{marker}'\"))"
        assert request(boards(daemon, stack)[0], "assert", WAIT_S, env="executive", fact=fact)
        assert marker.exists()


# -- constants


@pytest.mark.parametrize(
    ("text", "written"),
    [
        ("(a)", "(a)"),
        ("( a  1 2.5 -3e2 b \n c)", "(a 1 2.5 -3e2 b c)"),
        ('(a "b c" "d\\"e" "\\\\")', '(a "b c" "d\\"e" "\\\\")'),
        ("(a (b) (c 1 x) (d <= <>))", "(a (b) (c 1 x) (d <= <>))"),
        ("(wm-fact (key domain fact at args? r robot1) (value TRUE))",) * 2,
    ],
)
def test_constants_are_normalised(text, written):
    assert parse_constant_fact(text).text == written


@pytest.mark.parametrize(
    "text", ["", "(", ")", "()", "a", "(a", "a)", "(a))", "((a))", "(a (b) 1)", "(a ())"]
)
def test_invalid_facts_are_refused(text):
    with pytest.raises(ClipsError):
        parse_constant_fact(text)


@pytest.mark.parametrize("text", VALUES)
def test_invalid_constants_are_refused(text):
    with pytest.raises(ClipsError):
        to_safe_values_text(text.replace("M", '"x"'))
