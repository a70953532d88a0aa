"""Everything declared, of the right number and type; with the texts of Fawkes."""

from __future__ import annotations

import re

import pytest

from cxbridge.errors import PddlError
from cxbridge.executive.pddl import PddlSemanticError, parse_domain
from tests.executive.pddl.texts import action, domain


@pytest.mark.parametrize(
    ("condition", "message"),
    [
        ("(gone)", "Unknown predicate: gone"),
        ("(and (not (or (gone))))", "Unknown predicate: gone"),
        ("(free)", "Predicate argument length missmatch, expected 1 but got 0"),
        ("(at ?r ?p ?p)", "Predicate argument length missmatch, expected 2 but got 3"),
        ("(free (dist ?p ?p))", "Unexpected nested predicate."),
        ("(free nowhere)", "Unknown constant nowhere"),
        ("(free ?x)", "Unknown Parameter ?x"),
        ("(free ?r)", "Type missmatch: Argument 0 of free expects place but got robot"),
        ("(at ?r ?r)", "Type missmatch: Argument 1 of at expects place but got robot"),
        ("(exists (?r - place) (at ?r ?p))", "Type missmatch: Argument 0 of at expects robot but got place"),
        ("(and (exists (?z - place) (free ?z)) (free ?z))", "Unknown Parameter ?z"),
        # Fawkes does not look so far
        ("(at start (gone))", "Unknown predicate: gone"),
        ("(imply (ready) (gone))", "Unknown predicate: gone"),
        ("(= ?r ?x)", "Unknown Parameter ?x"),
        ("(< (gone) 3)", "Unknown function: gone"),
        ("(< (dist ?p) 3)", "Function argument length missmatch, expected 2 but got 1"),
    ],
)
def test_invalid_conditions_are_errors(condition: str, message: str) -> None:
    with pytest.raises(PddlSemanticError) as caught:
        parse_domain(domain(action(condition)), "d.pddl")
    assert caught.value.message == message
    assert (caught.value.file, caught.value.line) == ("d.pddl", 9)


@pytest.mark.parametrize(
    "effect", ["(gone)", "(when (gone) (ready))", "(when (ready) (gone))", "(increase (gone) 1)"]
)
def test_effects_with_unknown_names_are_errors(effect: str) -> None:
    with pytest.raises(PddlSemanticError, match=r"Unknown .*: gone") as caught:
        parse_domain(domain(action(effect=effect)))
    assert caught.value.line == 10


@pytest.mark.parametrize(
    "formula", ["(at start (gone))", "(when (gone) (gone))", "(< (gone) 3)", "(= ?r ?x)"]
)
def test_strict_parser_skips_checks_below_times_and_numbers(formula: str) -> None:
    parse_domain(domain(action(effect=formula)), fawkes_compat=True)


@pytest.mark.parametrize(
    "condition",
    [
        "(free home)",  # dock is a place
        "(exists (?d - dock) (free ?d))",
        "(and (= ?r ?r) (< (+ (dist ?p home) -1.5e3) (* 2 (total-cost))))",
        "(forall (?r - place) (free ?r))",  # hides the parameter
    ],
)
def test_valid_conditions_are_accepted(condition: str) -> None:
    assert parse_domain(domain(action(condition))).actions


def test_parameters_of_unknown_types_are_errors() -> None:
    with pytest.raises(PddlSemanticError, match="Unknown type: x - gone"):
        parse_domain(domain(action(parameters="?x - gone")))
    text = domain(action(parameters="?x - object"), types="(:types robot place dock)")
    assert parse_domain(text)
    with pytest.raises(PddlSemanticError, match="Unknown type: x - object"):
        parse_domain(text, fawkes_compat=True)
    assert parse_domain(domain(action(parameters="?x")))
    with pytest.raises(PddlSemanticError, match="Missing type"):
        parse_domain(domain(action(parameters="?x")), fawkes_compat=True)


_TYPED = """\
(define (domain test) (:requirements :adl :fluents :typing) (:types here - object)
(:constants home - here)
(:predicates (free ?p - here))
(:functions (dist ?a - here))
(:action go :parameters (?a - here)
  :precondition (and (exists (?b - here) (free ?b)) (imply (forall (?c - here) (free ?c)) (free ?a)))
  :effect (and (forall (?d - here) (free ?d)) (when (exists (?e - here) (free ?e)) (free ?a))))
(:durative-action slow :parameters (?a - here) :duration (= ?duration 5)
  :condition (at start (forall (?b - here) (free ?b)))
  :effect (at end (forall (?c - here) (free ?c)))))
"""
_PLACES_OF_TYPES = [found.start() for found in re.finditer("- here", _TYPED)]


@pytest.mark.parametrize("place", _PLACES_OF_TYPES)
def test_undeclared_type_is_an_error_everywhere(place: int) -> None:
    """A misspelt type would make a ``forall`` true of nothing."""
    assert parse_domain(_TYPED)
    invalid = f"{_TYPED[:place]}- hree{_TYPED[place + len('- here') :]}"
    with pytest.raises(PddlSemanticError, match=r"Unknown type: \w+ - hree") as caught:
        parse_domain(invalid)
    assert caught.value.line == _TYPED.count("\n", 0, place) + 1


def test_types_without_typing_are_one_warning() -> None:
    warnings: list[PddlError] = []
    text = domain(action(), requirements=":strips")
    parse_domain(text, "d.pddl", warn=warnings.append)
    (warning,) = warnings
    assert (warning.file, warning.line, warning.column) == ("d.pddl", 3, 9)
    assert "no :typing" in warning.message
    with pytest.raises(PddlSemanticError, match="Type missmatch"):
        parse_domain(domain(action("(free ?r)"), requirements=":strips"))
    with pytest.raises(PddlSemanticError, match="Requirement typing disabled") as caught:
        parse_domain(text, fawkes_compat=True)
    assert caught.value.hint is not None


def test_either() -> None:
    predicates = "(p ?x - (either robot dock)) (ready)"
    fine = domain(action("(p ?r)"), predicates=predicates)
    assert parse_domain(fine)
    with pytest.raises(PddlSemanticError, match=r"expects \(either robot dock\) but got place"):
        parse_domain(domain(action("(p ?p)"), predicates=predicates))
    with pytest.raises(PddlSemanticError, match=r"got \(either robot place\)"):
        parse_domain(domain(action("(p ?u)", parameters="?u - (either robot place)"), predicates=predicates))


def test_untyped_argument_fits_object_only() -> None:
    predicates = "(any ?x) (object ?x - object) (place ?x - place) (ready)"
    for name in ("any", "object"):
        assert parse_domain(domain(action(f"({name} ?x)", parameters="?x"), predicates=predicates))
    warnings: list[PddlError] = []
    text = domain(action("(place ?x)", parameters="?x"), predicates=predicates)
    parse_domain(text, warn=warnings.append)
    assert ["expects place but got object" in warning.message for warning in warnings] == [True]
    with pytest.raises(PddlSemanticError, match="expects place but got robot"):
        parse_domain(domain(action("(place ?x)", parameters="?x - robot"), predicates=predicates))


def test_cycle_of_types_is_one_error() -> None:
    types = "(:types robot - place place - robot dock)"
    with pytest.raises(PddlSemanticError, match="the type robot is a subtype of itself") as caught:
        parse_domain(domain(action("(p ?r)"), types=types, predicates="(p ?d - dock) (ready)"))
    assert caught.value.line == 3
    assert parse_domain(domain(action(), types="(:types object robot - object place dock)"))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (domain(f"{action()}\n{action()}"), "there is a second action go"),
        (domain(action(), predicates="(ready) (ready)"), "there is a second predicate ready"),
        (domain(action(), functions="(:functions (f) (f))"), "there is a second function f"),
        (domain(action(parameters="?r - robot ?r - place")), "there is a second parameter of action go r"),
    ],
)
def test_duplicate_names_are_errors(text: str, message: str) -> None:
    with pytest.raises(PddlSemanticError, match=message):
        parse_domain(text)
    assert parse_domain(text, fawkes_compat=True)


def test_constant_of_two_types_fits_either() -> None:
    constants = "(:constants home - dock home - robot)"
    assert parse_domain(domain(action("(and (at home ?p) (free home))"), constants=constants))
