"""Tells the event bus of messages to the writers of interfaces; docs/trace-model.md lists the outcomes."""

from __future__ import annotations

from cxbridge.events import EventBus, InterfaceMessage
from cxbridge.interfaces.message import Message

HANDLED = "handled"
QUEUED = "queued"
REFUSED = "refused"
SENT = "sent"


def tell_message(
    bus: EventBus | None, time_us: int, uid: str, sender: str, message: Message, outcome: str = ""
) -> None:
    """Emit what became of a message, when somebody wants to know.

    :param bus: None: nobody does.
    :param uid: of the interface that it was sent to.
    :param sender: owner of the instance that sent it.
    :param outcome: empty: it was not refused, and tells itself whether it came into a queue.
    """
    if bus is not None and bus.wants(InterfaceMessage):
        outcome = outcome or (QUEUED if message.enqueued else HANDLED)
        values = message.as_dict()
        bus.emit(InterfaceMessage(time_us, uid, message.type, message.id, sender, outcome, values))
