"""CLIPS 6.30's functions that 6.4 removed or changed, made from 6.4's functions.

:func:`remove_replaced_builtins` removes built-ins, and keeps the originals that the replacements need under
names that begin with ``cx-``. :data:`FUNCTIONS` are deffunctions that behave as in 6.30 and call the
originals. docs/evidence/clips.md lists the remaining differences. ``tests/executive/clips630`` compares the
functions with a real CLIPS 6.30.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable
from typing import Final

from clips._clips import ffi, lib

from cxbridge.executive.host.capi import EXTRA_FUNCTIONS, NULL, CData, encode, make_callback
from cxbridge.executive.host.udf import UNBOUNDED, UdfTable
from cxbridge.executive.host.values import Value

# The originals: built-ins that the functions below call as ``cx-NAME``. The values are the C function, the
# minimum and maximum number of arguments, and the types (see `UdfTable.define`).
_ORIGINALS = {
    "length$": ("LengthFunction", 1, 1, "m"),
    "str-byte-length": ("StrByteLengthFunction", 1, 1, "syn"),
    "str-index": ("StrIndexFunction", 2, 2, "syn"),
    "string-to-field": ("StringToFieldFunction", 1, 1, "syn"),
    "explode$": ("ExplodeFunction", 1, 1, "sy"),
    "nth$": ("NthFunction", 2, 2, "*;l;m"),
    "subseq$": ("SubseqFunction", 3, 3, "l;m"),
    "delete$": ("DeleteFunction", 3, 3, "l;m"),
    "insert$": ("InsertFunction", 3, UNBOUNDED, "*;m;l"),
    "replace$": ("ReplaceFunction", 4, UNBOUNDED, "*;m;l;l"),
    "sub-string": ("SubStringFunction", 3, 3, "*;l;l;syn"),
    "str-compare": ("StrCompareFunction", 2, 3, "*;syn;syn;l"),
    "evenp": ("EvenpFunction", 1, 1, "l"),
    "oddp": ("OddpFunction", 1, 1, "l"),
    "random": ("RandomFunction", 0, 2, "l"),
    "seed": ("SeedFunction", 1, 1, "l"),
    "setgen": ("SetgenFunction", 1, 1, "l"),
}

REMOVED = (
    *[
        "str-replace",
        "load",
        "load*",
        "batch",
        "batch*",
        "exit",
        "clear",
        "watch",
        "unwatch",
        "round",
        "halt",
    ],
    # 6.30 has no str-byte-length: an agent's function of this name replaces it, see ADDED
    *(name for name in _ORIGINALS if name != "str-byte-length"),
)
"""Built-ins of 6.4 that make room for 6.30's versions, or for functions of the host, e.g. ``load``.

They are removed before any construct is parsed, because CLIPS keeps pointers to functions.
"""


ADDED = frozenset(
    [
        "atan2",
        "bload-facts",
        "bsave-facts",
        "chdir",
        "clear-error",
        "difference$",
        "external-addressp",
        "fact-addressp",
        "fact-index-to-fact",
        "flush",
        "get-error",
        "gm-time",
        "intersection$",
        "local-time",
        "print",
        "println",
        "rewind",
        "seek",
        "set-error",
        "str-byte-length",
        "tell",
        "try",
        "unget-char",
        "union$",
        "void",
        "with-open-file",
    ]
)
"""Functions missing in 6.30. An agent can define functions of these names, see :func:`free_names`."""

OWN_NAMES: Final = {f"cx-{name}": name for name in _ORIGINALS}
"""The names of the originals in CLIPS' messages, and the names that agents know."""

# Functions missing in 6.4, so that an agent for 6.4 may define functions of these names.
_DROPPED: Final = frozenset(
    [
        "length",
        "nth",
        "member",
        "subset",
        "sequencep",
        "wordp",
        "str-explode",
        "str-implode",
        "mv-append",
        "mv-delete",
        "mv-replace",
        "mv-subseq",
    ]
)

_INT64_MIN, _INT64_MAX = -(2**63), 2**63 - 1


def _to_integer(name: str) -> str:
    """Return an expression that converts a FLOAT to INTEGER, as 6.30 does with INTEGER arguments."""
    return f"(if (floatp {name}) then (integer {name}) else {name})"


# the arguments ?i and ?j of the functions below
_I, _J = _to_integer("?i"), _to_integer("?j")
_SWITCHES = ("auto-float-dividend", "incremental-reset", "static-constraint-checking")
# the parameters and the body of the deffunctions `length$` and `length`
_LENGTH = (
    "(?x) (if (multifieldp ?x) then (cx-length$ ?x)"
    " else (if (lexemep ?x) then (cx-str-byte-length ?x) else (cx-length$ ?x))))"
)

FUNCTIONS = (
    # 6.30 counts the bytes of strings and symbols, too
    f"(deffunction length$ {_LENGTH}",
    f"(deffunction length {_LENGTH}",
    # 6.30 finds an empty text after the end of every text
    (
        "(deffunction str-index (?part ?text)"
        ' (if (and (lexemep ?part) (eq "" (str-cat ?part)))'
        " then (+ 1 (str-length ?text)) else (cx-str-index ?part ?text)))"
    ),
    # in 6.30, a token that is not a value becomes a STRING: a variable, a parenthesis, a connective
    (
        "(deffunction cx-field (?x)"
        ' (if (and (symbolp ?x) (or (cx-str-index (cx-sub-string 1 1 ?x) "?()&|~")'
        ' (eq (cx-sub-string 1 2 ?x) "$?")))'
        " then (str-cat ?x) else ?x))"
    ),
    "(deffunction string-to-field (?text) (cx-field (cx-string-to-field ?text)))",
    (
        "(deffunction explode$ (?text)"
        " (bind ?fields (cx-explode$ ?text))"
        ' (if (or (cx-str-index "?" ?text) (cx-str-index "(" ?text) (cx-str-index ")" ?text)'
        ' (cx-str-index "&" ?text) (cx-str-index "|" ?text) (cx-str-index "~" ?text))'
        " then (progn$ (?field ?fields)"
        " (bind ?fields (cx-replace$ ?fields ?field-index ?field-index (cx-field ?field)))))"
        " ?fields)"
    ),
    # a FLOAT in place of an INTEGER
    f"(deffunction nth$ (?i ?fields) (cx-nth$ {_I} ?fields))",
    f"(deffunction subseq$ (?fields ?i ?j) (cx-subseq$ ?fields {_I} {_J}))",
    f"(deffunction delete$ (?fields ?i ?j) (cx-delete$ ?fields {_I} {_J}))",
    f"(deffunction insert$ (?fields ?i ?x $?more) (cx-insert$ ?fields {_I} ?x ?more))",
    f"(deffunction replace$ (?fields ?i ?j ?x $?more) (cx-replace$ ?fields {_I} {_J} ?x ?more))",
    f"(deffunction sub-string (?i ?j ?text) (cx-sub-string {_I} {_J} ?text))",
    (
        "(deffunction str-compare (?one ?other $?most)"
        # ?most, an optional argument, is the maximum number of compared characters
        " (if (= 0 (cx-length$ ?most)) then (cx-str-compare ?one ?other)"
        " else (bind ?i (cx-nth$ 1 ?most))"
        f" (if (= 1 (cx-length$ ?most)) then (cx-str-compare ?one ?other {_I})"
        " else (cx-str-compare ?one ?other ?most))))"
    ),
    f"(deffunction evenp (?i) (cx-evenp {_I}))",
    f"(deffunction oddp (?i) (cx-oddp {_I}))",
    (
        "(deffunction random ($?range)"
        " (if (= 0 (cx-length$ ?range)) then (cx-random)"
        " else (if (<> 2 (cx-length$ ?range)) then (cx-random ?range)"
        " else (bind ?i (cx-nth$ 1 ?range)) (bind ?j (cx-nth$ 2 ?range))"
        f" (cx-random {_I} {_J}))))"
    ),
    f"(deffunction seed (?i) (cx-seed {_I}))",
    f"(deffunction setgen (?i) (cx-setgen {_I}))",
    # names that 6.4 removed, see _DROPPED
    "(deffunction nth (?n ?fields) (nth$ ?n ?fields))",
    "(deffunction member (?x ?fields) (member$ ?x ?fields))",
    "(deffunction subset (?few ?many) (subsetp ?few ?many))",
    "(deffunction sequencep (?x) (multifieldp ?x))",
    "(deffunction wordp (?x) (symbolp ?x))",
    "(deffunction str-explode (?text) (explode$ ?text))",
    "(deffunction str-implode (?fields) (implode$ ?fields))",
    "(deffunction mv-append ($?fields) ?fields)",
    "(deffunction mv-delete (?n ?fields) (delete$ ?fields ?n ?n))",
    "(deffunction mv-replace (?n ?fields ?x) (replace$ ?fields ?n ?n ?x))",
    "(deffunction mv-subseq (?first ?last ?fields) (subseq$ ?fields ?first ?last))",
    # switches missing in 6.4, with 6.30's initial state
    *(f"(deffunction get-{switch} () TRUE)" for switch in _SWITCHES),
    *(
        f"(deffunction set-{switch} (?on)"
        f' (if (eq FALSE ?on) then (printout error "{switch} cannot be FALSE in CLIPS 6.4" crlf)) TRUE)'
        for switch in _SWITCHES
    ),
)
"""Deffunctions that implement functions of 6.30. :class:`Clips630Functions` defines them."""

_FUNCTION: Final = re.compile(r"\(deffunction (\S+) \(([^)]*)\)")


CLIPS630_NAMES: Final = tuple(match[1] for match in map(_FUNCTION.match, FUNCTIONS) if match)
"""The names of the deffunctions in :data:`FUNCTIONS`."""


class Clips630Functions:
    """The functions of 6.30 in one environment, callable from each module.

    :param env: the environment's pointer.
    :param build_construct: defines a construct.
    """

    # a deffunction of MAIN is unknown in modules that do not import it, so each name also belongs to a UDF,
    # known in all modules, whose parser turns calls into calls of the deffunction; only funcall, which
    # resolves names at run time, needs a module that imports MAIN
    def __init__(self, env: CData, udfs: UdfTable, build_construct: Callable[[str], None]) -> None:
        self._env, self._udfs, self._build_construct = env, udfs, build_construct
        self._call_type = 0  # the type of expressions that call a deffunction
        self._parsers: dict[str, CData] = {}

    def build(self, deffunction: str) -> None:
        """Define a function of :data:`FUNCTIONS`. To be repeated after ``(clear)``.

        :raises RuntimeError: if this build of CLIPS differs from the expected build.
        """
        match = _FUNCTION.match(deffunction)
        assert match is not None
        name = match[1]
        function = EXTRA_FUNCTIONS.FindFunction(self._env, encode(name))
        if function != NULL:  # a deffunction cannot have the name of a UDF
            _set_name(self._env, function, name, _HIDDEN_NAME)
        self._build_construct(deffunction)
        if function != NULL:
            _set_name(self._env, function, _HIDDEN_NAME, name)
        reference = ffi.new("char[64]")  # more than a ``struct expr`` has
        if not EXTRA_FUNCTIONS.GetFunctionReference(self._env, encode(name), reference):
            raise RuntimeError(f"CLIPS does not find the function {name}")
        self._call_type = _type_of(reference)[0]
        if name not in self._parsers:
            # a placeholder: _parse replaces all calls
            self._udfs.define_c(name, EXTRA_FUNCTIONS.LengthFunction, 0, UNBOUNDED, "*")
            self._parsers[name] = make_callback(
                _PARSER_SIGNATURE, lambda env, call, source: self._parse(name, env, call, source)
            )
            EXTRA_FUNCTIONS.AddFunctionParser(self._env, encode(name), self._parsers[name])

    def _parse(self, name: str, env: CData, call: CData, source: CData) -> CData:
        """Parse the arguments of a call as for a deffunction.

        :param call: the call's expression.
        :param source: the logical name of the source text.
        :returns: the expression of a call of the deffunction; NULL after a mistake, which CLIPS has reported.
        """
        # the steps of CLIPS' own parser for deffunction calls
        call = EXTRA_FUNCTIONS.CollectArguments(env, call, source)
        function = lib.FindDeffunction(env, encode(f"MAIN::{name}"))
        if NULL in (call, function):
            return NULL
        _type_of(call)[0], _value_of(call)[0] = self._call_type, function
        if EXTRA_FUNCTIONS.GetSequenceOperatorRecognition(env):
            expansion_call, expand = (
                EXTRA_FUNCTIONS.FindFunction(env, operator) for operator in (b"(expansion-call)", b"expand$")
            )
            has_failed = EXTRA_FUNCTIONS.ReplaceSequenceExpansionOps(
                env, _arguments_of(call)[0], call, expansion_call, expand
            )
        else:
            count = EXTRA_FUNCTIONS.CountArguments(_arguments_of(call)[0])
            has_failed = not EXTRA_FUNCTIONS.CheckDeffunctionCall(env, _value_of(call)[0], count)
        if has_failed:
            EXTRA_FUNCTIONS.ReturnExpression(env, call)
            return NULL
        return call


_HIDDEN_NAME: Final = "cx-6.30-function"  # a UDF's name while a deffunction of its name is defined
_PARSER_SIGNATURE: Final = "void *(Environment *, void *, char *)"


def _type_of(expression: CData) -> CData:
    """Return the address of an expression's type, the first member of CLIPS' ``struct expr``.

    The next members are the value and the arguments, both pointers.
    """
    return ffi.cast("unsigned short *", expression)


def _value_of(expression: CData) -> CData:
    return ffi.cast("void **", expression) + 1


def _arguments_of(expression: CData) -> CData:
    return ffi.cast("void **", expression) + 2


def round_half_down(value: Value) -> int:
    """Return the nearest INTEGER. 6.30 rounds halves down, 6.4 away from zero."""
    if isinstance(value, int):
        return value
    is_finite = math.isfinite(value)
    rounded = math.ceil(value - 0.5) if is_finite else 0
    # on overflow, 6.30's cast in C gives the smallest integer
    return rounded if is_finite and _INT64_MIN <= rounded <= _INT64_MAX else _INT64_MIN


def remove_replaced_builtins(env: CData, udfs: UdfTable) -> None:
    """Remove the built-ins that 6.30's versions replace, and keep the originals that these versions call."""
    for name, (function, minimum, maximum, types) in _ORIGINALS.items():
        udfs.define_c(f"cx-{name}", getattr(EXTRA_FUNCTIONS, function), minimum, maximum, types)
    for name in REMOVED:
        EXTRA_FUNCTIONS.RemoveUDF(env, encode(name))
    udfs.define("round", round_half_down, 1, types="*;ld")


def free_names(env: CData, names: Iterable[str]) -> None:
    """Rename functions that only one CLIPS version has, so that an agent can define functions of these names.

    Existing constructs keep calling the renamed functions: unlike ``RemoveUDF``, a new name frees no memory,
    so that their pointers stay valid.
    """
    for name in ADDED.union(_DROPPED).intersection(names):
        function = EXTRA_FUNCTIONS.FindFunction(env, encode(name))
        if function != NULL:
            _set_name(env, function, name, f"cx-6.4-{name}")


def _set_name(env: CData, function: CData, name: str, new_name: str) -> None:
    """Change the name of a C function, so that CLIPS does not find it by the former name.

    :raises RuntimeError: if the record of the function does not begin with its name.
    """
    # the name is the first member of the record, which stays in CLIPS' hash table at its first name
    name_member = ffi.cast("CLIPSLexeme **", function)
    if name_member[0] != lib.CreateSymbol(env, encode(name)):
        raise RuntimeError("this build of CLIPS lays out functions in an unknown way")
    new_symbol = lib.CreateSymbol(env, encode(new_name))
    EXTRA_FUNCTIONS.RetainLexeme(env, new_symbol)
    name_member[0] = new_symbol
