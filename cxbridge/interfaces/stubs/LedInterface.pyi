"""The interface type LedInterface.

Made by 'cxbridge interface compile': do not edit, generate it again.
"""

# ruff: noqa: E501, FBT001, FBT002, N801, N802, N815, PLR0913, PLR0917, PYI021, RUF100, TC001, TC003

from typing import ClassVar

from cxbridge.interfaces.instance import Interface, Message

class LedInterface(Interface):
    """The interface type LedInterface.

    A lamp. Those that cannot be dimmed are on or off.
    """

    ON: ClassVar[float]
    """The most light."""

    OFF: ClassVar[float]
    """No light."""

    class SetIntensityMessage(Message):
        """The message SetIntensityMessage.

        Give another light.
        """

        time_sec: float
        """In how many seconds."""

        intensity: float
        """Its light, from OFF to ON."""

        def __init__(
            self,
            time_sec: float = 0.0,
            intensity: float = 0.0,
        ) -> None: ...

    class TurnOnMessage(Message):
        """The message TurnOnMessage.

        Give the most light at once.
        """

    class TurnOffMessage(Message):
        """The message TurnOffMessage.

        Give no light, at once.
        """

    intensity: float
    """Its light, from OFF to ON."""
