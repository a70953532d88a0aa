"""An operation of a plug-in: every way in has it."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import cxbridge_web.fawkes
from cxbridge.daemon.client import request
from cxbridge.errors import CxbridgeError
from cxbridge.operations.operation import Operation, OperationContext, ParameterError
from cxbridge.operations.table import operations, verbs
from cxbridge.plugins import PluginError
from cxbridge.rights import EVERYTHING, Right
from studio_tests.cli.test_run_break import _folder, _run  # noqa: F401 - fixtures
from tests.daemon.test_daemon import WAIT_S, connected
from tests.plugins import example, forget, install
from tests.run.mini import write_scenario
from web_tests.support import Client, serving


@pytest.fixture(name="added")
def _added(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """A plug-in with an operation."""
    install(tmp_path / "site", monkeypatch, "greeter", example())
    yield
    forget("greeter")


def ways(scenario: Path, tmp_path: Path) -> dict[str, Any]:
    """What a daemon answers on each way, or why it does not."""
    settings = (("zmq/endpoints", [f"ipc://{tmp_path}/bb"]), ("fawkes/enable", False))
    with serving(settings, config=scenario) as (daemon, client, _), connected(daemon) as board:
        assert isinstance(client, Client)
        try:
            verb = request(board, "count-words", WAIT_S, text="a bb ccc", least=2)
        except CxbridgeError as error:
            verb = str(error)
        described = client.get("/api/openapi.json").json
        return {
            "verb": verb,
            "rest": client.ask("POST", "/api/cxbridge/words", {"text": "a bb ccc"}),
            "wrong": client.ask("POST", "/api/cxbridge/words", {"text": "a", "least": "2"}),
            "path": described["paths"].get("/cxbridge/words"),
            "body": described["components"]["schemas"].get("Words"),
        }


@pytest.mark.usefixtures("added")
def test_a_new_operation_is_one_row(tmp_path: Path) -> None:
    assert verbs()["count-words"] is Right.CONTROL
    found = ways(write_scenario(tmp_path / "mini"), tmp_path)
    assert found["verb"] == {"count": 2}
    assert found["rest"].json == {"kind": "WordCount", "apiVersion": "v1beta1", "count": 3}
    assert (found["wrong"].status, found["wrong"].text) == (400, "'least' must be a whole number")
    assert found["path"]["post"]["summary"] == "Count words."
    assert found["body"] == {
        "type": "object",
        "properties": {"text": {"type": "string"}, "least": {"type": "integer"}},
        "required": ["text"],
    }


VIEW = '''
"""The endpoint that greets."""
from cxbridge_web.endpoint import Endpoint, Text

ENDPOINTS = (
    Endpoint(method="GET", path="/greeting", handler=lambda call: Text("hello"), about="Greet."),
)
'''


def test_a_new_view_of_the_rest_api_is_one_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "greeting.py").write_text(VIEW)
    with monkeypatch.context() as patch:
        patch.setattr(cxbridge_web.fawkes, "__path__", [*cxbridge_web.fawkes.__path__, str(tmp_path)])
        with serving() as (_, client, _):
            assert client.get("/api/greeting").text == "hello"
            assert client.get("/api/openapi.json").json["paths"]["/greeting"]["get"]["summary"] == "Greet."
    sys.modules.pop("cxbridge_web.fawkes.greeting")
    with serving() as (_, client, _):
        assert client.get("/api/greeting").status == 404


@pytest.mark.usefixtures("added")
def test_a_new_operation_can_be_typed_at_the_prompt(run: Any) -> None:
    status, out, _ = run(["goal:MINI:FORMULATED"], "count-words one", "env-list", "d 1", "c")
    assert status == 0
    assert '\n{"count": 1}\n' in out
    assert "there is no command 'env-list'" in out  # not all are for a prompt


def test_without_its_plug_in_it_is_gone(tmp_path: Path) -> None:
    assert "count-words" not in operations()
    found = ways(write_scenario(tmp_path / "mini"), tmp_path)
    assert "knows no request 'count-words'" in found["verb"]
    assert found["rest"].status == 404
    assert (found["path"], found["body"]) == (None, None)


def test_two_operations_of_one_name_are_an_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    tables = "from cxbridge.plugins import Row\nAPI = 1\nOPERATIONS = (Row('again', 'second.again'),)"
    files = {"plugin.py": tables, "again.py": "from cxbridge.operations.state import OPERATIONS"}
    install(tmp_path, monkeypatch, "second", files)
    with pytest.raises(PluginError, match=r"two operations are called 'state': .* of second"):
        operations()
    forget("second")


# -- parameters


@pytest.mark.parametrize(
    ("name", "given", "wrong"),
    [
        ("retract", {"env": "e"}, "'index' is missing"),
        ("retract", {"env": "e", "index": "x"}, "index"),
        ("env-watch", {"env": "e", "item": "facts", "names": [1]}, "names"),
        ("modify", {"env": "e", "index": 1, "slots": {"a": 1}}, "slots"),
        ("break-remove", {"all": "perhaps"}, "all"),
    ],
)
def test_parameters_have_types(name: str, given: dict[str, Any], wrong: str) -> None:
    with pytest.raises(ParameterError, match=wrong) as caught:
        operations()[name].parse(given)
    assert caught.value.name in operations()[name].parameters.__struct_fields__


def test_a_number_may_be_a_text_where_nobody_is_strict() -> None:
    retract: Operation[Any] = operations()["retract"]
    assert retract.parse({"env": "e", "index": "12"}).index == 12
    with pytest.raises(ParameterError):
        retract.parse({"env": "e", "index": "12"}, strict=True)


def test_words_at_a_prompt_are_parameters_in_their_order() -> None:
    assert operations()["find-facts"].words("battery 3 1000") == {
        "words": "battery",
        "after": "3",
        "limit": "1000",
    }
    assert operations()["assert"].words("(battery (level 3))") == {"fact": "(battery (level 3))"}
    assert operations()["go-on"].words("") == {}


def test_without_an_executive_each_operation_on_it_says_so() -> None:
    context = OperationContext(EVERYTHING, None)
    with pytest.raises(CxbridgeError, match="this daemon has no executive"):
        _ = context.service
    assert context.environments == ()
