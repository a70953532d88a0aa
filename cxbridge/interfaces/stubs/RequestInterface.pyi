"""The interface type RequestInterface.

Made by 'cxbridge interface compile': do not edit, generate it again.
"""

# ruff: noqa: E501, FBT001, FBT002, N801, N802, N815, PLR0913, PLR0917, PYI021, RUF100, TC001, TC003

from cxbridge.interfaces.instance import Interface, Message

class RequestInterface(Interface):
    """The interface type RequestInterface.

    Takes requests to the executive of a daemon: its debugger and its CLIPS
    environments.
    """

    class AskMessage(Message):
        """The message AskMessage.

        Ask for something to be done.
        """

        verb: str
        """What."""

        token: str
        """Comes back with the answer."""

        arguments: str
        """With what, as JSON."""

        def __init__(
            self,
            verb: str = "",
            token: str = "",
            arguments: str = "",
        ) -> None: ...

    stops: int
    """How often the debugger has stopped."""

    stopped: str
    """Where it has stopped; empty when it has not."""

    answer: str
    """The last answer as JSON: token, and result, or error and hint."""
