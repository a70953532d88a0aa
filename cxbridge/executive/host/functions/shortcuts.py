"""Functions of Fawkes' core that are called millions of times, answered by fewer calls of CLIPS.

An agent asks in joins and fact queries which keys begin with some words: ``wm-key-prefix``, a loop over the
words in CLIPS code. For each fact of the world model that is most of a game's time. So the host puts a
shortcut at the beginning of that function: the same answer from three built-ins. It goes only where the
code, apart from spaces, comments and strings, is exactly the one that is known; any other function of this
name stays alone.
"""

from __future__ import annotations

import hashlib
import re
from typing import Final

from cxbridge.clipstext.syntax import PARENTHESIS

_SHORTCUTS: Final = {
    "wm-key-prefix": (
        "4ca1cd37",
        "(if (multifieldp ?key) then (return (eq ?prefix (cx-subseq$ ?key 1 (cx-length$ ?prefix)))))",
    ),
}
"""By function: the first digits of the SHA-256 of its code, and what answers before that code does."""

_HEAD: Final = re.compile(r"\(\s*deffunction\s+([^\s()]+)\s*")


def shortcut_at(code: str, start: int, end: int) -> tuple[int, str] | None:
    """Return where a function takes a shortcut, and the shortcut; None when there is none for it.

    :param code: the text without its strings and comments (:func:`~cxbridge.clipstext.syntax.blank`).
    :param start: where the construct's parenthesis opens in ``code``.
    :param end: behind the one that closes it.
    """
    head = _HEAD.match(code, start, end)
    if head is None or head[1] not in _SHORTCUTS:
        return None
    digest, shortcut = _SHORTCUTS[head[1]]
    if digest_of(code[start:end]) != digest:
        return None
    closing = next((each for each in PARENTHESIS.finditer(code, head.end(), end) if each[0] == ")"), None)
    return None if closing is None else (closing.end(), f" {shortcut}")


def digest_of(construct: str) -> str:
    """Return the first digits of the SHA-256 of a construct's words."""
    words = " ".join(re.findall(r"[()]|[^\s()]+", construct))
    return hashlib.sha256(words.encode()).hexdigest()[:8]
