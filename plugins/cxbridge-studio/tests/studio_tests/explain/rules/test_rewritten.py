"""The source texts of rules that the environment has rewritten."""

from __future__ import annotations

from cxbridge_studio.constructs import read_rule_texts
from cxbridge_studio.explain.rules.environment import restore_sources
from studio_tests.explain.worlds import make_world


def test_restored_rule_has_modify_of_source(tmp_path):
    file = tmp_path / "agent.clp"
    file.write_text("(defrule go ?g <- (goal (mode A) (id ?i)) => (modify ?g (mode B) (params 1 ?i)))\n")
    with make_world() as env:
        env.load(file)
        texts = read_rule_texts(env)
        assert "(mode B)" not in texts["go"]
        assert "(modify ?g (mode B) (params 1 ?i))" in restore_sources(texts)["go"]
