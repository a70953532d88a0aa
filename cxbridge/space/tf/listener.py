"""Reading of a blackboard's TransformInterfaces into a buffer."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING, Any, Final

from cxbridge.blackboard.listeners import EventKind, Listener, Observer
from cxbridge.errors import BlackBoardError
from cxbridge.space.tf.buffer import StampedTransform, TransformBuffer
from cxbridge.space.tf.errors import InvalidRotationError
from cxbridge.space.tf.geometry import Transform

if TYPE_CHECKING:
    from cxbridge.blackboard.base import BlackBoard
    from cxbridge.interfaces.instance import Interface

INTERFACE_TYPE: Final = "TransformInterface"

ID_GLOB: Final = "/tf*"
"""The pattern for the ids of interfaces with transforms, as in Fawkes."""


class TransformListener(Listener, Observer):
    """Reads all present and future TransformInterfaces whose id starts with ``/tf``.

    :param buffer: gets the transforms; by default a new buffer.
    :param owner: the owner of the opened interfaces.
    """

    def __init__(
        self, board: BlackBoard, buffer: TransformBuffer | None = None, *, owner: str = "tf"
    ) -> None:
        self.buffer: Final = buffer or TransformBuffer()
        self._board = board
        self._owner = owner
        self._lock = threading.RLock()
        self._instances: dict[str, Interface | None] = {}  # by id; None while the interface is being opened
        board.register_observer(self, INTERFACE_TYPE, ID_GLOB)
        for existing in board.list(INTERFACE_TYPE, ID_GLOB):
            self.interface_created(existing.type, existing.id)

    def interface_created(self, interface_type: str, interface_id: str) -> None:
        """Open a new interface."""
        with self._lock:
            if interface_id in self._instances:
                return
            # opening may create the interface, which would notify this method again
            self._instances[interface_id] = None
            try:
                instance = self._board.open_for_reading(interface_type, interface_id, owner=self._owner)
            except BlackBoardError:  # another version of the type, which cannot be read
                del self._instances[interface_id]
                return
            self._instances[interface_id] = instance
        self._board.register_listener(self, instance, EventKind.DATA_REFRESHED, EventKind.WRITER_REMOVED)
        self.data_refreshed(instance)

    def data_refreshed(self, interface: Any) -> None:
        """Store a written transform."""
        interface.read()
        if not interface.child_frame:
            return  # the interface was never written
        stamped = StampedTransform(
            Transform(tuple(interface.translation), tuple(interface.rotation)),
            interface.timestamp_us,
            interface.frame,
            interface.child_frame,
        )
        try:
            self.buffer.set_transform(stamped, static=interface.static_transform)
        except InvalidRotationError:
            return  # as in Fawkes: the interface may not be initialised yet

    def writer_removed(self, interface: Interface, serial: object) -> None:  # noqa: ARG002 - a listener's signature
        """Close an interface that only this listener has open, as Fawkes does: its memory is freed."""
        if interface.num_readers <= 1:
            self._instances.pop(interface.id, None)
            self._board.close(interface)

    def close(self) -> None:
        """Stop listening; the buffer is kept."""
        self._board.unregister_observer(self)
        for instance in self._instances.values():
            if instance is not None:
                self._board.close(instance)
        self._instances.clear()
