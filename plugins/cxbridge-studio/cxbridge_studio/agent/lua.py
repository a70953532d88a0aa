"""Reads the names in Lua skills: the skill, its documented arguments, and the used skills and interfaces.

Skills follow Fawkes' pattern: their settings are assignments at the start of lines, which regular expressions
find.
"""

from __future__ import annotations

import re
from typing import Final

from cxbridge_studio.agent.names import Mention, Name, NameKind, SourceFile, Use, make_single_piece_file

_NAME: Final = re.compile(r"""^name\s*=\s*["']([\w-]+)["']""", re.MULTILINE)
# The list in: depends_skills = {"drive", "grasp"}
_NEEDED_SKILLS: Final = re.compile(r"^depends_skills\s*=\s*\{([^}]*)\}", re.MULTILINE)
_STRING: Final = re.compile(r"""["']([\w-]+)["']""")
# The type in: depends_interfaces = {{v = "pose", type = "Position3DInterface", id = "Pose"}}
_INTERFACE_TYPE: Final = re.compile(r"""\btype\s*=\s*["'](\w+)["']""")
# The first skill of a state in: skills = {{drive, x = 1}}
_CALLED_SKILL: Final = re.compile(r"\bskills\s*=\s*\{\s*\{\s*([A-Za-z_]\w*)")
# The text in: documentation = [==[ ... ]==]
_DOCUMENTATION: Final = re.compile(r"^documentation\s*=\s*\[(=*)\[(.*?)\]\1\]", re.MULTILINE | re.DOTALL)
_ARGUMENT: Final = re.compile(r"@param\s+(\w+)")


def read_lua(path: str, text: str) -> SourceFile:
    """Read a Lua file. A file that is not a skill may have mentions, but defines no name."""
    name_match = _NAME.search(text)
    skill = name_match[1] if name_match else ""
    mentions: list[Mention] = []

    def add_mention(kind: NameKind, use: Use, match: re.Match[str], owner: str = "") -> None:
        mentions.append(Mention(Name(kind, match[1], owner), use, *match.span(1)))

    if name_match:
        add_mention(NameKind.SKILL, Use.DEFINED, name_match)
    for skill_list in _NEEDED_SKILLS.finditer(text):
        for match in _STRING.finditer(text, *skill_list.span(1)):
            add_mention(NameKind.SKILL, Use.NAMED, match)
    for match in _INTERFACE_TYPE.finditer(text):
        add_mention(NameKind.INTERFACE, Use.NAMED, match)
    for match in _CALLED_SKILL.finditer(text):
        add_mention(NameKind.SKILL, Use.CALLED, match)
    # A skill does not declare its arguments: only its documentation names them.
    if skill and (documentation_match := _DOCUMENTATION.search(text)):
        for match in _ARGUMENT.finditer(text, *documentation_match.span(2)):
            add_mention(NameKind.ARGUMENT, Use.DEFINED, match, skill)
    defined_name = Name(NameKind.SKILL, skill) if skill else None
    return make_single_piece_file(path, text, "skill" if skill else "lua", defined_name, mentions)


def find_documentation(text: str) -> str:
    """Return the documentation in the text of a skill; empty if there is none."""
    match = _DOCUMENTATION.search(text)
    return match[2].strip() if match else ""
