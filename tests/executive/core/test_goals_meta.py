"""Facts attached to goals, in the built-in core."""

from __future__ import annotations

import pytest

from tests.executive.core.core_bench import Bench


@pytest.fixture
def meta(bench: Bench) -> Bench:
    """A bench with a template for meta facts, and one without the slot goal-id."""
    bench.env.build("(deftemplate tries (slot goal-id) (slot count (default 7)))")
    bench.env.build("(deftemplate no-id (slot count))")
    return bench


def index_of(bench: Bench, template: str) -> int:
    """Return the index of the only fact of the template."""
    ((index, _, _),) = bench.env.facts(template)
    return index


def test_meta_template_alone_makes_default_fact(meta: Bench) -> None:
    meta.env.eval("(assert (goal (id G) (meta-template tries) (verbosity NOISY)))")
    meta.tick()
    assert meta.one("tries") == {"goal-id": "G", "count": 7}
    assert meta.goal("G")["meta-fact"] == index_of(meta, "tries")
    assert meta.texts("I") == ["Goal G attached default meta fact from template tries"]


def test_meta_fact_alone_sets_template_and_goal_id(meta: Bench) -> None:
    meta.env.eval("(assert (goal (id G) (meta-fact (fact-index (assert (tries (count 1)))))))")
    meta.tick()
    assert meta.goal("G")["meta-template"] == "tries"
    assert meta.one("tries")["goal-id"] == "G"


def test_modified_meta_fact_is_linked_in_next_loop(meta: Bench) -> None:
    meta.env.eval("(assert (goal (id G) (meta-template tries)))")
    meta.tick()
    assert meta.env.retract(index_of(meta, "tries"))
    meta.env.eval("(assert (tries (goal-id G) (count 8)))")
    assert meta.goal("G")["meta-fact"] != index_of(meta, "tries")
    meta.tick()
    assert meta.goal("G")["meta-fact"] == index_of(meta, "tries")


def test_meta_fact_is_retracted_with_goal(meta: Bench) -> None:
    meta.retract_automatically()
    meta.env.eval("(assert (goal (id G) (meta-template tries)) (tries (goal-id other)))")
    meta.tick()
    meta.modify("goal", "(mode RETRACTED)", id="G")
    meta.tick()
    assert [fact["goal-id"] for fact in meta.all("tries")] == ["other"]
    assert not meta.all("goal")
    assert not meta.all("goal-meta-link")


@pytest.mark.parametrize(
    ("goal", "text"),
    [
        ("(meta-template nowhere)", "Goal G attached goal meta template 'nowhere' unknown"),
        (
            "(meta-template no-id) (meta-fact (fact-index (assert (no-id))))",
            "Goal G uses meta fact 'no-id' without slot 'goal-id'",
        ),
    ],
)
def test_meta_errors_are_reported(meta: Bench, goal: str, text: str) -> None:
    meta.env.eval(f"(assert (goal (id G) {goal}))")
    meta.tick()
    assert meta.texts("E") == [text]


def test_retracted_meta_fact_is_unlinked(meta: Bench) -> None:
    meta.env.eval("(assert (goal (id G) (mode SELECTED) (meta-fact (fact-index (assert (tries))))))")
    meta.tick()
    assert meta.env.retract(index_of(meta, "tries"))
    meta.tick()
    assert (meta.goal("G")["meta-fact"], meta.goal("G")["meta-template"]) == (0, "nil")
    assert not meta.all("goal-meta-link")
