"""The skill board: masters of running actions and their executors; see docs/skill-board.md.

A new master asks the first idle executor that knows its skill. Then the board offers each idle executor a
master: first a master without an unanswered request, then the oldest. An executor with an unanswered request
is asked by no other master, because an executor answers one request at a time. The first answer is
confirmed.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any, ClassVar, Final

from cxbridge.blackboard.errors import BlackBoardError, NoWriterError
from cxbridge.skiller.board.delivery import Sender
from cxbridge.skiller.board.master import Master, Timeouts
from cxbridge.skiller.board.protocol import (
    BOARD_TYPE,
    DEFAULT_BOARD,
    ExecutorState,
    MasterState,
    SkillCall,
    SkillOutcome,
    check_name,
    encode_parameters,
    enum_name,
)
from cxbridge.skiller.board.watch import ExecutorInfo, ExecutorWatch

if TYPE_CHECKING:
    from cxbridge.blackboard.base import BlackBoard
    from cxbridge.clock import Clock
    from cxbridge.events import EventBus

LOG_COMPONENT: Final = "SkillBoard"

_EPOCH_UNIT_US = 1000  # an epoch is the time of the start, in milliseconds
_EPOCH_COUNT = 2**32  # the field of the epoch has 32 bits


class SkillBoard:
    """Finds executors for actions and follows the actions to their end. Not thread-safe.

    A subclass may have other masters, and other rules for requests (:meth:`ask`, :meth:`offer`) and late
    messages (:meth:`refuse_late`).

    :raises BlackBoardError: if the interface has another writer.
    :raises SkillError: if the name does not fit into messages.
    """

    master_class: ClassVar[type[Master]] = Master
    """The class of the masters."""

    is_verbatim: ClassVar[bool] = False
    """Whether local executors send each value that a skill yields as FEEDBACK, and no other FEEDBACK."""

    def __init__(
        self,
        board: BlackBoard,
        clock: Clock,
        bus: EventBus,
        *,
        name: str = DEFAULT_BOARD,
        timeouts: Timeouts | None = None,
    ) -> None:
        self.name = check_name("a skill board", name)
        self._board = board
        self._clock = clock
        self._log = bus.logger(LOG_COMPONENT)
        self._timeouts = timeouts or Timeouts()
        # the classes of the interfaces are made from XML at run time, so they have no static types
        self._interface: Any = board.open_for_writing(BOARD_TYPE, name, owner=LOG_COMPONENT)
        self.epoch = self._begin_epoch()
        self._masters: dict[int, Master] = {}
        self._asking_masters: dict[str, dict[int, Master]] = {}  # in the state ASKING, by agent
        self._has_new_masters = False
        self._pending_by_executor: dict[str, int] = {}  # the master of the unanswered request
        self._pending_by_master: dict[int, set[str]] = {}  # the executors that have not answered
        self._last_number = 0
        self._watch = ExecutorWatch(board, self._log, LOG_COMPONENT)
        self._sender = Sender(
            board,
            self._watch,
            name=name,
            epoch=self.epoch,
            owner=LOG_COMPONENT,
            is_synchronous=clock.is_virtual,
        )
        self._change_callbacks: dict[int, Callable[[Master], None]] = {}
        self._handlers = {
            "ResponseMessage": self._handle_response,
            "FeedbackMessage": self._handle_feedback,
            "FinishMessage": self._handle_finish,
        }
        self.exchange()

    def _begin_epoch(self) -> int:
        """Publish an epoch that differs from the previous epoch."""
        # an executor may still remember the tickets of the previous epoch
        interface = self._interface
        interface.read()
        epoch: int = self._clock.now_us() // _EPOCH_UNIT_US % _EPOCH_COUNT
        if epoch == interface.epoch:
            epoch = (epoch + 1) % _EPOCH_COUNT
        interface.epoch, interface.asking, interface.running = epoch, 0, 0
        interface.write()
        return epoch

    def request(self, call: SkillCall, on_change: Callable[[Master], None] = lambda _master: None) -> Master:
        """Request a skill.

        :param on_change: called in the board's thread after each change of the master.
        :raises SkillError: if names or parameters do not fit into messages.
        """
        check_name("a skill", call.skill)
        check_name("an agent", call.agent)
        parameters = encode_parameters(call.parameters)
        self._last_number += 1
        master = self.master_class(
            self._last_number,
            call,
            parameters,
            self._sender,
            self._timeouts,
            self._clock.now_us(),
            explain=self._explain,
            on_change=self._process_change,
        )
        self._masters[master.number] = master
        self._change_callbacks[master.number] = on_change
        self._asking_masters.setdefault(call.agent, {})[master.number] = master
        if self._log.enabled:
            self._log.debug(
                f"action {master.number}: who executes {call.skill}{parameters} for {call.agent}?"
            )
        self.ask(master)
        self._has_new_masters = True
        return master

    def master(self, number: int) -> Master | None:
        """Return the master of a running action, or None."""
        return self._masters.get(number)

    def cancel(self, master: Master) -> bool:
        """Cancel an action; return False if it is over or is being cancelled already."""
        return master.cancel(self._clock.now_us())

    @property
    def local_executors(self) -> set[str]:
        """The names of executors in this process, which get their messages synchronously."""
        return self._sender.local_executors

    @property
    def executors(self) -> Iterable[ExecutorInfo]:
        """The present executors in order of appearance."""
        return self._watch.all()

    @property
    def offered_skills(self) -> set[tuple[str, str]]:
        """The pairs of agent and skill of all present and former executors."""
        return self._watch.offered_skills

    @property
    def version(self) -> int:
        """A number that changes with the executors or their states."""
        return self._watch.version

    @property
    def running(self) -> bool:
        """Whether an action is running or a message is pending."""
        return bool(self._masters) or not self._interface.msgq_empty()

    def exchange(self) -> bool:
        """Handle messages and changes of executors; return whether there was anything to handle."""
        # first the events: an executor's messages were sent before its end, so they are in the queue by then
        changes = self._watch.take_changes()
        is_quiet = not changes and not self._has_new_masters and self._interface.msgq_empty()
        while (message := self._interface.msgq_pop()) is not None:
            handler = self._handlers.get(message.type)
            if handler is not None:
                handler(message)
        while (failure := self._sender.next_failure()) is not None:
            self._process_failure(*failure)
        for executor, is_gone in changes:
            self._end_request(executor)
            if is_gone:
                self._lose_executor(executor)
            else:
                self.offer(executor)
        if self._has_new_masters:
            self._has_new_masters = False
            for executor_info in self._watch.all():
                self.offer(executor_info.id)
        return not is_quiet

    def expire(self) -> None:
        """End a loop: expire overdue masters, and publish the numbers of asking and running masters."""
        now_us = self._clock.now_us()
        # a list, because expire() removes masters
        for master in [master for master in self._masters.values() if master.deadline_us <= now_us]:
            master.expire()
        interface = self._interface
        asking_count = sum(map(len, self._asking_masters.values()))
        running_count = len(self._masters) - asking_count
        if (interface.asking, interface.running) != (asking_count, running_count):
            interface.asking, interface.running = asking_count, running_count
            interface.write()

    def loop(self) -> None:
        """Do one loop."""
        self.exchange()
        self.expire()

    def close(self) -> None:
        """Cancel all actions and leave the blackboard."""
        self.exchange()
        for master in list(self._masters.values()):
            self.cancel(master)
            master.give_up("the skill board was closed")
        self._sender.close()
        self._watch.close()
        self._board.close(self._interface)
        self._masters.clear()
        self._asking_masters.clear()
        self._change_callbacks.clear()

    def _handle_response(self, message: Any) -> None:
        executor = message.executor
        if message.epoch == self.epoch and message.master == self._pending_by_executor.get(executor):
            self._end_request(executor)
        executor_info = self._watch.get(executor)
        if executor_info is None:
            self._log.debug(f"RESPONSE of the unknown executor {executor}")
            return
        master = self._find_master(message)
        if master is None:
            self.refuse_late(message)
        elif executor_info.agent != master.call.agent:
            self._log.warn(
                f"{executor} of {executor_info.agent} answers to action {master.number}"
                f" of {master.call.agent}"
            )
            self._sender.reject(executor, master.number)
        else:
            master.handle_response(executor, self._clock.now_us())

    def _handle_feedback(self, message: Any) -> None:
        master = self._find_master(message)
        if master is None:
            self.refuse_late(message)
        else:
            master.handle_feedback(message.executor, message.progress, message.text, self._clock.now_us())

    def _handle_finish(self, message: Any) -> None:
        master = self._find_master(message)
        outcome = enum_name(message.outcome)
        if master is None or outcome not in SkillOutcome.__members__:
            return
        executor = message.executor
        master.handle_finish(
            executor, SkillOutcome(outcome), message.error, self._clock.now_us(), message.text
        )
        if master.state is MasterState.ASKING:  # the executor has refused
            self.ask_all(master, excluded=executor)

    def _find_master(self, message: Any) -> Master | None:
        """Return the master of a message; None if the master is over or the epoch differs."""
        return self._masters.get(message.master) if message.epoch == self.epoch else None

    def _lose_executor(self, executor: str) -> None:
        self._sender.forget(executor)
        for master in [master for master in self._masters.values() if master.executor == executor]:
            master.handle_loss(executor)

    def _process_failure(self, executor: str, message: Any, error: BlackBoardError) -> None:
        if isinstance(error, NoWriterError):
            return  # the watch reports the end of the executor
        self._log.warn(f"{message.type} does not reach {executor}: {error.message}")
        if message.type == "RequestMessage":
            self._end_request(executor)
        elif message.type == "ConfirmMessage":
            master = self._find_master(message)
            if master is not None:
                master.handle_undelivered(executor, error.message)

    def ask(self, master: Master) -> None:
        """Send the request of a new master to the first idle executor without a pending request."""
        if executors := self._find_free_executors(master):
            self._send_request(executors[0], master)

    def _find_free_executors(self, master: Master) -> list[str]:
        """Return the idle executors without a pending request that know the skill of a master."""
        return [
            executor_info.id
            for executor_info in self._watch.agent_executors(master.call.agent)
            if executor_info.state is ExecutorState.IDLE
            and master.call.skill in executor_info.skills
            and executor_info.id not in self._pending_by_executor
        ]

    def ask_all(self, master: Master, *, excluded: str = "") -> None:
        """Send the request of a master to all idle executors that know its skill and have no pending request.

        :param excluded: an executor that gets no request.
        """
        for executor in self._find_free_executors(master):
            if executor != excluded:
                self._send_request(executor, master)

    def refuse_late(self, message: Any) -> None:
        """Answer a message for a master that is over or of a former epoch.

        RESPONSE is answered with REJECT, FEEDBACK with CANCEL.
        """
        if message.type == "ResponseMessage":
            self._sender.reject(message.executor, message.master, message.epoch)
        else:
            self._log.warn(f"{message.executor} executes a skill without a request")
            self._sender.cancel(message.executor, message.master, message.epoch)

    def offer(self, executor: str) -> None:
        """Offer an idle executor the oldest master without a pending request, else the oldest master."""
        executor_info = self._watch.get(executor)
        if (
            executor_info is None
            or executor_info.state is not ExecutorState.IDLE
            or executor in self._pending_by_executor
        ):
            return
        fallback = None
        for master in self._asking_masters.get(executor_info.agent, {}).values():
            if master.call.skill in executor_info.skills:
                if master.number not in self._pending_by_master:
                    self._send_request(executor, master)
                    return
                fallback = fallback or master
        if fallback is not None:
            self._send_request(executor, fallback)

    def _send_request(self, executor: str, master: Master) -> None:
        """Ask an executor, which must have no pending request: an executor answers a single request."""
        self._pending_by_executor[executor] = master.number
        self._pending_by_master.setdefault(master.number, set()).add(executor)
        master.ask(executor)

    def _end_request(self, executor: str) -> None:
        """End the pending request of an executor that has answered, or will not answer."""
        number = self._pending_by_executor.pop(executor, None)
        if number is not None and (asked_executors := self._pending_by_master.get(number)) is not None:
            asked_executors.discard(executor)
            if not asked_executors:
                del self._pending_by_master[number]

    def _process_change(self, master: Master) -> None:
        """Update the indexes after a change and notify the caller."""
        number, agent = master.number, master.call.agent
        asking_masters = self._asking_masters.setdefault(agent, {})
        if master.state is MasterState.ASKING:
            asking_masters[number] = master
        else:
            asking_masters.pop(number, None)
        on_change = self._change_callbacks[number]
        if master.is_over:
            del self._masters[number], self._change_callbacks[number]
            self._log_end(master)
            self._release_executors(number)
        on_change(master)

    def _release_executors(self, number: int) -> None:
        """End the pending requests of a finished master, and offer their executors to other masters."""
        for executor in sorted(self._pending_by_master.pop(number, ())):
            self._pending_by_executor.pop(executor, None)
            self.offer(executor)

    def _log_end(self, master: Master) -> None:
        if not self._log.enabled:
            return
        summary = f"action {master.number}: {master.call.skill} of {master.call.agent} {master.state}"
        if master.error:
            self._log.warn(f"{summary}: {master.error}")
        else:
            self._log.debug(summary)

    def _explain(self, master: Master) -> str:
        """Return why no executor has started to execute an action."""
        call = master.call
        executors = self._watch.agent_executors(call.agent)
        capable_executors = [
            executor_info for executor_info in executors if call.skill in executor_info.skills
        ]
        if not executors:
            return f"the agent {call.agent} has no executor"
        if not capable_executors:
            skills = sorted({skill for executor_info in executors for skill in executor_info.skills})
            return f"no executor of {call.agent} offers {call.skill}; they offer: {', '.join(skills)}"
        return f"no executor of {call.agent} is free for {call.skill}, or answers: " + ", ".join(
            f"{executor_info.id} ({executor_info.skill or executor_info.state})"
            for executor_info in capable_executors
        )
