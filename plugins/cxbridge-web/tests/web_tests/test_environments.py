"""CLIPS environments over REST."""

from __future__ import annotations

import pytest

from tests.run.mini import write_scenario
from web_tests.support import serving

pytest.importorskip("cxbridge_studio", reason="needs cxbridge-studio")

PATH = "/api/cxbridge/environments"


@pytest.fixture(name="client", scope="module")
def _client(tmp_path_factory):
    scenario = write_scenario(tmp_path_factory.mktemp("environments") / "mini")
    with serving(config=scenario) as (_, client, _lines):
        assert client.ask("POST", PATH, {"name": "lab"}).json["own"] is True
        yield client


def test_loaded_file_has_diagnostics(client, tmp_path):
    valid, invalid = tmp_path / "valid.clp", tmp_path / "invalid.clp"
    valid.write_text(
        "(deftemplate box (slot size))\n(defrule lab-big (box (size ?s&:(> ?s 9))) => (assert (big)))\n"
    )
    invalid.write_text("(defrule lab-bad\n")
    assert client.ask("POST", f"{PATH}/lab/load", {"file": str(valid)}).json["diagnostics"] == []
    diagnostics = client.ask("POST", f"{PATH}/lab/load", {"file": str(invalid)}).json["diagnostics"]
    assert diagnostics
    assert all("invalid.clp" in text for text in diagnostics)
    assert client.ask("POST", "/api/cxbridge/facts", {"fact": "(box (size 10))", "env": "lab"}).status == 200
    client.until("/api/clips/lab/facts?template=big", lambda facts: len(facts) == 1)
    answer = client.ask("POST", f"{PATH}/lab/load", {"file": "relative.clp"})
    assert (answer.status, "absolute path" in answer.text) == (400, True), answer.text


def test_watches_and_log_level_are_set(client):
    for method, path, body, member, value in (
        ("PUT", "watch", {"item": "rules"}, "watch", ["rules"]),
        ("PUT", "watch", {"item": "all", "on": False}, "watch", []),
        ("PUT", "log", {"level": "warn"}, "log_level", "warn"),
    ):
        assert client.ask(method, f"{PATH}/lab/{path}", body).json[member] == value
    answer = client.ask("PUT", f"{PATH}/lab/watch", {"item": "rules", "on": "yes"})
    assert (answer.status, "'on' must be" in answer.text) == (400, True), answer.text


def test_expressions_are_evaluated(client):
    value = client.ask("POST", f"{PATH}/executive/eval", {"expression": '(printout t "hello" crlf)'}).json
    assert (value["kind"], value["text"], value["output"]) == ("Value", "", ["hello"])
    assert client.ask("POST", f"{PATH}/lab/eval", {"expression": "(nope)"}).status == 400
