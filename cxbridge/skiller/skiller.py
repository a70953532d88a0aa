"""The Skiller: executes skill strings of SkillerInterface in the Lua engine, loop by loop.

It writes the same states as Fawkes' Skiller (``src/lua/skiller/fawkes/init.lua``). ``mode='strict'`` avoids
Fawkes' oddities, listed in ``docs/skiller.md``.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, Protocol

from cxbridge.errors import SkillError
from cxbridge.events import EventBus, Level
from cxbridge.skiller.backend import Mode, SkillerBackend
from cxbridge.skiller.control import ExclusiveControl, ReaderWatch, sender_of
from cxbridge.skiller.debugboard import DebugBoard
from cxbridge.skiller.failure import FailureCause, SkillFailure
from cxbridge.skiller.lua.engine import LuaEngine
from cxbridge.skiller.lua.host import log_error
from cxbridge.skiller.lua.watch import ModuleWatch
from cxbridge.skiller.luacalls import read_calls
from cxbridge.skiller.status import Status

if TYPE_CHECKING:
    from cxbridge.blackboard.base import BlackBoard
    from cxbridge.interfaces.instance import Message

LOG_COMPONENT = "SkillerLua"
"""The log component of the Skiller and its skills, as in Fawkes."""

_NO_MESSAGE = 0


class Closable(Protocol):
    def close(self) -> None: ...


class Skiller(SkillerBackend):
    """Executes Lua skills.

    :param engine: the loaded skills; closed with the Skiller.
    :param name: the id of the SkillerInterface and SkillerDebugInterface.
    :param mode: whether to imitate Fawkes' oddities.
    :param watch: detects changed skill files, which are then reloaded.
    :param place_of: returns the place of a skill string's mapping, for messages; empty if unknown.
    :raises BlackBoardError: if an interface has another writer.
    """

    def __init__(
        self,
        board: BlackBoard,
        engine: LuaEngine,
        bus: EventBus,
        *,
        name: str = "Skiller",
        mode: Mode = "strict",
        watch: ModuleWatch | None = None,
        closing: Sequence[Closable] = (),
        place_of: Callable[[str], str] = lambda _skill_string: "",
    ) -> None:
        super().__init__(name)
        self._place_of = place_of
        self.mode: Mode = mode
        self.engine = engine
        self._log = bus.logger(LOG_COMPONENT)
        self._board = board
        self._readers = ReaderWatch(board)
        # the class of the interface is made from XML at run time, so it has no static type
        self._interface: Any = board.open_for_writing(
            "SkillerInterface", name, owner=LOG_COMPONENT, listen=self._readers.listen
        )
        self._interface.read()
        self._control = ExclusiveControl(self._interface, self._log)
        # like Fawkes, open a reader of the own interface to be notified of removed readers
        self._own_reader = (
            board.open_for_reading("SkillerInterface", name, owner="SkillerExecutionThread")
            if mode == "fawkes"
            else None
        )
        self._debug = DebugBoard(board, engine, self._log, name=name, mode=mode, owner=LOG_COMPONENT)
        self._active = False
        self._handlers = {
            "AcquireControlMessage": self._control.acquire,
            "ReleaseControlMessage": self._control.release,
            "ExecSkillMessage": self._exec,
            "StopExecMessage": self._stop,
        }
        if mode == "fawkes":
            self._log.warn(
                f"/skiller/mode: fawkes: {name} evaluates skill strings as Lua, no matter who sends them"
            )
        self._enqueued = False
        self._closing = tuple(closing)
        self._watch = watch
        if watch is not None:
            watch.follow(engine.modules)
        self._changed: list[str] = []

    @property
    def running(self) -> bool:
        """Whether a skill string is running or a message is pending."""
        return self._active or not self._interface.msgq_empty()

    @property
    def skill_string(self) -> str:
        """The skill string of the last ExecSkillMessage."""
        return str(self._interface.skill_string)

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
        while (serial := self._readers.pop()) is not None:
            if self._control.revoke(serial):
                self._interface.write()
        if self._watch is not None:
            self._look_for_changes(self._watch)
        self._debug.loop()
        if not self._interface.msgq_empty():
            self._process_messages()
        if self._active:
            self._execute()
            self._log_problem(self.engine.finish_loop())
        elif self.engine.has_callbacks:
            self._log_problem(self.engine.run_idle())

    def close(self) -> None:
        """Drop the skill string, and close all interfaces of the Skiller and its skills."""
        self._active = False
        self._readers.close()
        if self._own_reader is not None:
            self._board.close(self._own_reader)
        self.engine.close()
        self._debug.close()
        self._board.close(self._interface)
        for thing in self._closing:
            thing.close()

    def _look_for_changes(self, watch: ModuleWatch) -> None:
        # Fawkes reloads immediately and silently loses the running skill string; strict mode finishes it
        # first, because saving a file must not stop a driving robot
        changed = watch.look()
        if changed and not self._changed and self._active and self.mode == "strict":
            self._log.info(
                f"Skill files changed ({', '.join(changed)}); they are loaded after this skill string"
            )
        self._changed = changed or self._changed
        if self._changed and not (self._active and self.mode == "strict"):
            self._reload(watch)

    def _reload(self, watch: ModuleWatch) -> None:
        self._log.info(f"Skill files changed ({', '.join(self._changed)}); loading them again")
        self._changed = []
        try:
            self.engine.reload()
        except SkillError as error:
            self._log.error(f"{error}")
            self._log.error("Could not load the skills again, those from before stay")
            watch.follow(self.engine.attempt, also_before=True)
            return
        self._active = False
        watch.follow(self.engine.modules)

    def _process_messages(self) -> None:
        self._enqueued = False
        to_write = False
        while (message := self._interface.msgq_first()) is not None:
            handler = self._handlers.get(message.type)
            if handler is None:
                self._log.warn(f"Unhandled message of type {message.type} in skiller interface")
            else:
                to_write |= handler(message)
            self._interface.msgq_pop()
        if to_write:
            self._interface.write()

    def _exec(self, message: Any) -> bool:
        text = message.skill_string
        if not self._control.admit(message, again=self._enqueued, running=self._active):
            return False
        if self._active:
            self._reset()
        self._enqueued = True
        self._interface.skill_string = text
        self._interface.msgid = message.id
        if (
            self.mode == "strict"
        ):  # as in Fawkes, the error of an earlier skill string stays until the next change of status
            self._interface.error = ""
        self._compile(text)
        return True

    def _compile(self, text: str) -> None:
        longest = self._interface.maxlenof("skill_string") - 1
        if self.mode == "strict" and len(text.encode("utf-8", "surrogateescape")) >= longest:
            # the missing rest may have changed the meaning of the Lua chunk
            problem = f"the skill string fills its field of {longest} bytes: it may have been cut"
            self.engine.drop()
        else:
            problem = self.engine.compile(text) if self.mode == "fawkes" else self._prepare(text)
        self._active = not problem
        if problem:
            self._fail(SkillFailure(FailureCause.SKILL_STRING, problem, self._place_of(text)), text)
            return
        self._reset()
        self._interface.status = Status.S_RUNNING

    def _prepare(self, text: str) -> str:
        """Parse a skill string as data; return its mistake.

        Any client may send it, so nothing is evaluated.
        """
        try:
            return self.engine.prepare(read_calls(text))
        except SkillError as error:
            self.engine.drop()
            return error.message

    def _stop(self, message: Message) -> bool:
        # in Fawkes only a controller may stop, although without a controller any client may start
        may_stop = self._control.is_held_by(message) or (
            self.mode == "strict" and self._control.may_execute(message)
        )
        if not may_stop:
            self._log.debug(f"{sender_of(message)} sent stop without any exclusive controller")
            return False
        self._log.debug(f"Stopping execution of '{self._interface.skill_string}' on request")
        self._drop()
        self._interface.skill_string = ""
        self._interface.msgid = _NO_MESSAGE
        self._publish(Status.S_INACTIVE)
        return True

    def _execute(self) -> None:
        tick = self.engine.run()
        if tick.error:
            self._fail(SkillFailure(FailureCause.CODE, tick.error, self._place_of(self.skill_string)))
            self._interface.write()
            self._drop()
            if self.mode == "fawkes":  # S_FAILED is overwritten immediately, so that most readers miss it
                self._publish(Status.S_INACTIVE)
            self._debug.publish()
        else:
            self._publish(tick.status)
            self._debug.publish()
            if tick.status is not Status.S_RUNNING:
                self._drop()

    def _publish(self, status: Status) -> None:
        """Write a changed status."""
        if self._interface.status == status:
            return
        self._interface.status = status
        if status is Status.S_FAILED:
            self._fail(SkillFailure(FailureCause.OUTCOME, self.engine.failure(first=self.mode == "fawkes")))
        elif status is not Status.S_INACTIVE:
            self._interface.error = ""
        self._interface.write()

    def _fail(self, failure: SkillFailure, skill_string: str = "") -> None:
        """Log a failure, and set status and error of the interface.

        :param skill_string: the complete skill string, if the interface has only a part of it.
        """
        line = failure.line(skill_string or self.skill_string)
        if failure.cause is FailureCause.CODE:
            log_error(self._log, Level.ERROR, line, self.engine.modules)
        elif failure.cause is FailureCause.SKILL_STRING:
            self._log.error(line)
        shown = self._interface.error
        failure.show(self._interface)
        if not failure.text or (self.mode == "fawkes" and failure.cause is FailureCause.SKILL_STRING):
            self._interface.error = shown  # the error of an earlier skill string stays
        elif self.mode == "fawkes" and failure.cause is FailureCause.OUTCOME:
            self._interface.write()

    def _drop(self) -> None:
        self._active = False
        self.engine.drop()
        self._reset()

    def _reset(self) -> None:
        self._log_problem(self.engine.reset_all())

    def _log_problem(self, problem: str) -> None:
        if problem:
            self._log.error(problem)
