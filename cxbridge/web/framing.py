"""Requests whose length could be read in two ways are refused.

A proxy in front may see one request where a lenient server sees two: the second one then comes in the name of
somebody else (request smuggling). h11 takes some of what RFC 9112 lets a server refuse; here all of it is
refused, before h11 interprets it: both lengths at once (section 6.1), a length given twice, a transfer coding
of HTTP/1.0, lines that end without CR (2.2), folded lines (5.2), and control characters in the extension of a
chunk (7.1.1).
"""

from __future__ import annotations

import re
from typing import Final

import h11
from h11._receivebuffer import ReceiveBuffer  # it offers no other place to see the lines as they came

_LENGTH: Final = b"content-length"
_CODING: Final = b"transfer-encoding"
_BARE: Final = re.compile(rb"(?<!\r)\n|\r(?!\n)|\0")
_HEAD_END: Final = re.compile(rb"\n\r?\n")


class StrictBuffer(ReceiveBuffer):
    """The bytes of a connection. Its lines are looked at before they are taken for a request."""

    def maybe_extract_lines(self) -> list[bytearray] | None:
        """Return the lines up to a blank one; those of a request, or the trailers of its body.

        :raises h11.LocalProtocolError: when they can be read in two ways.
        """
        end = _HEAD_END.search(self._data)
        if end is not None and _BARE.search(self._data, 0, end.end()):
            raise _refused("a line ends without CR LF")
        lines = super().maybe_extract_lines()
        if lines:
            _check(lines)
        return lines

    def maybe_extract_next_line(self) -> bytearray | None:
        """Return the line that tells how long a chunk is.

        :raises h11.LocalProtocolError: when it can be read in two ways.
        """
        line = super().maybe_extract_next_line()
        if line is not None and _BARE.search(line):
            raise _refused("the extension of a chunk has control characters")
        return line


def _check(lines: list[bytearray]) -> None:
    """Refuse headers that tell the length in two ways.

    :raises h11.LocalProtocolError: when they do.
    """
    if any(line[:1] in b" \t" for line in lines if line):
        raise _refused("a header is folded")
    headers = [
        (name.strip().lower(), value)
        for name, colon, value in (line.partition(b":") for line in lines)
        if colon
    ]
    lengths = [value for name, value in headers if name == _LENGTH]
    codings = [value for name, value in headers if name == _CODING]
    if len(lengths) + len(codings) > 1 or any(b"," in value for value in lengths):
        raise _refused("it tells its length twice")
    if codings and lines[0].endswith(b"HTTP/1.0"):
        raise _refused("HTTP/1.0 has no transfer codings")


def _refused(why: str) -> h11.LocalProtocolError:
    return h11.LocalProtocolError(why)
