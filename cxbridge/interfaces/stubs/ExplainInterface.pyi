"""The interface type ExplainInterface.

Made by 'cxbridge interface compile': do not edit, generate it again.
"""

# ruff: noqa: E501, FBT001, FBT002, N801, N802, N815, PLR0913, PLR0917, PYI021, RUF100, TC001, TC003

from cxbridge.interfaces.instance import Interface, Message

class ExplainInterface(Interface):
    """The interface type ExplainInterface.

    Answers why a rule of a daemon's executive has not fired, and how a goal came to its
    outcome.
    """

    class WhyMessage(Message):
        """The message WhyMessage.

        Ask about a rule or a goal.
        """

        name: str
        """Its name; for goals also a class, or the begin of an id."""

        kind: str
        """rule, goal, action, fact or run; empty: a rule, if there is one of that name.
        """

        rules: int
        """How many rules to tell of those that fired before each step of a goal."""

        def __init__(
            self,
            name: str = "",
            kind: str = "",
            rules: int = 0,
        ) -> None: ...

    msgid: int
    """Id of the message that was answered last."""

    answer: str
    """The answer as JSON: lines and data, or error and hint."""
