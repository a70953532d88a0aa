"""Gateways between two local blackboards; the contract of the transports covers remote blackboards."""

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
    """Two boards, a gateway whose loop the test calls, and the gateway's log."""

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

    def acquire_control(self, skiller, agent):
        """Request control for an agent; return the sender of the message at the Skiller."""
        agent.msgq_enqueue(SkillerInterface.AcquireControlMessage())
        self.gateway.loop()
        return skiller.msgq_pop().source_id

    def write(self, skiller):
        """Write the values of a Skiller and mirror them."""
        skiller.write()
        self.gateway.loop()

    def sweep(self):
        self.gateway.request_sweep()
        self.gateway.loop()

    def agent(self, board, id_="Skiller"):
        return board.open_for_reading(SkillerInterface, id_, owner="agent")


@pytest.fixture
def rig():
    with Rig() as rig:
        yield rig


@pytest.fixture(params=["left", "right"])
def sides(rig, request):
    """The writer's board and the mirrored board, in both directions."""
    return (rig.left, rig.right) if request.param == "left" else (rig.right, rig.left)


def test_gateway_mirrors_data_with_time_stamp(rig, sides):
    source, target = sides
    skiller = rig.skiller(source)
    skiller.skill_string = "say{}"
    skiller.write()
    rig.clock.sleep_until(rig.clock.now_us() + 1_000_000)
    rig.gateway.loop()
    agent = rig.agent(target)
    assert agent.read()
    assert (agent.skill_string, agent.timestamp_us) == ("say{}", skiller.timestamp_us)
    skiller.status = SkillerInterface.S_RUNNING
    rig.write(skiller)
    assert agent.read()
    assert agent.status == SkillerInterface.S_RUNNING


class EventLog(Listener):
    def __init__(self):
        self.events = []

    def data_refreshed(self, interface):
        interface.read()
        self.events.append(("refreshed", interface.msgid))

    def data_changed(self, interface):
        self.events.append(("changed", interface.msgid))

    def writer_added(self, interface, serial):
        self.events.append(("writer added", serial))

    def writer_removed(self, interface, serial):
        self.events.append(("writer removed", serial))


def test_gateway_mirrors_each_write_and_change_in_order(rig):
    skiller = rig.mirrored()
    agent, log = rig.agent(rig.right), EventLog()
    rig.right.register_listener(log, agent, EventKind.DATA_REFRESHED, EventKind.DATA_CHANGED)
    for number in (1, 2, 2, 3):
        rig.clock.sleep_until(rig.clock.now_us() + 1)
        skiller.msgid = number
        rig.write(skiller)
    assert log.events == [
        ("refreshed", 1),
        ("changed", 1),
        ("refreshed", 2),
        ("changed", 2),
        ("refreshed", 2),
        ("refreshed", 3),
        ("changed", 3),
    ]


def test_gateway_mirrors_only_matching_interfaces():
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


def test_gateway_forwards_messages_with_id_from_own_instance(rig, sides):
    source, target = sides
    skiller = rig.skiller(source)
    rig.gateway.loop()
    agent = rig.agent(target)
    ids = [agent.msgq_enqueue(SkillerInterface.ExecSkillMessage(skill_string=text)) for text in "abc"]
    rig.gateway.loop()
    messages = list(skiller.msgq_iter())
    assert [(message.skill_string, message.id) for message in messages] == list(zip("abc", ids, strict=True))
    assert len({message.source_id for message in messages}) == 1
    assert source.list("SkillerInterface")[0].readers == ("gateway", "gateway"), (
        "the gateway has a reading and a sending instance"
    )


def test_gateway_numbers_messages_per_sender(rig):
    skiller = rig.mirrored()
    first, second = rig.agent(rig.right), rig.agent(rig.right)
    for agent in (first, second, first, first, second):
        agent.msgq_enqueue(SkillerInterface.StopExecMessage())
    rig.gateway.loop()
    messages = [(message.source_id, message.id) for message in skiller.msgq_iter()]
    sources = [source for source, _ in messages]
    assert sources == [sources[number] for number in (0, 1, 0, 0, 1)]
    assert sources[0] != sources[1]
    assert [number for _, number in messages] == [1, 1, 2, 3, 2]


def test_sender_older_than_writer_gets_its_own_message_ids(rig):
    first, agent = rig.connected()
    agent.msgq_enqueue(SkillerInterface.StopExecMessage())
    first.close()
    rig.gateway.loop()
    skiller = rig.mirrored()
    sent_id = agent.msgq_enqueue(SkillerInterface.ExecSkillMessage(skill_string="a"))
    rig.gateway.loop()
    message = skiller.msgq_pop()
    assert sent_id == 2
    assert message.id == 1
    skiller.msgid = message.id
    rig.write(skiller)
    agent.read()
    assert agent.msgid == sent_id


def test_full_writer_queue_is_logged_and_later_messages_arrive(rig):
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


def test_gateway_releases_control_of_closed_sender(rig):
    skiller, agent = rig.connected()
    source = rig.acquire_control(skiller, agent)
    skiller.exclusive_controller = str(source)
    rig.write(skiller)
    agent.read()
    assert agent.exclusive_controller == str(agent.serial)
    agent.close()
    rig.gateway.loop()
    message = skiller.msgq_pop()
    assert (message.type, message.source_id) == ("ReleaseControlMessage", source)


def test_gateway_releases_control_after_skiller_reload(rig):
    """A reloaded Skiller of Fawkes keeps the controller if any client has the interface open."""
    first = rig.skiller(rig.left)
    keeper = rig.left.open_for_reading(SkillerInterface, "Skiller", owner="keeper")
    rig.gateway.loop()
    source = rig.acquire_control(first, rig.agent(rig.right))
    first.close()
    rig.gateway.loop()
    second = rig.skiller(rig.left)
    second.exclusive_controller = str(source)
    second.write()
    rig.sweep()
    assert [(message.type, message.source_id) for message in second.msgq_iter()] == [
        ("ReleaseControlMessage", source)
    ]
    keeper.close()


@pytest.mark.parametrize(
    ("status", "last_status"),
    [
        ("S_RUNNING", "S_FAILED"),
        ("S_FINAL", "S_FINAL"),
        ("S_FAILED", "S_FAILED"),
        ("S_INACTIVE", "S_INACTIVE"),
    ],
)
@pytest.mark.parametrize("closed", ["writer", "gateway"])
def test_lost_writer_ends_control_and_running_skill(rig, status, last_status, closed):
    """The zeros of a new writer differ from the mirror's last write: a stale S_RUNNING does not stay."""
    skiller, agent = rig.connected()
    skiller.exclusive_controller = str(rig.acquire_control(skiller, agent))
    skiller.skill_string, skiller.status = "go{}", status
    rig.write(skiller)
    (skiller if closed == "writer" else rig.gateway).close()
    if closed == "writer":
        rig.gateway.loop()
    agent.read()
    assert (agent.status.name, agent.exclusive_controller, agent.has_writer) == (last_status, "", False)
    assert bool(agent.error) == (status == "S_RUNNING")
    if closed == "writer":
        rig.skiller(rig.left).write()
        rig.sweep()
        agent.read()
        assert (agent.status.name, agent.skill_string, agent.error) == ("S_INACTIVE", "", "")


def test_gateway_keeps_control_of_foreign_client(rig):
    skiller, agent = rig.connected()
    rig.acquire_control(skiller, agent)
    skiller.exclusive_controller = "foreign client"
    rig.write(skiller)
    agent.close()
    rig.gateway.loop()
    assert skiller.msgq_empty()


def test_closed_gateway_releases_control(rig):
    skiller = rig.mirrored()
    rig.agent(rig.right).msgq_enqueue(SkillerInterface.AcquireControlMessage())
    rig.gateway.close()
    assert [message.type for message in skiller.msgq_iter()] == [
        "AcquireControlMessage",
        "ReleaseControlMessage",
    ]


# -- errors


BROKEN = "go{to=1"


@pytest.mark.parametrize("earlier_error", ["no way", ""])
@pytest.mark.parametrize(("text", "is_valid"), [(BROKEN, False), ("go{to=1}", True)])
def test_invalid_skill_string_does_not_keep_earlier_error(rig, earlier_error, text, is_valid):
    """Fawkes writes S_FAILED at once, with the error of the earlier skill string."""
    skiller, agent = rig.connected()
    for message_id, skill_string in ((7, "go{}"), (8, text), (9, text)):
        skiller.skill_string, skiller.msgid = skill_string, message_id
        skiller.status, skiller.error = "S_FAILED", earlier_error
        rig.write(skiller)
        agent.read()
        assert agent.msgid == message_id
        assert (agent.error == earlier_error) == (is_valid or skill_string == "go{}")
    assert is_valid or "'}' expected" in agent.error


# -- writers and boards that vanish


def test_gateway_mirrors_removed_and_reopened_writer(rig, sides):
    source, target = sides
    agent, log = rig.agent(target), EventLog()
    target.register_listener(log, agent, EventKind.WRITER_ADDED, EventKind.WRITER_REMOVED)
    skiller = rig.skiller(source)
    rig.gateway.loop()
    assert agent.has_writer
    skiller.close()
    rig.gateway.loop()
    assert not agent.has_writer
    rig.skiller(source)
    rig.gateway.loop()
    assert [event for event, _ in log.events] == ["writer added", "writer removed", "writer added"]


def test_two_writers_are_logged_once_and_not_mirrored(rig, monkeypatch):
    rig.skiller(rig.left)
    second = rig.skiller(rig.right)
    for _ in range(3):
        rig.sweep()
    assert rig.gateway.mirrors() == []
    assert sum("both blackboards have a writer" in text for text in rig.log) == 1
    monkeypatch.setattr("cxbridge_fawkes.gateway.gateway.RIVAL_PAUSE_S", 0.0)
    second.close()
    rig.sweep()
    assert [mirror.source for mirror in rig.gateway.mirrors()] == ["left"]


def test_parallel_gateways_mirror_each_write_once(rig):
    agent, log = rig.agent(rig.right), EventLog()
    rig.right.register_listener(log, agent, EventKind.DATA_REFRESHED)
    with Gateway(rig.left, rig.right, [SKILLER], sweep_period_s=3600) as second:
        skiller = rig.skiller(rig.left)
        for _ in range(3):
            skiller.msgid += 1
            skiller.write()
            for gateway in (rig.gateway, second):
                gateway.request_sweep()
                gateway.loop()
        assert log.events == [("refreshed", number) for number in (1, 2, 3)]
        assert [mirror.source for mirror in (*rig.gateway.mirrors(), *second.mirrors())] == ["left"]
        (info,) = rig.left.list_all()
        assert (info.writer, info.readers) == ("skiller", ("gateway",))


def test_gateways_in_ring_do_not_mirror_mirrored_writers(rig, monkeypatch):
    """Gateways that mirror each other's writer would stop Fawkes from loading its Skiller."""
    monkeypatch.setattr("cxbridge_fawkes.gateway.gateway.RIVAL_PAUSE_S", 3600.0)
    with Gateway(rig.left, rig.right, [SKILLER], sweep_period_s=0) as second:
        skiller, agent = rig.skiller(rig.left), rig.agent(rig.right)
        rig.gateway.loop()
        second.loop()
        skiller.close()
        for _ in range(3):
            second.request_sweep()
            second.loop()  # only the mirrored writer exists until the first gateway closes it
            assert all(info.writer == "" for info in rig.left.list_all())
            rig.sweep()
        assert not agent.has_writer
        skiller = rig.skiller(rig.left)
        rig.sweep()
        assert agent.has_writer


DEFINITION = """<interface name="SkillerInterface"><data><comment>Of a test.</comment>
<field name="x" type="uint32">.</field></data></interface>"""


def test_different_definition_is_logged_and_not_mirrored(rig):
    changed_class = make_interface_class(parse_bytes(DEFINITION.encode(), "SkillerInterface.xml"))
    rig.right.registry.add(changed_class)
    rig.mirrored()
    assert rig.gateway.mirrors() == []
    assert any("on the two blackboards differ" in text for text in rig.log)


def test_closed_board_is_logged_once(rig):
    rig.mirrored()
    rig.right.shutdown()
    for _ in range(3):
        rig.sweep()
    assert rig.gateway.mirrors() == []
    assert len([text for text in rig.log if "cannot be mirrored" in text]) == 1


# -- messages during the start of a mirror


class ImmediateSender(Listener):
    """Sends a message as soon as the interface has a writer."""

    def writer_added(self, interface, serial):
        interface.msgq_enqueue(SkillerInterface.ExecSkillMessage(skill_string="at once"))


def test_message_during_opening_of_mirrored_writer_is_forwarded(rig):
    """The gateway has to listen before the writer opens: else the message stays in the queue."""
    agent = rig.agent(rig.right)
    rig.right.register_listener(ImmediateSender(), agent)
    skiller = rig.mirrored()
    message = skiller.msgq_pop()
    assert message is not None
    assert message.skill_string == "at once"


def test_gateway_refuses_messages_beyond_limit(rig, monkeypatch):
    """An accepted message beyond the limit would never reach the writer."""
    monkeypatch.setattr("cxbridge_fawkes.gateway.mirror.MAX_MESSAGES", 2)
    skiller, agent = rig.connected()
    for _ in range(2):
        agent.msgq_enqueue(SkillerInterface.StopExecMessage())
    with pytest.raises(QueueFullError):
        agent.msgq_enqueue(SkillerInterface.StopExecMessage())
    rig.gateway.loop()
    assert skiller.msgq_size() == 2
