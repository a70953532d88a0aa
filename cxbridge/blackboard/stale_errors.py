"""The error of a skill string, distinguished from that of the previous skill string.

A Skiller of Fawkes that cannot compile a skill string shows S_FAILED together with the error of the previous
skill string.
"""

from __future__ import annotations

from functools import cache

from cxbridge.lua_syntax import LuaCompiler


class ErrorTracker:
    """Tracks the message ids and errors that a Skiller shows.

    :param msgid: the id of the message whose skill string is shown first.
    :param error: the error that is shown first.
    """

    def __init__(self, msgid: int = 0, error: str = "") -> None:
        self._msgid = msgid
        self._error = error
        self._previous_error = ""

    def current_error(self, msgid: int, skill_string: str, error: str, *, failed: bool) -> str:
        """Return the shown error, or the syntax error if the shown error is the previous one.

        :param failed: whether S_FAILED is shown.
        """
        if msgid != self._msgid:
            self._previous_error = self._error
        self._msgid, self._error = msgid, error
        # Fawkes sets the error only after a skill string that it could compile
        if failed and error == self._previous_error:
            return syntax_error(skill_string) or error
        return error


def syntax_error(chunk: str) -> str:
    """Return the error of compiling a Lua chunk, empty if there is none."""
    problem = _compiler().problem(chunk.encode("utf-8", "surrogateescape"))
    return "" if problem is None else f"the skill string is not Lua: {problem[1]}"


@cache
def _compiler() -> LuaCompiler:
    """Return the compiler of this process, made at the first failure, because it loads Lua."""
    return LuaCompiler()
