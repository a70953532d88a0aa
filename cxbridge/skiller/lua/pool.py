"""Interfaces that outlive a Lua state: a reload hands them over, without closing them."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from cxbridge.blackboard.base import BlackBoard
    from cxbridge.interfaces.instance import Interface

_Key = tuple[str, str, bool]


class InterfacePool:
    """Instances that several Lua states share; each is closed when the last one gives it back.

    :param owner: who opens them, for lists and messages to people.
    """

    def __init__(self, board: BlackBoard, owner: str) -> None:
        self.board = board
        self.owner = owner
        self._shared: dict[_Key, list[Interface]] = {}  # an instance, once for each state that has it

    def open(self, type_name: str, interface_id: str, *, writing: bool) -> Interface:
        """Open a private instance.

        :raises BlackBoardError: when the blackboard refuses.
        """
        if writing:
            return self.board.open_for_writing(type_name, interface_id, owner=self.owner)
        instance = self.board.open_for_reading(type_name, interface_id, owner=self.owner)
        # A label in a skill file may be made of a field: it must have a value when the file is loaded.
        instance.read()
        return instance

    def share(self, type_name: str, interface_id: str, *, writing: bool) -> Interface:
        """Return the instance that all share.

        :raises BlackBoardError: when it must be opened and the blackboard refuses.
        """
        holders = self._shared.setdefault((type_name, interface_id, writing), [])
        if not holders:
            holders.append(self.open(type_name, interface_id, writing=writing))
        else:
            holders.append(holders[0])
        return holders[-1]

    def give_back(self, instance: Interface) -> None:
        """Close an instance, a shared one after its last user."""
        for key, holders in self._shared.items():
            if holders and holders[0] is instance:
                holders.pop()
                if holders:
                    return
                del self._shared[key]
                break
        self.board.close(instance)
