"""The commands of `cxbridge`, each in a module that is imported when the command is used.

A module ``NAME`` has either a function ``NAME``, the command, or a :class:`typer.Typer` ``app``, a group
of commands.
"""

from typing import Final

HELP_SECTIONS: Final = {
    "Run": ("new", "run", "daemon"),
    "Explore": (),
    "Look": (),
    "Record and compare": ("trace",),
    "Test": (),
    "Edit": (),
    "Blackboard": ("bb", "interface"),
    "Skills": ("skill",),
    "Set up": ("doctor", "keys"),
}
"""The sections of the help in order, with the core's commands.

A section without commands has only commands of plug-ins, whose rows name their sections.
"""
