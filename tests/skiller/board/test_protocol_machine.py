"""Each master ends once, and an executor has a single master, whatever executors, boards and strangers do."""

from __future__ import annotations

import re

from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import Bundle, RuleBasedStateMachine, initialize, invariant, rule

from cxbridge.skiller.board.board import SkillBoard
from cxbridge.skiller.board.master import Master, Timeouts
from cxbridge.skiller.board.protocol import ExecutorState, MasterState, Ticket
from tests.skiller.board.rig import Puppet, Rig, call
from tests.support import many

AGENTS = ("r1", "r2")
EXECUTORS = ("e1", "e2", "e3")
BOARDS = ("one", "two")
STRANGER = "stranger"
LIMITS = Timeouts(start=3.0, silence=2.0, cancel=2.0)
ALL_ENDED = 600
"""Loops after which all actions have ended."""

NO_EXECUTOR = re.compile(r"the agent \w+ has no executor|no executor of \w+ is free for.*")

FOLLOWS = {
    "ASKING": {"CONFIRMED", "FAILED", "CANCELLED"},
    "CONFIRMED": {"RUNNING", "ASKING", "SUCCEEDED", "FAILED", "CANCELLING", "CANCELLED"},
    "RUNNING": {"RUNNING", "SUCCEEDED", "FAILED", "CANCELLING", "CANCELLED"},
    "CANCELLING": {"SUCCEEDED", "FAILED", "CANCELLED"},
}
"""The states that may follow each state; the remaining states are final."""

boards, executors, agents = map(st.sampled_from, (BOARDS, EXECUTORS, AGENTS))
loops = st.sampled_from([0, 0, 1, 2, 3, 20])


class Protocol(RuleBasedStateMachine):
    """Boards, executors, and strangers that send invalid messages."""

    masters = Bundle("masters")
    board_class = SkillBoard

    def __init__(self) -> None:
        super().__init__()
        self.rig = Rig()
        self.stranger = self.rig.board.open_for_writing("SkillBoardInterface", STRANGER, owner="test")
        self.alive: dict[str, Puppet] = {}
        self.killed: set[str] = set()
        self.open = {
            name: self.rig.skills(name, timeouts=LIMITS, board_class=self.board_class) for name in BOARDS
        }
        self.history: dict[int, list[str]] = {}
        self.requested: list[Master] = []

    def teardown(self) -> None:
        """End all actions; then all executors are idle and the blackboard is empty."""
        for puppet in self.alive.values():
            puppet.ends = [None] * 100
        self.rig.loop(ALL_ENDED)
        for master in self.requested:
            assert master.is_over, (master.state, master.call)
            assert self._is_explained(master.error), master.error
        for host in self.rig.hosts:
            assert host.state is ExecutorState.IDLE
        for board in self.open.values():
            assert not board.running
        for puppet in self.alive.values():
            assert puppet.cleaned == len(puppet.calls)
        self.stranger.close()
        self.rig.close()
        assert self.rig.board.list_all() == []

    def _is_explained(self, error: str) -> bool:
        """Return whether an error is possible; no executor is silent here."""
        lost_executors = (f"the executor {name} is gone" for name in self.killed)
        return error in ("", "no", "the skill board was closed", *lost_executors) or bool(
            NO_EXECUTOR.fullmatch(error)
        )

    # -- rules

    @initialize(crew=st.tuples(agents, agents, agents))
    def begin(self, crew: tuple[str, str, str]) -> None:
        for name, agent in zip(EXECUTORS, crew, strict=True):
            self.alive[name] = self.rig.puppet(agent, name)

    @rule(target=masters, board=boards, skill=st.sampled_from(["move", "grasp"]), agent=agents, then=loops)
    def request(self, board: str, skill: str, agent: str, then: int) -> Master:
        master = self.open[board].request(call(skill, agent), self._record_state)
        self.history[id(master)] = ["ASKING"]
        self.requested.append(master)
        self._loop(then)
        return master

    def _record_state(self, master: Master) -> None:
        states, state = self.history[id(master)], str(master.state)
        assert state in FOLLOWS.get(states[-1], ()), (states, state)
        states.append(state)

    @rule(master=masters, then=loops)
    def cancel(self, master: Master, then: int) -> None:
        for board in self.open.values():
            if any(open_master is master for open_master in board._masters.values()):
                board.cancel(master)
        self._loop(then)

    @rule(name=executors, agent=agents, event=st.sampled_from(["kill", "end", "fail", "exchange", "step"]))
    def executor(self, name: str, agent: str, event: str) -> None:
        """Change an executor; a dead executor returns."""
        if name not in self.alive:
            self.alive[name] = self.rig.puppet(agent, name)
        elif event == "kill":
            self.rig.kill(name)
            self.killed.add(name)
            puppet = self.alive.pop(name)
            assert puppet.cleaned == len(puppet.calls)
        elif event in ("end", "fail"):
            self.alive[name].ends.append(None if event == "end" else "no")
        else:
            getattr(self.rig.host(name), event)()

    @rule(name=boards, restart=st.sampled_from([False, False, True]))
    def board(self, name: str, restart: bool) -> None:
        """Let a board exchange messages alone, or replace it by a new board."""
        board = self.open[name]
        if not restart:
            board.exchange()
            return
        self.rig.boards.remove(board)
        board.close()
        self.open[name] = self.rig.skills(name, timeouts=LIMITS, board_class=self.board_class)

    @rule(then=loops)
    def loop(self, then: int) -> None:
        self._loop(then)

    def _loop(self, count: int) -> None:
        if not count:
            return
        self.rig.loop(count)
        for _ in range(3):  # until no message is in transit
            for host in self.rig.hosts:
                host.exchange()
            for board in self.open.values():
                board.exchange()
        self.stranger.msgq_flush()
        self._check_agreement()

    def _check_agreement(self) -> None:
        """Each executor has at most one master, and no executor is idle while a master asks its agent."""
        open_masters = [
            (name, board, m) for name, board in self.open.items() for m in board._masters.values()
        ]
        served = {
            master.executor: Ticket(name, board.epoch, master.number)
            for name, board, master in open_masters
            if master.has_executor
        }
        busy = {
            host.name: host.ticket
            for host in self.rig.hosts
            if host.state is not ExecutorState.IDLE and host.ticket.board != STRANGER
        }
        assert served == busy
        idle = {host.executor.agent for host in self.rig.hosts if host.state is ExecutorState.IDLE}
        asking = {m.agent for _, _, m in open_masters if m.state is MasterState.ASKING}
        assert not idle & asking

    # -- strangers: repeated and late messages, messages of other agents

    @rule(
        board=boards,
        kind=st.sampled_from(["ResponseMessage", "FeedbackMessage", "FinishMessage"]),
        number=st.integers(0, 4),
        old=st.booleans(),
        executor=st.sampled_from([*EXECUTORS, "ghost"]),
        then=loops,
    )
    def stray_answer(self, board: str, kind: str, number: int, old: bool, executor: str, then: int) -> None:
        """A master ignores repeated and late messages, and messages of foreign executors."""
        master = self.open[board]._masters.get(number)
        is_own = master is not None and (master.executor == executor or not master.executor)
        if is_own and not old and not (kind == "ResponseMessage" and master and master.executor):
            return  # such a message may be genuine
        self._send(
            "SkillBoardInterface",
            board,
            kind,
            epoch=self.open[board].epoch - old,
            master=number,
            executor=executor,
        )
        self._loop(then)

    @rule(
        name=executors,
        kind=st.sampled_from(["ConfirmMessage", "RejectMessage", "CancelMessage"]),
        number=st.integers(0, 4),
        board=boards,
        then=loops,
    )
    def stray_order(self, name: str, kind: str, number: int, board: str, then: int) -> None:
        """An executor ignores messages of an earlier epoch of a board."""
        if name in self.alive:
            epoch = self.open[board].epoch - 1
            self._send("SkillExecutorInterface", name, kind, board=board, epoch=epoch, master=number)
            self._loop(then)

    @rule(name=executors, agent=agents, skill=st.sampled_from(["move", "dance"]))
    def stray_request(self, name: str, agent: str, skill: str) -> None:
        """Send a request without a later Confirm."""
        if name in self.alive:
            self._send(
                "SkillExecutorInterface",
                name,
                "RequestMessage",
                board=STRANGER,
                epoch=1,
                master=1,
                agent=agent,
                skill=skill,
            )

    def _send(self, kind: str, name: str, message_type: str, **fields: str | int) -> None:
        with self.rig.board.open_for_reading(kind, name, owner="stray") as reader:
            message = reader.create_message(message_type)
            for field, value in fields.items():
                message.set(field, value)
            reader.msgq_enqueue(message)

    # -- invariants

    @invariant()
    def executor_runs_single_skill_of_its_agent(self) -> None:
        for name, puppet in self.alive.items():
            busy = self.rig.host(name).state is ExecutorState.BUSY
            assert len(puppet.calls) - puppet.cleaned in ((0, 1) if busy else (0,))
            assert all(call.agent == puppet.agent for call in puppet.calls)


class AskAllBoard(SkillBoard):
    """Asks all executors at once, and rejects all but the first."""

    def ask(self, master: Master) -> None:
        self.ask_all(master)


class AskingAll(Protocol):
    """The protocol with boards that ask all executors."""

    board_class = AskAllBoard


TestAskingAll = AskingAll.TestCase
TestAskingAll.settings = settings(max_examples=many(60, 25), stateful_step_count=30)
TestProtocol = Protocol.TestCase
TestProtocol.settings = settings(max_examples=many(60, 25), stateful_step_count=30)
