"""The error of the present skill string, distinguished from the error of the previous skill string.

A Skiller of Fawkes that cannot compile a skill string shows S_FAILED together with the error of the previous
skill string, because Fawkes sets the error only after a compilation.
"""

from __future__ import annotations

from functools import cache

from cxbridge.lua_syntax import LuaCompiler


class ErrorTracker:
    """Tracks the message ids and errors that a Skiller shows.

    :param msgid: the id of the message that the Skiller shows at first.
    :param error: the error that the Skiller shows at first.
    """

    def __init__(self, msgid: int = 0, error: str = "") -> None:
        self._msgid = msgid
        self._error = error
        self._previous_error = ""

    def update(self, msgid: int, skill_string: str, error: str, *, failed: bool) -> str:
        """Record the shown id and error, and return the error of the present skill string.

        :param msgid: the id of the message that the Skiller shows.
        :param error: the error that the Skiller shows; replaced by the syntax error of the skill string if
            the skill string has failed and the previous skill string had the same error.
        :param failed: whether the Skiller shows S_FAILED.
        """
        if msgid != self._msgid:
            self._previous_error = self._error
        self._msgid, self._error = msgid, error
        if failed and error == self._previous_error:
            return find_syntax_error(skill_string) or error
        return error


def find_syntax_error(skill_string: str) -> str:
    """Return the error of compiling a skill string as Lua; empty for valid Lua."""
    line_and_message = _get_compiler().find_error(skill_string.encode("utf-8", "surrogateescape"))
    return "" if line_and_message is None else f"the skill string is not valid Lua: {line_and_message[1]}"


@cache
def _get_compiler() -> LuaCompiler:
    """Return the compiler of this process, constructed at the first failure, because it loads Lua."""
    return LuaCompiler()
