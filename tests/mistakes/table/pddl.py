"""Mistakes in domain.pddl."""

from __future__ import annotations

from typing import Final

from tests.mistakes.table.mistake import Mistake, mistake

_FILE: Final = "domain.pddl"

MISTAKES: Final[tuple[Mistake, ...]] = (
    mistake(
        "a parenthesis is missing",
        _FILE,
        ":effect (greeted ?who)))",
        ":effect (greeted ?who))",
        "",
        "domain.pddl:1",
    ),
    mistake(
        "a parenthesis is too many",
        _FILE,
        ":effect (greeted ?who)))",
        ":effect (greeted ?who))))",
        "",
        "domain.pddl:10",
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
        "a parameter is misspelt",
        _FILE,
        ":effect (greeted ?who)",
        ":effect (greeted ?how)",
        r"\?how",
        "domain.pddl:10",
    ),
    mistake(
        "a predicate gets too many arguments",
        _FILE,
        ":effect (greeted ?who)",
        ":effect (greeted ?who ann)",
        "greeted",
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
    mistake("a requirement is not known", _FILE, ":typing", ":types", ":types", "domain.pddl:2"),
    mistake(
        "the word domain is missing", _FILE, "(define (domain hello)", "(define (hello)", "", "domain.pddl:1"
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
        "the plan names an action that the domain lacks",
        "hello-plan.clp",
        "(action-name greet)",
        "(action-name greeet)",
        "greeet",
        "hello-plan.clp:6",
        status=3,
    ),
)
