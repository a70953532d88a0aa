"""Says in words which list of a construct was not closed; for the check and for editors."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from typing import Final

from msgspec import Struct

from cxbridge.clipstext.syntax import HIDDEN, Lines, read
from cxbridge_studio.agent.unclosed_lists import unclosed_lists

_BEGINNING: Final = re.compile(r"\((def\w+)\s+([^\s()\";]+)")


class Unclosed(Struct, frozen=True):
    """A construct that never closes.

    :param start: where the list begins that is open; of a string that is open, the construct.
    """

    start: int
    message: str
    hint: str


def describe_unclosed(
    part: str, start: int, lines: Lines, text: str, slots: Mapping[str, Collection[str]]
) -> Unclosed:
    """Return what is wrong with a construct that never closes.

    :param part: its text, up to where the next one begins.
    :param start: where it begins in the file.
    :param text: of the file.
    :param slots: those of the deftemplates that are known.
    """
    line = lines.at(start)
    what = _BEGINNING.match(part)
    message = f"{' '.join(what.groups()) if what else 'this'} never closes"
    if any(match["unclosed"] for match in HIDDEN.finditer(part)):
        return Unclosed(start, message, "a string in it never closes")
    rows = text.splitlines()[line:]
    after = next((n for n, row in enumerate(rows, line + 1) if row.lstrip().startswith("(def")), 0)
    hint = f"a ) is missing before {f'line {after}' if after else 'the end of the file'}"
    if inner := next(iter(unclosed_lists(part, slots)), 0):
        start += inner
        head = read(part[inner:], close=True)[0].head
        message += f": its list ({head} is open" if head else ": a list in it is open"
        hint += f"; {what[1] if what else 'the construct'} begins in line {line}"
    return Unclosed(start, message, hint)
