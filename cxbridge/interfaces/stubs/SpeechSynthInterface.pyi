"""The interface type SpeechSynthInterface.

Made by 'cxbridge interface compile': do not edit, generate it again.
"""

# ruff: noqa: E501, FBT001, FBT002, N801, N802, N815, PLR0913, PLR0917, PYI021, RUF100, TC001, TC003

from cxbridge.interfaces.instance import Interface, Message

class SpeechSynthInterface(Interface):
    """The interface type SpeechSynthInterface.

    A voice. Texts come as messages and are spoken one after the other.
    """

    class SayMessage(Message):
        """The message SayMessage.

        Speak a text.
        """

        text: str
        """The text that is being spoken, or was last."""

        def __init__(
            self,
            text: str = "",
        ) -> None: ...

    text: str
    """The text that is being spoken, or was last."""

    msgid: int
    """Id of the message whose text is being spoken, 0 when there is none."""

    final: bool
    """Whether the text has been spoken to its end."""

    duration: float
    """Seconds that the whole text takes to speak, from begin to end; -1 when that is
    not known.
    """
