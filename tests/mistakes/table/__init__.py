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
