"""The errors that cxbridge raises on purpose.

::

    CxbridgeError
    ├── ConfigError              a configuration file is wrong, or a value is missing or has the wrong type
    ├── InterfaceError
    │    └── InterfaceDefinitionError   an interface XML file is wrong
    ├── BlackBoardError          the blackboard refuses an operation (subclasses: blackboard.errors)
    ├── BrokenAgentError         an agent has mistakes: it is not started, or it is ended
    ├── ExecutiveError
    │    ├── ClipsError          CLIPS refused a construct, a command or a value
    │    ├── PddlError           a PDDL text does not parse or does not make sense
    │    └── ProtobufError       a protobuf message, frame or type is wrong, or a package for it is missing
    ├── SkillerError
    │    └── SkillError          a skill cannot be loaded or run
    ├── TransformError           the transform between two frames is unknown (subclasses: space.tf.errors)
    ├── NavGraphError            a navigation graph cannot be read, or lacks a node or an edge
    ├── Ros2Error                a definition, a message or a peer of ROS 2 is wrong
    └── TraceError               a recorded run cannot be read or written

Other modules define further subclasses, such as :class:`cxbridge.plugins.PluginError`. Each mistake of a user
raises a :class:`CxbridgeError`. The command line prints the error without traceback and exits with
:attr:`CxbridgeError.exit_status`.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path


class CxbridgeError(Exception):
    """Base of all errors of cxbridge.

    :param message: the mistake in one sentence.
    :param file: the file with the mistake.
    :param line: the line in the file, from 1.
    :param column: the column in the line, from 1.
    :param hint: the remedy.
    """

    exit_status = 2
    """The exit status of a command; 2 means bad input or usage (see docs/commands.md)."""

    def __init__(
        self,
        message: str,
        *,
        file: str | Path | None = None,
        line: int | None = None,
        column: int | None = None,
        hint: str | None = None,
    ) -> None:
        super().__init__(message)
        self.message, self.hint = message, hint
        self.file = None if file is None else str(file)
        self.line, self.column = line, column

    @property
    def location(self) -> str:
        """The known parts of ``file:line:column``; empty if all are unknown."""
        return ":".join(str(part) for part in (self.file, self.line, self.column) if part is not None)

    def __str__(self) -> str:
        """Return location, message and hint for users."""
        text = f"{self.location}: {self.message}" if self.location else self.message
        return f"{text}\n  hint: {self.hint}" if self.hint else text


class ConfigError(CxbridgeError):
    """A configuration file is wrong, or a value is missing or has the wrong type."""


class InterfaceError(CxbridgeError):
    """An interface type is unknown or unusable, or a value does not fit a field."""


class InterfaceDefinitionError(InterfaceError):
    """An interface definition (XML) is wrong."""


class BlackBoardError(CxbridgeError):
    """The blackboard refuses an operation."""


class ExecutiveError(CxbridgeError):
    """The executive cannot be set up or cannot continue."""


class BrokenAgentError(CxbridgeError):
    """An agent has mistakes, and was not started, or was ended while loading a file.

    ``str()`` lists all mistakes with their locations; :attr:`message` only counts them.

    :param mistakes: at least one mistake; the first provides the location of this error.
    :param started: whether the agent had been started.
    """

    def __init__(self, mistakes: Sequence[CxbridgeError], started: bool = False) -> None:
        noun = "mistake" if len(mistakes) == 1 else "mistakes"
        consequence = "the agent was ended" if started else "the agent was not started"
        super().__init__(
            f"{len(mistakes)} {noun}, {consequence}",
            file=mistakes[0].file,
            line=mistakes[0].line,
            column=mistakes[0].column,
        )
        self.mistakes = tuple(mistakes)
        self.started = started
        self.args = (self.mistakes, started)  # the arguments for unpickling

    def __str__(self) -> str:
        """Return all mistakes and their number."""
        return "\n".join([*map(str, self.mistakes), self.message])


class ClipsError(ExecutiveError):
    """CLIPS refused a construct, a command or a value."""


class ProtobufError(ExecutiveError):
    """A protobuf message, frame or type is wrong, or a package for it is missing."""


class PddlError(ExecutiveError):
    """A PDDL text does not parse or does not make sense."""


class SkillerError(CxbridgeError):
    """The Skiller cannot be set up or cannot continue."""


class SkillError(SkillerError):
    """A skill cannot be loaded or run."""


class TransformError(CxbridgeError):
    """The transform between two coordinate frames is unknown."""


class NavGraphError(CxbridgeError):
    """A navigation graph cannot be read, or lacks a node or an edge."""


class Ros2Error(CxbridgeError):
    """A definition, a message or a peer of ROS 2 is wrong."""


class TraceError(CxbridgeError):
    """A recorded run cannot be read or written."""
