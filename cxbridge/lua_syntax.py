"""Whether a text is Lua: it is compiled, and nothing of it is executed."""

from __future__ import annotations

import re
from typing import Any, Final

_LINE: Final = re.compile(r"\]:(\d+): (.*)")
_PRECOMPILED: Final = b"\x1b"


class LuaCompiler:
    """Compiles Lua and runs nothing of it.

    Lua's messages quote the text, and may cut a character of it in two.
    """

    def __init__(self) -> None:
        from lupa.lua51 import LuaError, LuaRuntime  # noqa: PLC0415 - only agents with Lua skills pay for it

        self._error: type[Exception] = LuaError
        self._lua: Any = LuaRuntime(encoding="latin-1", register_eval=False, register_builtins=False)

    def problem(self, text: bytes) -> tuple[int, str] | None:
        """Return the line of a mistake (0: unknown) and Lua's message; None when the text compiles."""
        if text.startswith(_PRECOMPILED):
            return 1, "precompiled Lua is not accepted"
        try:
            self._lua.compile(text)
        except self._error as error:
            told = readable(str(error))
            match = _LINE.search(told)
            return (int(match[1]), match[2]) if match else (0, told)
        return None

    def problem_of_file(self, text: bytes) -> tuple[int, str] | None:
        """Return a mistake as :meth:`problem`; Lua passes over the line of a script's interpreter."""
        return self.problem(b"--" + text if text.startswith(b"#") else text)


def readable(text: str) -> str:
    """Return a text that came out of Lua for people: bytes that are not UTF-8 are replaced."""
    return text if text.isascii() else text.encode("latin-1").decode("utf-8", "replace")
