"""The constructs of loaded files over HTTP: where they are, whose they are, their text."""

from __future__ import annotations

from cxbridge_web.constructs import find_constructs
from tests.support import ROOT
from web_tests.support import serving


def test_constructs_are_read_again_when_their_file_has_changed(tmp_path):
    file = tmp_path / "door.clp"
    file.write_text('; a door\n(deftemplate door (slot open))\n(defrule shut "Shuts."\n  (door) =>)\n')
    found = find_constructs([str(file), str(tmp_path / "missing.clp")])
    rule = found["defrule", "shut"]
    assert (rule.line, rule.core, rule.text) == (3, False, '(defrule shut "Shuts."\n  (door) =>)')
    file.write_text("(defrule open (door) =>)" + " " * 99)
    assert set(find_constructs([str(file)])) == {("defrule", "open")}


def test_a_daemon_has_the_source_of_its_rules_and_says_which_are_the_cores():
    with serving(config=ROOT / "scenarios" / "two-robots") as (_, client, _lines):
        client.until("/api/cxbridge/status", lambda status: bool(status["environments"]))
        path = "/api/cxbridge/constructs?text=true&construct=defrule&name="
        (own,) = client.until(path + "robots-choose", lambda found: len(found) == 1)
        assert own["text"].startswith("(defrule robots-choose")
        assert (own["core"], own["file"].endswith("robots-choose.clp")) == (False, True)
        templates = client.get("/api/cxbridge/constructs?construct=deftemplate").json
        core = {each["name"]: each["core"] for each in templates}
        assert (core["goal"], core["robot"]) == (True, False)
        assert "text" not in templates[0]
