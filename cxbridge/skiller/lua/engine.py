"""The Lua engine: one Lua 5.1 state with the skills of one skill space."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cxbridge.clock import Clock
from cxbridge.errors import SkillError
from cxbridge.events import Logger
from cxbridge.skiller.lua.boardaccess import BoardAccess
from cxbridge.skiller.lua.host import ConfigReader, HostFunctions, from_lua, readable, to_lua
from cxbridge.skiller.lua.modulepath import ModulePath
from cxbridge.skiller.lua.placeaccess import PlaceAccess
from cxbridge.skiller.status import Status

if TYPE_CHECKING:
    from cxbridge.blackboard.base import BlackBoard
    from cxbridge.navgraph import NavGraph
    from cxbridge.tf import TransformBuffer

_HERE = Path(__file__).parent

MEBIBYTE = 1024 * 1024


@dataclass(frozen=True, slots=True)
class Limits:
    """What the Lua of one engine may use.

    :param instructions_per_loop: VM instructions in one loop; a million takes some 10 ms.
    :param instructions_to_load: VM instructions to load the skill space.
    :param seconds_per_loop: processor time in one loop; for instructions that do much, such as string.rep.
    :param seconds_to_load: processor time to load the skill space.
    :param memory: bytes of all Lua objects together.
    """

    instructions_per_loop: int = 5_000_000
    instructions_to_load: int = 50_000_000
    seconds_per_loop: float = 1.0
    seconds_to_load: float = 10.0
    memory: int = 128 * MEBIBYTE


@dataclass(frozen=True, slots=True)
class Tick:
    """What running a skill string once came to.

    :param error: what Lua said, with a traceback; empty when it ran through.
    :param status: the overall status of the skills that it called.
    """

    error: str
    status: Status


@cache
def _sources() -> dict[str, str]:
    return {path.stem: path.read_text("latin-1") for path in sorted(_HERE.glob("*.lua"))}


def _deny_attributes(_obj: object, _name: object, _is_setting: bool) -> Any:
    raise AttributeError("Lua has no business in Python objects")


class LuaEngine:
    """Loads a skill space and runs skill strings in it.

    :param board: where skills open their interfaces.
    :param folders: where skills lie, see :class:`ModulePath`.
    :param space: the skill space: the module ``skills.SPACE`` that loads the skills.
    :param transforms: how frames lie to each other, for ``tf``; None: no frame is known.
    :param navgraph: for ``navgraph``; None: skills see none.
    :param owner: who opens interfaces.
    :param seed: of ``math.random``.
    :raises SkillError: when the space or one of its skills cannot be loaded; with file and line.
    """

    def __init__(  # noqa: PLR0913 - a façade over everything that Lua can reach
        self,
        board: BlackBoard,
        clock: Clock,
        logger: Logger,
        folders: Sequence[Path],
        *,
        space: str = "test",
        config: ConfigReader | None = None,
        limits: Limits | None = None,
        transforms: TransformBuffer | None = None,
        navgraph: NavGraph | None = None,
        owner: str = "Skiller",
        seed: int = 0,
    ) -> None:
        from lupa.lua51 import LuaError, LuaRuntime  # noqa: PLC0415 - only runs with Lua skills pay for it

        limits = limits or Limits()
        self.modules = ModulePath(folders)
        self.space = space
        lua = LuaRuntime(
            encoding="latin-1",
            unpack_returned_tuples=True,
            register_eval=False,
            register_builtins=False,
            attribute_filter=_deny_attributes,
            max_memory=limits.memory,
        )
        self._lua_error: type[Exception] = LuaError
        self._board_access = BoardAccess(board, owner, lua.table_from)
        functions = HostFunctions(logger, clock, self.modules, config, seed).table()
        functions |= self._board_access.table()
        functions |= PlaceAccess(transforms, navgraph).table()
        bounds = {name: value for name, value in asdict(limits).items() if name != "memory"}
        runner = lua.execute(
            _sources()["boot"],
            lua.table_from(functions),
            lua.table_from(_sources()),
            lua.table_from(bounds),
            name="@cxbridge/boot.lua",
        )
        self._calls = {name: runner[name] for name in runner}
        try:
            self._load(space)
        except SkillError:
            self._board_access.close_all()
            raise

    def _load(self, space: str) -> None:
        ok, problem = self._calls["load"](space)
        if ok:
            return
        file, line, text = self.modules.locate(readable(str(problem)))
        raise SkillError(f"cannot load skill space '{space}': {text}", file=file, line=line)

    @property
    def skills(self) -> tuple[str, ...]:
        """The names of the skills in order of registration."""
        return tuple(self._calls["names"]().split())

    def documentation(self, skill: str) -> str | None:
        """Return the documentation of a skill, None when there is none of this name."""
        text = self._calls["documentation"](skill)
        return None if text is None else readable(text)

    def compile(self, skill_string: str) -> str:
        """Compile a skill string for :meth:`run`, instead of the one before.

        :returns: what is wrong with it; empty when nothing is.
        """
        return self._outcome(self._call("compile", to_lua(skill_string)))

    def run(self) -> Tick:
        """Run the compiled skill string once: one loop."""
        ok, error, *status = self._call("run")
        return Tick(self._outcome((ok, error)), Status(status[0] if status else Status.S_INACTIVE))

    def drop(self) -> None:
        """Forget the compiled skill string."""
        self._calls["drop"]()

    def reset_all(self) -> str:
        """Reset the skills that the skill string called, and those they use.

        :returns: what went wrong in their code; empty when nothing did.
        """
        return self._outcome(self._call("reset_all"))

    @property
    def status(self) -> Status:
        """The overall status of the skills called in the last loop; nothing called is S_INACTIVE."""
        return Status(self._calls["overall_status"]())

    def first_error(self) -> str:
        """Return the error text of the skill that was called first in the last loop."""
        return from_lua(str(self._call("first_error")[0] or ""))

    def failure_text(self) -> str:
        """Return why the first failed skill failed: its error text, or the label of its last transition."""
        return from_lua(str(self._call("failure_text")[0] or ""))

    def graph(self, skill: str, direction: str, *, coloured: bool, always: bool) -> tuple[bool, str]:
        """Draw the state machine of a skill in the dot language.

        :param skill: its name; empty: the skill that was called first in the last loop.
        :param direction: ``TB``, ``BT``, ``LR`` or ``RL``.
        :param always: draw it also when it did not change since it was drawn last.
        :returns: whether there is such a machine, and its graph: empty when it did not change.
        """
        found, text = self._call("graph", to_lua(skill), direction, coloured, always)[:2]
        return bool(found), from_lua(text)

    def overview(self, what: str) -> str:
        """Return the names of all skills, one a line (``LIST``), or who uses whom in dot (``SKILL_DEP``)."""
        if what == "LIST":
            return "".join(f"{name}\n" for name in self.skills)
        return from_lua(self._calls["dependencies"]())

    def finish_loop(self) -> str:
        """End a loop: publish the interfaces that skills changed.

        :returns: what went wrong; empty when nothing did.
        """
        return self._outcome(self._call("finish_loop"))

    @property
    def has_callbacks(self) -> bool:
        """Whether skills asked to be called in every loop, also when none runs."""
        return bool(self._calls["has_callbacks"]())

    def run_idle(self) -> str:
        """Do a loop without a skill string: the callbacks of skills.

        :returns: what went wrong; empty when nothing did.
        """
        return self._outcome(self._call("run_preloop_callbacks")) or self.finish_loop()

    def _call(self, name: str, *args: Any) -> tuple[Any, ...]:
        """Call a function of the runner that answers with true, or with false and what is wrong."""
        try:
            result = self._calls[name](*args)
        except self._lua_error as error:  # not even the runner's own code had memory left
            return False, str(error)
        return result if isinstance(result, tuple) else (result, "")

    @staticmethod
    def _outcome(result: tuple[Any, ...]) -> str:
        ok, error = result[:2]
        return "" if ok else readable(str(error)) or "unknown error"

    def close(self) -> None:
        """Run the finalize callbacks and close all interfaces that Lua opened."""
        self._calls["finalize"]()
        self._board_access.close_all()
