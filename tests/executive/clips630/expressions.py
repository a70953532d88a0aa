"""Expressions for every function of CLIPS 6.30, with arguments of all types."""

from __future__ import annotations

import random
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from tests import support
from tests.executive.clips630 import engines

EXCLUDED: Mapping[str, str] = {
    "a function of CLIPS' own, not to be called": r"\(.*\)|active-.*|options|\(.*",
    "ends, empties or stops what the expressions work on": r"exit|clear|reset|halt|undef.*|run",
    "reads the terminal": r"read|readline|read-number|get-char",
    "files: test_programs.py": (
        r"batch\*?|load\*?|b?save|bload|(b?load|b?save|restore)-(facts|instances)|open|close|rename|remove"
        r"|dribble-o.*|constructs-to-c|fetch|toss|(get|print)-region|set-locale|put-char"
    ),
    "other processes": r"system",
    "time and memory": r"time|timer|mem-.*|release-mem|conserve-mem|profile.*|.*-profile-.*",
    "lists what CLIPS itself brings along": (
        r"get-function-list|apropos|operating-system|get-function-restrictions"
    ),
    "depends on the symbols that there are": r"gensym\*",
    "the watch items are the host's": r"watch|unwatch|list-watch-items|get-watch-item",
    "special forms: FORMS": (
        r"if|while|loop-for-count|progn|progn\$|foreach|switch|bind|return|break|assert|modify|duplicate"
        r"|(message-)?(modify|duplicate)-instance|(initialize|make)-instance|expand\$|.*(for|find|any)-?.*(fact|instance).*"
        r"|call|new|object-pattern-match-delay|override-next-.*|call-next-.*|next-.*p|mv-slot.*|init-slots|delete-instance"
        r"|(dynamic-)?(get|put)|ppinstance|call-specific-method|fetch"
    ),
    "breakpoints of CLIPS' own debugger": r"set-break|remove-break|show-breaks|join-activity.*|matches",
}
"""Functions that the generator leaves out, by the reason: patterns of names."""

SYMBOLS = (
    "abc",
    "ABC",
    "nil",
    "TRUE",
    "FALSE",
    "a-b",
    "t",
    "u",
    "C",
    "r",
    "d",
    "MAIN",
    "crlf",
    "a",
    "b",
    "m",
    "zz9",
)
STRINGS = (
    *(
        '""',
        '"abc"',
        '"ABC"',
        '"hello world"',
        r'"a\"b\\c"',
        '"1"',
        '"2.5"',
        '"1e3"',
        '"?x"',
        '"$?x"',
        '"[c1]"',
        '"b"',
    ),
    *(
        '"(+ 1 2)"',
        '"abc def"',
        '"ä€"',
        '"a;b"',
        '"a&b"',
        '"~a"',
        '"TRUE"',
        '" "',
        '"x\ny"',
        '"(o b) ?c"',
        '"="',
    ),
)
INTEGERS = ("0", "1", "-1", "2", "3", "7", "-7", "100", "9223372036854775807", "-9223372036854775808")
FLOATS = (
    *(
        "0.0",
        "-0.0",
        "0.5",
        "1.5",
        "2.5",
        "-2.5",
        "3.5",
        "1e15",
        "1e16",
        "123456789.123456789",
        "1e300",
        "1e-300",
    ),
    *("0.1", "3.0", "(/ 1 3)"),
)
INSTANCE_NAMES = ("[c1]", "[c2]", "[nope]")
MULTIFIELDS = (
    *(
        "(create$)",
        "(create$ a)",
        '(create$ a b "c" 1 2.5)',
        "(create$ 3 1 2)",
        "(create$ 1 1.0 b)",
        "(create$ a b a)",
    ),
    *("(create$ [c1] (the-fact))", '(create$ "" "a b")'),
)
FACTS = ("(the-fact)", "(the-ordered)")
INSTANCES = ("(the-instance)",)

ARGUMENTS = (
    *SYMBOLS,
    *STRINGS,
    *INTEGERS,
    *FLOATS,
    *INSTANCE_NAMES,
    *MULTIFIELDS,
    *FACTS,
    *INSTANCES,
    "(no-value)",
)
"""Expressions of every type."""

_OF_TYPE: Mapping[str, tuple[str, ...]] = {
    "a": (*INSTANCE_NAMES, *INSTANCES, *FACTS),
    "d": FLOATS,
    "e": (*INSTANCE_NAMES, *INSTANCES, "c1"),
    "f": FLOATS,
    "g": (*INTEGERS, *FLOATS, *SYMBOLS),
    "h": (*FACTS, *INTEGERS, *INSTANCE_NAMES, *INSTANCES, "*"),
    "i": INTEGERS,
    "j": (*SYMBOLS, *STRINGS, *INSTANCE_NAMES),
    "k": (*SYMBOLS, *STRINGS),
    "l": INTEGERS,
    "m": MULTIFIELDS,
    "n": (*INTEGERS, *FLOATS),
    "o": INSTANCE_NAMES,
    "p": (*INSTANCE_NAMES, *SYMBOLS),
    "q": (*MULTIFIELDS, *STRINGS, *SYMBOLS),
    "s": STRINGS,
    "w": SYMBOLS,
    "y": FACTS,
    "z": (*FACTS, *INTEGERS, "t", "o"),
}
"""Arguments by the letter that get-function-restrictions has for a type; other letters mean any."""

FORMS = (
    "(if {} then {} else {})",
    "(if {} then {})",
    "(switch {} (case {} then {}) (case {} then x) (default {}))",
    "(progn {} {})",
    "(progn$ (?x {}) (printout t ?x-index ?x crlf))",
    "(foreach ?x {} (printout t ?x-index ?x crlf))",
    "(loop-for-count {} (bind ?*n* (+ ?*n* 1)) (if (> ?*n* 20) then (break)))",
    "(loop-for-count (?i {} {}) (bind ?*n* (+ ?*n* 1)) (printout t ?i) (if (> ?*n* 20) then (break)))",
    "(while {} (bind ?*n* (+ ?*n* 1)) (if (> ?*n* 20) then (break)))",
    "(bind ?*n* {} {})",
    "(bind ?*n*)",
    "(create$ (expand$ {}) {})",
    "(assert (o {} {}))",
    "(assert (new-relation {}))",
    "(assert (t (a {})))",
    "(assert (t (b {})))",
    "(assert (t (c {})))",
    "(assert (t (f {}) (s {})))",
    "(assert (t (m {} {})))",
    "(assert (u (y {})))",
    "(assert (o {}) (o {}))",
    "(duplicate 1 (a {}))",
    "(progn (bind ?f (the-fact)) (duplicate ?f (a {}) (b 9)))",
    "(modify 1 (m {} {}))",
    "(progn (bind ?f (the-fact)) (modify ?f (s {}) (b 1)))",
    "(modify {} (a 2))",
    "(duplicate 2 (m {}))",
    "(duplicate {} (a 1))",
    "(retract {} {})",
    "(printout t {} {} crlf)",
    "(printout {} {} crlf)",
    '(format nil "%s|%d|%g" {} {} {})',
    '(format nil "%5d|%-5d|%05d|%x|%o|%c" {} {} {} {} {} {})',
    '(format nil "%f|%e|%g|%8.3f|%-10.2e|%G" {} {} {} {} {} {})',
    '(format nil "%10s|%-10s|%.2s|%r|%n|%%" {} {} {} {})',
    '(format t "%s%n" {})',
    "(format nil {} {})",
    "(make-instance [x] of C (s {}))",
    "(make-instance {} of C)",
    "(make-instance [new] of C (n {}) (ms {} {}))",
    "(modify-instance [c1] (s {}))",
    "(modify-instance {} (n {}))",
    "(duplicate-instance [c1] to [y] (ms {}))",
    "(message-modify-instance [c1] (s {}))",
    "(initialize-instance [c1] (s {}))",
    "(send [c1] twice {})",
    "(send [c1] put-s {})",
    "(send {} get-s)",
    "(send [c1] {} {})",
    "(any-factp ((?f t)) (eq ?f:a {}))",
    "(find-fact ((?f t)) (< ?f:b {}))",
    "(find-all-facts ((?f t) (?g o)) (neq ?f:a {}))",
    "(do-for-all-facts ((?f t)) {} (printout t (fact-index ?f) ?f:m crlf))",
    "(do-for-fact ((?f t)) (eq {} ?f:b) ?f:c)",
    "(delayed-do-for-all-facts ((?f t)) TRUE (retract ?f))",
    "(do-for-all-facts ((?f o)) TRUE (printout t ?f:implied crlf))",
    "(any-instancep ((?i C)) (eq ?i:s {}))",
    "(find-all-instances ((?i C)) (neq ?i:s {}))",
    "(do-for-all-instances ((?i C)) TRUE (printout t (instance-name ?i) ?i:ms crlf))",
    "(sort {} {})",
    "(sort > {} {} {})",
    "(sort (create$ str-compare) {} {})",
    "(funcall {} {} {})",
    '(eval "(+ 1 2)")',
    '(eval (str-cat "(create$ " {} ")"))',
    '(build "(deffunction made (?x) (+ ?x 1))")',
    "(g {})",
    "(add {} {})",
    "(id {})",
    "(length$ (idm {} {}))",
    "(call-specific-method g 1 {})",
    "(str-cat {} {} {})",
    "(implode$ (create$ {} {}))",
    '(nth$ 1 (explode$ (str-cat {} " " {})))',
    "(fact-slot-value (the-fact) {})",
    "(deftemplate-slot-default-value u {})",
    "(slot-insert$ [c1] ms 1 {})",
    "(slot-replace$ [c1] ms 1 2 {})",
    "(slot-delete$ [c1] ms {} {})",
    "(type {})",
    "(no-such-function {})",
)
"""Special forms with holes for arguments."""

_ROW = re.compile(r"^(\S+) ([\d*]{2})(\S?)(\S*)$")


@dataclass(frozen=True, slots=True)
class Function:
    """A function of 6.30 with its declared arguments.

    :param most: None: any number of arguments.
    :param letters: types of the arguments; the last type also counts for further arguments.
    """

    name: str
    least: int
    most: int | None
    letters: str

    def letter(self, position: int) -> str:
        """Return the letter of the type of an argument, counted from 0."""
        return (self.letters[1:] + self.letters[:1] * 9)[position : position + 1] or "u"


def functions(folder: Path) -> list[Function]:
    """Return the functions of 6.30 that are called."""
    text = engines.execute(
        ['(progn$ (?f (get-function-list)) (printout t ?f " " (get-function-restrictions ?f) crlf))'], folder
    )
    excluded = re.compile("|".join(f"(?:{pattern})" for pattern in EXCLUDED.values()))
    found = []
    for line in text.splitlines():
        row = _ROW.match(line)
        if row and not excluded.fullmatch(row[1]):
            least, most = (None if digit == "*" else int(digit) for digit in row[2])
            found.append(Function(row[1], least or 0, most, (row[3] or "u") + row[4]))
    return sorted(found, key=lambda function: function.name)


def generate(known: Sequence[Function], seed: int, each: int) -> Iterator[str]:
    """Yield expressions of every function and form, the same ones for the same seed.

    Functions of one argument get five times ``each`` arguments (with FULL all), the others ``each``
    combinations.
    """
    chance = random.Random(seed)
    for function in known:
        yield from _calls(chance, function, each)
    for form in FORMS:
        for _ in range(each if "{}" in form else 1):
            yield re.sub(r"\{\}", lambda _match: _argument(chance, ARGUMENTS), form)


def _calls(chance: random.Random, function: Function, each: int) -> Iterator[str]:
    name, least, most = function.name, function.least, function.most
    yield f"({name})"
    if most == 0:
        yield f"({name} {_argument(chance, ARGUMENTS)})"
        return
    if least <= 1:
        for argument in ARGUMENTS if support.FULL else chance.sample(ARGUMENTS, 5 * each):
            yield f"({name} {_late(chance, argument)})"
    if most == 1:
        yield f"({name} {_argument(chance, ARGUMENTS)} {_argument(chance, ARGUMENTS)})"
        return
    for number in range(each):
        # now and then one argument too few or too many
        low, high = max(0, least - 1), (least + 3 if most is None else most + 1)
        right = (max(2, least), max(2, least) + 2 if most is None else most)
        count = chance.randint(low, high) if number % 10 == 9 else chance.randint(*right)
        arguments = [
            _argument(
                chance, ARGUMENTS if chance.random() < 0.15 else _OF_TYPE.get(function.letter(i), ARGUMENTS)
            )
            for i in range(count)
        ]
        yield f"({' '.join([name, *arguments])})"


def _argument(chance: random.Random, choices: Sequence[str]) -> str:
    return _late(chance, chance.choice(choices))


def _late(chance: random.Random, argument: str) -> str:
    """Return an argument, which CLIPS knows only when it runs in half of the cases."""
    return argument if argument.startswith("(") or chance.random() < 0.5 else f"(id {argument})"
