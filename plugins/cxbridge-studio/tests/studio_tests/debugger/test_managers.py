"""The managers of chapter 4 of the thesis as operations of Python, the command line and HTTP."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from importlib.util import find_spec
from typing import Any

import pytest

from cxbridge.cli.main import invoke
from cxbridge.daemon.client import request
from cxbridge.daemon.operations.table import verbs
from cxbridge.errors import CxbridgeError
from tests.daemon.test_daemon import WAIT_S, connected, running
from tests.daemon.test_rights import rest
from tests.run.mini import write_scenario
from tests.support import needs_plugin


class RefusedError(Exception):
    """An operation was refused."""


class Access:
    """An access to the managers: calls operations by name."""

    def __init__(self, call: Callable[..., Any]) -> None:
        self.call = call

    def environments(self, feature: str) -> list[str]:
        """Return the environments with a feature."""
        row = next(info for info in self.call("feature-list") if info["name"] == feature)
        return list(row["environments"])

    def state(self, component: str) -> tuple[str, str]:
        row = next(row for row in self.call("component-list") if row["name"] == component)
        return row["state"], row["reason"]

    def value(self, expression: str, env: str = "lab") -> str:
        return str(self.call("env-eval", env=env, expression=expression)["text"])


def access_python(daemon: Any, board: Any) -> Access:
    def call(verb: str, **arguments: Any) -> Any:
        try:
            return request(board, verb, WAIT_S, **arguments)
        except CxbridgeError as error:
            raise RefusedError(str(error)) from error

    return Access(call)


def access_cli(daemon: Any, capsys: pytest.CaptureFixture[str]) -> Access:
    def call(verb: str, **arguments: Any) -> Any:
        words, as_json = COMMANDS[verb](arguments)
        status = invoke([*words, *(["--json"] if as_json else []), "--connect", daemon.endpoints[0]])
        out, err = capsys.readouterr()
        if status:
            raise RefusedError(err)
        return json.loads(out) if as_json else None

    return Access(call)


COMMANDS: dict[str, Callable[[dict[str, Any]], tuple[list[str], bool]]] = {
    "env-create": lambda arguments: (["env", "create", arguments["env"]], False),
    "env-destroy": lambda arguments: (["env", "destroy", arguments["env"]], False),
    "env-list": lambda _arguments: (["env", "list"], True),
    "env-eval": lambda arguments: (["env", "eval", arguments["env"], arguments["expression"]], True),
    "env-feature": lambda arguments: (["env", "feature", arguments["env"], arguments["feature"]], False),
    "feature-list": lambda _arguments: (["env", "features"], True),
    "component-list": lambda _arguments: (["daemon", "component"], True),
    "component-change": lambda arguments: (
        ["daemon", "component", arguments["component"], arguments["transition"]],
        False,
    ),
}


def access_rest(daemon: Any) -> Access:
    def call(verb: str, **arguments: Any) -> Any:
        method, path, body = REQUESTS[verb](arguments)
        status, text = rest(daemon, method, f"/cxbridge{path}", body)
        if status != 200:
            raise RefusedError(text)
        document = json.loads(text)
        rows = document if isinstance(document, list) else [document]
        rows_without_kind = [
            {name: row[name] for name in row if name not in ("kind", "apiVersion")} for row in rows
        ]
        return rows_without_kind if isinstance(document, list) else rows_without_kind[0]

    return Access(call)


REQUESTS: dict[str, Callable[[dict[str, Any]], tuple[str, str, Any]]] = {
    "env-create": lambda arguments: ("POST", "/environments", {"name": arguments["env"]}),
    "env-destroy": lambda arguments: ("DELETE", f"/environments/{arguments['env']}", None),
    "env-list": lambda _arguments: ("GET", "/environments", None),
    "env-eval": lambda arguments: (
        "POST",
        f"/environments/{arguments['env']}/eval",
        {"expression": arguments["expression"]},
    ),
    "env-feature": lambda arguments: (
        "POST",
        f"/environments/{arguments['env']}/features",
        {"feature": arguments["feature"]},
    ),
    "feature-list": lambda _arguments: ("GET", "/features", None),
    "component-list": lambda _arguments: ("GET", "/components", None),
    "component-change": lambda arguments: (
        "PUT",
        f"/components/{arguments['component']}",
        {"transition": arguments["transition"]},
    ),
}


@pytest.fixture(name="served", scope="module")
def _served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Any, list[str]]]:
    folder = tmp_path_factory.mktemp("managers")
    settings: Any = (
        ("fawkes/enable", False),
        ("zmq/endpoints", [f"ipc://{folder}/bb"]),
        *((("web/enable", True), ("web/port", 0)) if find_spec("cxbridge_web") else ()),
    )
    with running(config=write_scenario(folder / "mini"), settings=settings) as (daemon, lines, _):
        yield daemon, lines


@pytest.fixture(name="access", params=["python", "cli", pytest.param("rest", marks=needs_plugin("web"))])
def _way(
    request: pytest.FixtureRequest, served: tuple[Any, list[str]], capsys: pytest.CaptureFixture[str]
) -> Iterator[Access]:
    daemon, _ = served
    if request.param == "python":
        with connected(daemon) as board:
            yield access_python(daemon, board)
    else:
        yield access_rest(daemon) if request.param == "rest" else access_cli(daemon, capsys)


@pytest.fixture(name="lab")
def _lab(access: Access) -> Iterator[Access]:
    """An access with an environment ``lab``."""
    access.call("env-create", env="lab")
    yield access
    if "lab" in [info["name"] for info in access.call("env-list")]:
        access.call("env-destroy", env="lab")


def test_environments_are_created_and_destroyed(access: Access) -> None:
    access.call("env-create", env="other")
    with pytest.raises(RefusedError, match="already exists"):
        access.call("env-create", env="other")
    access.call("env-destroy", env="other")
    with pytest.raises(RefusedError, match="other"):
        access.call("env-destroy", env="other")
    assert [info["name"] for info in access.call("env-list")] == ["executive"]


def test_environment_gets_feature(lab: Access) -> None:
    assert lab.environments("navgraph") == []
    lab.call("env-feature", env="lab", feature="navgraph")
    assert lab.environments("navgraph") == ["lab"]
    with pytest.raises(RefusedError, match="nope"):
        lab.call("env-feature", env="lab", feature="nope")


def test_component_changes_state_in_its_lifecycle(access: Access) -> None:
    """The original has the services change_state and get_state of each node."""
    assert access.state("executive") == ("ACTIVE", "")
    access.call("component-change", component="executive", transition="deactivate")
    assert access.state("executive") == ("INACTIVE", "deactivate on request")
    with pytest.raises(RefusedError, match="it is inactive, expected unconfigured"):
        access.call("component-change", component="executive", transition="configure")
    access.call("component-change", component="executive", transition="cleanup")
    with pytest.raises(RefusedError, match="it is unconfigured"):
        access.call("component-change", component="executive", transition="activate")
    with pytest.raises(RefusedError, match="executive"):
        access.call("env-list")
    access.call("component-change", component="executive", transition="configure")
    access.call("component-change", component="executive", transition="activate")
    assert access.state("executive") == ("ACTIVE", "")
    for component, transition, message in (
        ("nope", "activate", "nope"),
        ("executive", "dance", "no transition 'dance'"),
        ("blackboard", "deactivate", "no component 'blackboard' to change"),
    ):
        with pytest.raises(RefusedError, match=message):
            access.call("component-change", component=component, transition=transition)


def test_each_operation_has_command_and_http_request() -> None:
    beginnings = ("env-feature", "feature-", "component-")
    assert {verb for verb in verbs() if verb.startswith(beginnings)} <= set(COMMANDS)
    assert set(REQUESTS) == set(COMMANDS)
