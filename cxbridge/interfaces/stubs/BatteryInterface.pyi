"""The interface type BatteryInterface.

Made by 'cxbridge interface compile': do not edit, generate it again.
"""

# ruff: noqa: E501, FBT001, FBT002, N801, N802, N815, PLR0913, PLR0917, PYI021, RUF100, TC001, TC003

from cxbridge.interfaces.instance import Interface, Message

class BatteryInterface(Interface):
    """The interface type BatteryInterface.

    How the battery is.
    """

    class PushButtonMessage(Message):
        """The message PushButtonMessage.

        Do as if somebody pressed its button.
        """

    class SleepMessage(Message):
        """The message SleepMessage.

        Let the battery go to sleep.
        """

    current: int
    """Current in mA."""

    voltage: int
    """Voltage in mV."""

    temperature: int
    """Temperature in °C."""

    absolute_soc: float
    """Charge, in per cent of a new battery."""

    relative_soc: float
    """Charge, in per cent of what it can hold today."""
