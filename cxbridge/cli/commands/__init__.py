"""The commands of `cxbridge`: each module here is one, found by its name and imported when somebody uses it.

A module ``NAME.py`` has either a function ``NAME``, which is the command, or a :class:`typer.Typer` ``app``,
which is a group of commands.
"""

from typing import Final

HELP_SECTIONS: Final = {
    "Run": ("new", "run", "check", "daemon", "plan", "gateway"),
    "Explore": ("explore",),
    "Look": ("view", "monitor", "why", "dap", "env"),
    "Record and compare": ("trace", "coverage"),
    "Test": ("sweep", "game"),
    "Edit": ("lsp", "format"),
    "Blackboard": ("bb", "interface", "ros2"),
    "Skills": ("skill",),
    "Set up": ("doctor", "keys"),
}
"""The parts of the help, and what is in each, in order; a command that is nowhere comes last."""
