from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Final

from cxbridge.blackboard.base import BlackBoard
from cxbridge.blackboard.listeners import ListenerTable
from cxbridge.interfaces.instance import Interface
from cxbridge.interfaces.message_ids import id_in, id_offset, next_id


class BoardPort:
    """An interface on a blackboard; the transport adds the block and the access to it.

    :param interface_class: the class of the first instance.
    :param mem_serial: the number of the interface on the blackboard.
    """

    def __init__(
        self, board: BlackBoard, interface_class: type[Interface], interface_id: str, mem_serial: int
    ) -> None:
        schema = interface_class.SCHEMA
        self._board: Final = board
        self.interface_class: Final = interface_class
        self.type: Final = schema.name
        self.id: Final = interface_id
        self.key: Final = (schema.name, interface_id)
        self.uid: Final = f"{schema.name}::{interface_id}"
        self.hash: Final = schema.hash
        self.size: Final = schema.datasize
        self.mem_serial = mem_serial
        self.listeners: Final = ListenerTable(board.report_fault)
        self.close: Final[Callable[[Interface], None]] = board.close
        self.now_us: Final[Callable[[], int]] = board.clock.now_us
        self._lock: Final = threading.Lock()
        self._id_at: Final = id_offset(schema)

    def _unshown_id(self, last: int, block: bytes | bytearray) -> int:
        """Return the id after ``last`` that the interface does not show in ``block``."""
        return next_id(last) if self._id_at is None else next_id(last, id_in(block, self._id_at))

    def next_id_is_stale(self, last: int) -> bool:  # noqa: ARG002 - subclasses of Fawkes need it
        """Return False: the ids that this port gives are never stale."""
        return False
