"""One run of an exploration, from its start or from where it was forked, to how it ended."""

from __future__ import annotations

from cxbridge.errors import CxbridgeError
from cxbridge.explore.graph import BAD_INPUT, Leaf
from cxbridge.worlds.judged import JudgedRun


class ExploredRun(JudgedRun):
    """A run of which only its end is kept."""

    def leaf(self) -> Leaf:
        """Play it to its end.

        :raises CxbridgeError: when the agent is broken.
        """
        ended, result = self.play()
        return Leaf(ended.word, ended.reason, result.seconds)


def failure(error: Exception) -> Leaf:
    """Return how a run ended that an error of Python has ended."""
    if isinstance(error, CxbridgeError):
        return Leaf(BAD_INPUT, str(error), 0.0)
    return Leaf("fault", f"{type(error).__name__}: {error}", 0.0)
