"""Preparation of CLIPS text: positions of constructs, and `modify` as in CLIPS 6.30.

In 6.30 ``modify`` retracts a fact and asserts a new fact with a new index; 6.4 changes the fact in place.
Users' files, including Fawkes', rely on 6.30's way (docs/evidence/clips.md). Therefore
``(modify F (slot v...))`` becomes ``(cx-modify F slot (create$ v...))``, a host function, and likewise
``duplicate``, which in 6.4 ends the process if a single slot gets several values. Line numbers stay the
same.

The built-in core keeps 6.4's faster `modify`. Only for goals it calls ``(cx-modify-goal F (slot v...))``,
which is rewritten like a user's `modify`, because decisions depend on the order of goals: a changed goal
moves to the end.

Texts that would crash or block CLIPS' parser are detected here, see :class:`ExceededLimit`.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import lru_cache
from itertools import islice

from msgspec import Struct

from cxbridge.clipstext.syntax import (
    CONSTRUCT,
    HIDDEN,
    PARENTHESIS,
    Lines,
    blank,
    is_declaration,
    top_level_lists,
)
from cxbridge.errors import ClipsError
from cxbridge.executive.host.recursion import find_guard_insertion
from cxbridge.executive.host.retracted import Edit, find_retracted_slot_edits

_USER_CALL = re.compile(r"\(\s*(modify|duplicate|cx-modify-goal)(?=[\s(])")
_CORE_CALL = re.compile(r"\(\s*(cx-modify-goal)(?=[\s(])")
# the text before the first argument of such a call
_CALL_START = re.compile(r"\(\s*(?:modify|duplicate|cx-modify-goal)\s+\Z")
# a variable in a defglobal
_GLOBAL = re.compile(r"(\?\*[^\s()&|~]+\*)\s*=")
_SLOT = re.compile(r"\(\s*([^\s()\";]+)")
# 6.30 accepts single-slot for slot in a defclass; ontology editors write single-slot
_SINGLE_SLOT = re.compile(r"(?<=\()(\s*)single-slot(?=\s)")

# the maximum nesting of parentheses: CLIPS parses by recursion, and a stack overflow ends the process
_MAX_DEPTH = 500

# the maximum length of a string or symbol: CLIPS reads them in quadratic time
_MAX_WORD_LENGTH = 128 * 1024

# the maximum number of parts of a construct: CLIPS counts them in 16 bits, slowly
_MAX_PARTS = 4096

_LONG_WORD = re.compile(rf"""[^\s()";]{{{_MAX_WORD_LENGTH + 1}}}""")
_FORMAT = re.compile(r'\(\s*format\s+[^\s()";]+\s+"((?:[^"\\]|\\.)*)"')
# a field of 200 characters or more in a format string, which overflows CLIPS' buffer
_WIDE_FIELD = re.compile(r"(?:^|[^%])(?:%%)*%-?(?:\d*\.)?(?:[2-9]\d\d|\d{4})")

# the maximum number of characters between the name `modify` and its first argument, which bounds a backward
# search
_MAX_GAP = 1000
_FUNCTION_KINDS = ("deffunction", "defmethod")
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
    :param is_declaration: whether the construct is a function without actions, a forward declaration.
    """

    kind: str
    name: str
    line: int
    is_declaration: bool = False


class ExceededLimit(Struct, frozen=True):
    """A part of a text that would crash or block CLIPS' parser.

    :param line: counted from 1.
    :param message: the mistake and the limit.
    """

    line: int
    message: str


class ClipsSource(Struct, frozen=True):
    """The prepared text of a file.

    :param is_changed: whether the text differs from the file.
    :param constructs: the top-level constructs in order; empty for a file of the core.
    :param unclosed_line: the line of an unclosed top-level parenthesis, if any.
    """

    text: str
    is_changed: bool
    constructs: tuple[SourceConstruct, ...]
    unclosed_line: int | None = None


def prepare_source(text: str, is_known: Callable[[str], bool] = lambda _name: False) -> ClipsSource:
    """Prepare users' text: list its constructs, rewrite calls, and guard recursive functions.

    :param is_known: returns whether a function existed before the text is loaded.
    """
    code, lines = blank(text), Lines(text)
    constructs: list[SourceConstruct] = []
    edits: list[Edit] = []
    function_names: set[str] = set()
    unclosed_line = None
    for start, end in top_level_lists(code):
        construct = CONSTRUCT.match(code, start)  # group 1 is the kind, group 2 the name
        search_end = len(code) if end is None else end
        _add_modify_edits(code, (start, search_end), _USER_CALL, edits)
        if end is None:
            unclosed_line = lines.line_at(start)
        else:
            insertion = find_guard_insertion(
                code, start, end, lambda name: name in function_names or is_known(name)
            )
            if insertion is not None:
                edits.append(insertion)
        if construct is None:
            continue
        constructs += _make_constructs(construct, code, end, lines)
        if construct[1] == "defclass":
            edits += (
                (match.start(), match.end(), f"{match[1]}slot")
                for match in _SINGLE_SLOT.finditer(code, start, search_end)
            )
        if end is not None:
            edits += find_retracted_slot_edits(code, start, end)
        # a function that is defined again after others, which call it, may be mutually recursive with them
        if construct[1] == "defgeneric" or (end is not None and construct[1] in _FUNCTION_KINDS):
            function_names.add(construct[2])
    return _apply_edits(text, edits, constructs, unclosed_line)


# larger than the number of the core's files
@lru_cache(128)
def prepare_core_source(text: str) -> ClipsSource:
    """Rewrite the calls in a file of the core, without a list of its constructs."""
    # cached, because a process that loads many agents loads the same core each time
    edits: list[Edit] = []
    if _CORE_CALL.search(text):
        _add_modify_edits(blank(text), (0, len(text)), _CORE_CALL, edits)
    return _apply_edits(text, edits, [])


def _apply_edits(
    text: str, edits: list[Edit], constructs: list[SourceConstruct], unclosed_line: int | None = None
) -> ClipsSource:
    pieces: list[str] = []
    position = 0
    for start, end, replacement in sorted(edits):
        pieces += (text[position:start], replacement)
        position = end
    pieces.append(text[position:])
    return ClipsSource("".join(pieces), bool(edits), tuple(constructs), unclosed_line)


def _make_constructs(head: re.Match[str], code: str, end: int | None, lines: Lines) -> list[SourceConstruct]:
    """Return the construct with a head; for a closed defglobal, a construct for each of its variables.

    :param head: the match of :data:`CONSTRUCT`: group 1 is the kind, group 2 the name.
    """
    variables = _GLOBAL.finditer(code, head.start(), end) if head[1] == "defglobal" and end else ()
    return [SourceConstruct("defglobal", match[1], lines.line_at(match.start())) for match in variables] or [
        SourceConstruct(
            head[1],
            head[2],
            lines.line_at(head.start()),
            head[1] == "deffunction" and is_declaration(code[head.start() : end]),
        )
    ]


def rewrite_expression(text: str) -> str:
    """Return an expression with rewritten calls of `modify` and `duplicate`."""
    return prepare_source(text).text if _USER_CALL.search(text) else text


def _describe_excess(text: str, offset: int, depth: int, part_count: int) -> str:
    """Return the message of the limit that an opening parenthesis exceeds, or an empty text."""
    if depth > _MAX_DEPTH:
        return f"parentheses are nested more than {_MAX_DEPTH} deep"
    if part_count > _MAX_PARTS:
        return f"a construct has more than {_MAX_PARTS} parts"
    call = _FORMAT.match(text, offset)
    if call is not None and _WIDE_FIELD.search(call[1]):
        return "a field of format is wider than 199 characters"
    return ""


def find_exceeded_limit(text: str) -> ExceededLimit | None:
    """Return the first part of a text that exceeds a limit of CLIPS' parser; None without such a part.

    A NUL byte precedes all other parts.
    """
    if "\0" in text:
        return ExceededLimit(
            text.count("\n", 0, text.index("\0")) + 1, "the line has a NUL byte: save the file as UTF-8"
        )
    code = blank(text)
    long_strings = (
        hidden
        for hidden in HIDDEN.finditer(text)
        if hidden[0][0] == '"' and len(hidden[0]) > _MAX_WORD_LENGTH
    )
    excesses = [
        (match.start(), f"a {noun} of more than {_MAX_WORD_LENGTH} characters")
        for noun, matches in (("word", _LONG_WORD.finditer(code)), ("string", long_strings))
        for match in islice(matches, 1)
    ]
    depth, part_count, is_limited = 0, 0, False
    for match in PARENTHESIS.finditer(code, 0, min(excesses)[0] if excesses else len(text)):
        offset = match.start()
        if match.group() == ")":
            depth -= depth > 0  # a surplus parenthesis closes nothing
            continue
        depth += 1
        if depth == 1:
            head = CONSTRUCT.match(code, offset)  # group 1 is the kind
            part_count, is_limited = 0, head is not None and head[1] not in _UNLIMITED_KINDS
        elif depth == 2 and is_limited:  # noqa: PLR2004  right below the construct
            part_count += 1
        if message := _describe_excess(text, offset, depth, part_count):
            excesses.append((offset, message))
            break
    if not excesses:
        return None
    offset, message = min(excesses)
    return ExceededLimit(Lines(text).line_at(offset), message)


def check_parser_limits(text: str) -> None:
    """Check that a text would neither crash nor block CLIPS' parser.

    :raises ClipsError: if the text exceeds a limit.
    """
    excess = find_exceeded_limit(text)
    if excess is not None:
        raise ClipsError(f"CLIPS cannot read this text: {excess.message}")


def _add_modify_edits(
    code: str, span: tuple[int, int], call_pattern: re.Pattern[str], edits: list[Edit]
) -> None:
    """Add the edits for the calls that match in a span, and for their slots."""
    if call_pattern.search(code, *span) is None:
        return
    # the depths of the open calls; 0: outside of all calls
    depth, modify_depths = 0, [0]
    for match in PARENTHESIS.finditer(code, *span):
        offset = match.start()
        if match.group() == ")":
            depth -= depth > 0  # a surplus parenthesis closes nothing
            if depth < modify_depths[-1]:
                modify_depths.pop()
            continue
        depth += 1
        call = call_pattern.match(code, offset)
        if call:
            edits.append((offset + 1, call.end(), _line_ends_of(call) + _REPLACEMENTS[call[1]]))
            modify_depths.append(depth)
        elif depth == modify_depths[-1] + 1 and modify_depths[-1] > 0:
            slot = _SLOT.match(code, offset)
            # the first argument of modify is the fact, which may be an expression
            if slot and not _CALL_START.search(code, max(0, offset - _MAX_GAP), offset):
                edits.append((offset, slot.end(), f"{_line_ends_of(slot)} {slot[1]} (create$"))


def _line_ends_of(match: re.Match[str]) -> str:
    """Return the line ends of the replaced text: with them, later lines keep their numbers."""
    return "\n" * match.group().count("\n")
