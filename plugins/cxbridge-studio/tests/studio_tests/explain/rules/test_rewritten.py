"""Rules in their source form, of an environment that has them rewritten."""

from __future__ import annotations

from cxbridge_studio.constructs import read_rule_texts
from cxbridge_studio.explain.rules.environment import restore_sources
from studio_tests.explain.worlds import world


def test_what_a_live_rule_sets_is_read_as_in_a_file(tmp_path):
    file = tmp_path / "agent.clp"
    file.write_text("(defrule go ?g <- (goal (mode A) (id ?i)) => (modify ?g (mode B) (params 1 ?i)))\n")
    with world() as env:
        env.load(file)
        texts = read_rule_texts(env)
        assert "(mode B)" not in texts["go"]
        assert "(modify ?g (mode B) (params 1 ?i))" in restore_sources(texts)["go"]
