"""The outbox of a slow client keeps the newest data of each instance, and each write once."""

from __future__ import annotations

import pytest

from cxbridge_fawkes.network.messages.blackboard import pack_data_frame
from cxbridge_fawkes.network.outbox import CONFLATE_FROM, Outbox

SERIAL = b"s" * 16


def block(number: int) -> bytes:
    return bytes([number]) * 64


def refreshed(number: int) -> bytes:
    return pack_data_frame(SERIAL, block(number), changed=False)


def changed(number: int) -> bytes:
    return pack_data_frame(SERIAL, block(number), changed=True)


def take_all(outbox: Outbox) -> bytes:
    return b"".join(iter(outbox.take_frames, b""))


@pytest.mark.parametrize("room", [0, 1, len(refreshed(1)), 10_000])
def test_write_is_sent_once_if_outbox_fills_between_frames(room: int) -> None:
    """A CHANGED beyond the limit must not add a second REFRESHED of the same write."""
    outbox = Outbox()
    outbox.put_frames(bytes(CONFLATE_FROM - room))
    for number in (1, 2):
        outbox.put_data(SERIAL, block(number), changed=False)
        outbox.put_data(SERIAL, block(number), changed=True)
    sent = take_all(outbox)
    pairs = refreshed(1) + changed(1), refreshed(2) + changed(2)
    assert sent[CONFLATE_FROM - room :] in (pairs[0] + pairs[1], pairs[1])
    assert outbox.queued_bytes == 0


@pytest.mark.parametrize("taken_after", range(1, 7))
def test_write_is_sent_once_if_client_reads_between_frames(taken_after: int) -> None:
    """A CHANGED of older data must not carry the newest data, whose own CHANGED would repeat the write."""
    outbox = Outbox()
    outbox.put_frames(bytes(CONFLATE_FROM))
    sent = b""
    steps = [(number, differs) for number in (1, 2, 3) for differs in (False, True)]
    for count, (number, differs) in enumerate(steps, 1):
        outbox.put_data(SERIAL, block(number), changed=differs)
        if count == taken_after:
            sent = take_all(outbox)
    rest = (sent + take_all(outbox))[CONFLATE_FROM:]
    expected = b""
    for number in (1, 2, 3):
        if refreshed(number) in rest:
            expected += refreshed(number) + changed(number)
    assert rest == expected
    assert refreshed(3) in rest


def test_unchanged_data_does_not_hide_later_change() -> None:
    outbox = Outbox()
    outbox.put_frames(bytes(CONFLATE_FROM))
    outbox.put_data(SERIAL, block(1), changed=False)
    outbox.put_data(SERIAL, block(1), changed=True)
    outbox.put_data(SERIAL, block(2), changed=False)
    sent = take_all(outbox)
    assert sent.endswith(refreshed(2) + changed(2))
    outbox.put_data(SERIAL, block(2), changed=False)
    outbox.put_data(SERIAL, block(3), changed=True)
    assert outbox.take_frames() == refreshed(2) + changed(3)
