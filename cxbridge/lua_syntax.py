"""Checks of Lua syntax by compiling a text without executing it."""

from __future__ import annotations

import re
from typing import Any, Final

_LINE_AND_MESSAGE: Final = re.compile(r"\]:(\d{1,9}): (.*)")  # [string "..."]:3: unexpected symbol near ...
_BYTECODE_START: Final = b"\x1b"  # Lua does not check bytecode, which may crash the process


class LuaCompiler:
    """Compiles Lua without executing it.

    The messages of Lua quote the text, and may cut it within a character.
    """

    def __init__(self) -> None:
        from lupa.lua51 import LuaError, LuaRuntime  # noqa: PLC0415 - only agents with Lua skills pay for it

        self._error: type[Exception] = LuaError
        # latin-1 keeps every byte, because scripts are files in any encoding
        self._lua: Any = LuaRuntime(encoding="latin-1", register_eval=False, register_builtins=False)

    def find_error(self, text: bytes) -> tuple[int, str] | None:
        """Return line (0: unknown) and message of the first error; None if the text is valid Lua."""
        if text.startswith(_BYTECODE_START):
            return 1, "precompiled Lua is not accepted"
        try:
            self._lua.compile(text)
        except self._error as error:
            message = decode_lua_text(str(error))
            match = _LINE_AND_MESSAGE.search(message)
            return (int(match[1]), match[2]) if match else (0, message)
        return None

    def find_file_error(self, text: bytes) -> tuple[int, str] | None:
        """Return the error of a file as :meth:`find_error` does; Lua ignores a first line with ``#``."""
        return self.find_error(b"--" + text if text.startswith(b"#") else text)


def decode_lua_text(text: str) -> str:
    """Decode a text from Lua, which is Latin-1 here; bytes that are not UTF-8 are replaced."""
    return text if text.isascii() else text.encode("latin-1").decode("utf-8", "replace")
