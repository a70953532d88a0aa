"""The error that a Skiller shows for a skill string, if it is not that of the skill string before.

A Fawkes that cannot compile a skill string shows S_FAILED, and leaves the error of the skill string before.
"""

from __future__ import annotations

from functools import cache

from cxbridge.lua_syntax import LuaCompiler


class OwnError:
    """Follows the state of a Skiller, from one write to the next.

    :param msgid: id of the message whose skill string is shown first.
    :param error: the error that is shown first.
    """

    def __init__(self, msgid: int = 0, error: str = "") -> None:
        self._msgid = msgid
        self._error = error
        self._before = ""

    def of(self, msgid: int, skill_string: str, error: str, *, failed: bool) -> str:
        """Return the error of the skill string: the one that is shown, or why Lua cannot compile it.

        :param failed: whether S_FAILED is shown.
        """
        if msgid != self._msgid:
            self._before = self._error
        self._msgid, self._error = msgid, error
        if failed and error == self._before:
            return syntax_error(skill_string) or error
        return error


def syntax_error(chunk: str) -> str:
    """Return why Lua cannot compile a chunk, which is not executed; empty when Lua can."""
    problem = _compiler().problem(chunk.encode("utf-8", "surrogateescape"))
    return "" if problem is None else f"the skill string is not Lua: {problem[1]}"


@cache
def _compiler() -> LuaCompiler:
    return LuaCompiler()
