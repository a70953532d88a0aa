"""The commands of `cxbridge`: each module here is one, found by its name and imported when somebody uses it.

A module ``NAME.py`` has either a function ``NAME``, which is the command, or a :class:`typer.Typer` ``app``,
which is a group of commands.
"""

from typing import Final

HELP_ORDER: Final = (
    *("run", "plan", "doctor", "gateway", "keys", "why", "monitor", "coverage"),
    *("interface", "trace", "daemon", "env", "bb", "skill"),
)
"""In which order the help names them; a command that is not here comes last."""
