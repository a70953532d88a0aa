"""The blackboard for Lua, where a number stands for an open interface, and a name for a field."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from cxbridge.errors import InterfaceError
from cxbridge.skiller.lua.host import from_lua, guard, is_plain, to_lua

if TYPE_CHECKING:
    from cxbridge.blackboard.base import BlackBoard
    from cxbridge.interfaces.block import Block
    from cxbridge.interfaces.instance import Interface
    from cxbridge.interfaces.schema import FieldSchema

_InterfaceKey = tuple[str, str, bool]  # type and id of an interface, and whether it is open for writing


class InterfacePool:
    """Instances shared by several Lua states, closed by their last user.

    :param owner: the owner of the instances in lists and messages.
    """

    def __init__(self, board: BlackBoard, owner: str) -> None:
        self.board = board
        self.owner = owner
        # the shared instance, once for each of its users
        self._shared: dict[_InterfaceKey, list[Interface]] = {}

    def open(self, type_name: str, interface_id: str, *, writing: bool) -> Interface:
        """Open a private instance.

        :raises BlackBoardError: if the blackboard refuses.
        """
        if writing:
            return self.board.open_for_writing(type_name, interface_id, owner=self.owner)
        instance = self.board.open_for_reading(type_name, interface_id, owner=self.owner)
        # while loading, a skill file may build a label from a field, which needs a value by then
        instance.read()
        return instance

    def share(self, type_name: str, interface_id: str, *, writing: bool) -> Interface:
        """Return the shared instance, opened if necessary.

        :raises BlackBoardError: if the blackboard refuses.
        """
        users = self._shared.setdefault((type_name, interface_id, writing), [])
        if not users:
            users.append(self.open(type_name, interface_id, writing=writing))
        else:
            users.append(users[0])
        return users[-1]

    def give_back(self, instance: Interface) -> None:
        """Release an instance; the last user of a shared instance closes the instance."""
        for key, users in self._shared.items():
            if users and users[0] is instance:
                users.pop()
                if users:
                    return
                del self._shared[key]
                break
        self.board.close(instance)


MakeTable = Callable[[Mapping[Any, Any]], Any]
"""Makes a Lua table from a mapping."""

_TABLE_FUNCTIONS = frozenset(["set", "send"])  # functions whose arguments may be Lua tables
# the interfaces of one Lua state need a limit, because their memory is outside of Lua's limit; the number is
# chosen freely
_MAX_OPEN_INTERFACES = 2000

_PROPERTIES = frozenset(
    ["has_writer", "num_readers", "changed", "refreshed", "is_writer", "type", "id", "uid", "mem_serial"]
)


class BoardAccess:
    """The open interfaces of one Lua state.

    :param pool: opens the instances.
    """

    def __init__(self, pool: InterfacePool, make_table: MakeTable) -> None:
        self._pool = pool
        self._make_table = make_table
        self._open_interfaces: dict[int, Interface] = {}
        self._readers: list[Interface] = []
        self._writers: list[Interface] = []
        self._last_handle = 0

    def functions_by_name(self) -> dict[str, Callable[..., Any]]:
        """Return the functions by their Lua names."""
        # `and None`: Lua needs no result of these functions, and must not get a Python object (a message)
        functions: dict[str, Callable[..., Any]] = {
            "describe": self._describe,
            "open": self._open,
            "close": self._close,
            "read": lambda handle: self._find_interface(handle).read() and None,
            "write": lambda handle: self._find_interface(handle).write(),
            "read_all": self._read_all,
            "write_changed": self._write_changed,
            "query": self._query,
            "timestamp": lambda handle: self._find_interface(handle).timestamp_us,
            "get": self._get,
            "set": self._set,
            "send": self._send,
            "queue_first": self._queue_first,
            "queue_size": lambda handle: self._find_interface(handle).msgq_size(),
            "queue_pop": lambda handle: self._find_interface(handle).msgq_pop() and None,
            "queue_flush": lambda handle: self._find_interface(handle).msgq_flush(),
            "queue_remove": lambda handle, number: (
                self._find_interface(handle).msgq_remove(int(number)) and None
            ),
        }
        return {
            name: guard(function, takes_tables=name in _TABLE_FUNCTIONS)
            for name, function in functions.items()
        }

    def close_all(self) -> None:
        """Close all interfaces, at the end of the Lua state."""
        for instance in self._open_interfaces.values():
            self._pool.give_back(instance)
        # Lua references this object; a reference back to Lua would be a cycle that no garbage collector sees
        self._make_table = dict
        self._open_interfaces.clear()
        self._readers.clear()
        self._writers.clear()

    def _find_interface(self, handle: int) -> Interface:
        return self._open_interfaces[int(handle)]

    def _open(self, type_name: str, interface_id: str, for_writing: object, shared: object) -> int:
        if len(self._open_interfaces) >= _MAX_OPEN_INTERFACES:
            raise InterfaceError(f"skills may not open more than {_MAX_OPEN_INTERFACES} interfaces")
        acquire = self._pool.share if shared else self._pool.open
        instance = acquire(type_name, from_lua(interface_id), writing=bool(for_writing))
        (self._writers if for_writing else self._readers).append(instance)
        self._last_handle += 1
        self._open_interfaces[self._last_handle] = instance
        return self._last_handle

    def _close(self, handle: int) -> None:
        instance = self._open_interfaces.pop(int(handle))
        self._readers = [other for other in self._readers if other is not instance]
        self._writers = [other for other in self._writers if other is not instance]
        self._pool.give_back(instance)

    def _read_all(self) -> None:
        for instance in self._readers:
            instance.read()

    def _write_changed(self) -> None:
        for instance in self._writers:
            if instance.changed:
                instance.write()

    def _query(self, handle: int, name: str) -> Any:
        instance = self._find_interface(handle)
        if name == "serial":
            return str(instance.serial)
        if name not in _PROPERTIES:
            raise ValueError(f"an interface has no property '{name}'")
        value = getattr(instance, name)
        return to_lua(value) if isinstance(value, str) else value

    def _describe(self, type_name: str) -> Any:
        schema = self._pool.board.registry.get(type_name).SCHEMA
        constants: dict[str, Any] = {item.name: item.value for enum in schema.enums for item in enum.items}
        for constant in schema.constants:
            value = constant.value
            constants[constant.name] = to_lua(value) if isinstance(value, str) else value
        messages = [
            self._make_table(
                {
                    "name": message.name,
                    "order": self._make_list([field.name for field in message.fields]),
                    "fields": self._make_field_table(message.fields),
                }
            )
            for message in schema.messages
        ]
        return self._make_table(
            {
                "fields": self._make_field_table(schema.fields),
                "constants": self._make_table(constants),
                "messages": self._make_list(messages),
            }
        )

    def _make_field_table(self, fields: tuple[FieldSchema, ...]) -> Any:
        return self._make_table(
            {
                field.name: self._make_table(
                    {"type": field.type, "length": field.runtime_length, "array": field.is_array}
                )
                for field in fields
            }
        )

    def _make_list(self, items: list[Any]) -> Any:
        return self._make_table(dict(enumerate(items, start=1)))

    def _get(self, handle: int, name: str, index: float | None = None) -> Any:
        """Return a field, or the element of an array at an index from 0."""
        return self._to_lua(self._find_interface(handle).get(name, None if index is None else int(index)))

    def _to_lua(self, value: Any) -> Any:
        """Return the value of a field for Lua; an array becomes a table."""
        return (
            self._make_list([*map(_convert_value, value)])
            if isinstance(value, tuple)
            else _convert_value(value)
        )

    def _set(self, handle: int, name: str, value: Any, index: float | None = None) -> None:
        _assign(self._find_interface(handle), name, value, index)

    def _send(self, handle: int, message_type: str, values: Any) -> int:
        instance = self._find_interface(handle)
        message = instance.create_message(message_type)
        for name, value in values.items():
            if not is_plain(value):
                # a table, whose indexes begin with 1; for other Lua values, items() raises an error
                for index, element in value.items():
                    _assign(message, name, element, index - 1)
            else:
                _assign(message, name, value, None)
        return instance.msgq_enqueue(message)

    def _queue_first(self, handle: int) -> Any:
        """Return type, fields and envelope (ids and sender) of the first message; None in an empty queue."""
        message = self._find_interface(handle).msgq_first()
        if message is None:
            return None
        values = {name: self._to_lua(value) for name, value in message.as_dict().items()}
        envelope = {
            "id": message.id,
            "sender_id": str(message.sender_id or ""),
            "source_id": str(message.source_id or ""),
            "sender_thread_name": to_lua(message.sender_thread_name),
        }
        return message.type, self._make_table(values), self._make_table(envelope)


def _convert_value(value: Any) -> Any:
    if isinstance(value, str):
        return to_lua(value)
    # an item of an enum becomes a plain number
    return int(value) if isinstance(value, int) and not isinstance(value, bool) else value


def _assign(block: Block, name: str, value: Any, index: float | None) -> None:
    """Set a field from a Lua value with tolua's conversions; nil leaves the field unchanged."""
    if value is None:
        return
    field = block.field(name)
    if not is_plain(value):
        raise InterfaceError(f"{name} of type {field.type} cannot be a table or a function")
    field_value: Any
    if field.is_string:
        if not isinstance(value, str | int | float):
            raise InterfaceError(f"{name} of type string cannot be {value!r}")
        # Lua converts numbers to text with this format
        field_value = from_lua(value) if isinstance(value, str) else f"{value:.14g}"
    elif field.storage.python_type is bool:
        field_value = bool(value)
    elif isinstance(value, str | bool | None):
        raise InterfaceError(
            f"{name} of type {field.type} cannot be {value!r}", hint="the value must be a number"
        )
    elif field.storage.python_type is float:
        field_value = float(value)
    else:
        field_value = int(value)
    if index is not None:
        block.get(name, int(index))  # raises for an unknown element
        elements = list(block.get(name))
        elements[int(index)] = field_value
        field_value = elements
    # not by set(), which never marks a block as changed: at the end of a loop, only marked blocks are written
    block.ACCESSORS[name].fset(block, field_value)
