"""Mistakes in domain.pddl."""

from __future__ import annotations

from typing import Final

from tests.mistakes.table.mistake import Mistake, mistake

_FILE: Final = "domain.pddl"
_EFFECT: Final = ":effect (greeted ?who)"
_FAILED: Final = 1
_DONE: Final = 0

MISTAKES: Final[tuple[Mistake, ...]] = (
    mistake(
        "a parenthesis is missing", _FILE, f"{_EFFECT}))", f"{_EFFECT})", "never closed", "domain.pddl:1"
    ),
    mistake(
        "a parenthesis is too many", _FILE, f"{_EFFECT}))", f"{_EFFECT})))", "too many", "domain.pddl:10"
    ),
    mistake(
        "a predicate is misspelt", _FILE, ":effect (greeted", ":effect (greted", "greted", "domain.pddl:10"
    ),
    mistake(
        "a type is misspelt",
        _FILE,
        "(:constants ann - person)",
        "(:constants ann - persno)",
        "persno",
        "domain.pddl:4",
    ),
    mistake(
        "a type of a parameter is misspelt",
        _FILE,
        ":parameters (?who - person)",
        ":parameters (?who - persno)",
        "persno",
        "domain.pddl:8",
    ),
    mistake("a parameter is misspelt", _FILE, _EFFECT, ":effect (greeted ?how)", r"\?how", "domain.pddl:10"),
    mistake(
        "a predicate gets too many arguments",
        _FILE,
        _EFFECT,
        ":effect (greeted ?who ann)",
        "expected 1 but got 2",
        "domain.pddl:10",
    ),
    mistake("a section is misspelt", _FILE, ":predicates", ":predicate", ":predicate", "domain.pddl:5"),
    mistake(
        "a keyword of an action is misspelt",
        _FILE,
        ":precondition",
        ":preconditions",
        ":preconditions",
        "domain.pddl:9",
    ),
    mistake(
        "typing is not required", _FILE, ":strips :typing", ":strips", "typing", "domain.pddl:4", status=_DONE
    ),
    mistake(
        "the word domain is missing",
        _FILE,
        "(define (domain hello)",
        "(define (hello)",
        "unexpected 'hello'",
        "domain.pddl:1",
    ),
    mistake(
        "the file is named wrongly",
        "hello-domain.clp",
        '"domain.pddl"',
        '"domian.pddl"',
        "domian.pddl",
        "hello-domain.clp:5",
    ),
    mistake(
        "a precondition is false",
        _FILE,
        ":precondition (not (greeted ?who))",
        ":precondition (greeted ?who)",
        "the precondition of 'greet' is false",
        "hello-plan.clp:6",
        status=_FAILED,
    ),
    mistake(
        "the plan names an action that the domain lacks",
        "hello-plan.clp",
        "(action-name greet)",
        "(action-name greeet)",
        "the action 'greeet' has no executor; did you mean greet",
        "hello-plan.clp:6",
        status=_FAILED,
    ),
)
