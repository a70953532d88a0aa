"""Messages of readers in the queue of the writer."""

from __future__ import annotations

import threading
from collections.abc import Callable

import pytest

from cxbridge.blackboard import Listener, errors
from cxbridge.events import InterfaceMessage, Level, LogLine
from cxbridge.interfaces import SkillerInterface
from cxbridge.interfaces.instance import Interface
from tests.blackboard.contract import BoardPair, Contract
from tests.blackboard.samples import (
    NewerSampleInterface,
    OtherInterface,
    SampleInterface,
    remade_sample_interface,
)

Add, Reset, SetCount = (
    SampleInterface.MESSAGES[name] for name in ("AddMessage", "ResetMessage", "SetCountMessage")
)


class MessagesContract(Contract):
    def test_queued_message_has_id_sender_and_time(self, pair, reader, writer):
        message = Add(3, 4)
        assert (message.id, message.sender_id, message.enqueued) == (0, None, False)
        assert reader.msgq_enqueue(message) == 1
        pair.settle()
        got = writer.msgq_first()
        assert (got.summand, got.addend, got.type) == (3, 4, "AddMessage")
        assert got.id == 1
        assert got.sender_id == got.source_id == reader.serial
        assert got.recipient == writer.mem_serial
        assert got.enqueued
        assert got.time_enqueued_us == got.timestamp_us == pair.clock.now_us()

    def test_message_id_is_never_0(self, pair, reader, writer):
        """The id 0, after 65535, means a message that could not be sent."""
        reader._last_message_id = 65534
        ids = [reader.msgq_enqueue(Reset()) for _ in range(3)]
        assert ids == ([65535, 0, 1] if self.server_numbers_messages(pair) else [65535, 1, 2])

    def test_message_id_differs_from_shown_id(self, pair):
        """The shown id belongs to an earlier message, whose result would count as that of the new message."""
        writer = pair.far.open_for_writing(SkillerInterface, "Skiller")
        for shown in (*range(1, 6), 65534, 65535):
            writer.msgid = shown
            writer.write()
            for last in {0, shown - 1, shown, 65533, 65534, 65535}:
                reader = pair.near.open_for_reading(SkillerInterface, "Skiller")
                pair.settle()
                reader._last_message_id = last
                sent = reader.msgq_enqueue(SkillerInterface.StopExecMessage())
                if not self.server_numbers_messages(pair):
                    assert sent not in (0, shown)
                    assert sent in {(last + step) % 65536 for step in (1, 2, 3)}
                reader.close()

    @staticmethod
    def server_numbers_messages(pair: BoardPair) -> bool:
        """Return whether the server numbers the messages of readers, as Fawkes does."""
        return False

    def test_first_in_first_out(self, pair, reader, writer):
        other = pair.near.open_for_reading(SampleInterface, "a")
        for count, sender in enumerate([reader, other, reader, other]):
            sender.msgq_enqueue(SetCount(count))
        pair.settle()
        got = []
        while (message := writer.msgq_pop()) is not None:
            got.append(message.count)
        assert got == [0, 1, 2, 3]

    def test_queue_has_size_first_and_iteration(self, pair, reader, writer):
        assert (writer.msgq_size(), writer.msgq_empty(), writer.msgq_first()) == (0, True, None)
        assert writer.msgq_pop() is None
        reader.msgq_enqueue(Add(1, 2))
        reader.msgq_enqueue(Reset())
        pair.settle()
        assert (writer.msgq_size(), writer.msgq_empty()) == (2, False)
        assert writer.msgq_first() is writer.msgq_first()
        assert [message.type for message in writer.msgq_iter()] == ["AddMessage", "ResetMessage"]
        writer.msgq_flush()
        assert writer.msgq_empty()

    def test_messages_take_their_fields_in_order_or_by_name(self):
        assert Add(1, addend=2).as_dict() == {"summand": 1, "addend": 2}
        assert Add().as_dict() == {"summand": 0, "addend": 0}
        with pytest.raises(TypeError, match="AddMessage has 2 fields, not 3"):
            Add(1, 2, 3)

    # -- refusals

    def test_a_writer_cannot_send(self, writer):
        with pytest.raises(errors.EnqueueDeniedError) as caught:
            writer.msgq_enqueue(Reset())
        assert caught.value.message == (
            "This interface instance 'a' of type 'SampleInterface' IS opened for writing, "
            "but messages can only be enqueued on reading interfaces."
        )

    @pytest.mark.parametrize(
        ("operation", "call"),
        [
            ("append", lambda reader: reader.msgq_append(Reset())),
            ("first", Interface.msgq_first),
            ("pop", Interface.msgq_pop),
            ("remove id", lambda reader: reader.msgq_remove(1)),
            ("remove msg", lambda reader: reader.msgq_remove(Reset())),
            ("size", Interface.msgq_size),
            ("empty", Interface.msgq_empty),
            ("flush", Interface.msgq_flush),
            ("begin", Interface.msgq_iter),
        ],
    )
    def test_a_reader_has_no_queue(self, reader, operation: str, call: Callable[[Interface], object]):
        with pytest.raises(errors.QueueAccessError) as caught:
            call(reader)
        assert caught.value.message == (
            "This interface instance 'a' of type 'SampleInterface' is not opened for writing. "
            f"Cannot work on message queue on reading instance of an interface ({operation})."
        )

    def test_a_message_of_another_interface_is_refused(self, reader, writer):
        for message in (OtherInterface.SetCountMessage(1), OtherInterface.MESSAGES["SetCountMessage"]()):
            with pytest.raises(errors.ForeignMessageError) as caught:
                reader.msgq_enqueue(message)
            assert caught.value.message == (
                "Message of type 'SetCountMessage' cannot be enqueued in interface of type 'SampleInterface'"
            )
        assert writer.msgq_empty()

    def test_message_of_equal_class_is_accepted(self, pair, reader, writer):
        reader.msgq_enqueue(remade_sample_interface().AddMessage(1, 2))
        pair.settle()
        assert writer.msgq_first().addend == 2

    def test_a_message_of_another_version_is_refused(self, reader, writer):
        with pytest.raises(errors.ForeignMessageError):
            reader.msgq_enqueue(NewerSampleInterface.AddMessage(1, 2))

    def test_message_cannot_be_sent_twice(self, pair, reader, writer):
        message = Reset()
        reader.msgq_enqueue(message)
        pair.settle()
        with pytest.raises(errors.MessageAlreadyQueuedError) as caught:
            reader.msgq_enqueue(message)
        assert caught.value.message == "Message already enqueued in another MessageQueue."
        assert writer.msgq_size() == 1
        assert reader.msgq_enqueue(Reset()) == 2

    def test_copies_can_be_sent_again(self, pair, reader, writer):
        message = Add(1, 2)
        assert [reader.msgq_enqueue_copy(message), message.id] == [1, 1]
        message.summand = 5
        assert [reader.msgq_enqueue_copy(message), message.id] == [2, 2]
        pair.settle()
        assert [queued.summand for queued in writer.msgq_iter()] == [1, 5]
        assert all(queued is not message for queued in writer.msgq_iter())
        assert message.source_id == reader.serial
        assert not message.enqueued

    def test_message_without_writer_is_error_of_sender(self, pair, reader):
        lines = pair.collect(LogLine)
        with pytest.raises(errors.NoWriterError) as caught:
            reader.msgq_enqueue(Reset())
        assert caught.value.message == "No writing instance for interface SampleInterface::a"
        text = (
            f"Cannot transmit message from sender {threading.current_thread().name} via interface a "
            "(type SampleInterface), no writing instance exists!"
        )
        assert [(line.level, line.component, line.text) for line in lines] == [
            (Level.WARN, "BlackBoard", text),
        ]

    def test_full_queue_refuses_messages(self, pair):
        reader = pair.near.open_for_reading(SampleInterface, "bounded")
        writer = pair.far.open_for_writing(SampleInterface, "bounded", queue_limit=2)
        reader.msgq_enqueue(Reset())
        reader.msgq_enqueue(Reset())
        with pytest.raises(errors.QueueFullError, match=r"SampleInterface::bounded is full \(2 messages\)"):
            reader.msgq_enqueue(Reset())
        pair.settle()
        writer.msgq_pop()
        assert reader.msgq_enqueue(Reset()) == 4

    # -- proxies

    def test_proxy_keeps_source_of_message(self, pair, reader, writer):
        origin = pair.near.open_for_reading(SampleInterface, "origin")
        relay = pair.far.open_for_writing(SampleInterface, "origin")
        origin.msgq_enqueue(Add(1, 2))
        pair.settle()
        relayed = relay.msgq_pop().copy()
        reader.msgq_enqueue(relayed, proxy=True)
        pair.settle()
        got = writer.msgq_first()
        assert (got.source_id, got.sender_id, got.summand) == (origin.serial, reader.serial, 1)

    def test_message_has_name_of_sender_thread(self, pair, reader, writer):
        def send() -> None:
            reader.msgq_enqueue(Reset())

        thread = threading.Thread(target=send, name="SenderThread")
        thread.start()
        thread.join()
        pair.settle()
        assert writer.msgq_first().sender_thread_name == "SenderThread"

    # -- recording

    def test_bus_gets_messages_with_outcome(self, pair, reader, writer):
        class Declines(Listener):
            def message_received(self, interface, message):
                return False

        events = pair.collect(InterfaceMessage)
        reader.msgq_enqueue(Add(3, 4))
        pair.settle()
        declines = Declines()
        pair.far.register_listener(declines, writer)
        reader.msgq_enqueue(Reset())
        pair.settle()
        told = [(event.time_us, event.uid, event.message, event.msgid, event.values) for event in events]
        now_us, uid = pair.clock.now_us(), "SampleInterface::a"
        assert told == [
            (now_us, uid, "AddMessage", 1, {"summand": 3, "addend": 4}),
            (now_us, uid, "ResetMessage", 2, {}),
        ]
        assert list(events[0].values) == ["summand", "addend"]
        self.check_outcomes(events)

    def check_outcomes(self, events: list[InterfaceMessage]) -> None:
        assert [event.outcome for event in events] == ["queued", "handled"]
        assert [event.sender for event in events] == ["r", "r"]

    def test_bus_gets_refused_message(self, pair, reader):
        events = pair.collect(InterfaceMessage)
        with pytest.raises(errors.NoWriterError):
            reader.msgq_enqueue(Reset())
        pair.settle()
        self.check_refused(events)

    def check_refused(self, events: list[InterfaceMessage]) -> None:
        assert [(event.outcome, event.message) for event in events] == [("refused", "ResetMessage")]
