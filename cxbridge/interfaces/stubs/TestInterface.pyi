"""The interface type TestInterface.

Made by 'cxbridge interface compile': do not edit, generate it again.
"""

# ruff: noqa: E501, FBT001, FBT002, N801, N802, N815, PLR0913, PLR0917, PYI021, RUF100, TC001, TC003

from enum import IntEnum
from typing import ClassVar

from cxbridge.interfaces.instance import Interface, Message

class TestInterface(Interface):
    """The interface type TestInterface.

    For tests of the blackboard and for trying things out.
    """

    class TestEnum(IntEnum):
        """Values of type TestEnum.

        An enum.
        """

        TEST_ENUM_1 = 0
        """Its first item."""

        TEST_ENUM_2 = 1
        """Its second item."""

    TEST_ENUM_1: ClassVar[TestEnum]
    TEST_ENUM_2: ClassVar[TestEnum]

    TEST_CONSTANT: ClassVar[int]
    """An integer."""

    TEST_FLOAT_CONSTANT: ClassVar[float]
    """A float that 32 bits cannot hold exactly."""

    class SetTestIntMessage(Message):
        """The message SetTestIntMessage.

        Write a value into test_int.
        """

        test_int: int
        """A signed integer."""

        def __init__(
            self,
            test_int: int = 0,
        ) -> None: ...

    class SetTestStringMessage(Message):
        """The message SetTestStringMessage.

        Write a text into test_string.
        """

        test_string: str
        """A text."""

        def __init__(
            self,
            test_string: str = "",
        ) -> None: ...

    class CalculateMessage(Message):
        """The message CalculateMessage.

        Add two numbers and write the sum into result.
        """

        summand: int
        """One number."""

        addend: int
        """The other number."""

        def __init__(
            self,
            summand: int = 0,
            addend: int = 0,
        ) -> None: ...

    test_bool: bool
    """A bool."""

    test_int: int
    """A signed integer."""

    flags: int
    """A byte."""

    test_string: str
    """A text."""

    result: int
    """The sum, after a message Calculate."""

    test_uint: int
    """An unsigned integer."""
