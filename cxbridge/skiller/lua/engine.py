"""The Lua engine: the skills of a skill space in a Lua 5.1 state. A reload replaces the state."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from msgspec.structs import asdict

from cxbridge.clock import Clock
from cxbridge.errors import SkillError
from cxbridge.events import Logger, SourceRead
from cxbridge.lua_syntax import decode_lua_text
from cxbridge.skiller.lua.boardaccess import BoardAccess, InterfacePool, MakeTable
from cxbridge.skiller.lua.host import HostFunctions, from_lua, to_lua
from cxbridge.skiller.lua.limits import Limits
from cxbridge.skiller.lua.modulepath import ModulePath
from cxbridge.skiller.lua.placeaccess import make_place_functions
from cxbridge.skiller.lua.state import HostTable, LuaState
from cxbridge.skiller.skillstring import ONLY_FAWKES, LuaCall, format_place
from cxbridge.skiller.status import Status

if TYPE_CHECKING:
    from cxbridge.blackboard.base import BlackBoard
    from cxbridge.config import Configuration
    from cxbridge.space.navgraph import NavGraph
    from cxbridge.space.tf.buffer import TransformBuffer


class LuaEngine:
    """Loads a skill space and executes calls of its skills.

    :param board: the blackboard of the skills.
    :param folders: the folders of skills, see :class:`ModulePath`.
    :param space: the skill space: the module ``skills.SPACE``, which loads the skills.
    :param config: the configuration for skills; None: skills have no configuration.
    :param limits: the limits of the skills; None: the default limits.
    :param transforms: the transforms for ``tf``; None: ``tf`` has no frames.
    :param navgraph: the graph of ``navgraph``; None: ``navgraph`` is nil in Lua.
    :param seed: the seed of ``math.random``.
    :raises SkillError: if the space or a skill cannot be loaded, with file and line.
    """

    def __init__(  # noqa: PLR0913 - a façade over everything that Lua can reach
        self,
        board: BlackBoard,
        clock: Clock,
        logger: Logger,
        folders: Sequence[Path],
        *,
        space: str = "test",
        config: Configuration | None = None,
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

        def make_host_functions(modules: ModulePath) -> HostTable:
            functions = HostFunctions(logger, clock, modules, config, seed).functions_by_name()
            return functions | make_place_functions(transforms, navgraph)

        self._make_host_functions = make_host_functions
        self.space = space
        self.attempted_modules = ModulePath(())
        """The module path of the last :meth:`reload`, even of a failed reload."""
        self._set_state(*self._load())

    def _load(self) -> tuple[LuaState, BoardAccess]:
        """Load the present skill files into a new Lua state."""
        modules = self.attempted_modules = ModulePath(self._folders)
        accesses: list[BoardAccess] = []

        def make_host(make_table: MakeTable) -> HostTable:
            # the access needs a function of the state, and the state needs the functions of the access:
            # therefore the state's constructor calls this function, which hands the access over by the list
            accesses.append(BoardAccess(self._pool, make_table))
            return self._make_host_functions(modules) | accesses[0].functions_by_name()

        state = LuaState(asdict(self._limits), modules, make_host)
        try:
            state.load(self.space)
        except SkillError:
            accesses[0].close_all()
            raise
        if self._bus.wants(SourceRead):
            for label, path in modules.files.items():
                with suppress(OSError):  # the file was deleted after loading
                    self._bus.emit_source("skill", "", label, path.read_bytes())
        return state, accesses[0]

    def _set_state(self, state: LuaState, access: BoardAccess) -> None:
        self._state = state
        self._board_access = access
        self._has_callbacks: bool | None = None

    def _call(self, name: str, *args: Any) -> tuple[Any, ...]:
        """Call a function of the runner. Skills may add or remove callbacks during the call."""
        self._has_callbacks = None
        return self._state.call(name, *args)

    def reload(self) -> None:
        """Reload the skills from their files; shared interfaces stay open. Drop the compiled skill string.

        :raises SkillError: if the skills cannot be loaded; the old skills stay.
        """
        # load before the old skills are finalised: a broken file leaves them running
        state, access = self._load()
        self._call("finalize")
        former_access = self._board_access
        self._set_state(state, access)
        former_access.close_all()

    @property
    def modules(self) -> ModulePath:
        """The module path of the loaded skills."""
        return self._state.modules

    @property
    def skills(self) -> tuple[str, ...]:
        """The skills in order of registration."""
        return tuple(self._call_for_text("names").split())

    def documentation(self, skill: str) -> str | None:
        """Return the documentation of a skill; None if the skill does not exist."""
        if skill not in self.skills:
            return None
        return decode_lua_text(self._call_for_text("documentation", to_lua(skill)))

    def prepare(self, calls: Sequence[LuaCall]) -> str:
        """Set the calls for :meth:`run`.

        :returns: the mistakes in the calls; empty if there are none.
        """
        make_table = self._state.make_table
        call_tables = make_table(
            {number: _make_call_table(call, make_table) for number, call in enumerate(calls, start=1)}
        )
        ok, problem = self._call("prepare", call_tables)[:2]
        if ok:
            return ""
        # the problem is the number of the first call of a missing skill, or the text of another error
        if not isinstance(problem, int | float):
            return str(problem)
        call = calls[int(problem) - 1]
        return f"{format_place(call.line, call.column)}: there is no skill '{call.name}'; {ONLY_FAWKES}"

    def compile(self, skill_string: str) -> str:
        """Compile a skill string as Lua code for :meth:`run`.

        :returns: the mistakes; empty if there are none.
        """
        # only in mode `fawkes`, because any client may send the skill string
        return self._error_text(self._call("compile", to_lua(skill_string)))

    def run(self) -> tuple[str, Status]:
        """Execute the prepared calls or the compiled skill string once, in one loop.

        :returns: the Lua error with traceback, empty after success; and the combined status of the called
            skills.
        """
        ok, error, *status = self._call("run")
        return self._error_text((ok, error)), _to_status(status[0] if status else Status.S_INACTIVE)

    def drop(self) -> None:
        """Forget the skill string, so that :meth:`run` calls no skill."""
        self._call("drop")

    def reset_all(self) -> str:
        """Reset the called skills and the skills they use.

        :returns: the errors of the skills' code; empty if there are none.
        """
        return self._error_text(self._call("reset_all"))

    def find_failure_reason(self) -> str:
        """Return the reason for a failure, as reported by a skill; empty if no skill reports a reason."""
        return from_lua(self._call_for_text("failure"))

    def draw_graph(self, skill: str, direction: str, *, coloured: bool, redraw: bool) -> tuple[bool, str]:
        """Return a skill's state machine in the dot language.

        :param skill: the skill; empty: the first called skill of the last loop.
        :param direction: ``TB``, ``BT``, ``LR`` or ``RL``.
        :param redraw: draw an unchanged machine again.
        :returns: whether the machine exists, and its graph, empty if unchanged.
        """
        exists, text = self._call("graph", to_lua(skill), direction, coloured, redraw)[:2]
        return bool(exists), from_lua(text) if exists else ""

    def overview(self, subject: str) -> str:
        """Return all skills, one per line (``LIST``), or the graph of their dependencies (``SKILL_DEP``)."""
        if subject == "LIST":
            return "".join(f"{name}\n" for name in self.skills)
        return from_lua(self._call_for_text("dependencies"))

    def finish_loop(self) -> str:
        """End a loop: write the changed interfaces.

        :returns: errors; empty if there are none.
        """
        return self._error_text(self._call("finish_loop"))

    @property
    def has_callbacks(self) -> bool:
        """Whether skills registered callbacks for every loop, even without a running skill."""
        if self._has_callbacks is None:
            self._has_callbacks = bool(self._state.call("has_callbacks")[0])
        return self._has_callbacks

    def run_idle(self) -> str:
        """Execute a loop without a skill string: the callbacks of skills.

        :returns: errors; empty if there are none.
        """
        return self._error_text(self._call("run_preloop_callbacks")) or self.finish_loop()

    @staticmethod
    def _error_text(result: tuple[Any, ...]) -> str:
        ok, error = result[:2]
        return "" if ok else decode_lua_text(str(error)) or "unknown error"

    def close(self) -> None:
        """Run the finalize callbacks and close all interfaces."""
        self._call("finalize")
        self._board_access.close_all()

    def _call_for_text(self, name: str, *args: Any) -> str:
        text = self._call(name, *args)[0]
        return text if isinstance(text, str) else ""


def _to_status(value: Any) -> Status:
    """Convert a status from Lua, where skills may have set any value."""
    try:
        return Status(value)
    except ValueError:
        return Status.S_FAILED


def _make_call_table(call: LuaCall, make_table: MakeTable) -> Any:
    """Return a call in the runner's format."""
    values = {
        position: _to_lua_value(value, make_table) for position, value in enumerate(call.values, start=1)
    }
    return make_table({"name": call.name, "count": len(call.values), **_drop_nil(values)})


def _to_lua_value(value: Any, make_table: MakeTable) -> Any:
    if isinstance(value, dict):
        return make_table(
            {
                to_lua(key) if isinstance(key, str) else key: _to_lua_value(item, make_table)
                for key, item in _drop_nil(value).items()
            }
        )
    return to_lua(value) if isinstance(value, str) else value


def _drop_nil(items: Mapping[Any, Any]) -> dict[Any, Any]:
    return {key: value for key, value in items.items() if value is not None}
