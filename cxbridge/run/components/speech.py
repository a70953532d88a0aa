"""The speech synthesis that Lua skills need. They open its interface, so it is made before the Skiller."""

from __future__ import annotations

from cxbridge.mainloop import Hook
from cxbridge.run.components.component import Component
from cxbridge.run.context import RunContext
from cxbridge.skiller.make import make_speech


class Speech(Component):
    """Writes ``SpeechSynthInterface``; works after the Skiller.

    :raises CxbridgeError: when it cannot speak, or somebody else writes its interface.
    """

    hooks = (Hook.ACT,)
    description = "Speech synthesis that skills use"

    def __init__(self, context: RunContext) -> None:
        self._writer = make_speech(context.board, context.clock, context.bus, speech=context.options.speech)

    def loop(self) -> None:
        """Take messages, and go on speaking."""
        self._writer.loop()

    @property
    def is_quiet(self) -> bool:
        """Whether it only speaks what skills say: always."""
        return True

    def close(self) -> None:
        """Close the interface."""
        self._writer.close()
