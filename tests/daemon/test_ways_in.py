"""The tables of ways in have every component, socket and service."""

from __future__ import annotations

import ast
from collections.abc import Iterable, Iterator

import pytest

from cxbridge.blackboard.kit.errors import InsecureEndpointError
from cxbridge.blackboard.zmq.security import check_endpoint
from cxbridge.daemon.table import DAEMON_COMPONENTS
from cxbridge.listening import is_loopback, is_private_endpoint
from cxbridge.rights import FRAME_RIGHTS, Right, right_of_frame
from cxbridge.run.components.table import COMPONENTS
from tests.support import module_files, needs_all_plugins

WAYS = {
    "blackboard": (),
    "recorder": (),
    "zmq": ("zmq",),
    "fawkes": ("fawkes-blackboard", "fawkes-plugins", "fawkes-configuration", "fawkes-logger"),
    "foxglove": ("foxglove",),
    "web": (),  # its endpoints name their rights: test_rights.py
    "ros2-node": ("ros2-lifecycle", "ros2-parameters"),
    "skiller": (),
    "remote-skiller": (),
    "speech": (),
    "skill-board": (),
    "ros2-performers": ("ros2-performers",),
    "ros2-experts": ("ros2-experts",),
    "ros2-interfaces": ("ros2-interfaces",),
    "ros2-skiller": ("ros2-action",),
    "ros2-tf": ("ros2-tf",),
    "planning": (),
    "robot-memory": (),
    "explainer": (),  # its interface is on the blackboard
    "executive": (),  # connections of the agent's rules are the agent's concern: docs/security.md
}
"""The protocols of each component. A component without protocols has no clients."""

LISTENS = {
    "cxbridge.listening": "its callers: allowed_peers.resolve_listen_address, WebSettings.check",
    "cxbridge.blackboard.zmq.client.receiving": "inproc: within the process",
    "cxbridge.blackboard.zmq.server.server": "security.check_endpoint",
    "cxbridge.blackboard.zmq.wire.sockets": "security.check_endpoint, in the server",
    "cxbridge_web.options": "tries whether a port of the loopback is free",
    "cxbridge_protobuf.socket_connections": "clips-protobuf/server-address",
    "cxbridge_protobuf.peer": "the address that the agent's rules name",
    "cxbridge_explore.coordinator": "a file in a folder of this user",
    "cxbridge_web.foxglove.proxy": "FoxgloveSettings.check",
    "cxbridge_web.foxglove.server": "a random address of the loopback, behind the door",
}
"""The modules that bind a socket, and the setting of the address."""

SENDS_SKILL_STRINGS = {
    "cxbridge.cli.commands.skill": "a client: the daemon asks the table",
    "cxbridge_ros2.components.skiller": "Rights.message_right",
    "cxbridge.daemon.services.skiller_executor": "parse_skill_string: only data is sent",
    "cxbridge.skiller.calls": "its callers, which are above",
    "cxbridge_web.fawkes.skiller": "Endpoint.is_skill",
}
"""The modules that send skill strings to a Skiller, and the check that keeps out programs of clients."""

_BINDING = {
    *("bind", "bind_to_random_port", "create_server", "start_server", "start_unix_server"),
    *("create_unix_server", "HTTPServer", "TCPServer", "UDPServer", "ThreadingHTTPServer"),
}


def calls(names: Iterable[str]) -> Iterator[tuple[str, ast.Call, str, str]]:
    """Yield the calls of these names in the package: module, call, receiver and name."""
    wanted = {*names}
    for module, path in module_files().items():
        text = path.read_text()
        if not any(name in text for name in wanted):
            continue
        for node in ast.walk(ast.parse(text)):
            if not isinstance(node, ast.Call):
                continue
            if isinstance(node.func, ast.Attribute) and node.func.attr in wanted:
                yield module, node, ast.unparse(node.func.value), node.func.attr
            elif isinstance(node.func, ast.Name) and node.func.id in wanted:
                yield module, node, "", node.func.id


# -- the tables


@needs_all_plugins
def test_components_are_classified():
    names = [row.name for row in (*DAEMON_COMPONENTS, *COMPONENTS.rows)]
    assert set(names) == set(WAYS)
    assert {protocol for protocols in WAYS.values() for protocol in protocols} == set(FRAME_RIGHTS)


@needs_all_plugins
def test_bound_sockets_are_known():
    found = {module for module, _, receiver, _ in calls(_BINDING) if "signature" not in receiver}
    assert found == set(LISTENS)


@needs_all_plugins
def test_services_and_topics_of_nodes_name_rights():
    """Without a right, a service needs the highest right, which no client beyond the loopback has."""
    found = [
        (module, {keyword.arg for keyword in call.keywords})
        for module, call, receiver, name in calls(("subscribe", "serve", "serve_later", "ActionServer"))
        if (
            name in ("subscribe", "serve", "serve_later")
            and receiver.rpartition(".")[2].strip("_") in ("node", "_node")
        )
        or name == "ActionServer"
    ]
    assert len(found) > 12
    assert [module for module, keywords in found if "right" not in keywords] == []


@needs_all_plugins
def test_senders_of_skill_strings_are_known():
    found = {
        module.removesuffix(".__init__")
        for module, call, _, name in calls(("SkillerCall", "create_message", "_send"))
        if name == "SkillerCall"
        or (
            name in ("create_message", "_send")
            and [argument.value for argument in call.args if isinstance(argument, ast.Constant)]
            == ["ExecSkillMessage"]
        )
    }
    assert found == set(SENDS_SKILL_STRINGS)


def test_unknown_frame_needs_highest_right():
    assert right_of_frame("ros2-lifecycle", "new") is right_of_frame("new", "any") is Right.PROGRAMS


# -- where servers may listen


@pytest.mark.parametrize(
    ("host", "expected"),
    [
        *(
            (host, True)
            for host in ("localhost", "127.0.0.1", "127.4.5.6", "::1", "[::1]", "::ffff:127.0.0.1")
        ),
        *((host, False) for host in ("0.0.0.0", "::", "192.168.0.1", "robot", "", "*", "fe80::1%eth0")),
    ],
)
def test_loopback_addresses(host: str, expected: bool):
    assert is_loopback(host) is expected


@pytest.mark.parametrize(
    ("endpoint", "expected"),
    [
        *((url, True) for url in ("ipc:///tmp/x", "tcp://127.0.0.1:*", "tcp://[::1]:1911")),
        *((url, False) for url in ("ipc://@x", "ipc://@", "tcp://*:1911", "tcp://eth0:1", "tcp://[::1")),
    ],
)
def test_public_endpoint_needs_keys(endpoint: str, expected: bool):
    assert is_private_endpoint(endpoint) is expected
    for has_keys in (True, False):
        check_endpoint(endpoint, has_keys=has_keys, is_insecure_allowed=not has_keys)
    if expected:
        check_endpoint(endpoint, has_keys=False, is_insecure_allowed=False)
    else:
        with pytest.raises(InsecureEndpointError):
            check_endpoint(endpoint, has_keys=False, is_insecure_allowed=False)
