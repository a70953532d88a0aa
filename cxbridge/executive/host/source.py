"""Preparation of CLIPS text: position of constructs, and `modify` as in CLIPS 6.30.

In 6.30 ``modify`` retracts a fact and asserts a new one with a new index; 6.4 changes the fact in place.
Users' files, including Fawkes', rely on the former (docs/evidence/clips.md). Therefore
``(modify F (slot v...))`` becomes ``(cx-modify F slot (create$ v...))``, a host function, and likewise
``duplicate``, which in 6.4 ends the process if a single slot gets several values. Line numbers stay the
same.

The built-in core keeps 6.4's faster `modify`. Only for goals it calls ``(cx-modify-goal F (slot v...))``,
which is rewritten like a user's `modify`, because decisions depend on the order of goals: the last changed
goal is the last.

Texts that crash or block CLIPS' parser are detected here, see :class:`Excess`.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import lru_cache

from msgspec import Struct

from cxbridge.clipstext.syntax import CONSTRUCT, HIDDEN, PARENTHESIS, Lines, blank, is_declaration, top_level
from cxbridge.errors import ClipsError
from cxbridge.executive.host.recursion import guards_at
from cxbridge.executive.host.retracted import slot_edits

_REWRITTEN = re.compile(r"\(\s*(modify|duplicate|cx-modify-goal)(?=[\s(])")
_REWRITTEN_IN_CORE = re.compile(r"\(\s*(cx-modify-goal)(?=[\s(])")
_CONSTRUCT_IN_CORE = re.compile(rf"^{CONSTRUCT.pattern}", re.MULTILINE)
_FIRST_ARGUMENT = re.compile(r"\(\s*(?:modify|duplicate|cx-modify-goal)\s+\Z")
_GLOBAL = re.compile(r"(\?\*[^\s()&|~]+\*)\s*=")
_SLOT = re.compile(r"\(\s*([^\s()\";]+)")
# 6.30 accepts this for ``slot`` in a defclass; ontology editors write it.
_SINGLE_SLOT = re.compile(r"(?<=\()(\s*)single-slot(?=\s)")

# The maximum nesting of parentheses: CLIPS parses by recursion, and a stack overflow ends the process.
_MAX_DEPTH = 500

# The maximum length of a string or symbol: CLIPS reads it in quadratic time.
_MAX_WORD = 128 * 1024

# The maximum number of parts of a construct: CLIPS counts them in 16 bits, slowly.
_MAX_PARTS = 4096

_LONG_WORD = re.compile(rf"""[^\s()";]{{{_MAX_WORD + 1}}}""")
_FORMAT = re.compile(r'\(\s*format\s+[^\s()";]+\s+"((?:[^"\\]|\\.)*)"')
# A field of 200 characters or more, which overflows CLIPS' buffer.
_WIDE_FIELD = re.compile(r"(?:^|[^%])(?:%%)*%-?(?:\d*\.)?(?:[2-9]\d\d|\d{4})")

_MAX_GAP = 1000  # characters between the name `modify` and its first argument
_FUNCTIONS = ("deffunction", "defmethod")
# CLIPS does not count the parts of these constructs
_UNLIMITED_KINDS = ("deffacts", "definstances")

MODIFY_FUNCTION = "cx-modify"
"""The host's replacement of `modify`."""

DUPLICATE_FUNCTION = "cx-duplicate"
"""The host's replacement of `duplicate`."""

_REPLACEMENTS = {
    "modify": MODIFY_FUNCTION,
    "duplicate": DUPLICATE_FUNCTION,
    "cx-modify-goal": MODIFY_FUNCTION,
}


class SourceConstruct(Struct, frozen=True):
    """A top-level construct ``(def... NAME``.

    :param kind: ``defrule``, ``deftemplate`` ...
    :param line: counted from 1.
    :param declares: whether it is a function without actions, a forward declaration.
    """

    kind: str
    name: str
    line: int
    declares: bool = False


class Excess(Struct, frozen=True):
    """A text that CLIPS cannot process without harm to the process.

    :param line: counted from 1.
    :param message: the mistake and the limit.
    """

    line: int
    message: str


class ClipsSource(Struct, frozen=True):
    """The prepared text of a file.

    :param changed: whether the text differs from the file.
    :param unclosed_line: the line of an unclosed top-level parenthesis, if any.
    :param excess: why CLIPS must not read the text, if there is a reason.
    """

    text: str
    changed: bool
    constructs: tuple[SourceConstruct, ...]
    unclosed_line: int | None
    excess: Excess | None = None


# A size of the cache that holds all files of the core.
_CORE_FILES = 128


def prepare(
    text: str,
    *,
    rewrite_modify: bool,
    is_known: Callable[[str], bool] = lambda _name: False,
) -> ClipsSource:
    """Scan a text: list its constructs, and rewrite its calls of functions missing in 6.4.

    :param rewrite_modify: True for users' text, which also gets guards against endless recursion
        (:mod:`cxbridge.executive.host.recursion`); False for the core's.
    :param is_known: returns whether a function existed before the text is loaded.
    """
    code, lines = blank(text), Lines(text)
    constructs: list[SourceConstruct] = []
    edits: list[tuple[int, int, str]] = []
    functions: set[str] = set()
    unclosed = None
    rewritten = _REWRITTEN if rewrite_modify else _REWRITTEN_IN_CORE
    for start, end in top_level(code):
        construct = CONSTRUCT.match(code, start)
        limit = len(code) if end is None else end
        if end is None:
            unclosed = lines.at(start)
        _rewrite(code, (start, limit), rewritten, edits)
        is_rewritten = rewrite_modify and end is not None
        if is_rewritten:
            guards = guards_at(code, start, limit, lambda name: name in functions or is_known(name))
            edits += ((offset, offset, guard) for offset, guard in guards)
        if construct is None:
            continue
        constructs += _constructs(construct, code, end, lines)
        if construct[1] == "defclass":
            single = _SINGLE_SLOT.finditer(code, start, limit)
            edits += ((match.start(), match.end(), f"{match[1]}slot") for match in single)
        if is_rewritten:
            edits += slot_edits(code, start, limit)
        # a function that exists may be called by the next one: mutual recursion
        if construct[1] == "defgeneric" or (is_rewritten and construct[1] in _FUNCTIONS):
            functions.add(construct[2])
    return ClipsSource(
        _apply(text, sorted(edits)) if edits else text, bool(edits), tuple(constructs), unclosed
    )


@lru_cache(_CORE_FILES)
def prepare_core(text: str) -> ClipsSource:
    """Prepare a file of the core faster than :func:`prepare`, since its constructs start at line starts."""
    # cached, because a process that loads many agents loads the same core each time
    code = blank(text) if _REWRITTEN_IN_CORE.search(text) or "(defglobal" in text else text
    heads = list(_CONSTRUCT_IN_CORE.finditer(code))
    ends = [*(head.start() for head in heads[1:]), len(text)]
    lines = Lines(text)
    constructs: list[SourceConstruct] = []
    edits: list[tuple[int, int, str]] = []
    for head, end in zip(heads, ends, strict=False):
        _rewrite(code, (head.start(), end), _REWRITTEN_IN_CORE, edits)
        constructs += _constructs(head, code, end, lines)
    return ClipsSource(_apply(text, sorted(edits)) if edits else text, bool(edits), tuple(constructs), None)


def _constructs(head: re.Match[str], code: str, end: int | None, lines: Lines) -> list[SourceConstruct]:
    """Return the construct with a head; for a closed defglobal, each of its variables."""
    variables = _GLOBAL.finditer(code, head.start(), end) if head[1] == "defglobal" and end else ()
    return [SourceConstruct("defglobal", match[1], lines.at(match.start())) for match in variables] or [
        SourceConstruct(
            head[1],
            head[2],
            lines.at(head.start()),
            head[1] == "deffunction" and is_declaration(code[head.start() : end]),
        )
    ]


def rewrite(text: str) -> str:
    """Return an expression with rewritten calls of `modify` and `duplicate`."""
    return prepare(text, rewrite_modify=True).text if _REWRITTEN.search(text) else text


def _opening_excess(text: str, at: int, depth: int, parts: int) -> str:
    """Return the limit that an opening parenthesis exceeds, or an empty text."""
    if depth > _MAX_DEPTH:
        return f"parentheses are nested more than {_MAX_DEPTH} deep"
    if parts > _MAX_PARTS:
        return f"a construct has more than {_MAX_PARTS} parts"
    call = _FORMAT.match(text, at)
    if call is not None and _WIDE_FIELD.search(call[1]):
        return "a field of format is wider than 199 characters"
    return ""


def find_excess(text: str) -> Excess | None:
    """Return the first part of a text that CLIPS cannot process safely."""
    if "\0" in text:
        before = text.partition("\0")[0]
        return Excess(before.count("\n") + 1, "a NUL byte: the file is not UTF-8 text")
    code = blank(text)
    excesses: list[tuple[int, str]] = []
    word = _LONG_WORD.search(code)
    if word is not None:
        excesses.append((word.start(), f"a word of more than {_MAX_WORD} characters"))
    string = next((m for m in HIDDEN.finditer(text) if m[0][0] == '"' and len(m[0]) > _MAX_WORD), None)
    if string is not None:
        excesses.append((string.start(), f"a string of more than {_MAX_WORD} characters"))
    depth, parts, limited = 0, 0, False
    for match in PARENTHESIS.finditer(code, 0, min(excesses)[0] if excesses else len(text)):
        at = match.start()
        if match.group() == ")":
            depth -= depth > 0
            continue
        depth += 1
        if depth == 1:
            kind = CONSTRUCT.match(code, at)
            parts, limited = 0, kind is not None and kind[1] not in _UNLIMITED_KINDS
        elif depth == 2 and limited:  # noqa: PLR2004  right below the construct
            parts += 1
        message = _opening_excess(text, at, depth, parts)
        if message:
            excesses.append((at, message))
            break
    if not excesses:
        return None
    offset, message = min(excesses)
    return Excess(Lines(text).at(offset), message)


def check_excess(text: str) -> None:
    """Check that CLIPS can process a text safely.

    :raises ClipsError: if it cannot.
    """
    excess = find_excess(text)
    if excess is not None:
        raise ClipsError(f"CLIPS cannot take this text: {excess.message}")


def _rewrite(
    code: str, span: tuple[int, int], rewritten: re.Pattern[str], edits: list[tuple[int, int, str]]
) -> None:
    """Add the edits for `modify`, `duplicate` and their slots in a span."""
    if rewritten.search(code, *span) is None:
        return
    depth, modify_depths = 0, [0]
    for match in PARENTHESIS.finditer(code, *span):
        at = match.start()
        if match.group() == ")":
            depth -= depth > 0
            if depth < modify_depths[-1]:
                modify_depths.pop()
            continue
        depth += 1
        call = rewritten.match(code, at)
        if call:
            edits.append((at + 1, call.end(), _line_ends(call) + _REPLACEMENTS[call[1]]))
            modify_depths.append(depth)
        elif depth == modify_depths[-1] + 1 and modify_depths[-1] > 0:
            slot = _SLOT.match(code, at)
            # the first argument of modify is the fact, which may be an expression
            if slot and not _FIRST_ARGUMENT.search(code, max(0, at - _MAX_GAP), at):
                edits.append((at, slot.end(), f"{_line_ends(slot)} {slot[1]} (create$"))


def _line_ends(match: re.Match[str]) -> str:
    """Return the line ends of the replaced text, which keep the line numbers."""
    return "\n" * match.group().count("\n")


def _apply(text: str, edits: list[tuple[int, int, str]]) -> str:
    parts: list[str] = []
    position = 0
    for start, end, replacement in edits:
        parts += (text[position:start], replacement)
        position = end
    parts.append(text[position:])
    return "".join(parts)
