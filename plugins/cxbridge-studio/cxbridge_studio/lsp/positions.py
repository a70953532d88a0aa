"""Converts between offsets in files and the protocol's lines and characters."""

from __future__ import annotations

from pathlib import Path

from lsprotocol.types import Location, Position, Range
from pygls.uris import from_fs_path, to_fs_path
from pygls.workspace import PositionCodec

from cxbridge_studio.agent.names import SourceFile


class PositionConverter:
    """Converts positions for a client.

    :param codec: the codec of pygls, which counts characters in the client's encoding.
    """

    def __init__(self, codec: PositionCodec) -> None:
        self._codec = codec

    def to_offset(self, file: SourceFile, position: Position) -> int:
        """Return the offset of a position. A position after the end of a line means the end of the line."""
        lines = file.lines
        start = lines.position(position.line + 1)
        end = file.text.find("\n", start)
        line_text = file.text[start : None if end < 0 else end]
        # only the line, not the whole file, since the codec visits each character
        position_in_line = self._codec.position_from_client_units(
            [line_text], Position(0, position.character)
        )
        return start + min(position_in_line.character, len(line_text))

    def to_position(self, file: SourceFile, offset: int) -> Position:
        line = file.lines.line_at(offset)
        line_text = file.text[file.lines.position(line) : offset]
        return Position(line - 1, self._codec.client_num_units(line_text))

    def to_range(self, file: SourceFile, start: int, end: int) -> Range:
        return Range(self.to_position(file, start), self.to_position(file, end))

    def to_location(self, file: SourceFile, start: int, end: int) -> Location:
        return Location(path_to_uri(file.path), self.to_range(file, start, end))


def uri_to_path(uri: str) -> str:
    """Return the resolved path of a file URI, as the model has it; return any other URI unchanged."""
    path = to_fs_path(uri)
    return str(Path(path).resolve()) if path else uri


def path_to_uri(path: str) -> str:
    return from_fs_path(path) or path
