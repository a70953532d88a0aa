"""Checks of Lua syntax by compiling a source without executing it."""

from __future__ import annotations

import re
from typing import Any, Final

_LINE_AND_MESSAGE: Final = re.compile(r"\]:(\d{1,9}): (.*)")  # [string "..."]:3: unexpected symbol near ...
_BYTECODE_START: Final = b"\x1b"  # Lua does not check bytecode, which may crash the process


class LuaCompiler:
    """Compiles Lua without executing it.

    The messages of Lua quote the source, and may cut the quotation within a character.
    """

    def __init__(self) -> None:
        from lupa.lua51 import LuaError, LuaRuntime  # noqa: PLC0415 - only agents with Lua skills pay for it

        self._error: type[Exception] = LuaError
        # latin-1 keeps every byte, because scripts are files in any encoding
        self._lua: Any = LuaRuntime(encoding="latin-1", register_eval=False, register_builtins=False)

    def find_error(self, source: bytes) -> tuple[int, str] | None:
        """Return the first error; None if the source is valid Lua.

        :returns: the line, 0 if it is unknown, and the message.
        """
        if source.startswith(_BYTECODE_START):
            return 1, "precompiled Lua is not accepted"
        try:
            self._lua.compile(source)
        except self._error as error:
            message = decode_lua_text(str(error))
            match = _LINE_AND_MESSAGE.search(message)
            return (int(match[1]), match[2]) if match else (0, message)
        return None

    def find_file_error(self, content: bytes) -> tuple[int, str] | None:
        """Return the first error in the content of a file as :meth:`find_error` does; None if it is valid."""
        # Lua ignores a first line with #, but only in files; a comment keeps the numbers of the lines
        return self.find_error(b"--" + content if content.startswith(b"#") else content)


def decode_lua_text(text: str) -> str:
    """Decode a text from Lua, which is Latin-1 here; bytes that are not UTF-8 are replaced."""
    return text if text.isascii() else text.encode("latin-1").decode("utf-8", "replace")
