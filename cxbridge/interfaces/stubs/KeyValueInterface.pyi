"""The interface type KeyValueInterface.

Made by 'cxbridge interface compile': do not edit, generate it again.
"""

# ruff: noqa: E501, FBT001, FBT002, N801, N802, N815, PLR0913, PLR0917, PYI021, RUF100, TC001, TC003

from enum import IntEnum
from typing import ClassVar

from cxbridge.interfaces.instance import Interface

class KeyValueInterface(Interface):
    """The interface type KeyValueInterface.

    One value under a key, where an interface type of its own is not worth it.
    """

    class ValueType(IntEnum):
        """Values of type ValueType.

        Which field holds the value.
        """

        TypeStr = 0
        """It is a text: value_string."""

        TypeInt = 1
        """It is signed: value_int."""

        TypeUint = 2
        """It is unsigned: value_uint."""

        TypeBool = 3
        """It is true or false: value_bool."""

        TypeByte = 4
        """It is a byte: value_byte."""

        TypeFloat = 5
        """It is a float: value_float."""

    TypeStr: ClassVar[ValueType]
    TypeInt: ClassVar[ValueType]
    TypeUint: ClassVar[ValueType]
    TypeBool: ClassVar[ValueType]
    TypeByte: ClassVar[ValueType]
    TypeFloat: ClassVar[ValueType]

    key: str
    """The key."""

    value_type: ValueType
    """Which of the fields below counts."""

    value_string: str
    """The value as a text."""

    value_uint: int
    """The value, unsigned."""

    value_int: int
    """The value, signed."""

    value_bool: bool
    """The value as true or false."""

    value_byte: int
    """The value as a byte."""

    value_float: float
    """The value as a float."""
