"""The interface type SkillerDebugInterface.

Made by 'cxbridge interface compile': do not edit, generate it again.
"""

# ruff: noqa: E501, FBT001, FBT002, N801, N802, N815, PLR0913, PLR0917, PYI021, RUF100, TC001, TC003

from enum import IntEnum
from typing import ClassVar

from cxbridge.interfaces.instance import Interface, Message

class SkillerDebugInterface(Interface):
    """The interface type SkillerDebugInterface.

    A picture of the skill that runs, for people: its state machine as a graph in the
    dot language.
    """

    class GraphDirectionEnum(IntEnum):
        """Values of type GraphDirectionEnum.

        Where a graph of states grows to.
        """

        GD_TOP_BOTTOM = 0
        """Downwards."""

        GD_BOTTOM_TOP = 1
        """Upwards."""

        GD_LEFT_RIGHT = 2
        """To the right."""

        GD_RIGHT_LEFT = 3
        """To the left."""

    GD_TOP_BOTTOM: ClassVar[GraphDirectionEnum]
    GD_BOTTOM_TOP: ClassVar[GraphDirectionEnum]
    GD_LEFT_RIGHT: ClassVar[GraphDirectionEnum]
    GD_RIGHT_LEFT: ClassVar[GraphDirectionEnum]

    class SetGraphMessage(Message):
        """The message SetGraphMessage.

        Show the state machine of that name; ACTIVE shows the one of the skill that
        runs.
        """

        graph_fsm: str
        """Name of the state machine that is shown."""

        def __init__(
            self,
            graph_fsm: str = "",
        ) -> None: ...

    class SetGraphDirectionMessage(Message):
        """The message SetGraphDirectionMessage.

        Let the graph grow in another direction.
        """

        graph_dir: SkillerDebugInterface.GraphDirectionEnum
        """Where the graph grows to."""

        def __init__(
            self,
            graph_dir: SkillerDebugInterface.GraphDirectionEnum | int = 0,
        ) -> None: ...

    class SetGraphColoredMessage(Message):
        """The message SetGraphColoredMessage.

        Switch colours on or off.
        """

        graph_colored: bool
        """Whether states and transitions are coloured."""

        def __init__(
            self,
            graph_colored: bool = False,
        ) -> None: ...

    graph_fsm: str
    """Name of the state machine that is shown."""

    graph: str
    """The graph as dot text."""

    graph_dir: GraphDirectionEnum
    """Where the graph grows to."""

    graph_colored: bool
    """Whether states and transitions are coloured."""
