"""The mistakes of a new user, by where they are made: each module has its MISTAKES."""

from __future__ import annotations

from typing import Final

from tests.mistakes.table import clips, command_line, daemon, lua, mapping, pddl, xml, yaml
from tests.mistakes.table.mistake import Mistake

MISTAKES: Final[dict[str, tuple[Mistake, ...]]] = {
    "YAML": yaml.MISTAKES,
    "XML": xml.MISTAKES,
    "CLIPS": clips.MISTAKES,
    "PDDL": pddl.MISTAKES,
    "Lua": lua.MISTAKES,
    "mapping": mapping.MISTAKES,
    "command line": command_line.MISTAKES,
    "daemon": daemon.MISTAKES,
}
"""The tables, by the kind of file, or of command."""

WITHOUT_LINE: Final = {
    **dict.fromkeys(
        (
            "command line: the scenario is not there",
            "command line: the folder is not a scenario",
            "command line: an option is misspelt",
            "command line: a command is misspelt",
            "command line: a value is none of those allowed",
            "command line: a number is none",
            "command line: a folder is not there",
            "command line: an overlay is not there",
            "command line: no scenario is named",
            "command line: the recording overwrites the agent",
            "command line: the URL of the Skiller is misspelt",
            "command line: the spec is misspelt",
            "daemon: the endpoint is not an address",
            "daemon: the configuration is not there",
            "daemon: a word is not a policy",
        ),
        "argument",
    ),
}
"""The mistakes that are in no line of a file, and where they are instead; the list only shrinks."""
