"""A Lua 5.1 state with the skills of one skill space, and the limits of its memory.

Lua gets functions that take and return plain values, no Python objects (:mod:`.host`). A reload makes a new
state.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

from cxbridge.errors import SkillError
from cxbridge.lua_syntax import decode_lua_text
from cxbridge.skiller.lua.modulepath import ModulePath

_LUA_FILES_DIR = Path(__file__).parent

# The functions of the runner that begin a step, and with it a new limit of additional memory.
_STEPS = frozenset(["prepare", "compile", "run", "run_preloop_callbacks", "finalize"])

HostTable = dict[str, Callable[..., Any]]
"""The functions that Lua may call, by name."""


@cache
def _read_sources() -> dict[str, str]:
    """Return the engine's Lua files by name, with one character per byte."""
    return {path.stem: path.read_text("latin-1") for path in sorted(_LUA_FILES_DIR.glob("*.lua"))}


def _deny_attributes(_obj: object, _name: object, _is_setting: bool) -> Any:
    """Refuse the access to an attribute of a Python object, which could lead out of the sandbox."""
    raise AttributeError("Lua must not access attributes of Python objects")


class LuaState:
    """A Lua state with the engine's files; :meth:`load` adds the skills.

    :param limits: the fields of :class:`~cxbridge.skiller.lua.limits.Limits` by name.
    :param make_host: gets the function that makes Lua tables; returns the host functions.
    """

    def __init__(
        self,
        limits: dict[str, Any],
        modules: ModulePath,
        make_host: Callable[[Callable[[Any], Any]], HostTable],
    ) -> None:
        from lupa.lua51 import LuaError, LuaRuntime  # noqa: PLC0415 - only runs with Lua skills pay for it

        self.modules = modules
        lua = LuaRuntime(
            encoding="latin-1",  # one character per byte, because Lua's strings are bytes
            unpack_returned_tuples=True,  # host functions return several values
            register_eval=False,
            register_builtins=False,
            attribute_filter=_deny_attributes,
            max_memory=limits["memory"],
        )
        self._lua_error: type[Exception] = LuaError
        self._lua = lua
        self._memory = limits["memory"]
        self._max_growth = limits["memory_per_loop"]
        runner = lua.execute(
            _read_sources()["boot"],
            lua.table_from(make_host(lua.table_from)),
            lua.table_from(_read_sources()),
            lua.table_from(limits),
            name="@cxbridge/boot.lua",
        )
        self.functions: HostTable = {name: runner[name] for name in runner}
        """The functions of the runner, by name."""

    def make_table(self, items: Any) -> Any:
        """Make a Lua table. Its texts must be in Lua's encoding."""
        return self._lua.table_from(items)

    def load(self, space: str) -> None:
        """Load a skill space.

        :raises SkillError: if the space or a skill cannot be loaded, with file and line.
        """
        ok, problem = self.call("load", space)[:2]
        if ok:
            return
        file, line, text = self.modules.locate(decode_lua_text(str(problem)))
        raise SkillError(f"cannot load skill space '{space}': {text}", file=file, line=line)

    def call(self, name: str, *args: Any) -> tuple[Any, ...]:
        """Call a function of the runner; return at least two values: after a failure, False and the error."""
        # the calls of one step share a limit of additional memory, because copying and freeing large data
        # takes long; the clean-up after an exceeded limit gets more
        if name in _STEPS:
            self._limit_memory()
        try:
            result = self.functions[name](*args)
        except self._lua_error as error:  # no memory was left even for the runner's own code
            self._limit_memory()
            return False, str(error)
        if not isinstance(result, tuple):
            return result, ""  # callers expect a second value, such as an error
        if result[0] is False:
            self._limit_memory()
        return result

    def _limit_memory(self) -> None:
        self._lua.set_max_memory(min(self._memory, self._lua.get_memory_used() + self._max_growth))
