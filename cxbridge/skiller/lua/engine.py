"""The Lua engine: the skills of one skill space in a Lua 5.1 state, which a reload replaces."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cxbridge.clock import Clock
from cxbridge.errors import SkillError
from cxbridge.events import Logger, SourceRead
from cxbridge.skiller.lua.boardaccess import BoardAccess, MakeTable
from cxbridge.skiller.lua.host import ConfigReader, HostFunctions, from_lua, readable, to_lua
from cxbridge.skiller.lua.modulepath import ModulePath
from cxbridge.skiller.lua.placeaccess import PlaceAccess
from cxbridge.skiller.lua.pool import InterfacePool
from cxbridge.skiller.lua.state import HostTable, LuaState
from cxbridge.skiller.status import Status

if TYPE_CHECKING:
    from cxbridge.blackboard.base import BlackBoard
    from cxbridge.navgraph import NavGraph
    from cxbridge.tf import TransformBuffer

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
        self._limits = limits or Limits()
        self._folders = tuple(folders)
        self._pool = InterfacePool(board, owner)
        self._bus = logger.bus

        def host_of(modules: ModulePath) -> HostTable:
            functions = HostFunctions(logger, clock, modules, config, seed).table()
            return functions | PlaceAccess(transforms, navgraph).table()

        self._host_of = host_of
        self.space = space
        self.attempt = ModulePath(())
        """Where the last :meth:`reload` looked for modules, also one that failed."""
        self._use(*self._load())

    def _load(self) -> tuple[LuaState, BoardAccess]:
        """Make a new Lua state with the skills as their files are now.

        :raises SkillError: when that is not possible.
        """
        bounds = {name: value for name, value in asdict(self._limits).items() if name != "memory"}
        bounds["largest_text"] = self._limits.memory
        modules = self.attempt = ModulePath(self._folders)
        access: list[BoardAccess] = []

        def make_host(make_table: MakeTable) -> HostTable:
            access.append(BoardAccess(self._pool, make_table))
            return self._host_of(modules) | access[0].table()

        state = LuaState(self._limits.memory, bounds, modules, make_host)
        try:
            state.load(self.space)
        except SkillError:
            access[0].close_all()
            raise
        if self._bus.wants(SourceRead):
            for label, path in modules.files.items():
                with suppress(OSError):  # it is gone, and was there when it was loaded
                    self._bus.tell_source("skill", "", label, path.read_bytes())
        return state, access[0]

    def _use(self, state: LuaState, access: BoardAccess) -> None:
        self._state = state
        self._board_access = access
        self._calls = state.functions
        self._call = state.call

    def reload(self) -> None:
        """Load the skills again as their files are now; the interfaces that they go on using stay open.

        The compiled skill string is gone.

        :raises SkillError: when the skills cannot be loaded; then all is as it was before.
        """
        state, access = self._load()
        self._calls["finalize"]()
        before = self._board_access
        self._use(state, access)
        before.close_all()

    @property
    def modules(self) -> ModulePath:
        """Where the skills that are loaded lie."""
        return self._state.modules

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

    @staticmethod
    def _outcome(result: tuple[Any, ...]) -> str:
        ok, error = result[:2]
        return "" if ok else readable(str(error)) or "unknown error"

    def close(self) -> None:
        """Run the finalize callbacks and close all interfaces that Lua opened."""
        self._calls["finalize"]()
        self._board_access.close_all()
