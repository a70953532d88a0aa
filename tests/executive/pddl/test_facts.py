"""Facts of a domain equal those of Fawkes in content, order and ids."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from cxbridge.errors import PddlError
from cxbridge.executive.pddl import (
    FactToAssert,
    domain_facts,
    formula_facts,
    load_domain,
    parse_domain,
    parse_formula,
)
from tests.executive.pddl.texts import GARDEN, action, domain
from tests.support import SHARED, needs_shared

DOMAINS = sorted((SHARED / "fawkes-data" / "pddl").glob("*/domain.pddl"))

GARDEN_FACTS = """\
(domain-object-type (name tool) (super-type object))
(domain-object-type (name plant) (super-type object))
(domain-object-type (name rose) (super-type plant))
(domain-predicate (name held) (param-names t) (param-types tool))
(domain-predicate (name dry) (param-names p) (param-types plant))
(domain-operator-parameter (name p) (operator pour) (type plant))
(domain-operator (name pour) (param-names p))
(pddl-formula (id pour1) (part-of pour) (type conjunction))
(pddl-formula (id pour11) (part-of pour1) (type atom))
(pddl-predicate (id pour11-atom) (part-of pour11) (predicate held) (param-names c) (param-constants can))
(pddl-formula (id pour12) (part-of pour1) (type negation))
(pddl-formula (id pour121) (part-of pour12) (type disjunction))
(pddl-formula (id pour1211) (part-of pour121) (type atom))
(pddl-predicate (id pour1211-atom) (part-of pour1211) (predicate dry) (param-names p) (param-constants nil))
(pddl-formula (id pour1212) (part-of pour121) (type atom))
(pddl-predicate (id pour1212-atom) (part-of pour1212) (predicate EQUALITY) (param-names p p) (param-constants nil nil))
(domain-effect (part-of pour) (predicate dry) (param-names p) (param-constants nil) (type NEGATIVE))
(domain-effect (part-of pour) (predicate held) (param-names c) (param-constants can) (type POSITIVE))
(domain-operator-parameter (name t) (operator pick) (type tool))
(domain-operator (name pick) (param-names t))
(pddl-formula (id pick1) (part-of pick) (type conjunction))
(pddl-formula (id pick11) (part-of pick1) (type atom))
(pddl-predicate (id pick11-atom) (part-of pick11) (predicate held) (param-names t) (param-constants nil))
(domain-effect (part-of pick) (predicate held) (param-names t) (param-constants nil) (type NEGATIVE))
"""  # noqa: E501 - a fact a line


def condition_facts(text: str) -> list[str]:
    return [str(row) for row in formula_facts(parse_formula(text), "op")]


def effect_facts(text: str, **options: bool) -> list[FactToAssert]:
    rows = domain_facts(parse_domain(domain(action(effect=text))), **options)  # type: ignore[arg-type]
    return [row for row in rows if row.template == "domain-effect"]


@pytest.mark.parametrize("fawkes_compat", [False, True])
def test_worked_example(fawkes_compat: bool) -> None:
    garden = parse_domain(GARDEN, fawkes_compat=fawkes_compat)
    rows = domain_facts(garden, fawkes_compat=fawkes_compat)
    assert [str(row) for row in rows] == GARDEN_FACTS.splitlines()


def test_id_of_tenth_part_collides_as_in_fawkes() -> None:
    ids = [fact.split()[2] for fact in condition_facts(f"(and {'(or (p)) ' * 11})") if "atom)" not in fact]
    assert ids[:3] == ["op1)", "op11)", "op12)"]
    assert ids[-1] == "op111)"
    assert "(id op111)" in "".join(condition_facts(f"(and {'(or (p)) ' * 1})"))


@pytest.mark.parametrize(
    ("condition", "facts"),
    [
        # a time takes the formula around its part with it
        ("(at start (p ?x))", "(pddl-predicate (id op1-atom) (part-of op1) (predicate p) (param-names x) "),
        ("(and (over all (p)))", "\n".join(condition_facts("(and (p))"))),
        ("(= ?x k)", "(predicate EQUALITY) (param-names x c) (param-constants nil k)"),
        ("(< ?x 5)", "(predicate <) (param-names x c) (param-constants nil 5)"),
        ("()", "(pddl-formula (id op1) (part-of op) (type conjunction))"),
    ],
)
def test_facts_of_condition(condition: str, facts: str) -> None:
    assert facts in "\n".join(condition_facts(condition))


@pytest.mark.parametrize(
    ("condition", "message"),
    [
        ("(exists (?x - place) (free ?x))", "'exists' in a condition"),
        ("(and (ready) (forall (?x - place) (free ?x)))", "'forall' in a condition"),
    ],
)
def test_conditions_without_facts_are_an_error(condition: str, message: str) -> None:
    parsed = parse_domain(domain(action(condition)), "d.pddl")
    for fawkes_compat in (False, True):
        with pytest.raises(PddlError, match=message) as caught:
            domain_facts(parsed, fawkes_compat=fawkes_compat)
        assert (caught.value.file, caught.value.line) == ("d.pddl", 9)
        assert caught.value.hint is not None


def test_signs_of_effects() -> None:
    rows = effect_facts("(and (not (not (free ?p))) (at end (not (and (at ?r ?p) (ready)))) (and))")
    assert [(row.slots["predicate"], row.slots["type"]) for row in rows] == [
        ("free", "POSITIVE"),
        ("at", "NEGATIVE"),
        ("ready", "NEGATIVE"),
    ]
    assert rows[2].slots["param-names"] == ()


def test_changes_of_numbers_have_no_fact() -> None:
    warnings: list[PddlError] = []
    parsed = parse_domain(domain(action(effect="(and (ready) (increase (total-cost) 1))")))
    for fawkes_compat in (False, True):
        rows = domain_facts(parsed, fawkes_compat=fawkes_compat, warn=warnings.append)
        assert [row.slots["predicate"] for row in rows if row.template == "domain-effect"] == ["ready"]
    assert [(error.line, error.column) for error in warnings] == [(10, 22)]
    assert "Fawkes has no fact for 'increase'" in warnings[0].message


def test_comparisons_of_numbers_have_the_variables_as_parameters() -> None:
    text = "(and (ready) (>= (- (total-cost) 1) 3))"
    facts = condition_facts(text)
    assert (
        "(pddl-predicate (id op12-atom) (part-of op12) (predicate >=) (param-names) (param-constants))"
        in facts
    )
    assert "(domain-comparison (predicate-id op12-atom) (text (>= (- (total-cost) 1) 3)))" in facts


def test_comparisons_of_numbers_are_refused_in_fawkes() -> None:
    parsed = parse_domain(domain(action("(< (total-cost) 3)")), "d.pddl")
    with pytest.raises(PddlError, match="a number or nested predicate"):
        domain_facts(parsed, fawkes_compat=True)


@pytest.mark.parametrize("effect", ["(when (ready) (free ?p))", "(or (ready) (free ?p))", "(= ?r ?r)"])
def test_unsupported_effects_are_refused(effect: str) -> None:
    with pytest.raises(PddlError, match="cannot be expressed as facts"):
        effect_facts(effect)
    warnings: list[PddlError] = []
    parsed = parse_domain(domain(action(effect=f"(and {effect} (ready))")))
    rows = domain_facts(parsed, fawkes_compat=True, warn=warnings.append)
    assert [row.slots["predicate"] for row in rows if row.template == "domain-effect"] == ["ready"]
    assert len(warnings) == 1


UNTYPED = domain(
    "(:action go :parameters (?x) :precondition (p ?x) :effect (p ?x))",
    requirements=":strips", types="(:types a)", constants="", predicates="(p ?x)", functions="",
)  # fmt: skip


def test_untyped_parameters_are_lost_in_fawkes() -> None:
    kept = [str(row) for row in domain_facts(parse_domain(UNTYPED))]
    assert kept[:2] == [
        "(domain-object-type (name a))",
        "(domain-predicate (name p) (param-names x) (param-types))",
    ]
    assert kept[2] == "(domain-operator-parameter (name x) (operator go))"
    warnings: list[PddlError] = []
    lost = [str(row) for row in domain_facts(parse_domain(UNTYPED), fawkes_compat=True, warn=warnings.append)]
    assert lost == kept[:2] + kept[3:]
    assert len(warnings) == 1


def test_either_multiplies_parameters_in_fawkes() -> None:
    predicates = "(p ?x - (either robot place)) (ready)"
    text = domain(action("(p ?u)", parameters="?u - (either robot place)"), predicates=predicates)
    sane, compat = (
        [str(row) for row in domain_facts(parse_domain(text), fawkes_compat=flag)] for flag in (False, True)
    )
    assert "(domain-predicate (name p) (param-names x) (param-types object))" in sane
    assert "(domain-predicate (name p) (param-names x x) (param-types robot place))" in compat
    assert "(domain-operator (name go) (param-names u))" in sane
    assert "(domain-operator (name go) (param-names u u))" in compat
    for rows in (sane, compat):
        assert "(domain-operator-parameter (name u) (operator go) (type place))" in rows


# ---- real domains


@pytest.mark.parametrize("file", DOMAINS, ids=lambda file: file.parent.name)
def test_real_domains_are_the_same_with_fawkes_grammar(file: Path) -> None:
    sane, compat = load_domain(file), load_domain(file, fawkes_compat=True)
    assert sane == compat
    assert domain_facts(sane) == domain_facts(compat, fawkes_compat=True)


@needs_shared
@pytest.mark.parametrize("run", ["skiller-1", "skiller-2", "simulator-1"])
def test_facts_equal_recorded_facts(run: str) -> None:
    log = (SHARED / "traces" / "test-scenario" / run / "fawkes.log").read_text().splitlines()
    start = next(index for index, line in enumerate(log) if re.search(r"FIRE +50 load-domain", line))
    end = next(index for index in range(start, len(log)) if "(domain-loaded)" in log[index])
    asserted = [line.split("==> ")[1].split(maxsplit=1)[1] for line in log[start:end] if "==> f-" in line]
    recorded = [without_defaults(fact) for fact in asserted]
    rows = domain_facts(load_domain(SHARED / "fawkes-data" / "pddl" / "test-scenario" / "domain.pddl"))
    assert [str(row) for row in rows] == recorded
    assert len(recorded) == 38


def without_defaults(fact: str) -> str:
    """Leave out of a recorded fact what its template gives; this domain's types have no super type."""
    fact = re.sub(r" \((?:sensed|value-predicate|wait-sensed|exogenous) \w+\)| \(param-values\)", "", fact)
    fact = fact.replace("(super-type object)", "").replace(" )", ")")
    return re.sub(r"\(domain-effect \(name gen\d+\)", "(domain-effect", fact)
