"""Operations of a plug-in over the blackboard, over REST and in the description of the API."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import pytest

import cxbridge_web.fawkes
from cxbridge.daemon.client import request
from cxbridge.errors import CxbridgeError
from tests.daemon.operations.test_table import _added  # noqa: F401 - a fixture
from tests.daemon.test_daemon import WAIT_S, connected
from tests.run.mini import write_scenario
from web_tests.support import Client, serving


def call_operation(scenario: Path, tmp_path: Path) -> dict[str, Any]:
    """Return the answers or errors of a daemon on each interface."""
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
            "invalid": client.ask("POST", "/api/cxbridge/words", {"text": "a", "least": "2"}),
            "path": described["paths"].get("/cxbridge/words"),
            "body": described["components"]["schemas"].get("Words"),
        }


@pytest.mark.usefixtures("added")
def test_each_interface_has_new_operation(tmp_path: Path) -> None:
    answers = call_operation(write_scenario(tmp_path / "mini"), tmp_path)
    assert answers["verb"] == {"count": 2}
    assert answers["rest"].json == {"kind": "WordCount", "apiVersion": "v1beta1", "count": 3}
    assert (answers["invalid"].status, answers["invalid"].text) == (400, "'least' must be a whole number")
    assert answers["path"]["post"]["summary"] == "Count words."
    assert answers["body"]["required"] == ["text"]
    members = {name: schema["type"] for name, schema in answers["body"]["properties"].items()}
    assert members == {"text": "string", "least": "integer"}


VIEW = '''
"""The endpoint that greets."""
from cxbridge_web.endpoint import Endpoint, TextReply

ENDPOINTS = (
    Endpoint(method="GET", path="/greeting", handler=lambda call: TextReply("hello"), summary="Greet."),
)
'''


def test_new_endpoint_of_rest_api_needs_single_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "greeting.py").write_text(VIEW)
    with monkeypatch.context() as patch:
        patch.setattr(cxbridge_web.fawkes, "__path__", [*cxbridge_web.fawkes.__path__, str(tmp_path)])
        with serving() as (_, client, _):
            assert client.get("/api/greeting").text == "hello"
            assert client.get("/api/openapi.json").json["paths"]["/greeting"]["get"]["summary"] == "Greet."
    sys.modules.pop("cxbridge_web.fawkes.greeting")
    with serving() as (_, client, _):
        assert client.get("/api/greeting").status == 404


def test_operation_is_unknown_without_plugin(tmp_path: Path) -> None:
    answers = call_operation(write_scenario(tmp_path / "mini"), tmp_path)
    assert "the request 'count-words' is unknown" in answers["verb"]
    assert answers["rest"].status == 404
    assert (answers["path"], answers["body"]) == (None, None)
