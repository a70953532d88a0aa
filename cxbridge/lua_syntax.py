"""Checks of Lua syntax by compiling a text without executing it."""

from __future__ import annotations

import re
from typing import Any, Final

_LINE: Final = re.compile(r"\]:(\d+): (.*)")  # [string "..."]:3: unexpected symbol near ...
_PRECOMPILED: Final = b"\x1b"  # Lua does not check bytecode, which may crash the process


class LuaCompiler:
    """Compiles Lua without executing it.

    The messages of Lua quote the text, and may cut it within a character.
    """

    def __init__(self) -> None:
        from lupa.lua51 import LuaError, LuaRuntime  # noqa: PLC0415 - only agents with Lua skills pay for it

        self._error: type[Exception] = LuaError
        self._lua: Any = LuaRuntime(encoding="latin-1", register_eval=False, register_builtins=False)

    def problem(self, text: bytes) -> tuple[int, str] | None:
        """Return the line of an error (0: unknown) and Lua's message, or None."""
        if text.startswith(_PRECOMPILED):
            return 1, "precompiled Lua is not accepted"
        try:
            self._lua.compile(text)
        except self._error as error:
            message = readable(str(error))
            match = _LINE.search(message)
            return (int(match[1]), match[2]) if match else (0, message)
        return None

    def problem_of_file(self, text: bytes) -> tuple[int, str] | None:
        """Return an error of a file like :meth:`problem`, ignoring a first line with ``#`` as Lua does."""
        return self.problem(b"--" + text if text.startswith(b"#") else text)


def readable(text: str) -> str:
    """Return a text from Lua with bytes that are not UTF-8 replaced."""
    return text if text.isascii() else text.encode("latin-1").decode("utf-8", "replace")
