"""Gateways between two blackboards of this process; transports have their own contract to be alike."""

from __future__ import annotations

import pytest

from cxbridge.blackboard import EventKind, Listener, LocalBlackBoard
from cxbridge.blackboard.errors import QueueFullError
from cxbridge.clock import VirtualClock
from cxbridge.closing import Closing
from cxbridge.events import EventBus, LogLine
from cxbridge.interfaces import InterfaceRegistry, SkillerInterface
from cxbridge.interfaces.classes import make_interface_class
from cxbridge.interfaces.xml.parser import parse_bytes
from cxbridge_fawkes.gateway import Gateway

SKILLER = "SkillerInterface::*"
WAIT_S = 10


class Rig(Closing):
    """Two boards, a gateway that works when the test lets it, and its log."""

    def __init__(self, *patterns: str) -> None:
        self.clock = VirtualClock()
        self.left = LocalBlackBoard(InterfaceRegistry(), self.clock)
        self.right = LocalBlackBoard(InterfaceRegistry(), self.clock)
        self.bus = EventBus(self.clock)
        self.log: list[str] = []
        self.bus.subscribe(lambda event: self.log.append(event.text), LogLine)  # type: ignore[attr-defined]
        self.gateway = Gateway(
            self.left, self.right, patterns or (SKILLER,), bus=self.bus, sweep_period_s=3600
        )

    def close(self):
        self.gateway.close()
        assert [
            info.readers
            for info in (*self.left.list_all(), *self.right.list_all())
            if "gateway" in info.readers
        ] == []
        assert all(info.writer != "gateway" for info in (*self.left.list_all(), *self.right.list_all()))
        self.left.shutdown()
        self.right.shutdown()

    def skiller(self, board, id_="Skiller"):
        return board.open_for_writing(SkillerInterface, id_, owner="skiller")

    def mirrored(self):
        """Return a Skiller on the left that the gateway mirrors."""
        skiller = self.skiller(self.left)
        self.gateway.loop()
        return skiller

    def connected(self):
        """Return a mirrored Skiller, and an agent on the right."""
        return self.mirrored(), self.agent(self.right)

    def let_acquire(self, skiller, agent):
        """Let an agent ask for control of a Skiller; return the sender that the Skiller sees."""
        agent.msgq_enqueue(SkillerInterface.AcquireControlMessage())
        self.gateway.loop()
        return skiller.msgq_pop().source_id

    def write(self, skiller):
        """Write the values of a Skiller, and let the gateway mirror them."""
        skiller.write()
        self.gateway.loop()

    def look_again(self):
        self.gateway.request_sweep()
        self.gateway.loop()

    def agent(self, board, id_="Skiller"):
        return board.open_for_reading(SkillerInterface, id_, owner="agent")


@pytest.fixture
def rig():
    with Rig() as made:
        yield made


@pytest.fixture(params=["left", "right"])
def sides(rig, request):
    """The board of the writer and the other one, both ways."""
    return (rig.left, rig.right) if request.param == "left" else (rig.right, rig.left)


def test_data_go_from_the_writer_to_the_other_board_with_their_time_stamp(rig, sides):
    here, there = sides
    skiller = rig.skiller(here)
    skiller.skill_string = "say{}"
    skiller.write()
    rig.clock.sleep_until(rig.clock.now_us() + 1_000_000)
    rig.gateway.loop()
    agent = rig.agent(there)
    assert agent.read()
    assert (agent.skill_string, agent.timestamp_us) == ("say{}", skiller.timestamp_us)
    skiller.status = SkillerInterface.S_RUNNING
    rig.write(skiller)
    assert agent.read()
    assert agent.status == SkillerInterface.S_RUNNING


class Notes(Listener):
    def __init__(self):
        self.heard = []

    def data_refreshed(self, interface):
        interface.read()
        self.heard.append(("refreshed", interface.msgid))

    def data_changed(self, interface):
        self.heard.append(("changed", interface.msgid))

    def writer_added(self, interface, serial):
        self.heard.append(("writer added", serial))

    def writer_removed(self, interface, serial):
        self.heard.append(("writer removed", serial))


def test_every_write_is_mirrored_in_order_and_changes_are_told_as_such(rig):
    skiller = rig.mirrored()
    agent, notes = rig.agent(rig.right), Notes()
    rig.right.register_listener(notes, agent, EventKind.DATA_REFRESHED, EventKind.DATA_CHANGED)
    for number in (1, 2, 2, 3):
        rig.clock.sleep_until(rig.clock.now_us() + 1)
        skiller.msgid = number
        rig.write(skiller)
    assert notes.heard == [
        ("refreshed", 1),
        ("changed", 1),
        ("refreshed", 2),
        ("changed", 2),
        ("refreshed", 2),
        ("refreshed", 3),
        ("changed", 3),
    ]


def test_only_what_is_chosen_is_mirrored():
    with Rig("SkillerInterface::Sk*", "Position3DInterface") as rig:
        for type_, id_ in (
            ("SkillerInterface", "Skiller"),
            ("SkillerInterface", "Other"),
            ("Position3DInterface", "Pose"),
            ("TestInterface", "T"),
        ):
            rig.left.open_for_writing(type_, id_)
        rig.gateway.loop()
        assert [info.uid for info in rig.right.list_all()] == [
            "SkillerInterface::Skiller",
            "Position3DInterface::Pose",
        ]


# -- messages


def test_messages_go_to_the_writer_with_their_id_from_an_instance_of_the_gateway(rig, sides):
    here, there = sides
    skiller = rig.skiller(here)
    rig.gateway.loop()
    agent = rig.agent(there)
    ids = [agent.msgq_enqueue(SkillerInterface.ExecSkillMessage(skill_string=text)) for text in "abc"]
    rig.gateway.loop()
    came = list(skiller.msgq_iter())
    assert [(message.skill_string, message.id) for message in came] == list(zip("abc", ids, strict=True))
    assert len({message.source_id for message in came}) == 1
    assert here.list("SkillerInterface")[0].readers == ("gateway", "gateway"), "one reads, one sends"


def test_each_sender_has_its_own_count(rig):
    skiller = rig.mirrored()
    one, two = rig.agent(rig.right), rig.agent(rig.right)
    for agent in (one, two, one, one, two):
        agent.msgq_enqueue(SkillerInterface.StopExecMessage())
    rig.gateway.loop()
    came = [(message.source_id, message.id) for message in skiller.msgq_iter()]
    sources = [source for source, _ in came]
    assert sources == [sources[number] for number in (0, 1, 0, 0, 1)]
    assert sources[0] != sources[1]
    assert [number for _, number in came] == [1, 1, 2, 3, 2]


def test_a_sender_that_came_before_the_writer_gets_answers_under_the_ids_it_knows(rig):
    first, agent = rig.connected()
    agent.msgq_enqueue(SkillerInterface.StopExecMessage())
    first.close()
    rig.gateway.loop()
    skiller = rig.mirrored()
    asked = agent.msgq_enqueue(SkillerInterface.ExecSkillMessage(skill_string="a"))
    rig.gateway.loop()
    message = skiller.msgq_pop()
    assert asked == 2
    assert message.id == 1
    skiller.msgid = message.id
    rig.write(skiller)
    agent.read()
    assert agent.msgid == asked


def test_a_message_that_the_writer_cannot_take_is_told_and_the_others_come(rig):
    skiller = rig.left.open_for_writing(SkillerInterface, "Skiller", queue_limit=1)
    rig.gateway.loop()
    agent = rig.agent(rig.right)
    for _ in range(3):
        agent.msgq_enqueue(SkillerInterface.StopExecMessage())
    rig.gateway.loop()
    assert skiller.msgq_size() == 1
    assert any("StopExecMessage cannot be delivered" in text for text in rig.log)
    skiller.msgq_flush()
    agent.msgq_enqueue(SkillerInterface.StopExecMessage())
    rig.gateway.loop()
    assert skiller.msgq_size() == 1


# -- exclusive control


def test_control_that_a_sender_has_is_given_back_when_it_leaves(rig):
    skiller, agent = rig.connected()
    source = rig.let_acquire(skiller, agent)
    skiller.exclusive_controller = str(source)
    rig.write(skiller)
    agent.read()
    assert agent.exclusive_controller == str(agent.serial)
    agent.close()
    rig.gateway.loop()
    message = skiller.msgq_pop()
    assert (message.type, message.source_id) == ("ReleaseControlMessage", source)


def test_control_of_an_instance_that_was_closed_unnoticed_is_given_back(rig):
    """A Fawkes that loads its Skiller again keeps the controller, if any client has the interface open."""
    first = rig.skiller(rig.left)
    keeper = rig.left.open_for_reading(SkillerInterface, "Skiller", owner="keeper")
    rig.gateway.loop()
    source = rig.let_acquire(first, rig.agent(rig.right))
    first.close()
    rig.gateway.loop()
    second = rig.skiller(rig.left)
    second.exclusive_controller = str(source)
    second.write()
    rig.look_again()
    assert [(message.type, message.source_id) for message in second.msgq_iter()] == [
        ("ReleaseControlMessage", source)
    ]
    keeper.close()


@pytest.mark.parametrize(
    ("shown", "left"),
    [
        ("S_RUNNING", "S_FAILED"),
        ("S_FINAL", "S_FINAL"),
        ("S_FAILED", "S_FAILED"),
        ("S_INACTIVE", "S_INACTIVE"),
    ],
)
@pytest.mark.parametrize("loser", ["writer", "gateway"])
def test_a_writer_that_is_lost_leaves_nobody_in_control_and_nothing_running(rig, shown, left, loser):
    """The mirror took the zeros of a new writer for its last write, and showed S_RUNNING for ever."""
    skiller, agent = rig.connected()
    skiller.exclusive_controller = str(rig.let_acquire(skiller, agent))
    skiller.skill_string, skiller.status = "go{}", shown
    rig.write(skiller)
    (skiller if loser == "writer" else rig.gateway).close()
    if loser == "writer":
        rig.gateway.loop()
    agent.read()
    assert (agent.status.name, agent.exclusive_controller, agent.has_writer) == (left, "", False)
    assert bool(agent.error) == (shown == "S_RUNNING")
    if loser == "writer":
        rig.skiller(rig.left).write()
        rig.look_again()
        agent.read()
        assert (agent.status.name, agent.skill_string, agent.error) == ("S_INACTIVE", "", "")


def test_control_that_somebody_else_has_is_left_alone(rig):
    skiller, agent = rig.connected()
    rig.let_acquire(skiller, agent)
    skiller.exclusive_controller = "somebody else"
    rig.write(skiller)
    agent.close()
    rig.gateway.loop()
    assert skiller.msgq_empty()


def test_a_gateway_that_closes_gives_control_back(rig):
    skiller = rig.mirrored()
    rig.agent(rig.right).msgq_enqueue(SkillerInterface.AcquireControlMessage())
    rig.gateway.close()
    assert [message.type for message in skiller.msgq_iter()] == [
        "AcquireControlMessage",
        "ReleaseControlMessage",
    ]


# -- errors


BROKEN = "go{to=1"


@pytest.mark.parametrize("before", ["no way", ""])
@pytest.mark.parametrize(("text", "is_own"), [(BROKEN, False), ("go{to=1}", True)])
def test_a_skill_string_that_a_fawkes_cannot_compile_has_not_the_error_of_the_one_before(
    rig, before, text, is_own
):
    """The writes of a Fawkes: at once S_FAILED, with the earlier error."""
    skiller, agent = rig.connected()
    for message_id, skill_string in ((7, "go{}"), (8, text), (9, text)):
        skiller.skill_string, skiller.msgid = skill_string, message_id
        skiller.status, skiller.error = "S_FAILED", before
        rig.write(skiller)
        agent.read()
        assert agent.msgid == message_id
        assert (agent.error == before) == (is_own or skill_string == "go{}")
    assert is_own or "'}' expected" in agent.error


# -- coming and going


def test_the_death_of_the_writer_is_mirrored_and_so_is_its_return(rig, sides):
    here, there = sides
    agent, notes = rig.agent(there), Notes()
    there.register_listener(notes, agent, EventKind.WRITER_ADDED, EventKind.WRITER_REMOVED)
    skiller = rig.skiller(here)
    rig.gateway.loop()
    assert agent.has_writer
    skiller.close()
    rig.gateway.loop()
    assert not agent.has_writer
    rig.skiller(here)
    rig.gateway.loop()
    assert [what for what, _ in notes.heard] == ["writer added", "writer removed", "writer added"]


def test_two_writers_are_told_once_and_left_alone(rig, monkeypatch):
    rig.skiller(rig.left)
    second = rig.skiller(rig.right)
    for _ in range(3):
        rig.look_again()
    assert rig.gateway.mirrors() == []
    assert sum("both blackboards have a writer" in text for text in rig.log) == 1
    monkeypatch.setattr("cxbridge_fawkes.gateway.gateway.RIVAL_PAUSE_S", 0.0)
    second.close()
    rig.look_again()
    assert [mirror.source for mirror in rig.gateway.mirrors()] == ["left"]


def test_two_gateways_in_a_row_carry_nothing_back_and_forth(rig):
    agent, notes = rig.agent(rig.right), Notes()
    rig.right.register_listener(notes, agent, EventKind.DATA_REFRESHED)
    with Gateway(rig.left, rig.right, [SKILLER], sweep_period_s=3600) as second:
        skiller = rig.skiller(rig.left)
        for _ in range(3):
            skiller.msgid += 1
            skiller.write()
            for gateway in (rig.gateway, second):
                gateway.request_sweep()
                gateway.loop()
        assert notes.heard == [("refreshed", number) for number in (1, 2, 3)]
        assert [mirror.source for mirror in (*rig.gateway.mirrors(), *second.mirrors())] == ["left"]
        (info,) = rig.left.list_all()
        assert (info.writer, info.readers) == ("skiller", ("gateway",))


def test_gateways_in_a_ring_leave_a_free_writers_place_free(rig, monkeypatch):
    """Each stood in for the other, for ever: a Fawkes could not load its skiller again."""
    monkeypatch.setattr("cxbridge_fawkes.gateway.gateway.RIVAL_PAUSE_S", 3600.0)
    with Gateway(rig.left, rig.right, [SKILLER], sweep_period_s=0) as second:
        skiller, agent = rig.skiller(rig.left), rig.agent(rig.right)
        rig.gateway.loop()
        second.loop()
        skiller.close()
        for _ in range(3):
            second.request_sweep()
            second.loop()  # sees the mirrored writer alone, before the first gateway takes it away
            assert all(info.writer == "" for info in rig.left.list_all())
            rig.look_again()
        assert not agent.has_writer
        skiller = rig.skiller(rig.left)
        rig.look_again()
        assert agent.has_writer


DEFINITION = """<interface name="SkillerInterface"><data><comment>Of a test.</comment>
<field name="x" type="uint32">.</field></data></interface>"""


def test_another_layout_is_refused_in_words(rig):
    other = make_interface_class(parse_bytes(DEFINITION.encode(), "SkillerInterface.xml"))
    rig.right.registry.add(other)
    rig.mirrored()
    assert rig.gateway.mirrors() == []
    assert any("on the two blackboards differ" in text for text in rig.log)


def test_a_board_that_is_gone_is_told_once(rig):
    rig.mirrored()
    rig.right.shutdown()
    for _ in range(3):
        rig.look_again()
    assert rig.gateway.mirrors() == []
    assert len([text for text in rig.log if "cannot be mirrored" in text]) == 1


# -- messages while a mirror begins


class Hasty(Listener):
    """Sends a message in the very moment in which there is a writer."""

    def writer_added(self, interface, serial):
        interface.msgq_enqueue(SkillerInterface.ExecSkillMessage(skill_string="at once"))


def test_a_message_that_comes_while_the_mirrored_writer_is_opened_is_carried(rig):
    """The gateway listened only after it had opened: the message stayed in a queue without a reader."""
    agent = rig.agent(rig.right)
    rig.right.register_listener(Hasty(), agent)
    skiller = rig.mirrored()
    message = skiller.msgq_pop()
    assert message is not None
    assert message.skill_string == "at once"


def test_messages_that_are_too_many_are_refused(rig, monkeypatch):
    """They went into the queue of the mirrored writer, acknowledged, and were never carried."""
    monkeypatch.setattr("cxbridge_fawkes.gateway.mirror.MAX_MESSAGES", 2)
    skiller, agent = rig.connected()
    for _ in range(2):
        agent.msgq_enqueue(SkillerInterface.StopExecMessage())
    with pytest.raises(QueueFullError):
        agent.msgq_enqueue(SkillerInterface.StopExecMessage())
    rig.gateway.loop()
    assert skiller.msgq_size() == 2
