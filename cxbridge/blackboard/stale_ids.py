"""Exclusive control on any blackboard, and message ids of a remote Fawkes.

A Fawkes numbers the messages of each sender from 1. The next message may therefore get the id that the
interface already shows for another sender, and the result of the earlier message would be taken for its own.
It may also get 0, which means no message. The blackboards of cxbridge leave out both ids, see

:mod:`~cxbridge.interfaces.message_ids`. For a Fawkes, a harmless message uses up the id.
"""

from __future__ import annotations

from typing import Final

from cxbridge.interfaces.instance import Interface

ACQUIRE: Final = "AcquireControlMessage"
RELEASE: Final = "ReleaseControlMessage"
"""The messages that acquire and release exclusive control."""


def skip_stale_ids(instance: Interface, *, controls: bool) -> int:
    """Send harmless messages until the next id is neither 0 nor the id that the interface shows.

    A Skiller ignores both kinds of message: a controller that acquires again keeps control, and a sender
    without control has nothing to release. Interfaces without control are left alone.

    :param controls: whether the instance may have control.
    :returns: the number of messages sent.
    :raises BlackBoardError: if they cannot be sent.
    """
    spare = ACQUIRE if controls else RELEASE
    if spare not in instance.MESSAGES:
        return 0
    sent = 0
    while instance.next_id_is_stale:
        instance.msgq_enqueue(instance.create_message(spare))
        sent += 1
    return sent
