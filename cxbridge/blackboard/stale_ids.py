"""Exclusive control on any blackboard, and message ids that a remote Fawkes counts.

A Fawkes gives the ids to messages that reach it, counted for each sender from 1. So the next message may get
the id that the interface shows already, of an earlier sender: what became of that one's message would be
taken for the answer to ours. Or it may get 0, which is not a message's. Our own blackboards leave both out
(see
:mod:`~cxbridge.interfaces.message_ids`); to a Fawkes something harmless is sent first, which takes the id.
"""

from __future__ import annotations

from typing import Final

from cxbridge.interfaces.instance import Interface

ACQUIRE: Final = "AcquireControlMessage"
RELEASE: Final = "ReleaseControlMessage"
"""How an interface that can be controlled exclusively calls taking control and giving it back."""


def skip_stale_ids(instance: Interface, *, controls: bool) -> int:
    """Ensure that the next message gets an id that is neither 0 nor the id that the interface shows.

    A Skiller ignores both messages that may be sent: who has control and acquires it again keeps it, and
    who never asked for control has nothing to release. Interfaces without control are left alone.

    :param instance: opened for reading.
    :param controls: whether the instance has asked for control, so that it may have it.
    :returns: how many messages were sent.
    :raises BlackBoardError: when they cannot be sent.
    """
    spare = ACQUIRE if controls else RELEASE
    if spare not in instance.MESSAGES:
        return 0
    sent = 0
    while instance.next_id_is_stale:
        instance.msgq_enqueue(instance.create_message(spare))
        sent += 1
    return sent
