"""The interface type SwitchInterface.

Made by 'cxbridge interface compile': do not edit, generate it again.
"""

# ruff: noqa: E501, FBT001, FBT002, N801, N802, N815, PLR0913, PLR0917, PYI021, RUF100, TC001, TC003

from cxbridge.interfaces.instance import Interface, Message

class SwitchInterface(Interface):
    """The interface type SwitchInterface.

    Something that is on or off: a button, a lamp, a whole component. May know steps in
    between.
    """

    class SetMessage(Message):
        """The message SetMessage.

        Switch it, where software may.
        """

        enabled: bool
        """Whether it is on."""

        value: float
        """How much it is on, where there are steps in between."""

        def __init__(
            self,
            enabled: bool = False,
            value: float = 0.0,
        ) -> None: ...

    class EnableSwitchMessage(Message):
        """The message EnableSwitchMessage.

        Switch it on.
        """

    class DisableSwitchMessage(Message):
        """The message DisableSwitchMessage.

        Switch it off.
        """

    class EnableDurationMessage(Message):
        """The message EnableDurationMessage.

        Switch it on for a while; not everything can.
        """

        duration: float
        """How many seconds."""

        value: float
        """How much it is on, where there are steps in between."""

        def __init__(
            self,
            duration: float = 0.0,
            value: float = 0.0,
        ) -> None: ...

    enabled: bool
    """Whether it is on."""

    value: float
    """How much it is on, where there are steps in between."""

    history: float
    """Seconds that it has been on (above 0) or off (below 0) without a break; 0 at the
    beginning.
    """

    short_activations: int
    """How often in a row it was switched on for a short time."""

    long_activations: int
    """How often in a row it was switched on for a long time."""

    activation_count: int
    """How often it was switched on at all."""
