"""The contracts within the limits of Fawkes' protocol (docs/evidence/protocol-fawkes.md)."""

from __future__ import annotations

import pytest

from cxbridge.blackboard import Listener, errors
from cxbridge.events import InterfaceMessage
from cxbridge_fawkes.network.client import FawkesBlackBoard
from tests.blackboard.contract import BoardPair
from tests.blackboard.contract.data import DataContract
from tests.blackboard.contract.events import EventsContract
from tests.blackboard.contract.messages import Add, MessagesContract, Reset
from tests.blackboard.contract.opening import SAMPLE, OpeningContract
from tests.blackboard.contract.recorder import Recorder
from tests.blackboard.samples import SampleInterface


class WireOpeningContract(OpeningContract):
    """The protocol has no names of owners."""

    def test_a_second_writer_is_refused(self, pair):
        pair.far.open_for_writing(SAMPLE, "a", owner="the first")
        with pytest.raises(errors.WriterActiveError, match="already a writer on interface 'a' of type"):
            pair.near.open_for_writing(SAMPLE, "a")

    def test_refused_open_leaves_no_instance(self, pair):
        pair.far.open_for_writing(SAMPLE, "a", owner="w")
        with pytest.raises(errors.WriterActiveError):
            pair.near.open_for_writing(SAMPLE, "a", owner="second")
        (info,) = pair.near.list_all()
        assert (info.has_writer, info.num_readers) == (True, 0)

    def test_owners_and_counts(self, pair):
        first = pair.near.open_for_reading(SAMPLE, "a", owner="r1")
        pair.far.open_for_reading(SAMPLE, "a", owner="r2")
        writer = pair.far.open_for_writing(SAMPLE, "a", owner="w")
        pair.settle()
        for instance in (first, writer):
            assert (instance.has_writer, instance.num_readers) == (True, 2)

    def test_list_has_all_data_of_interface(self, pair):
        writer = pair.far.open_for_writing(SAMPLE, "a", owner="w")
        pair.near.open_for_reading(SAMPLE, "a", owner="r")
        writer.mark_data_refreshed()
        writer.write()
        pair.settle()
        (info,) = pair.near.list_all()
        assert (info.uid, info.hash) == ("SampleInterface::a", SampleInterface.SCHEMA.hash)
        assert (info.has_writer, info.num_readers) == (True, 1)
        assert info.timestamp_us == pair.clock.now_us()


class WireDataContract(DataContract):
    """Equal blocks with equal time stamps look the same on the wire."""

    def test_setting_the_same_value_refreshes_and_does_not_change(self, pair, reader, writer):
        writer.count = 1
        writer.write()
        pair.settle()
        reader.read()
        pair.clock.sleep_until(pair.clock.now_us() + 1)
        writer.count = 1
        writer.write()
        pair.settle()
        assert reader.read() is True
        assert (reader.refreshed, reader.changed) == (True, False)


class WireMessagesContract(MessagesContract):
    """The sender gets no result of a message."""

    @staticmethod
    def server_numbers_messages(pair: BoardPair) -> bool:
        """Return whether the board is a client: Fawkes numbers the messages of clients with 16 bits."""
        return isinstance(pair.near, FawkesBlackBoard)

    def test_full_queue_refuses_messages(self, pair):
        reader = pair.near.open_for_reading(SampleInterface, "bounded")
        writer = pair.far.open_for_writing(SampleInterface, "bounded", queue_limit=2)
        pair.settle()
        assert [reader.msgq_enqueue(Reset()) for _ in range(3)] == [1, 2, 3]
        pair.settle()
        assert [message.id for message in writer.msgq_iter()] == [1, 2]

    def test_proxy_keeps_source_of_message(self, pair, reader, writer):
        origin = pair.near.open_for_reading(SampleInterface, "origin")
        relay = pair.far.open_for_writing(SampleInterface, "origin")
        pair.settle()
        origin.msgq_enqueue(Add(1, 2))
        pair.settle()
        reader.msgq_enqueue(relay.msgq_pop().copy(), proxy=True)
        pair.settle()
        message = writer.msgq_first()
        assert (message.source_id, message.summand) == (origin.serial, 1)

    def test_message_has_name_of_sender_thread(self, pair, reader, writer):
        reader.msgq_enqueue(Reset())
        pair.settle()
        assert writer.msgq_first().sender_thread_name == "Unknown"

    def check_outcomes(self, events: list[InterfaceMessage]) -> None:
        """The served board knows neither the sender nor the remote writer's reaction."""
        assert events[0].outcome == "queued"

    def check_refused(self, events: list[InterfaceMessage]) -> None:
        """A client without a known writer sends no message."""
        assert [event.outcome for event in events] in ([], ["refused"])


class WireEventsContract(EventsContract):
    """Only a round trip orders the requests of two clients."""

    def test_order_of_created_added_removed_destroyed(self, pair):
        recorder = Recorder()
        pair.near.register_observer(recorder)
        instance = pair.near.open_for_reading(SampleInterface, "a")
        pair.settle()
        pair.near.register_listener(recorder, instance)
        writer = pair.far.open_for_writing(SampleInterface, "a")
        pair.settle()
        writer.close()
        pair.settle()
        instance.close()
        pair.settle()
        uid = "SampleInterface::a"
        assert recorder.log == [
            ("created", uid),
            ("+writer", uid, writer.serial),
            ("-writer", uid, writer.serial),
            ("-reader", uid, instance.serial),
            ("destroyed", uid),
        ]

    def test_first_listener_that_returns_false_stops_message(self, pair, reader, writer):
        calls = []

        class Answers(Listener):
            def __init__(self, name: str, answer: bool) -> None:
                self.name, self.answer = name, answer

            def message_received(self, interface, message):
                calls.append(self.name)
                return self.answer

        for name, answer in (("yes", True), ("no", False), ("uncalled", True)):
            pair.far.register_listener(Answers(name, answer), writer)
        assert reader.msgq_enqueue(SampleInterface.ResetMessage()) == 1
        pair.settle()
        assert calls == ["yes", "no"]
        assert writer.msgq_empty()

    def test_the_writer_may_be_closed_while_its_listeners_are_asked(self, pair, reader, writer):
        class ClosesWriter(Listener):
            def message_received(self, interface, message):
                interface.close()
                return True

        pair.far.register_listener(ClosesWriter(), writer)
        reader.msgq_enqueue(SampleInterface.ResetMessage())
        pair.settle()
        with pytest.raises(errors.NoWriterError):
            reader.msgq_enqueue(SampleInterface.ResetMessage())
