"""The Lua engine: the skills of one skill space in a Lua 5.1 state, which a reload replaces."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from msgspec import Struct
from msgspec.structs import asdict

from cxbridge.clock import Clock
from cxbridge.errors import SkillError
from cxbridge.events import Logger, SourceRead
from cxbridge.lua_syntax import readable
from cxbridge.skiller.lua.boardaccess import BoardAccess, InterfacePool, MakeTable
from cxbridge.skiller.lua.host import ConfigReader, HostFunctions, from_lua, to_lua
from cxbridge.skiller.lua.modulepath import ModulePath
from cxbridge.skiller.lua.placeaccess import PlaceAccess
from cxbridge.skiller.lua.state import HostTable, LuaState
from cxbridge.skiller.luacalls import ONLY_FAWKES, LuaCall
from cxbridge.skiller.status import Status

if TYPE_CHECKING:
    from cxbridge.blackboard.base import BlackBoard
    from cxbridge.space.navgraph import NavGraph
    from cxbridge.space.tf.buffer import TransformBuffer

MEBIBYTE = 1024 * 1024


class Limits(Struct, frozen=True):
    """The access of one engine's Lua to its environment.

    :param instructions_per_loop: VM instructions in one loop; a million takes some 10 ms.
    :param instructions_to_load: VM instructions to load the skill space.
    :param seconds_per_loop: processor time in one loop; for instructions that do much, such as ``s .. s``.
    :param seconds_to_load: processor time to load the skill space.
    :param memory: bytes of all Lua objects together.
    :param memory_per_loop: bytes that may come to it in one step; no text is longer.
    """

    instructions_per_loop: int = 2_000_000
    instructions_to_load: int = 50_000_000
    seconds_per_loop: float = 0.02
    seconds_to_load: float = 10.0
    memory: int = 128 * MEBIBYTE
    memory_per_loop: int = 4 * MEBIBYTE


class Tick(Struct, frozen=True):
    """What running a skill string once came to.

    :param error: what Lua said, with a traceback; empty when it ran through.
    :param status: the overall status of the skills that it called.
    """

    error: str
    status: Status


class LuaEngine:
    """Loads a skill space and runs calls of its skills.

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
        bounds["largest_text"] = self._limits.memory_per_loop
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
                with suppress(OSError):  # the file was deleted after it was loaded
                    self._bus.emit_source("skill", "", label, path.read_bytes())
        return state, access[0]

    def _use(self, state: LuaState, access: BoardAccess) -> None:
        self._state = state
        self._board_access = access
        self._has_callbacks: bool | None = None

    def _call(self, name: str, *args: Any) -> tuple[Any, ...]:
        """Call a function of the runner; what skills do in it may add or remove callbacks."""
        self._has_callbacks = None
        return self._state.call(name, *args)

    def reload(self) -> None:
        """Load the skills again from their files; interfaces that they still use stay open.

        The compiled skill string is gone.

        :raises SkillError: when the skills cannot be loaded; then the old skills stay.
        """
        state, access = self._load()
        self._call("finalize")
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
        return tuple(self._text("names").split())

    def documentation(self, skill: str) -> str | None:
        """Return the documentation of a skill, None when there is none of this name."""
        return readable(self._text("documentation", to_lua(skill))) if skill in self.skills else None

    def prepare(self, calls: Sequence[LuaCall]) -> str:
        """Take calls of skills for :meth:`run`, in place of the earlier ones.

        :returns: their mistakes; empty when there are none.
        """
        make = self._state.table
        prepared = make({number: _table_of(call, make) for number, call in enumerate(calls, start=1)})
        ok, unknown = self._call("prepare", prepared)[:2]
        if ok:
            return ""
        if not isinstance(unknown, int | float):
            return str(unknown)
        call = calls[int(unknown) - 1]
        where = f"column {call.column}" if call.line == 1 else f"line {call.line}, column {call.column}"
        return f"{where}: there is no skill '{call.name}'; {ONLY_FAWKES}"

    def compile(self, skill_string: str) -> str:
        """Compile a skill string as Lua for :meth:`run`, in place of the earlier one.

        Only for the mode ``fawkes``: a skill string can be anybody's.

        :returns: its mistakes; empty when there are none.
        """
        return self._outcome(self._call("compile", to_lua(skill_string)))

    def run(self) -> Tick:
        """Run the compiled skill string once: one loop."""
        ok, error, *status = self._call("run")
        return Tick(self._outcome((ok, error)), _status(status[0] if status else Status.S_INACTIVE))

    def drop(self) -> None:
        """Forget the compiled skill string."""
        self._call("drop")

    def reset_all(self) -> str:
        """Reset the skills that the skill string called, and those they use.

        :returns: what went wrong in their code; empty when nothing did.
        """
        return self._outcome(self._call("reset_all"))

    @property
    def status(self) -> Status:
        """The overall status of the skills called in the last loop; nothing called is S_INACTIVE."""
        return _status(self._call("overall_status")[0])

    def failure(self, *, first: bool = False) -> str:
        """Return why the skill string failed, as far as a skill says so; empty when none does.

        :param first: only the error text of the skill that was called first counts, as in Fawkes.
        """
        return from_lua(self._text("failure", first))

    def graph(self, skill: str, direction: str, *, coloured: bool, always: bool) -> tuple[bool, str]:
        """Draw the state machine of a skill in the dot language.

        :param skill: its name; empty: the skill that was called first in the last loop.
        :param direction: ``TB``, ``BT``, ``LR`` or ``RL``.
        :param always: draw it also when it did not change since it was drawn last.
        :returns: whether there is such a machine, and its graph: empty when it did not change.
        """
        found, text = self._call("graph", to_lua(skill), direction, coloured, always)[:2]
        return bool(found), from_lua(text) if found else ""

    def overview(self, subject: str) -> str:
        """Return all skills, one a line (``LIST``), or the graph of their uses in dot (``SKILL_DEP``)."""
        if subject == "LIST":
            return "".join(f"{name}\n" for name in self.skills)
        return from_lua(self._text("dependencies"))

    def finish_loop(self) -> str:
        """End a loop: publish the interfaces that skills changed.

        :returns: what went wrong; empty when nothing did.
        """
        return self._outcome(self._call("finish_loop"))

    @property
    def has_callbacks(self) -> bool:
        """Whether skills asked to be called in every loop, also when none runs."""
        if self._has_callbacks is None:
            self._has_callbacks = bool(self._state.call("has_callbacks")[0])
        return self._has_callbacks

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
        self._call("finalize")
        self._board_access.close_all()

    def _text(self, name: str, *args: Any) -> str:
        """Ask the runner for a text; empty when there is none."""
        text = self._call(name, *args)[0]
        return text if isinstance(text, str) else ""


def _status(value: Any) -> Status:
    """Return a status that skills' code had a hand in."""
    try:
        return Status(value)
    except ValueError:
        return Status.S_FAILED


def _table_of(call: LuaCall, make: MakeTable) -> Any:
    """Return a call as the runner takes it."""
    values = {position: _to_table(value, make) for position, value in enumerate(call.values, start=1)}
    return make({"name": call.name, "count": len(call.values), **_without_nil(values)})


def _to_table(value: Any, make: MakeTable) -> Any:
    if isinstance(value, dict):
        return make(
            {
                to_lua(key) if isinstance(key, str) else key: _to_table(item, make)
                for key, item in _without_nil(value).items()
            }
        )
    return to_lua(value) if isinstance(value, str) else value


def _without_nil(items: Mapping[Any, Any]) -> dict[Any, Any]:
    return {key: value for key, value in items.items() if value is not None}
