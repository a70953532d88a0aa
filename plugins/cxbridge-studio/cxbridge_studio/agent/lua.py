"""Reads the names in Lua skills: the skill, the arguments it documents, skills and interfaces it needs."""

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
    """Return the names of a Lua file."""
    name = _NAME.search(text)
    skill = name[1] if name else ""
    found: list[Mention] = []

    def note(kind: NameKind, use: Use, match: re.Match[str], owner: str = "") -> None:
        found.append(Mention(Name(kind, match[1], owner), use, *match.span(1)))

    if name:
        note(NameKind.SKILL, Use.DEFINED, name)
    for needs in _NEEDS.finditer(text):
        for match in _STRING.finditer(text, *needs.span(1)):
            note(NameKind.SKILL, Use.NAMED, match)
    for match in _INTERFACE.finditer(text):
        note(NameKind.INTERFACE, Use.NAMED, match)
    for match in _CALLED.finditer(text):
        note(NameKind.SKILL, Use.CALLED, match)
    described = _DOCUMENTATION.search(text)
    if described and skill:
        for match in _ARGUMENT.finditer(text, *described.span(2)):
            note(NameKind.ARGUMENT, Use.DEFINED, match, skill)
    mentions = tuple(sorted(found, key=lambda mention: mention.start))
    own = Name(NameKind.SKILL, skill) if skill else None
    return SourceFile(path, text, (PlacedPiece(0, Piece("skill" if skill else "lua", own, text, mentions)),))


def skill_documentation(text: str) -> str:
    """Return the documentation of a skill; empty when there is none."""
    found = _DOCUMENTATION.search(text)
    return found[2].strip() if found else ""
