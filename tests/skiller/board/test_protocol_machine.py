"""Whatever executors, boards and strangers do: a master ends once, and an executor serves one at a time."""

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
"""Loops after which everything has come to its end."""

NOBODY = re.compile(r"the agent \w+ has no executor|no executor of \w+ is free for.*")

FOLLOWS = {
    "ASKING": {"CONFIRMED", "FAILED", "CANCELLED"},
    "CONFIRMED": {"RUNNING", "ASKING", "SUCCEEDED", "FAILED", "CANCELLING", "CANCELLED"},
    "RUNNING": {"RUNNING", "SUCCEEDED", "FAILED", "CANCELLING", "CANCELLED"},
    "CANCELLING": {"SUCCEEDED", "FAILED", "CANCELLED"},
}
"""Which state may come after which; after the others none."""

boards, executors, agents = map(st.sampled_from, (BOARDS, EXECUTORS, AGENTS))
loops = st.sampled_from([0, 0, 1, 2, 3, 20])


class Protocol(RuleBasedStateMachine):
    """Boards, executors, and strangers who send what they should not."""

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
        self.made: list[Master] = []

    def teardown(self) -> None:
        """Everything comes to its end; then nobody is busy and nothing is left behind."""
        for puppet in self.alive.values():
            puppet.ends = [None] * 100
        self.rig.loop(ALL_ENDED)
        for master in self.made:
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
        """Whether an action may have ended like that: nobody was silent here."""
        gone = (f"the executor {name} is gone" for name in self.killed)
        return error in ("", "no", "the skill board was closed", *gone) or bool(NOBODY.fullmatch(error))

    # -- what may happen

    @initialize(crew=st.tuples(agents, agents, agents))
    def begin(self, crew: tuple[str, str, str]) -> None:
        for name, agent in zip(EXECUTORS, crew, strict=True):
            self.alive[name] = self.rig.puppet(agent, name)

    @rule(target=masters, board=boards, skill=st.sampled_from(["move", "grasp"]), agent=agents, then=loops)
    def request(self, board: str, skill: str, agent: str, then: int) -> Master:
        master = self.open[board].request(call(skill, agent), self._note)
        self.history[id(master)] = ["ASKING"]
        self.made.append(master)
        self._loop(then)
        return master

    def _note(self, master: Master) -> None:
        states, state = self.history[id(master)], str(master.state)
        assert state in FOLLOWS.get(states[-1], ()), (states, state)
        states.append(state)

    @rule(master=masters, then=loops)
    def cancel(self, master: Master, then: int) -> None:
        for board in self.open.values():
            if any(known is master for known in board._masters.values()):
                board.cancel(master)
        self._loop(then)

    @rule(name=executors, agent=agents, what=st.sampled_from(["kill", "end", "fail", "exchange", "step"]))
    def executor(self, name: str, agent: str, what: str) -> None:
        """Do something with an executor; one that is dead comes back."""
        if name not in self.alive:
            self.alive[name] = self.rig.puppet(agent, name)
        elif what == "kill":
            self.rig.kill(name)
            self.killed.add(name)
            puppet = self.alive.pop(name)
            assert puppet.cleaned == len(puppet.calls)
        elif what in ("end", "fail"):
            self.alive[name].ends.append(None if what == "end" else "no")
        else:
            getattr(self.rig.host(name), what)()

    @rule(name=boards, restart=st.sampled_from([False, False, True]))
    def board(self, name: str, restart: bool) -> None:
        """Let a board exchange messages with nobody else at work, or end it and begin another one."""
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
        for _ in range(3):  # until nothing is under way
            for host in self.rig.hosts:
                host.exchange()
            for board in self.open.values():
                board.exchange()
        self.stranger.msgq_flush()
        self._boards_and_executors_agree()

    def _boards_and_executors_agree(self) -> None:
        """Each master that has an executor is its only one; no executor is idle that somebody could use."""
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

    # -- strangers: duplicates, late ones, other people's

    @rule(
        board=boards,
        kind=st.sampled_from(["ResponseMessage", "FeedbackMessage", "FinishMessage"]),
        number=st.integers(0, 4),
        old=st.booleans(),
        executor=st.sampled_from([*EXECUTORS, "ghost"]),
        then=loops,
    )
    def stray_answer(self, board: str, kind: str, number: int, old: bool, executor: str, then: int) -> None:
        """What does not come from its executor harms no master; again, late, of another agent."""
        master = self.open[board]._masters.get(number)
        its_own = master is not None and (master.executor == executor or not master.executor)
        if its_own and not old and not (kind == "ResponseMessage" and master and master.executor):
            return  # that might be true
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
        """What comes from an earlier life of a board harms no executor."""
        if name in self.alive:
            epoch = self.open[board].epoch - 1
            self._send("SkillExecutorInterface", name, kind, board=board, epoch=epoch, master=number)
            self._loop(then)

    @rule(name=executors, agent=agents, skill=st.sampled_from(["move", "dance"]))
    def stray_request(self, name: str, agent: str, skill: str) -> None:
        """Somebody asks and never confirms."""
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

    # -- what always holds

    @invariant()
    def an_executor_runs_one_skill_and_its_agents_only(self) -> None:
        for name, puppet in self.alive.items():
            busy = self.rig.host(name).state is ExecutorState.BUSY
            assert len(puppet.calls) - puppet.cleaned in ((0, 1) if busy else (0,))
            assert all(made.agent == puppet.agent for made in puppet.calls)


class AskAllBoard(SkillBoard):
    """Asks all executors at once, and rejects all but one."""

    def ask(self, master: Master) -> None:
        self.ask_all(master)


class AskingAll(Protocol):
    """The same with boards that ask all executors."""

    board_class = AskAllBoard


TestAskingAll = AskingAll.TestCase
TestAskingAll.settings = settings(max_examples=many(60, 25), stateful_step_count=30)
TestProtocol = Protocol.TestCase
TestProtocol.settings = settings(max_examples=many(60, 25), stateful_step_count=30)
