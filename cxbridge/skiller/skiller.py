"""The Lua Skiller: executes skill strings in the Lua engine, one step in each loop.

The Skiller writes the same states as Fawkes' Skiller (``src/lua/skiller/fawkes/init.lua``), except for the
differences in ``docs/evidence/skiller.md``.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from cxbridge.errors import SkillError
from cxbridge.events import EventBus, Level
from cxbridge.skiller.backend import Mode
from cxbridge.skiller.debug_writer import SkillerDebugWriter
from cxbridge.skiller.interface import InterfaceSkiller
from cxbridge.skiller.lua.engine import LuaEngine
from cxbridge.skiller.lua.host import log_text
from cxbridge.skiller.lua.modulepath import ModuleWatch
from cxbridge.skiller.skillstring import read_calls
from cxbridge.skiller.status import Status

if TYPE_CHECKING:
    from cxbridge.blackboard.base import BlackBoard
    from cxbridge.space.tf.listener import TransformListener

LOG_COMPONENT = "SkillerLua"
"""The log component of the Skiller and its skills, as in Fawkes."""


class Skiller(InterfaceSkiller):
    """Executes Lua skills.

    :param engine: the loaded skills; closed with the Skiller.
    :param transforms: the listener for the skills' ``tf``; closed with the Skiller.
    :param name: the id of the SkillerInterface and SkillerDebugInterface.
    :param mode: ``fawkes`` evaluates skill strings as Lua, ``strict`` reads them as data.
    :param watch: detects changed skill files, which are then reloaded.
    :param find_mapping_place: see :class:`InterfaceSkiller`.
    :raises BlackBoardError: if an interface has another writer.
    """

    def __init__(
        self,
        board: BlackBoard,
        engine: LuaEngine,
        transforms: TransformListener,
        bus: EventBus,
        *,
        name: str = "Skiller",
        mode: Mode = "strict",
        watch: ModuleWatch | None = None,
        find_mapping_place: Callable[[str], str] = lambda _skill_string: "",
    ) -> None:
        super().__init__(
            board, bus, name=name, component=LOG_COMPONENT, find_mapping_place=find_mapping_place
        )
        self.mode: Mode = mode
        self.engine = engine
        self._transforms = transforms
        # as in Fawkes, a new Skiller keeps the exclusive controller that the interface holds
        self._interface.read()
        self._debug = SkillerDebugWriter(board, engine, self._log, name=name, owner=LOG_COMPONENT)
        self._is_active = False
        if mode == "fawkes":
            self._log.warn(
                f"/skiller/mode: fawkes: {name} evaluates skill strings as Lua, no matter who sends them"
            )
        self._watch = watch
        if watch is not None:
            watch.follow(engine.modules)
        self._changed_modules: list[str] = []

    @property
    def is_executing(self) -> bool:
        return self._is_active

    @property
    def skills(self) -> tuple[str, ...]:
        """The skills in the order of the skill space."""
        return self.engine.skills

    @property
    def is_quiet(self) -> bool:
        """Whether the Skiller is idle until the next message, without callbacks of skills."""
        return not self.running and not self.engine.has_callbacks

    @property
    def known_skills(self) -> frozenset[str] | None:
        """The available skills; None in mode ``fawkes``, where any Lua code is accepted."""
        return None if self.mode == "fawkes" else frozenset(self.engine.skills)

    def loop(self) -> None:
        """Handle messages, run the skill string once, and publish changes."""
        if self._watch is not None:
            self._look_for_changes(self._watch)
        self._debug.loop()
        self.handle_messages()
        if self._is_active:
            self._execute()
            self._log_problem(self.engine.finish_loop())
        elif self.engine.has_callbacks:
            self._log_problem(self.engine.run_idle())

    def close(self) -> None:
        """Drop the skill string, and close all interfaces of the Skiller and its skills."""
        self._is_active = False
        self.engine.close()
        self._debug.close()
        super().close()
        self._transforms.close()

    def start(self, skill_string: str) -> None:
        max_bytes = self._interface.maxlenof("skill_string") - 1  # without the NUL at the end
        if len(skill_string.encode("utf-8", "surrogateescape")) >= max_bytes:
            # the start of a cut text may be a whole chunk of another meaning
            raise SkillError(f"the skill string fills its field of {max_bytes} bytes: it may have been cut")
        if self.mode == "fawkes":
            problem = self.engine.compile(skill_string)
        else:
            # any client may send a skill string, so nothing in it is evaluated
            problem = self.engine.prepare(read_calls(skill_string))
        if problem:
            raise SkillError(problem)
        self._is_active = True
        self._reset()

    def drop(self) -> None:
        self._is_active = False
        self.engine.drop()
        self._reset()

    def _look_for_changes(self, watch: ModuleWatch) -> None:
        """Reload changed skill files, or wait for the end of the running skill string."""
        # Fawkes reloads at once and loses the running skill string, so that saving a file stops a driving
        # robot
        changed_modules = watch.find_changed_modules()
        if changed_modules and not self._changed_modules and self._is_active:
            self._log.info(
                f"Skill files changed ({', '.join(changed_modules)}); they are loaded after this skill string"
            )
        self._changed_modules = changed_modules or self._changed_modules
        if self._changed_modules and not self._is_active:
            self._reload(watch)

    def _reload(self, watch: ModuleWatch) -> None:
        self._log.info(f"Skill files changed ({', '.join(self._changed_modules)}); reloading them")
        self._changed_modules = []
        try:
            self.engine.reload()
        except SkillError as error:
            self._log.error(f"{error}")
            self._log.error("Could not reload the skills; the previous skills stay loaded")
        # after an error, watch the modules up to the broken module: a change of any of them may mend it
        watch.follow(self.engine.attempted_modules)

    def _execute(self) -> None:
        error, status = self.engine.run()
        if error:
            self._fail(error)
            self._debug.publish()
            return
        if status != self._interface.status:
            self._interface.status = status
            self._interface.error = self.engine.find_failure_reason() if status is Status.S_FAILED else ""
            self._interface.write()
        # before the reset of the skills, which would hide the last state from viewers of the graph
        self._debug.publish()
        if status is not Status.S_RUNNING:
            self.drop()

    def _fail(self, problem: str) -> None:
        """Log an error in a skill's code and write the failure."""
        mapping_note = self.make_mapping_note(self.skill_string)
        failure = f"{self.skill_string}|{problem}"
        log_text(
            self._log, Level.ERROR, f"Failed to execute skill{mapping_note}: {failure}", self.engine.modules
        )
        self.end(Status.S_FAILED, failure)

    def _reset(self) -> None:
        self._log_problem(self.engine.reset_all())

    def _log_problem(self, problem: str) -> None:
        if problem:
            self._log.error(problem)
