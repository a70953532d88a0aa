r"""Foreign text made safe for a terminal and for a log: every printer uses these functions.

Skill strings, facts, errors, names of peers, ids of interfaces, configuration values and recordings hold what
text of other programs. On a terminal an escape sequence moves the cursor, sets the clipboard or the title, or
draws a link; in a log a line break forges a line of another program. Such characters are printed by
their number, as JSON writes them: ``\u001b``. All other text is kept, tabs and any script included.

What counts as such: C0 but tab and line feed, DEL, C1 (U+0080 to U+009F), the separators of lines and of
paragraphs, embeddings, overrides and isolates, which turn the reading order around, and lone surrogates, that
are bytes that were no UTF-8. JSON has the same characters so, too: it stays valid, and says the same.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import IO, Any, Final

_SURROGATES: Final = range(0xD800, 0xE000)
_LATIN_1: Final = range(0xDCA0, 0xDD00)

UNSAFE: Final = (
    *range(0x09),
    *range(0x0B, 0x20),
    *range(0x7F, 0xA0),
    *range(0x2028, 0x202F),
    *range(0x2066, 0x206A),
    *_SURROGATES,
)
"""Code points that never reach a terminal or a log; a line feed does, where a text may have several lines."""


def numbered(code: int) -> str:
    r"""Return a code point of the basic plane as its number: ``\u001b``."""
    return f"\\u{code:04x}"


_VISIBLE: Final[Mapping[int, str]] = {code: numbered(code) for code in UNSAFE}
_ONE_LINE: Final[Mapping[int, str]] = {**_VISIBLE, 0x0A: numbered(0x0A)}
_IN_FILE: Final[Mapping[int, str]] = {code: text for code, text in _ONE_LINE.items() if code not in _LATIN_1}
_DANGEROUS: Final = re.compile(f"[{''.join(map(chr, UNSAFE))}]")
_LOOKS_ESCAPED: Final = re.compile(r"\\(?=u[0-9a-f]{4})")
_ESCAPED: Final = re.compile(r"\\u([0-9a-f]{4})")
_GOES_ON: Final = re.compile(r"\n(?=[ \t()\n]|\Z)")
_BACKSLASH: Final = 0x5C


def visible(text: str) -> str:
    """Return a text of one or several lines as a terminal may have it."""
    return text if text.isprintable() or not _DANGEROUS.search(text) else text.translate(_VISIBLE)


def one_line(text: str) -> str:
    """Return a text as a terminal may have it, in one line: line feeds appear as numbers, too."""
    return text if text.isprintable() else text.translate(_ONE_LINE)


def indented(text: str) -> str:
    """Return a text of several lines as a terminal may have it, all but the first begin with blanks.

    None of them can be mistaken for a line of another program.
    """
    first, *more = visible(text).split("\n")
    return "\n".join([first, *(line if line.startswith("  ") or not line else f"  {line}" for line in more)])


def to_record(text: str) -> str:
    r"""Return a text for a line of a recording: as :func:`one_line`, and :func:`from_record` gets it back.

    Bytes that were letters of Latin-1 stay. A backslash that would begin a number is ``\u005c``.
    """
    if text.isprintable() and "\\u" not in text:
        return text
    return _LOOKS_ESCAPED.sub(lambda _: numbered(_BACKSLASH), text).translate(_IN_FILE)


def to_entry(text: str) -> str:
    """Return a text for an entry of a log: as :func:`to_record`, but of several lines.

    As Fawkes logs constructs: a line feed stays before a blank, a tab or a parenthesis, with which no entry
    begins, and before the end.
    """
    if text.isprintable() and "\\u" not in text:
        return text
    lines = _GOES_ON.split(text)
    return "\n".join(map(to_record, lines)) if len(lines) > 1 else to_record(text)


def from_record(text: str) -> str:
    """Return the text that :func:`to_record` or :func:`to_entry` was given; other numbers stay."""
    return _ESCAPED.sub(_character, text) if "\\u" in text else text


def _character(match: re.Match[str]) -> str:
    code = int(match.group(1), 16)
    return chr(code) if code in _ONE_LINE or code == _BACKSLASH else match.group()


class VisibleStream:
    """A text stream that passes nothing on that a terminal would obey: what no printer forgets.

    All other attributes are the stream's. The program's own escape sequences go to :attr:`terminal`.

    :param stream: e.g. ``sys.stdout``.
    """

    def __init__(self, stream: IO[str]) -> None:
        self.terminal: Final = stream
        """The stream without the filter, for colours and the cursor."""

    def write(self, text: str) -> int:
        """Write a text of one or several lines."""
        self.terminal.write(visible(text))
        return len(text)

    def writelines(self, lines: list[str]) -> None:
        """Write texts."""
        for line in lines:
            self.write(line)

    def __getattr__(self, name: str) -> Any:
        """Return whatever else a stream has."""
        return getattr(self.terminal, name)


def terminal_of(stream: IO[str] | VisibleStream) -> IO[str]:
    """Return the stream to which the program's own colours and movements of the cursor go."""
    return stream.terminal if isinstance(stream, VisibleStream) else stream


def short_path(file: str | Path) -> str:
    """Return a path as seen from the working directory, if it is below that."""
    try:
        return str(Path(file).relative_to(Path.cwd()))
    except ValueError:
        return str(file)
