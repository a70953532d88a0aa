"""Valid PDDL that Fawkes' parser refuses."""

from __future__ import annotations

import pytest

from cxbridge.executive.pddl import PddlSyntaxError, parse_domain
from cxbridge_studio.check.fawkes_pddl import check_domain
from tests.executive.pddl.texts import GARDEN, action, domain

ONE_ACTION = "(:action a :parameters () :precondition (and) :effect (and))"
SWAPPED_SECTIONS = (
    "(define (domain x) (:requirements :typing) (:constants k - t) (:types t) "
    f"(:predicates (p)) {ONE_ACTION})"
)
PREDICATES = "(ready) (exists-path ?x) (forall_done)"
SWAPPED = "(:action a :parameters () :effect (ready) :precondition (ready))"


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        (GARDEN.replace("(:requirements :strips :typing)", ""), "there are no requirements"),
        (f"(define (domain x) (:requirements) {ONE_ACTION})", "there are no predicates"),
        ("(define (domain x) (:requirements) (:predicates (p)))", "there are no actions"),
        (GARDEN.replace(":precondition (held ?t)", ""), "action pick has no condition"),
        (GARDEN.replace(":effect (not (held ?t))", ""), "action pick has no effect"),
        (domain(SWAPPED), ":precondition comes too late"),
        (SWAPPED_SECTIONS, ":types comes too late"),
    ],
)
def test_domains_that_fawkes_refuses(text: str, reason: str) -> None:
    with pytest.raises(PddlSyntaxError, match="Fawkes' parser refuses this") as caught:
        check_domain(parse_domain(text))
    assert reason in caught.value.message


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("(exists-path ?r)", "'exists-path' for a keyword"),
        ("(forall_done)", "for a keyword"),
        ("(AND (ready))", "'AND' must be written 'and'"),
        ("(<= (total-cost) 3)", "does not know '<='"),
        ("(imply (ready) (ready))", "does not know 'imply'"),
        ("(and)", "Unknown predicate: and"),
        ("(at  start (ready))", "exactly one blank after 'at'"),
        ("(at\nend (ready))", "exactly one blank"),
    ],
)
def test_conditions_that_fawkes_refuses(text: str, reason: str) -> None:
    with pytest.raises(PddlSyntaxError, match="Fawkes' parser refuses this") as caught:
        check_domain(parse_domain(domain(action(text), predicates=PREDICATES)))
    assert reason in caught.value.message


def test_names_have_the_letters_of_their_declaration() -> None:
    with pytest.raises(PddlSyntaxError, match="'HELD' must be written 'held'"):
        check_domain(parse_domain(GARDEN.replace(":effect (not (held ?t))", ":effect (not (HELD ?t))")))


@pytest.mark.parametrize(
    "condition", ["(and (ready) (not (or (ready))))", "(= ?r ?r)", "(exists (?x - place) (ready))"]
)
def test_what_fawkes_reads(condition: str) -> None:
    check_domain(parse_domain(GARDEN))
    check_domain(parse_domain(domain(action(condition))))
