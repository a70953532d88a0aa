"""Finds the skills of a skill space in the text of its Lua files, without executing the files.

A skill space is the Lua module that loads the skills of a robot. It calls ``use_skill`` for each skill, or in
a loop over a list. A space with any other call computes its skills, so they are unknown.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Final

from cxbridge.errors import SkillError
from cxbridge.lua_syntax import LuaCompiler
from cxbridge.skiller.lua.modulepath import ModulePath
from cxbridge_studio.agent.lua import read_lua
from cxbridge_studio.agent.names import NameKind
from cxbridge_studio.check.lua_skills import find_load_mistakes

# The beginning of a comment or a long string, or a whole short string.
_LEXEME: Final = re.compile(r"""--|\[=*\[|"(?:[^"\\]|\\.)*"|'(?:[^'\\]|\\.)*'""", re.DOTALL)
_LONG_BRACKET: Final = re.compile(r"\[(=*)\[")
_USE_SKILL: Final = re.compile(r"\buse_skill\b")
# A call for a literal skill: use_skill("skills.test.say")
_LITERAL_USE: Final = re.compile(r"""\buse_skill\s*\(?\s*["']([^"'\\]*)["']\s*\)?""")
# A loop over literal skills: for _, name in ipairs({"say", "goto"}) do use_skill("skills.test." .. name)
_LOOP_USE: Final = re.compile(
    r"""\bipairs\s*\(?\s*\{([^{}]*)\}\s*\)?\s*do\s+(?:\w+\.)*use_skill\s*\(\s*["']([^"'\\]*)["']\s*\.\.\s*\w+\s*\)"""
)
_STRING: Final = re.compile(r"""["']([^"'\\]*)["']""")


def find_space_skills(space: str, folders: Sequence[Path], compiler: LuaCompiler) -> dict[str, Path] | None:
    """Return the file of each skill in a skill space; None if the space computes its skills.

    :param folders: the folders of Lua modules.
    :raises SkillError: if the space or one of its skills cannot be read, does not compile, or a skill occurs
        twice.
    """
    try:
        return _SpaceReader(ModulePath(folders), compiler).read_skills(f"skills.{space}")
    except SkillError as error:
        error.message = f"cannot load skill space '{space}': {error.message}"
        raise


class _SpaceReader:
    """Reads one skill space.

    :param compiler: checks the syntax of the modules.
    """

    def __init__(self, modules: ModulePath, compiler: LuaCompiler) -> None:
        self._modules = modules
        self._compiler = compiler

    def read_skills(self, module: str) -> dict[str, Path] | None:
        """Return the file of each skill that a module loads; None if the module computes its skills."""
        path, text = self._read_module(module)
        code = _blank_comments(text)
        calls = list(_find_skill_uses(code))
        if len(calls) != len(_USE_SKILL.findall(code)) or not calls:
            return None
        skill_files: dict[str, Path] = {}
        for offset, names in calls:
            for name in names:
                skill = self._read_skill(name, path, text.count("\n", 0, offset) + 1)
                if skill is None:
                    return None
                skill_name, skill_file = skill
                if skill_name in skill_files:
                    # Fawkes reports the same text.
                    raise SkillError(f"A skill with the name {skill_name} already exists", file=path)
                skill_files[skill_name] = skill_file
        return skill_files

    def _read_skill(self, module: str, space: Path, line: int) -> tuple[str, Path] | None:
        """Return the name and the file of the skill in a module; None if the name is computed.

        :param space: the file of the space.
        :param line: the line of the call of ``use_skill``: the position of an error without a file.
        """
        try:
            path, text = self._read_module(module)
        except SkillError as error:
            if error.file is None:
                error.file, error.line = str(space), line
            raise
        # a Lua file is a single piece, which has the name of the skill
        name = read_lua(str(path), text).pieces[0].piece.name
        if name is not None and name.kind is NameKind.SKILL:
            return name.text, path
        for offset, message, hint in find_load_mistakes(text):
            raise SkillError(message, file=path, line=text.count("\n", 0, offset) + 1, hint=hint)
        return None

    def _read_module(self, module: str) -> tuple[Path, str]:
        """Return the path and the text of a module that compiles."""
        text, _ = self._modules.read(module)
        path = self._modules.find(module)
        # Modules are read as Latin-1, which maps each byte of a Lua string to one character.
        if (problem := self._compiler.find_file_error(text.encode("latin-1"))) is not None:
            line, message = problem
            raise SkillError(message, file=path, line=line or None)
        return path, text


def _find_skill_uses(code: str) -> Iterator[tuple[int, list[str]]]:
    """Yield the offset and the loaded modules of each call of ``use_skill`` with literal names."""
    for match in _LITERAL_USE.finditer(code):
        if not code.startswith("..", match.end()):  # a concatenated name is computed
            yield match.start(), [match[1]]
    for match in _LOOP_USE.finditer(code):
        yield match.start(), [match[2] + name for name in _STRING.findall(match[1])]


def _blank_comments(text: str) -> str:
    """Return Lua code with its comments blanked out, so that offsets stay the same."""
    pieces, offset = [], 0
    while (match := _LEXEME.search(text, offset)) is not None:
        start, end = match.span()
        pieces.append(text[offset:start])
        is_comment = match[0] == "--"
        # Long brackets, [[...]] or [==[...]==], enclose a string, or after -- a comment of several lines.
        bracket = _LONG_BRACKET.match(text, end if is_comment else start)
        if bracket is not None:
            close = text.find(f"]{bracket[1]}]", bracket.end())
            end = len(text) if close < 0 else close + len(bracket[1]) + 2
        elif is_comment:
            close = text.find("\n", end)
            end = len(text) if close < 0 else close
        lexeme = text[start:end]
        pieces.append(re.sub(r"[^\n]", " ", lexeme) if is_comment else lexeme)
        offset = end
    return "".join(pieces) + text[offset:]
