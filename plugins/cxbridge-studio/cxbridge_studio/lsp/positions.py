"""Places in files: offsets here, lines and characters in the protocol."""

from __future__ import annotations

from pathlib import Path

from lsprotocol.types import Location, Position, Range
from pygls.uris import from_fs_path, to_fs_path
from pygls.workspace import PositionCodec

from cxbridge_studio.agent.names import SourceFile


class Positions:
    """Converts places.

    :param codec: counts characters as the client does.
    """

    def __init__(self, codec: PositionCodec) -> None:
        self._codec = codec

    def offset(self, file: SourceFile, position: Position) -> int:
        """Return the offset of a position; one behind the end of its line is at that end."""
        lines = file.lines
        start = lines.place(position.line + 1)
        end = file.text.find("\n", start)
        row = file.text[start : None if end < 0 else end]
        inside = self._codec.position_from_client_units([row], Position(0, position.character))
        return start + min(inside.character, len(row))

    def position(self, file: SourceFile, offset: int) -> Position:
        """Return the position of an offset."""
        line = file.lines.at(offset)
        row = file.text[file.lines.place(line) : offset]
        return Position(line - 1, self._codec.client_num_units(row))

    def range(self, file: SourceFile, start: int, end: int) -> Range:
        """Return the range between two offsets."""
        return Range(self.position(file, start), self.position(file, end))

    def location(self, file: SourceFile, start: int, end: int) -> Location:
        """Return the same with the file."""
        return Location(uri_of(file.path), self.range(file, start, end))


def path_of(uri: str) -> str:
    """Return the path of a file, as the model names it; the URI itself when it is not a file."""
    path = to_fs_path(uri)
    return str(Path(path).resolve()) if path else uri


def uri_of(path: str) -> str:
    """Return the URI of a file."""
    return from_fs_path(path) or path
