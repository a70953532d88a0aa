"""CLIPS text before CLIPS sees it: where constructs begin, and `modify` as CLIPS 6.30 meant it.

In 6.30 ``modify`` retracts a fact and asserts a new one with a new index; in 6.4 it changes the fact in
place. Users' files, Fawkes' own among them, rely on the former (docs/clips.md). So ``(modify F (slot v...))``
becomes ``(cx-modify F slot (create$ v...))``, a function of the host that does as 6.30 did. Nothing moves:
line numbers stay what they are in the file.

Some texts make CLIPS' parser crash the process, or never end; they are found here, see :class:`Excess`.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass

from cxbridge.errors import ClipsError
from cxbridge.executive.recursion import guard_at

_TOKEN = re.compile(r'"(?:[^"\\]|\\.)*(?:"|\Z)|;[^\n]*|[()]', re.DOTALL)
_CONSTRUCT = re.compile(r"\(\s*(def[a-z]+)\s+([^\s()\";]+)")
_MODIFY = re.compile(r"\(\s*modify(?=[\s(])")
_SLOT = re.compile(r"\(\s*([^\s()\";]+)")

_MAX_DEPTH = 500
"""Parentheses in parentheses: CLIPS parses them by recursion, and its stack ends the process."""

_MAX_WORD = 128 * 1024
"""Characters of a string or symbol: CLIPS' time to read one grows with the square of it."""

_MAX_PARTS = 4096
"""Slots, patterns, actions of one construct: CLIPS counts them in 16 bits, slowly."""

_LONG_WORD = re.compile(rf"""[^\s()";]{{{_MAX_WORD + 1}}}""")
_FORMAT = re.compile(r'\(\s*format\s+[^\s()";]+\s+"((?:[^"\\]|\\.)*)"')
_WIDE_FIELD = re.compile(r"(?:^|[^%])(?:%%)*%-?(?:\d*\.)?(?:[2-9]\d\d|\d{4})")
"""A field of 200 characters or more: CLIPS writes it into a buffer that has no room for it."""

_FUNCTIONS = ("deffunction", "defmethod")
_OF_ANY_SIZE = ("deffacts", "definstances")

MODIFY_FUNCTION = "cx-modify"
"""The host's function that `modify` becomes."""


@dataclass(frozen=True, slots=True)
class Construct:
    """A ``(def... NAME`` at the top level of a file.

    :param kind: ``defrule``, ``deftemplate`` ...
    :param line: counted from 1.
    """

    kind: str
    name: str
    line: int


@dataclass(frozen=True, slots=True)
class Excess:
    """Something in a file that CLIPS cannot take without harm to the process.

    :param line: where, counted from 1.
    :param message: what it is, and how much of it there may be.
    """

    line: int
    message: str


@dataclass(frozen=True, slots=True)
class Source:
    """A file's text as CLIPS shall load it.

    :param changed: whether `modify` was rewritten in it.
    :param unclosed_line: where a parenthesis opens at the top level that never closes, if there is one.
    :param excess: why CLIPS must not see the text, if there is a reason.
    """

    text: str
    changed: bool
    constructs: tuple[Construct, ...]
    unclosed_line: int | None
    excess: Excess | None = None


def prepare(
    text: str, *, rewrite_modify: bool, is_known: Callable[[str], bool] = lambda _name: False
) -> Source:
    """Scan ``text`` once: list its constructs and, if asked, rewrite its `modify` calls.

    What is rewritten gets guards against endless recursion, too (:mod:`cxbridge.executive.recursion`).

    :param is_known: whether there is a function of this name before the text is loaded.
    """
    rewrite = rewrite_modify and _MODIFY.search(text) is not None
    constructs: list[Construct] = []
    edits: list[tuple[int, int, str]] = []
    functions: set[str] = set()
    depth, modify_depths, top, line, counted = 0, [0], 0, 1, 0
    for match in _TOKEN.finditer(text):
        token, at = match.group(), match.start()
        if token == "(":
            if depth == 0:
                line += text.count("\n", counted, at)
                top, counted = line, at
                found = _CONSTRUCT.match(text, at)
                if found:
                    constructs.append(Construct(found[1], found[2], line))
            depth += 1
            if rewrite:
                _rewrite_open(text, at, depth, modify_depths, edits)
        elif token == ")":
            depth = max(0, depth - 1)
            if depth < modify_depths[-1]:
                modify_depths.pop()
            if depth == 0 and rewrite_modify and constructs and constructs[-1].kind in _FUNCTIONS:
                _add_guard(text, (counted, match.end()), functions, is_known, edits)
    return Source(
        text=_apply(text, sorted(edits)) if edits else text,
        changed=bool(edits),
        constructs=tuple(constructs),
        unclosed_line=top if depth > 0 else None,
    )


def _add_guard(
    text: str,
    span: tuple[int, int],
    functions: set[str],
    is_known: Callable[[str], bool],
    edits: list[tuple[int, int, str]],
) -> None:
    """Note the edit that guards the function in ``span`` against endless recursion, if it needs one."""
    found = _CONSTRUCT.match(text, span[0])
    if found is None:
        return
    guard = guard_at(text, *span, lambda name: name in functions or is_known(name))
    functions.add(found[2])
    if guard is not None:
        edits.append((guard[0], guard[0], guard[1]))


def _find_by_pattern(text: str) -> tuple[int, str] | None:
    """Return place and message of the first word that is too long, or field of `format` that is too wide."""
    found = []
    word = _LONG_WORD.search(text)
    if word:
        found.append((word.start(), f"a word of more than {_MAX_WORD} characters"))
    wide = next((match for match in _FORMAT.finditer(text) if _WIDE_FIELD.search(match[1])), None)
    if wide:
        found.append((wide.start(), "a field of format is wider than 199 characters"))
    return min(found, default=None)


def find_excess(text: str) -> Excess | None:
    """Return the first thing in ``text`` that CLIPS cannot take, if there is one."""
    found = _find_by_pattern(text)
    end = len(text) if found is None else found[0]
    depth, parts, limited = 0, 0, False
    for match in _TOKEN.finditer(text, 0, end):
        token, at = match.group(), match.start()
        if token == "(":
            depth += 1
            if depth == 1:
                kind = _CONSTRUCT.match(text, at)
                parts, limited = 0, kind is not None and kind[1] not in _OF_ANY_SIZE
            elif depth == 2 and limited:  # noqa: PLR2004  right below the construct
                parts += 1
            if depth > _MAX_DEPTH:
                found = at, f"parentheses are nested more than {_MAX_DEPTH} deep"
            elif parts > _MAX_PARTS:
                found = at, f"a construct has more than {_MAX_PARTS} parts"
        elif token == ")":
            depth = max(0, depth - 1)
        elif token[0] == '"' and len(token) > _MAX_WORD:
            found = at, f"a string of more than {_MAX_WORD} characters"
        if found is not None and found[0] == at:
            break
    return None if found is None else Excess(text.count("\n", 0, found[0]) + 1, found[1])


def check_excess(text: str) -> None:
    """See that CLIPS can take ``text`` without harm to the process.

    :raises ClipsError: when it cannot.
    """
    excess = find_excess(text)
    if excess is not None:
        raise ClipsError(f"CLIPS cannot take this text: {excess.message}")


def _rewrite_open(
    text: str, at: int, depth: int, modify_depths: list[int], edits: list[tuple[int, int, str]]
) -> None:
    """Note the edits for the parenthesis at ``at``, which opens level ``depth``."""
    modify = _MODIFY.match(text, at)
    if modify:
        edits.append((at, modify.end(), "(" + MODIFY_FUNCTION))
        modify_depths.append(depth)
        return
    if depth == modify_depths[-1] + 1 and modify_depths[-1] > 0:
        slot = _SLOT.match(text, at)
        if slot and not _is_first_argument(text, at):
            newlines = "\n" * text.count("\n", at, slot.start(1))
            edits.append((at, slot.end(), f"{newlines} {slot[1]} (create$"))


def _is_first_argument(text: str, at: int) -> bool:
    """Whether the parenthesis at ``at`` follows the word ``modify``: then it is the fact, not a slot."""
    return re.search(r"\(\s*modify\s+(?:;[^\n]*\n\s*)*$", text[max(0, at - 400) : at]) is not None


def _apply(text: str, edits: list[tuple[int, int, str]]) -> str:
    """Replace the parts of ``text`` named by ``edits``, which are in order and do not overlap."""
    parts: list[str] = []
    position = 0
    for start, end, new in edits:
        parts += (text[position:start], new)
        position = end
    parts.append(text[position:])
    return "".join(parts)
