"""The constructs of loaded files over HTTP, with place, origin and text."""

from __future__ import annotations

from cxbridge_web.constructs import find_constructs
from tests.support import ROOT
from web_tests.support import serving


def test_changed_file_is_reread(tmp_path):
    file = tmp_path / "door.clp"
    file.write_text('; a door\n(deftemplate door (slot open))\n(defrule shut "Shuts."\n  (door) =>)\n')
    constructs = find_constructs([str(file), str(tmp_path / "missing.clp")])
    rule = constructs["defrule", "shut"]
    assert (rule.line, rule.core, rule.text) == (3, False, '(defrule shut "Shuts."\n  (door) =>)')
    file.write_text("(defrule open (door) =>)" + " " * 99)
    assert set(find_constructs([str(file)])) == {("defrule", "open")}


def test_daemon_has_text_and_origin_of_constructs():
    with serving(config=ROOT / "scenarios" / "two-robots") as (_, client, _lines):
        client.until("/api/cxbridge/status", lambda status: bool(status["environments"]))
        path = "/api/cxbridge/constructs?text=true&construct=defrule&name="
        (own,) = client.until(path + "robots-choose", lambda constructs: len(constructs) == 1)
        assert own["text"].startswith("(defrule robots-choose")
        assert (own["core"], own["file"].endswith("robots-choose.clp")) == (False, True)
        templates = client.get("/api/cxbridge/constructs?construct=deftemplate").json
        core = {each["name"]: each["core"] for each in templates}
        assert (core["goal"], core["robot"]) == (True, False)
        assert "text" not in templates[0]
