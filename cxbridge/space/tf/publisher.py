"""Publishing of a transform on a blackboard."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from cxbridge.space.tf.buffer import StampedTransform

if TYPE_CHECKING:
    from cxbridge.blackboard.base import BlackBoard


class TransformPublisher:
    """Writes transforms to one TransformInterface.

    :param name: the interface's id; an id without a leading slash gets the prefix ``/tf/``.
    :raises BlackBoardError: if the interface has another writer.
    """

    def __init__(self, board: BlackBoard, name: str, *, owner: str = "tf") -> None:
        self._board = board
        interface_id = name if name.startswith("/") else f"/tf/{name}"
        # the class of the interface is made from XML at run time, so it has no static type
        self._interface: Any = board.open_for_writing("TransformInterface", interface_id, owner=owner)
        self._interface.auto_timestamping = False  # the time stamp is that of the transform

    def send(self, stamped: StampedTransform, *, static: bool = False) -> None:
        """Publish a transform.

        :raises InterfaceError: if a frame's name is too long.
        """
        interface = self._interface
        interface.frame, interface.child_frame = stamped.frame, stamped.child_frame
        interface.static_transform = static
        interface.translation, interface.rotation = stamped.transform.translation, stamped.transform.rotation
        interface.set_timestamp(stamped.stamp_us)
        interface.write()

    def close(self) -> None:
        self._board.close(self._interface)
