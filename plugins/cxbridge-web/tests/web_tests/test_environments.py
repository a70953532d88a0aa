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


def test_files_are_loaded_and_what_is_wrong_is_told(client, tmp_path):
    good, bad = tmp_path / "good.clp", tmp_path / "bad.clp"
    good.write_text(
        "(deftemplate box (slot size))\n(defrule lab-big (box (size ?s&:(> ?s 9))) => (assert (big)))\n"
    )
    bad.write_text("(defrule lab-bad\n")
    assert client.ask("POST", f"{PATH}/lab/load", {"file": str(good)}).json["diagnostics"] == []
    told = client.ask("POST", f"{PATH}/lab/load", {"file": str(bad)}).json["diagnostics"]
    assert told
    assert all("bad.clp" in text for text in told)
    assert client.ask("POST", "/api/cxbridge/facts", {"fact": "(box (size 10))", "env": "lab"}).status == 200
    client.until("/api/clips/lab/facts?template=big", lambda facts: len(facts) == 1)
    answer = client.ask("POST", f"{PATH}/lab/load", {"file": "relative.clp"})
    assert (answer.status, "absolute path" in answer.text) == (400, True), answer.text


def test_watches_and_log_levels(client):
    for method, path, body, member, value in (
        ("PUT", "watch", {"item": "rules"}, "watch", ["rules"]),
        ("PUT", "watch", {"item": "all", "on": False}, "watch", []),
        ("PUT", "log", {"level": "warn"}, "log_level", "warn"),
    ):
        assert client.ask(method, f"{PATH}/lab/{path}", body).json[member] == value
    answer = client.ask("PUT", f"{PATH}/lab/watch", {"item": "rules", "on": "yes"})
    assert (answer.status, "'on' must be" in answer.text) == (400, True), answer.text


def test_expressions_are_evaluated(client):
    found = client.ask("POST", f"{PATH}/executive/eval", {"expression": '(printout t "hello" crlf)'}).json
    assert (found["kind"], found["text"], found["output"]) == ("Value", "", ["hello"])
    assert client.ask("POST", f"{PATH}/lab/eval", {"expression": "(nope)"}).status == 400
