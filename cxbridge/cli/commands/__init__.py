"""The commands of `cxbridge`: each module here is one, found by its name and imported when it is used.

A module ``NAME.py`` has either a function ``NAME``, which is the command, or a :class:`typer.Typer` ``app``,
which is a group of commands.
"""

from typing import Final

HELP_SECTIONS: Final = {
    "Run": ("new", "run", "daemon", "gateway"),
    "Explore": (),
    "Look": (),
    "Record and compare": ("trace",),
    "Test": (),
    "Edit": (),
    "Blackboard": ("bb", "interface"),
    "Skills": ("skill",),
    "Set up": ("doctor", "keys"),
}
"""The sections of the help and the core's commands in each, in order; a plug-in's row names its section."""
