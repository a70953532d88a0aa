"""CLIPS environments over REST."""

from __future__ import annotations

import pytest

from tests.run.mini import write_scenario
from web_tests.support import serving

pytest.importorskip("cxbridge_studio", reason="needs cxbridge-studio")

PATH = "/api/cxbridge/environments"


@pytest.fixture(name="there", scope="module")
def _there(tmp_path_factory):
    scenario = write_scenario(tmp_path_factory.mktemp("environments") / "mini")
    with serving(config=scenario) as (_, client, lines):
        assert client.ask("POST", PATH, {"name": "lab"}).json["own"] is True
        yield client, lines


def test_environments_are_created_listed_and_destroyed(there):
    client, _ = there
    made = client.ask("POST", PATH, {"name": "other"}).json
    assert (made["kind"], made["name"], made["own"]) == ("EnvironmentInfo", "other", True)
    assert [info["name"] for info in client.get(PATH).json] == ["executive", "lab", "other"]
    assert client.get(f"{PATH}/other").json["features"] == made["features"]
    assert client.ask("DELETE", f"{PATH}/other").json["name"] == "other"
    assert client.get(f"{PATH}/other").status == 404
    answer = client.ask("DELETE", f"{PATH}/executive")
    assert (answer.status, "it is the executive's" in answer.text) == (400, True)


def test_files_are_loaded_and_what_is_wrong_is_told(there, tmp_path):
    client, _ = there
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


def test_features_watches_and_log_levels(there, tmp_path):
    client, lines = there
    assert (
        "pddl-parser"
        in client.ask("POST", f"{PATH}/lab/features", {"feature": "pddl-parser"}).json["features"]
    )
    assert client.ask("PUT", f"{PATH}/lab/watch", {"item": "rules"}).json["watch"] == ["rules"]
    assert client.ask("PUT", f"{PATH}/lab/watch", {"item": "all", "on": False}).json["watch"] == []
    assert client.ask("PUT", f"{PATH}/lab/log", {"level": "warn"}).json["log_level"] == "warn"
    speaks = tmp_path / "speaks.clp"
    speaks.write_text(
        '(defrule lab-speak (speak) => (printout t "a quiet" crlf) (printout warn "a loud" crlf))'
    )
    assert client.ask("POST", f"{PATH}/lab/load", {"file": str(speaks)}).json["diagnostics"] == []
    assert client.ask("POST", "/api/cxbridge/facts", {"fact": "(speak)", "env": "lab"}).status == 200
    client.until(
        "/api/cxbridge/rules?env=lab&name=lab-speak",
        lambda rules: rules[0]["agenda"] == 0 and "a loud" in lines,
    )
    assert "a quiet" not in lines
    answer = client.ask("PUT", f"{PATH}/lab/watch", {"item": "rules", "on": "yes"})
    assert (answer.status, "'on' must be" in answer.text) == (400, True), answer.text


def test_expressions_are_evaluated(there):
    client, _ = there
    found = client.ask("POST", f"{PATH}/executive/eval", {"expression": '(printout t "hello" crlf)'}).json
    assert (found["kind"], found["text"], found["output"]) == ("Value", "", ["hello"])
    assert client.ask("POST", f"{PATH}/lab/eval", {"expression": "(nope)"}).status == 400
