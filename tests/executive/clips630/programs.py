"""Random programs: rules over a few templates, the same for the same seed."""

from __future__ import annotations

import random

_VALUES = ("a", "b", "1", "2", "2.5", '"s"')
_HEAD = """(deftemplate p (slot x) (slot y (default a)) (multislot z))
(deftemplate q (slot x) (slot y (default-dynamic (+ 1 1))))
(defglobal ?*steps* = 0)
"""


def program(seed: int) -> str:
    """Return a program of deffacts and rules; each rule prints a line and changes facts."""
    chance = random.Random(seed)
    facts = "\n".join(f"  {_fact(chance)}" for _ in range(chance.randint(3, 8)))
    rules = "\n".join(_rule(chance, number) for number in range(chance.randint(3, 8)))
    return f"{_HEAD}(deffacts start\n{facts})\n{rules}\n"


def _value(chance: random.Random) -> str:
    return chance.choice(_VALUES)


def _fact(chance: random.Random) -> str:
    return chance.choice(
        (
            f"(p (x {_value(chance)}) (y {_value(chance)}) (z {_value(chance)} {_value(chance)}))",
            f"(p (x {_value(chance)}))",
            f"(q (x {_value(chance)}))",
            f"(o {_value(chance)} {_value(chance)})",
            f"(o {_value(chance)})",
        )
    )


def _pattern(chance: random.Random, variable: str) -> str:
    return chance.choice(
        (
            f"(p (x ?{variable}))",
            f"(p (x ?{variable}) (y ?y{variable}))",
            f"(p (x ?{variable}&~{_value(chance)}))",
            f"(p (x ?{variable}) (z $? {_value(chance)} $?))",
            f"(q (x ?{variable}))",
            f"(o ?{variable} $?)",
            f"(o $? ?{variable})",
        )
    )


def _rule(chance: random.Random, number: int) -> str:
    salience = f"(declare (salience {chance.choice((-2, -1, 0, 0, 0, 1, 5))}))"
    conditions, facts = [], []
    for index in range(chance.randint(1, 3)):
        variable = chance.choice(("v", "w"))
        kind = chance.random()
        if index == 0 or kind < 0.6:
            variable = "v" if index == 0 else variable
            conditions.append(f"?f{index} <- {_pattern(chance, variable)}")
            facts.append(index)
        elif kind < 0.8:
            conditions.append(f"(not {_pattern(chance, 'v')})")
        elif kind < 0.9:
            conditions.append(f"(exists {_pattern(chance, 'u')})")
        else:
            conditions.append(f"(test (neq ?v {_value(chance)}))")
    actions = [f'(printout t "r{number} " ?v " " (fact-index ?f0) crlf)']
    if chance.random() < 0.8:
        actions.append(_action(chance, chance.choice(facts), conditions))
    if chance.random() < 0.3:
        actions.append(f"(assert {_fact(chance)})")
    return f"(defrule r{number} {salience}\n  " + "\n  ".join([*conditions, "=>", *actions]) + ")"


def _action(chance: random.Random, fact: int, conditions: list[str]) -> str:
    is_p = any(text.startswith(f"?f{fact} <- (p") for text in conditions)
    is_q = any(text.startswith(f"?f{fact} <- (q") for text in conditions)
    if is_p and chance.random() < 0.8:
        verb = chance.choice(("modify", "modify", "duplicate"))
        return f"({verb} ?f{fact} (y {_value(chance)}) (z ?v {_value(chance)}))"
    if is_q and chance.random() < 0.8:
        return f"(modify ?f{fact} (y {_value(chance)}))"
    return f"(retract ?f{fact})"
