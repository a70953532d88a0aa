"""Known differences between CLIPS 6.30 and ours: a new difference fails a test, a missing one too.

docs/evidence/clips.md explains them.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

from tests.executive.clips630.engines import Outcome


@dataclass(frozen=True, slots=True)
class Known:
    """A difference.

    :param functions: pattern of names of functions, or of first words of forms, with the difference.
    :param reference: pattern of the outcome in CLIPS 6.30: see :func:`sign`.
    :param ours: pattern of our outcome.
    :param reason: why the difference stays.
    :param example: expression with the difference.
    :param expressions: pattern of the expressions, if not all of the functions.
    """

    functions: str
    reference: str
    ours: str
    reason: str
    example: str
    expressions: str = ""

    def covers(self, expression: str, reference: Outcome, ours: Outcome) -> bool:
        """Whether this is the difference between the two outcomes."""
        return (
            re.fullmatch(self.functions, name_of(expression)) is not None
            and re.fullmatch(self.reference, sign(reference)) is not None
            and re.fullmatch(self.ours, sign(ours)) is not None
            and re.search(self.expressions, expression, re.DOTALL) is not None
        )


def name_of(expression: str) -> str:
    """Return the function that an expression calls."""
    return expression[1:].split(maxsplit=1)[0].rstrip(")")


def sign(outcome: Outcome) -> str:
    """Return ``value``, or the kind of the error, with ``, goes on`` if the command continues."""
    if not outcome.error:
        return "value" if outcome.done else "ends"
    return outcome.error + (", goes on" if outcome.done else "")


def find(expression: str, reference: Outcome, ours: Outcome) -> list[Known]:
    """Return the rows that cover a difference."""
    return [row for row in KNOWN if row.covers(expression, reference, ours)]


_GOES_ON = "6.30 says the error, gives FALSE or nothing and goes on; 6.4 ends the right-hand side"
_INITIAL = "6.4 has no initial-fact, initial-object, INITIAL-OBJECT; our shims are deffunctions"
_CHECKS = "6.4 looks at a wrong argument, or number of arguments, at another time and with other words"
_NAMES = "6.4 takes no instance name for a symbol or string"
_SHIMS = "our shims are deffunctions: their arguments are looked at when they run, and none may be void"
_FLOATS = "6.4 has no bounds that are no INTEGER, nor does the parser of 6.30 take them as they are written"

_LISTS = r"get-.*-list|list-.*|show-defglobals|rules|agenda|refresh-agenda|browse-classes|facts|instances"
_FACTS = r"fact-.*|timetag|dependents|dependencies|ppfact|retract"
_TEMPLATES = r"deftemplate-.*|ppdeftemplate"
_SETTINGS = r"set-.*|focus|preview-.*|funcall|sort|refresh"
_OBJECTS = (
    r".*class.*|.*slot.*|.*handler.*|.*method.*|.*instance.*|pp.*|preview-.*|get-.*|list-.*|send|focus|sub.*p"
    r"|super.*p"
)
_SHIMMED = (
    r"length\$?|str-index|string-to-field|explode\$|nth\$?|subseq\$|delete\$|insert\$|replace\$|sub-string"
    r"|str-compare"
    r"|evenp|oddp|random|seed|setgen|member|subset|sequencep|wordp|str-explode|str-implode|mv-.*|round|[gs]et-(auto|inc|sta).*"
)
_NAME = r"\[(c1|c2|nope|new|x|y)\]"
_ANY = r".*"
_TYPE = "type of an argument"
_ENDS = r"[^,]*"

KNOWN: tuple[Known, ...] = (
    Known(
        f"{_LISTS}|{_FACTS}|{_TEMPLATES}|{_SETTINGS}|slot-.*",
        ".*, goes on",
        _ENDS,
        _GOES_ON,
        "(fact-index (id abc))",
    ),
    Known("facts", "value", _TYPE, _CHECKS, "(facts MAIN 1 2 (id 2.5))"),
    Known(
        "send|slot-.*",
        "MSGFUN1|MSGFUN4|no such thing",
        _TYPE,
        _CHECKS,
        "(slot-delete$ (the-instance) C (/ 1 3) 1)",
    ),
    Known(_LISTS, "value", "value", _INITIAL, "(get-deffacts-list)"),
    Known(_FACTS, _ANY, "(no such thing|value).*", _INITIAL, "(fact-relation 0)", r"\b0"),
    Known(
        _FACTS,
        "value",
        "no such thing, goes on",
        "6.30 says nothing of a fact index that is not a fact's",
        "(fact-relation 9223372036854775807)",
    ),
    Known("mv-.*", "value", _TYPE, _SHIMS, "(mv-subseq (id 9223372036854775807) 100 (id b))"),
    Known("timetag", "value", "value", "6.4 counts time tags from another number", "(timetag 2)"),
    Known("pp.*", "number of arguments", _ANY, _CHECKS, "(ppdefrule (id nil) (id x))"),
    Known(
        _OBJECTS,
        f"no such thing.*|TMPLTDEF1.*|syntax|{_TYPE}|value",
        _TYPE,
        _NAMES,
        "(class-slots (id [c1]))",
        _NAME,
    ),
    Known(
        "set-sequence-operator-recognition",
        "value",
        _TYPE,
        _NAMES,
        "(set-sequence-operator-recognition (id [nope]))",
    ),
    Known(
        "delete-member\\$",
        "MULTIFUN1",
        "value",
        "6.30 refuses an empty multifield as a value to delete, 6.4 finds none",
        "(delete-member$ (create$ a b) c (create$))",
    ),
    Known(
        "build|eval|format|printout|str-.*|sym.*",
        "value",
        _TYPE,
        _NAMES,
        '(format nil "%s" (id [c1]))',
        _NAME,
    ),
    Known(_SHIMMED, f"{_TYPE}|number of arguments", _ANY, _SHIMS, "(evenp 1.5)"),
    Known(_SHIMMED, _ANY, "PRCCODE2", _SHIMS, "(sequencep (no-value))", r"no-value"),
    Known(
        "loop-for-count",
        f"value|{_TYPE}",
        f"{_TYPE}|syntax",
        _FLOATS,
        "(loop-for-count (id 2.5) (printout t x))",
    ),
    Known(
        "direct-mv-.*",
        _ANY,
        "no such function",
        "6.4 has dropped them; 6.30 has them for old message-handlers only",
        "(direct-mv-delete ms 1 1)",
    ),
    Known(
        r"set-incremental-reset|set-auto-float-dividend|set-static-constraint-checking",
        _ANY,
        _ANY,
        "6.4 cannot switch them; setting one to FALSE is an error in the log",
        "(set-auto-float-dividend FALSE)",
    ),
    Known(
        "insert\\$",
        "MULTIFUN1",
        "MULTIFUN1, goes on",
        "6.4 goes on after an index that is out of range",
        "(insert$ (create$ a) (id -1) b)",
    ),
    Known(
        "eval",
        _ANY,
        _ANY,
        "6.4 refuses what follows an expression, with other words",
        '(eval (id "hello world"))',
    ),
    Known(
        "funcall",
        _ANY,
        "number of arguments.*",
        "6.4 counts the arguments of a function that is called by its name",
        '(funcall (id "="))',
    ),
    Known(
        "get-method-restrictions|ppdefmethod|undefmethod",
        "no such thing",
        _TYPE,
        _CHECKS,
        "(get-method-restrictions MAIN (/ 1 3))",
    ),
    Known(
        "funcall",
        _TYPE,
        f"{_TYPE}, goes on",
        "6.4 goes on after an error in the function that is called",
        '(funcall (id "=") a b)',
    ),
    Known("modify|duplicate", "TMPLTDEF1", "no such thing, goes on", _INITIAL, "(modify 0 (a 2))"),
    Known(
        "modify|duplicate|progn",
        "value",
        "The single field.*",
        "6.30 puts nil for a value of a function that has none",
        "(duplicate 1 (a (no-value)))",
        r"no-value",
    ),
    Known("member\\$?", "value", "value", "6.4 finds an empty multifield", "(member$ (create$) (create$))"),
    Known("retract", ".*", _TYPE, "6.30 retracts the other facts", "(retract (id 0.1) 3)"),
    Known(
        "assert",
        "value",
        "CSTRNCHK1",
        "6.4 knows the type that a function returns, and refuses it for the slot while it parses",
        "(assert (t (b (/ 1 3))))",
    ),
    Known("max|min", "number of arguments", "value", "6.4 takes a single argument", "(max 1)"),
    Known(
        "check-syntax", "value", "value", "6.4 has quotes in its messages", '(check-syntax (id "(o b) ?c"))'
    ),
    Known(
        "str-compare",
        "value",
        "value",
        "a negative number of characters: 6.30 compares none, 6.4 all",
        '(str-compare (id "a") (id "b") -9223372036854775808)',
    ),
    Known("assert", "value", "value", "6.4 gives the fact that is there, 6.30 FALSE", "(assert (o))"),
    Known(
        "modify|duplicate",
        _TYPE,
        _ANY,
        "ours is called with any value, 6.30 wants a variable or an index: otherwise another message",
        '(modify "x" (a 2))',
    ),
    Known(
        "implode\\$",
        "value",
        "value",
        "6.4 writes an instance as its address",
        "(implode$ (create$ (the-instance)))",
    ),
    Known(
        "ppfact",
        "value|ROUTER1, goes on",
        _ANY,
        "6.4 gives the text for the logical name nil",
        "(ppfact (the-fact) nil)",
    ),
)
