"""The interface type DaemonInterface.

Made by 'cxbridge interface compile': do not edit, generate it again.
"""

# ruff: noqa: E501, FBT001, FBT002, N801, N802, N815, PLR0913, PLR0917, PYI021, RUF100, TC001, TC003

from enum import IntEnum
from typing import ClassVar

from cxbridge.interfaces.instance import Interface, Message

class DaemonInterface(Interface):
    """The interface type DaemonInterface.

    A cxbridge daemon, and the way to tell it what to do.
    """

    class DaemonState(IntEnum):
        """Values of type DaemonState.

        How a daemon stands.
        """

        STARTING = 0
        """Its components are being started."""

        RUNNING = 1
        """All components are active."""

        PAUSED = 2
        """Components are paused on request."""

        DEGRADED = 3
        """Some component is not active, or does not come to its end; its
        ComponentInterface says why.
        """

        STOPPING = 4
        """It comes to its end."""

    STARTING: ClassVar[DaemonState]
    RUNNING: ClassVar[DaemonState]
    PAUSED: ClassVar[DaemonState]
    DEGRADED: ClassVar[DaemonState]
    STOPPING: ClassVar[DaemonState]

    class PauseMessage(Message):
        """The message PauseMessage.

        Deactivate the components that work; those that serve clients go on.
        """

    class ResumeMessage(Message):
        """The message ResumeMessage.

        Activate what is inactive.
        """

    class ResetMessage(Message):
        """The message ResetMessage.

        Take the components that work down, and start them anew.
        """

    class InterruptMessage(Message):
        """The message InterruptMessage.

        End what rules do in this loop, as an error in them would.
        """

    class ShutdownMessage(Message):
        """The message ShutdownMessage.

        End the daemon.
        """

    state: DaemonState
    """How it stands."""

    msgid: int
    """Id of the message that was carried out last, 0 until it is."""

    pid: int
    """Its process."""

    started: int
    """When it was started, in microseconds since the epoch."""

    version: str
    """Version of cxbridge."""

    time_source: str
    """Its clock: real, virtual or scaled:N."""

    endpoints: str
    """Where it can be reached, with blanks between."""

    error: str
    """What went wrong last; empty when nothing did."""
