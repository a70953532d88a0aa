"""The managers of the thesis' chapter 4 as operations: from Python, the command line and over HTTP."""

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


class Way:
    """One way to the managers: each operation under one name."""

    def __init__(self, ask: Callable[..., Any]) -> None:
        self.ask = ask

    def environments(self, feature: str) -> list[str]:
        """The environments that have a feature."""
        found = next(info for info in self.ask("feature-list") if info["name"] == feature)
        return list(found["environments"])

    def state(self, component: str) -> tuple[str, str]:
        found = next(row for row in self.ask("component-list") if row["name"] == component)
        return found["state"], found["reason"]

    def value(self, expression: str, env: str = "lab") -> str:
        return str(self.ask("env-eval", env=env, expression=expression)["text"])


def over_python(daemon: Any, board: Any) -> Way:
    def ask(verb: str, **arguments: Any) -> Any:
        try:
            return request(board, verb, WAIT_S, **arguments)
        except CxbridgeError as error:
            raise RefusedError(str(error)) from error

    return Way(ask)


def over_cli(daemon: Any, capsys: pytest.CaptureFixture[str]) -> Way:
    def ask(verb: str, **given: Any) -> Any:
        words, as_json = COMMANDS[verb](given)
        status = invoke([*words, *(["--json"] if as_json else []), "--connect", daemon.endpoints[0]])
        out, err = capsys.readouterr()
        if status:
            raise RefusedError(err)
        return json.loads(out) if as_json else None

    return Way(ask)


COMMANDS: dict[str, Callable[[dict[str, Any]], tuple[list[str], bool]]] = {
    "env-create": lambda given: (["env", "create", given["env"]], False),
    "env-destroy": lambda given: (["env", "destroy", given["env"]], False),
    "env-list": lambda _given: (["env", "list"], True),
    "env-eval": lambda given: (["env", "eval", given["env"], given["expression"]], True),
    "env-feature": lambda given: (["env", "feature", given["env"], given["feature"]], False),
    "feature-list": lambda _given: (["env", "features"], True),
    "component-list": lambda _given: (["daemon", "component"], True),
    "component-change": lambda given: (
        ["daemon", "component", given["component"], given["transition"]],
        False,
    ),
}


def over_rest(daemon: Any) -> Way:
    def ask(verb: str, **given: Any) -> Any:
        method, path, body = REQUESTS[verb](given)
        status, text = rest(daemon, method, f"/cxbridge{path}", body)
        if status != 200:
            raise RefusedError(text)
        found = json.loads(text)
        rows = found if isinstance(found, list) else [found]
        plain = [{name: row[name] for name in row if name not in ("kind", "apiVersion")} for row in rows]
        return plain if isinstance(found, list) else plain[0]

    return Way(ask)


REQUESTS: dict[str, Callable[[dict[str, Any]], tuple[str, str, Any]]] = {
    "env-create": lambda given: ("POST", "/environments", {"name": given["env"]}),
    "env-destroy": lambda given: ("DELETE", f"/environments/{given['env']}", None),
    "env-list": lambda _given: ("GET", "/environments", None),
    "env-eval": lambda given: (
        "POST",
        f"/environments/{given['env']}/eval",
        {"expression": given["expression"]},
    ),
    "env-feature": lambda given: (
        "POST",
        f"/environments/{given['env']}/features",
        {"feature": given["feature"]},
    ),
    "feature-list": lambda _given: ("GET", "/features", None),
    "component-list": lambda _given: ("GET", "/components", None),
    "component-change": lambda given: (
        "PUT",
        f"/components/{given['component']}",
        {"transition": given["transition"]},
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


@pytest.fixture(name="way", params=["python", "cli", pytest.param("rest", marks=needs_plugin("web"))])
def _way(
    request: pytest.FixtureRequest, served: tuple[Any, list[str]], capsys: pytest.CaptureFixture[str]
) -> Iterator[Way]:
    daemon, _ = served
    if request.param == "python":
        with connected(daemon) as board:
            yield over_python(daemon, board)
    else:
        yield over_rest(daemon) if request.param == "rest" else over_cli(daemon, capsys)


@pytest.fixture(name="lab")
def _lab(way: Way) -> Iterator[Way]:
    """A way with an environment ``lab``."""
    way.ask("env-create", env="lab")
    yield way
    if "lab" in [info["name"] for info in way.ask("env-list")]:
        way.ask("env-destroy", env="lab")


def test_environments_are_created_and_destroyed(way: Way) -> None:
    way.ask("env-create", env="other")
    with pytest.raises(RefusedError, match="already exists"):
        way.ask("env-create", env="other")
    way.ask("env-destroy", env="other")
    with pytest.raises(RefusedError, match="other"):
        way.ask("env-destroy", env="other")
    assert [info["name"] for info in way.ask("env-list")] == ["executive"]


def test_an_environment_gets_a_feature(lab: Way) -> None:
    assert lab.environments("navgraph") == []
    lab.ask("env-feature", env="lab", feature="navgraph")
    assert lab.environments("navgraph") == ["lab"]
    with pytest.raises(RefusedError, match="nope"):
        lab.ask("env-feature", env="lab", feature="nope")


def test_a_component_is_taken_through_its_life(way: Way) -> None:
    """The original's change_state and get_state of each node."""
    assert way.state("executive") == ("ACTIVE", "")
    way.ask("component-change", component="executive", transition="deactivate")
    assert way.state("executive") == ("INACTIVE", "deactivate on request")
    with pytest.raises(RefusedError, match="it is inactive, expected unconfigured"):
        way.ask("component-change", component="executive", transition="configure")
    way.ask("component-change", component="executive", transition="cleanup")
    with pytest.raises(RefusedError, match="it is unconfigured"):
        way.ask("component-change", component="executive", transition="activate")
    with pytest.raises(RefusedError, match="executive"):
        way.ask("env-list")
    way.ask("component-change", component="executive", transition="configure")
    way.ask("component-change", component="executive", transition="activate")
    assert way.state("executive") == ("ACTIVE", "")
    for component, transition, what in (
        ("nope", "activate", "nope"),
        ("executive", "dance", "no transition 'dance'"),
        ("blackboard", "deactivate", "no component 'blackboard' to change"),
    ):
        with pytest.raises(RefusedError, match=what):
            way.ask("component-change", component=component, transition=transition)


def test_every_operation_has_all_ways() -> None:
    beginnings = ("env-feature", "feature-", "component-")
    assert {verb for verb in verbs() if verb.startswith(beginnings)} <= set(COMMANDS)
    assert set(REQUESTS) == set(COMMANDS)
