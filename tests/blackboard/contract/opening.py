"""Opening, closing, listing: one writer, many readers."""

from __future__ import annotations

import pytest

from cxbridge.blackboard import errors
from tests.blackboard.contract import BoardPair, Contract
from tests.blackboard.samples import NewerSampleInterface, SampleInterface

SAMPLE = "SampleInterface"


class OpeningContract(Contract):
    def test_instance_has_type_id_owner_and_mode(self, pair: BoardPair):
        reader = pair.near.open_for_reading(SAMPLE, "a", owner="me")
        writer = pair.near.open_for_writing(SampleInterface, "a", owner="you")
        assert (reader.type, reader.id, reader.uid, reader.owner) == (SAMPLE, "a", "SampleInterface::a", "me")
        assert (reader.is_writer, writer.is_writer) == (False, True)
        assert (reader.valid, writer.valid) == (True, True)
        assert reader.hash == SampleInterface.SCHEMA.hash
        assert reader.serial != writer.serial
        assert reader.mem_serial == writer.mem_serial
        assert repr(reader) == "<SampleInterface::a opened for reading by me>"

    def test_first_reader_has_zeros_and_no_writer(self, pair: BoardPair):
        reader = pair.near.open_for_reading(SAMPLE, "a")
        assert reader.read() is False
        assert (reader.has_writer, reader.writer, reader.timestamp_us) == (False, "", 0)
        assert reader.to_bytes() == bytes(SampleInterface.SCHEMA.datasize)

    def test_a_second_writer_is_refused(self, pair: BoardPair):
        pair.far.open_for_writing(SAMPLE, "a", owner="the first")
        with pytest.raises(errors.WriterActiveError) as caught:
            pair.near.open_for_writing(SAMPLE, "a")
        assert caught.value.message == "There is already a writer on interface 'a' of type 'SampleInterface'"
        assert "the first" in str(caught.value)

    @pytest.mark.parametrize("mode", ["open_for_reading", "open_for_writing"])
    def test_another_version_of_the_type_is_refused(self, pair: BoardPair, mode: str):
        pair.far.open_for_reading(SampleInterface, "a")
        with pytest.raises(errors.VersionMismatchError) as caught:
            getattr(pair.near, mode)(NewerSampleInterface, "a")
        assert (
            caught.value.message
            == "Interface versions do not match, need to update and recompile interfaces?"
        )
        assert "00000000000000000000000000000000" in str(caught.value)

    def test_refused_open_leaves_no_instance(self, pair: BoardPair):
        pair.far.open_for_writing(SAMPLE, "a", owner="w")
        with pytest.raises(errors.WriterActiveError):
            pair.near.open_for_writing(SAMPLE, "a", owner="second")
        (info,) = pair.near.list_all()
        assert (info.writer, info.readers) == ("w", ())

    @pytest.mark.parametrize(
        ("interface_type", "interface_id", "text"),
        [
            ("", "a", "Interface type may not be empty"),
            (SAMPLE, "", "Interface ID may not be empty"),
            ("T" * 49, "a", f"Interface type '{'T' * 49}' too long, maximum length is 48"),
            (SAMPLE, "i" * 65, f"Interface ID '{'i' * 65}' too long, maximum length is 64"),
            (SAMPLE, "a\0b", "Interface ID 'a\\x00b' may not contain NUL"),
        ],
    )
    def test_unusable_names_are_refused(
        self, pair: BoardPair, interface_type: str, interface_id: str, text: str
    ):
        for open_it in (pair.near.open_for_reading, pair.near.open_for_writing):
            with pytest.raises(errors.InvalidNameError) as caught:
                open_it(interface_type, interface_id)
            assert caught.value.message == text
        assert list(pair.near.list_all()) == []

    def test_unknown_type_is_refused_with_reason_of_registry(self, pair: BoardPair):
        with pytest.raises(errors.UnknownTypeError) as caught:
            pair.near.open_for_reading("NoInterface", "a")
        assert caught.value.message == "Interface of type 'NoInterface' not found. Module file not found."
        assert "not among the samples" in str(caught.value)

    def test_owners_and_counts(self, pair: BoardPair):
        first = pair.near.open_for_reading(SAMPLE, "a", owner="r1")
        pair.far.open_for_reading(SAMPLE, "a", owner="r2")
        writer = pair.far.open_for_writing(SAMPLE, "a", owner="w")
        pair.settle()
        for instance in (first, writer):
            assert (instance.has_writer, instance.writer) == (True, "w")
            assert (instance.num_readers, instance.readers) == (2, ("r1", "r2"))

    def test_list_has_all_data_of_interface(self, pair: BoardPair):
        writer = pair.far.open_for_writing(SAMPLE, "a", owner="w")
        pair.near.open_for_reading(SAMPLE, "a", owner="r")
        writer.mark_data_refreshed()
        pair.publish(writer)
        (info,) = pair.near.list_all()
        assert (info.type, info.id, info.uid) == (SAMPLE, "a", "SampleInterface::a")
        assert info.hash == SampleInterface.SCHEMA.hash
        assert (info.has_writer, info.writer, info.num_readers, info.readers) == (True, "w", 1, ("r",))
        assert info.serial == writer.mem_serial
        assert info.timestamp_us == pair.clock.now_us()

    def test_list_by_patterns_has_oldest_first(self, pair: BoardPair):
        for interface_type, interface_id in [(SAMPLE, "b1"), ("OtherInterface", "b1"), (SAMPLE, "a2")]:
            pair.far.open_for_reading(interface_type, interface_id)

        def uids(*globs: str) -> list[str]:
            return [info.uid for info in pair.near.list(*globs)]

        assert uids() == ["SampleInterface::b1", "OtherInterface::b1", "SampleInterface::a2"]
        assert uids("Sample*") == ["SampleInterface::b1", "SampleInterface::a2"]
        assert uids("*", "b?") == ["SampleInterface::b1", "OtherInterface::b1"]
        assert uids("*Interface", "[!b]*") == ["SampleInterface::a2"]
        assert uids("sample*") == []

    def test_closed_writer_is_invalid_and_removed(self, pair: BoardPair):
        reader = pair.near.open_for_reading(SAMPLE, "a")
        writer = pair.far.open_for_writing(SAMPLE, "a")
        pair.far.close(writer)
        pair.settle()
        assert (writer.valid, reader.valid, reader.has_writer) == (False, True, False)
        reader.close()
        pair.settle()
        assert list(pair.far.list_all()) == []

    def test_closed_instance_refuses_write_but_has_uid(self, pair: BoardPair):
        writer = pair.near.open_for_writing(SAMPLE, "a")
        serial = writer.serial
        writer.close()
        with pytest.raises(errors.InvalidInstanceError) as caught:
            writer.write()
        assert caught.value.message == (
            f"The interface SampleInterface::a (instance serial {serial}) is invalid. "
            "You cannot call write() anymore."
        )
        assert writer.uid == "SampleInterface::a"

    def test_shutdown_invalidates_instances_and_board(self, pair: BoardPair):
        reader = pair.near.open_for_reading(SAMPLE, "a")
        serial = reader.serial
        pair.near.shutdown()
        assert not reader.valid
        with pytest.raises(errors.InvalidInstanceError) as caught:
            reader.read()
        assert caught.value.message == (
            f"The interface SampleInterface::a (instance serial {serial}) is invalid. "
            "You cannot call read() anymore."
        )
        with pytest.raises(errors.InvalidInstanceError):
            reader.msgq_enqueue(SampleInterface.ResetMessage())
        with pytest.raises(errors.InvalidInstanceError):
            _ = reader.has_writer
        with pytest.raises(errors.BlackBoardGoneError):
            pair.near.open_for_reading(SAMPLE, "a")
        reader.close()
