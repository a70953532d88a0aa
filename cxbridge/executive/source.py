"""CLIPS text before CLIPS sees it: where constructs begin, and `modify` as CLIPS 6.30 meant it.

In 6.30 ``modify`` retracts a fact and asserts a new one with a new index; in 6.4 it changes the fact in
place. Users' files, Fawkes' own among them, rely on the former (docs/clips.md). So ``(modify F (slot v...))``
becomes ``(cx-modify F slot (create$ v...))``, a function of the host that does as 6.30 did. Nothing moves:
line numbers stay what they are in the file.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

_TOKEN = re.compile(r'"(?:[^"\\]|\\.)*"|;[^\n]*|[()]', re.DOTALL)
_CONSTRUCT = re.compile(r"\(\s*(def[a-z]+)\s+([^\s()\";]+)")
_MODIFY = re.compile(r"\(\s*modify(?=[\s(])")
_SLOT = re.compile(r"\(\s*([^\s()\";]+)")

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
class Source:
    """A file's text as CLIPS shall load it.

    :param changed: whether `modify` was rewritten in it.
    :param unclosed_line: where a parenthesis opens at the top level that never closes, if there is one.
    """

    text: str
    changed: bool
    constructs: tuple[Construct, ...]
    unclosed_line: int | None


def prepare(text: str, *, rewrite_modify: bool) -> Source:
    """Scan ``text`` once: list its constructs and, if asked, rewrite its `modify` calls."""
    rewrite = rewrite_modify and _MODIFY.search(text) is not None
    constructs: list[Construct] = []
    edits: list[tuple[int, int, str]] = []
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
    return Source(
        text=_apply(text, edits) if edits else text,
        changed=bool(edits),
        constructs=tuple(constructs),
        unclosed_line=top if depth > 0 else None,
    )


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
