"""The base class of ROS plug-ins: facts and functions for messages."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Final, Generic, TypeVar

from cxbridge.errors import ClipsError, Ros2Error
from cxbridge.executive.host.values import ExternalAddress, Value
from cxbridge_ros2cx.cx.plugin import CxPlugin
from cxbridge_ros2cx.cx.ros.messages import Addresses, FieldError

if TYPE_CHECKING:
    from cxbridge.executive.host.environment import ClipsEnvironment
    from cxbridge_ros2.names import TypeName
    from cxbridge_ros2cx.cx.ros.messages import MessageTable
    from cxbridge_ros2cx.cx.ros.node import RosNode

STRING: Final = "(type STRING)"
ADDRESS: Final = "(type EXTERNAL-ADDRESS)"
INTEGER: Final = "(type INTEGER)"
SYMBOL: Final = "(type SYMBOL)"
FLOAT: Final = "(type FLOAT)"

T = TypeVar("T")


class Handles(Generic[T]):
    """Objects by their addresses in rules.

    :param kind: the kind of the objects, for errors.
    """

    def __init__(self, kind: str, first: int) -> None:
        self._kind = kind
        self._addresses = Addresses(first)
        self._objects: dict[ExternalAddress, T] = {}

    def add(self, item: T) -> ExternalAddress:
        address = self._addresses.take()
        self._objects[address] = item
        return address

    def find(self, address: ExternalAddress) -> T:
        item = self._objects.get(address)
        if item is None:
            raise ClipsError(f"Unknown {self._kind}")
        return item

    def destroy(self, address: ExternalAddress) -> None:
        """Remove an object; unknown addresses are ignored."""
        if self._objects.pop(address, None) is not None:
            self._addresses.free(address)


class RosPlugin(CxPlugin):
    """A plug-in with functions and facts for messages."""

    @property
    def ros(self) -> RosNode:
        return self.context.ros

    @property
    def messages(self) -> MessageTable:
        return self.context.ros.messages

    def template(self, env: ClipsEnvironment, name: str, /, **slots: str) -> None:
        """Define a deftemplate unless the name is taken.

        :param slots: the attributes of each slot; ``_`` in its name becomes ``-``.
        """
        if not env.has_template(name):
            text = " ".join(f"(slot {slot.replace('_', '-')} {kind})" for slot, kind in slots.items())
            env.build(f"(deftemplate {name} {text})")

    def add_fact(self, env: ClipsEnvironment, template: str, slots: Mapping[str, Value]) -> int | None:
        """Assert a fact of a message for the next run of the rules."""
        with env.lock:
            return env.assert_fact(template, slots)

    def define(
        self, env: ClipsEnvironment, name: str, function: Callable[..., Value], types: str, result: str = "*"
    ) -> None:
        """Define a function; a ROS error becomes an error of the calling rule.

        :param types: the types of its arguments, separated by ``;``.
        """

        def call(*arguments: Value) -> Value:
            try:
                return function(*arguments)
            except Ros2Error as error:
                raise ClipsError(str(error)) from None

        count = len(types.split(";")) if types else 0
        env.define(name, call, count, types=f"{result};{types}" if types else result)

    # --- messages -----------------------------------------------------------------------------------------

    def define_message(
        self,
        env: ClipsEnvironment,
        prefix: str,
        kind: TypeName,
        create: str,
        destroy: str,
    ) -> None:
        """Define the message functions of a generated plug-in."""
        self.define(env, f"{prefix}{create}", lambda: self.messages.create(kind), "")
        self.define(env, f"{prefix}{destroy}", self.messages.destroy, "e")

        def get(address: ExternalAddress, field: str) -> Value:
            try:
                return self.messages.get(address, field)
            except FieldError:
                raise ClipsError(f"cannot retrieve unknown slot name {field}") from None

        self.define(env, f"{prefix}get-field", get, "e;sy")
        self.define(env, f"{prefix}set-field", self.messages.set, "e;sy;*")
