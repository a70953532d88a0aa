"""Reader of Lua skills: the skill, its documented arguments, and the skills and interfaces it uses."""

from __future__ import annotations

import re
from typing import Final

from cxbridge_studio.agent.names import Mention, Name, NameKind, Piece, PlacedPiece, SourceFile, Use

_NAME: Final = re.compile(r"""^name\s*=\s*["']([\w-]+)["']""", re.MULTILINE)
_NEEDS: Final = re.compile(r"^depends_skills\s*=\s*\{([^}]*)\}", re.MULTILINE)
_STRING: Final = re.compile(r"""["']([\w-]+)["']""")
_INTERFACE: Final = re.compile(r"""\btype\s*=\s*["'](\w+)["']""")
_CALLED: Final = re.compile(r"\bskills\s*=\s*\{\s*\{\s*([A-Za-z_]\w*)")
_DOCUMENTATION: Final = re.compile(r"^documentation\s*=\s*\[(=*)\[(.*?)\]\1\]", re.MULTILINE | re.DOTALL)
_ARGUMENT: Final = re.compile(r"@param\s+(\w+)")


def read_lua(path: str, text: str) -> SourceFile:
    name = _NAME.search(text)
    skill = name[1] if name else ""
    found: list[Mention] = []

    def add_mention(kind: NameKind, use: Use, match: re.Match[str], owner: str = "") -> None:
        found.append(Mention(Name(kind, match[1], owner), use, *match.span(1)))

    if name:
        add_mention(NameKind.SKILL, Use.DEFINED, name)
    for needs in _NEEDS.finditer(text):
        for match in _STRING.finditer(text, *needs.span(1)):
            add_mention(NameKind.SKILL, Use.NAMED, match)
    for match in _INTERFACE.finditer(text):
        add_mention(NameKind.INTERFACE, Use.NAMED, match)
    for match in _CALLED.finditer(text):
        add_mention(NameKind.SKILL, Use.CALLED, match)
    described = _DOCUMENTATION.search(text)
    if described and skill:
        for match in _ARGUMENT.finditer(text, *described.span(2)):
            add_mention(NameKind.ARGUMENT, Use.DEFINED, match, skill)
    mentions = tuple(sorted(found, key=lambda mention: mention.start))
    skill_name = Name(NameKind.SKILL, skill) if skill else None
    return SourceFile(
        path, text, (PlacedPiece(0, Piece("skill" if skill else "lua", skill_name, text, mentions)),)
    )


def skill_documentation(text: str) -> str:
    match = _DOCUMENTATION.search(text)
    return match[2].strip() if match else ""
