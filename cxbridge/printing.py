r"""Functions that make foreign text safe for terminals and logs. All printers use them.

Skill strings, facts, errors, peer names, interface ids, configuration values and recordings contain text of
other programs. On a terminal, escape sequences could move the cursor, set the clipboard or the title, or draw
links; in a log, line breaks could forge lines of other programs. Such characters are printed as numbers like
in JSON: ``\u001b``. All other text is kept, including tabs and any script.

These characters are C0 except tab and line feed, DEL, C1 (U+0080 to U+009F), separators of lines and
paragraphs, embeddings, overrides and isolates, which change the reading order, and lone surrogates, which
represent bytes that are not UTF-8. JSON output remains valid with the same meaning.
"""

from __future__ import annotations

import re
from itertools import chain
from pathlib import Path
from typing import IO, Any, Final

_SURROGATES: Final = range(0xD800, 0xE000)
# The surrogates by which Python (surrogateescape) represents the bytes 0xA0 to 0xFF, letters in Latin-1.
_LATIN_1_SURROGATES: Final = range(0xDCA0, 0xDD00)

_UNSAFE_RANGES: Final = (
    range(0x09),
    range(0x0B, 0x20),
    range(0x7F, 0xA0),
    range(0x2028, 0x202F),
    range(0x2066, 0x206A),
    _SURROGATES,
)
UNSAFE_CODE_POINTS: Final = tuple(chain.from_iterable(_UNSAFE_RANGES))
"""The code points that are never printed; line feeds are printed in texts of several lines."""


def escape_code_point(code: int) -> str:
    r"""Return a code point of the basic plane as a number: ``\u001b``."""
    return f"\\u{code:04x}"


_LINE_FEED: Final = range(0x0A, 0x0B)


def _character_pattern(*ranges: range) -> str:
    """Return the regular expression of a character in one of the ranges."""
    # a table of all code points would take milliseconds of each start
    return f"[{''.join(f'{chr(span.start)}-{chr(span.stop - 1)}' for span in ranges)}]"


_UNSAFE_CHARACTER: Final = re.compile(_character_pattern(*_UNSAFE_RANGES))
_UNSAFE_IN_LINE: Final = re.compile(_character_pattern(*_UNSAFE_RANGES, _LINE_FEED))
# The lookahead excepts the surrogates that represent Latin-1 letters.
_UNSAFE_IN_RECORD: Final = re.compile(
    f"(?!{_character_pattern(_LATIN_1_SURROGATES)}){_UNSAFE_IN_LINE.pattern}"
)
# A backslash before text that looks like an escaped code point.
_AMBIGUOUS_BACKSLASH: Final = re.compile(r"\\(?=u[0-9a-f]{4})")
_ESCAPE: Final = re.compile(r"\\u([0-9a-f]{4})")
# A line feed within an entry of Fawkes' log: no entry starts with a blank, a tab or a parenthesis.
_INNER_LINE_FEED: Final = re.compile(r"\n(?=[ \t()\n]|\Z)")


def _escape_match(match: re.Match[str]) -> str:
    return escape_code_point(ord(match.group()))


def visible(text: str) -> str:
    """Return a text of any number of lines with its control characters escaped."""
    return text if text.isprintable() else _UNSAFE_CHARACTER.sub(_escape_match, text)


def one_line(text: str) -> str:
    """Return a text as one line with its control characters escaped."""
    return text if text.isprintable() else _UNSAFE_IN_LINE.sub(_escape_match, text)


def indent_lines(text: str) -> str:
    """Return a text with its control characters escaped and its further lines indented.

    Such a line cannot be mistaken for a line of another program. Empty lines stay empty.
    """
    head, *lines = visible(text).split("\n")
    return "\n".join([head, *(line if line.startswith("  ") or not line else f"  {line}" for line in lines)])


def escape_record(text: str) -> str:
    r"""Return a text for a line of a recording, from which :func:`unescape_record` restores it.

    Bytes that represent Latin-1 letters are kept. A backslash that looks like an escaped number becomes
    ``\u005c``.
    """
    is_safe = text.isprintable() and "\\u" not in text
    return (
        text
        if is_safe
        else _UNSAFE_IN_RECORD.sub(_escape_match, _AMBIGUOUS_BACKSLASH.sub(_escape_match, text))
    )


def escape_log_entry(text: str) -> str:
    """Return a text for a log entry like :func:`escape_record`, but with several lines.

    As in constructs logged by Fawkes, a line feed is kept at the end, and before a blank, a tab, a
    parenthesis or another line feed.
    """
    if text.isprintable() and "\\u" not in text:
        return text
    lines = _INNER_LINE_FEED.split(text)
    return "\n".join(map(escape_record, lines)) if len(lines) > 1 else escape_record(text)


def unescape_record(text: str) -> str:
    """Restore the text from :func:`escape_record` or :func:`escape_log_entry`; other numbers are kept."""
    return _ESCAPE.sub(_unescape_match, text) if "\\u" in text else text


def _unescape_match(match: re.Match[str]) -> str:
    """Return the character of an escape, unless :func:`escape_record` would keep the character."""
    character = chr(int(match.group(1), 16))
    return character if character == "\\" or _UNSAFE_IN_LINE.match(character) else match.group()


class VisibleStream:
    """A text stream that filters control sequences, in case a printer forgets to filter them.

    All other attributes are those of the filtered stream. The program writes its own colours and cursor
    movements to :attr:`terminal`.

    :param stream: the stream to filter, e.g. ``sys.stdout``.
    """

    def __init__(self, stream: IO[str]) -> None:
        self.terminal: Final = stream
        """The unfiltered stream, for colours and the cursor."""

    def write(self, text: str) -> int:
        """Write a text, filtered; return the length of the unfiltered text, as streams do."""
        self.terminal.write(visible(text))
        return len(text)

    def writelines(self, lines: list[str]) -> None:
        self.write("".join(lines))

    def __getattr__(self, name: str) -> Any:
        """Return an attribute of the stream."""
        return getattr(self.terminal, name)


def unfiltered_stream(stream: IO[str] | VisibleStream) -> IO[str]:
    """Return the stream for the program's colours and cursor movements."""
    return stream.terminal if isinstance(stream, VisibleStream) else stream


def short_path(file: str | Path) -> str:
    """Return a path relative to the working directory if the path is within that folder; else unchanged."""
    try:
        return str(Path(file).relative_to(Path.cwd()))
    except ValueError:
        return str(file)


def format_count(count: int, noun: str) -> str:
    """Return a number with its noun: ``1 write``, ``2 writes``."""
    return f"{count} {noun}{'' if count == 1 else 's'}"
