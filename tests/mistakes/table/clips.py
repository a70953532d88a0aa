"""Mistakes in CLIPS files."""

from __future__ import annotations

from typing import Final

from tests.mistakes.table.mistake import RUN, STUCK, Edit, Mistake, mistake

_DOMAIN: Final = "hello-domain.clp"
_GOALS: Final = "hello-goals.clp"
_PLAN: Final = "hello-plan.clp"

_SYNTAX: Final = (
    mistake(
        "a parenthesis is missing",
        _GOALS,
        "(mode SELECTED)))",
        "(mode SELECTED))",
        "hello-select never closes",
        "hello-goals.clp:23",
    ),
    mistake(
        "a parenthesis is missing at the end of the file",
        _PLAN,
        "(mode EXPANDED)))",
        "(mode EXPANDED))",
        "hello-expand never closes",
        "hello-plan.clp:1",
    ),
    mistake(
        "a parenthesis is too many",
        _GOALS,
        "(mode DISPATCHED)))",
        "(mode DISPATCHED))))",
        "Expected the beginning|too many",
        "hello-goals.clp:38",
    ),
    mistake(
        "a string never closes",
        _GOALS,
        '"It is "',
        '"It is ',
        "hello-evaluate never closes: its string is open",
        "hello-goals.clp:43",
    ),
    mistake(
        "the arrow is missing",
        _GOALS,
        "  (skiller-control (acquired TRUE))\n  =>\n",
        "  (skiller-control (acquired TRUE))\n",
        "hello-select",
        "hello-goals.clp:23",
    ),
    mistake(
        "a rule has no name", _GOALS, "(defrule hello-dispatch", "(defrule", "name", "hello-goals.clp:35"
    ),
    mistake(
        "a construct is misspelt",
        _GOALS,
        "(defrule hello-dispatch",
        "(defule hello-dispatch",
        "Expected the beginning|defule",
        "hello-goals.clp:35",
    ),
)

_NAMES: Final = (
    mistake("a function is misspelt", _GOALS, "printout t", "prinout t", "prinout", "hello-goals.clp:43"),
    mistake(
        "a deffunction is misspelt",
        _GOALS,
        "(id (hello-id ?name))",
        "(id (hello-di ?name))",
        "hello-di",
        "hello-goals.clp:20",
    ),
    mistake(
        "a deffunction gets too many arguments",
        _GOALS,
        "(id (hello-id ?name))",
        "(id (hello-id ?name 1))",
        "hello-id",
        "hello-goals.clp:20",
    ),
    mistake(
        "a slot is misspelt in a condition",
        _GOALS,
        "(class GREET) (mode FINISHED)",
        "(class GREET) (mod FINISHED)",
        "'mod'",
        "hello-goals.clp:41",
    ),
    mistake(
        "a slot is misspelt in assert",
        _PLAN,
        "(type SEQUENTIAL)",
        "(typ SEQUENTIAL)",
        "'typ'",
        "hello-plan.clp:4",
    ),
    mistake(
        "a slot of a goal is misspelt in assert",
        _GOALS,
        "(class GREET) (params",
        "(clas GREET) (params",
        "'clas'",
        "hello-goals.clp:20",
    ),
    mistake(
        "a deftemplate is misspelt in a condition",
        _GOALS,
        "(hello-visitor (name ?name))",
        "(hello-visiter (name ?name))",
        "hello-visiter",
        "hello-goals.clp:16",
    ),
    mistake(
        "a deftemplate is misspelt in assert",
        _PLAN,
        "(plan-action (id 1)",
        "(plan-acton (id 1)",
        "hello-expand",
        "hello-plan.clp:2",
    ),
    mistake(
        "a variable is misspelt",
        _GOALS,
        '"It is " ?outcome',
        '"It is " ?outcom',
        r"\?outcom",
        "hello-goals.clp:43",
    ),
    mistake(
        "a defglobal is not defined", _GOALS, '"It is "', "?*HELLO*", r"\?\*HELLO\*", "hello-goals.clp:43"
    ),
    mistake(
        "a file is loaded by a wrong name",
        _PLAN,
        "(defrule hello-expand",
        '(defrule hello-more (executive-init) => (path-load "more.clp"))\n(defrule hello-expand',
        "more.clp",
        "hello-plan.clp:1",
    ),
)

_VALUES: Final = (
    mistake(
        "a value has the wrong type",
        _GOALS,
        "(hello-visitor (name ann))",
        '(hello-visitor (name "ann"))',
        "allowed types",
        "hello-goals.clp:12",
    ),
    mistake(
        "a goal mode is misspelt in a condition",
        _GOALS,
        "(mode COMMITTED))\n  =>",
        "(mode COMITTED))\n  =>",
        "hello-dispatch",
        "hello-goals.clp:36",
    ),
    mistake(
        "a type of a slot is misspelt",
        _GOALS,
        "(type INTEGER)",
        "(type INT)",
        "hello-visitor",
        "hello-goals.clp:1",
    ),
    mistake(
        "a default is of another type",
        _GOALS,
        "(default 30)",
        '(default "30")',
        "hello-visitor",
        "hello-goals.clp:3",
    ),
)

_STUCK_AGENTS: Final = (
    mistake(
        "a goal mode is misspelt in modify",
        _GOALS,
        "(mode SELECTED)",
        "(mode SELECT)",
        "GREET-ann is SELECT .*, which is not a mode of goals|'?SELECT'?",
        "hello-goals.clp:27",
        status=STUCK,
    ),
    mistake(
        "a slot is misspelt in modify",
        _GOALS,
        "(modify ?goal (mode RETRACTED))",
        "(modify ?goal (moed RETRACTED))",
        "GREET-ann is EVALUATED.*actions of rule hello-retract",
        "hello-goals.clp:46",
        status=STUCK,
    ),
    mistake(
        "an error happens in a rule",
        _GOALS,
        '"It is "',
        "(/ 1 0)",
        "GREET-ann is FINISHED.*actions of rule hello-evaluate",
        "hello-goals.clp:40",
        status=STUCK,
    ),
    mistake(
        "facts of deffacts never come",
        _GOALS,
        "(defrule hello-visitors\n  (domain-facts-loaded)\n  =>\n  (assert (hello-visitor (name ann))))",
        "(deffacts hello-visitors\n  (hello-visitor (name ann)))",
        "deffacts hello-visitors",
        "hello-goals.clp:9",
        status=STUCK,
    ),
    mistake(
        "a goal is never dispatched",
        _GOALS,
        "(defrule hello-dispatch\n  ?goal <- (goal (class GREET)",
        "(defrule hello-dispatch\n  ?goal <- (goal (class GRET)",
        "GREET-ann is COMMITTED",
        "hello-goals.clp:33",
        status=STUCK,
    ),
    mistake(
        "nobody asks for control of the Skiller",
        _DOMAIN,
        "(assert (domain-loaded)\n          (skiller-control))",
        "(assert (domain-loaded))",
        r"GREET-ann is FORMULATED \(.*\); no fact \(skiller-control\)",
        "hello-goals.clp:20",
        status=STUCK,
    ),
    mistake(
        "the file of action selection is forgotten",
        "scenario.yaml",
        "action-selection/sequential.clp, ",
        "",
        "GREET-ann is DISPATCHED .*action greet ann is FORMULATED",
        "hello-plan.clp:6",
        status=STUCK,
    ),
    mistake(
        "nothing tells the domain that all facts are there",
        _DOMAIN,
        "(assert (domain-facts-loaded))",
        "(assert (domain-facts-lodaed))",
        "no goal has appeared",
        "hello-domain.clp:12",
        status=STUCK,
    ),
    mistake(
        "the time is forgotten",
        "scenario.yaml",
        "assert-time-each-loop: true\n",
        "assert-time-each-loop: false\n",
        "assert-time-each-loop is not true",
        "scenario.yaml:3",
        status=STUCK,
    ),
    Mistake(
        "an interface is read that nobody writes",
        "SkillerInterface::Arm has no writer",
        (
            Edit(
                _DOMAIN,
                'blackboard-open-writing "HelloInterface" "eye"',
                'blackboard-open-reading "SkillerInterface" "Arm"',
            ),
            Edit(
                _GOALS,
                "  (skiller-control (acquired TRUE))\n",
                '  (skiller-control (acquired TRUE))\n  (SkillerInterface (id "Arm"))\n',
            ),
        ),
        "hello-domain.clp:18",
        RUN,
        STUCK,
    ),
)

MISTAKES: Final[tuple[Mistake, ...]] = (*_SYNTAX, *_NAMES, *_VALUES, *_STUCK_AGENTS)
