"""Publishes a transform on a blackboard."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from cxbridge.space.tf.buffer import StampedTransform

if TYPE_CHECKING:
    from cxbridge.blackboard.base import BlackBoard


class TransformPublisher:
    """Writes one TransformInterface.

    :param name: the interface's id; without a leading slash it is put below ``/tf/``.
    :raises BlackBoardError: when it has another writer.
    """

    def __init__(self, board: BlackBoard, name: str, *, owner: str = "tf") -> None:
        self._board = board
        interface_id = name if name.startswith("/") else f"/tf/{name}"
        # The fields of the interface come from its XML definition: there is no static type for them here.
        self._interface: Any = board.open_for_writing("TransformInterface", interface_id, owner=owner)
        self._interface.auto_timestamping = False

    def send(self, entry: StampedTransform, *, static: bool = False) -> None:
        """Publish a transform.

        :raises InterfaceError: when a frame's name does not fit.
        """
        interface = self._interface
        interface.frame, interface.child_frame = entry.frame, entry.child_frame
        interface.static_transform = static
        interface.translation, interface.rotation = entry.transform.translation, entry.transform.rotation
        interface.set_timestamp(entry.stamp_us)
        interface.write()

    def close(self) -> None:
        """Close the interface."""
        self._board.close(self._interface)
