"""Finds the skills of a skill space in the text of its Lua files, without executing the files.

A skill space is the Lua module that loads the skills of a robot. It calls ``use_skill`` for each skill, or in
a loop over a list. A space with any other call computes its skills, so they are unknown.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from cxbridge.errors import SkillError
from cxbridge.lua_syntax import LuaCompiler
from cxbridge.skiller.lua.modulepath import ModulePath
from cxbridge_studio.agent.lua import read_lua
from cxbridge_studio.agent.lua_tokens import Table, Token, read_table, read_tokens
from cxbridge_studio.agent.names import NameKind
from cxbridge_studio.check.lua_skills import find_load_mistakes


def find_space_skills(space: str, folders: Sequence[Path], compiler: LuaCompiler) -> dict[str, Path] | None:
    """Return the file of each skill in a skill space; None if the space has no skills, or computes them.

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
        """Return the file of each skill that a module loads; None if it loads none, or computes them.

        :raises SkillError: as :func:`find_space_skills`.
        """
        path, text = self._read_module(module)
        skill_files: dict[str, Path] = {}
        for offset, names in _find_skill_uses(read_tokens(text)):
            if names is None:
                return None
            for name in names:
                skill = self._read_skill(name, path, text.count("\n", 0, offset) + 1)
                if skill is None:
                    return None
                skill_name, skill_file = skill
                if skill_name in skill_files:
                    # Fawkes reports the same text.
                    raise SkillError(f"A skill with the name {skill_name} already exists", file=path)
                skill_files[skill_name] = skill_file
        return skill_files or None

    def _read_skill(self, module: str, space: Path, line: int) -> tuple[str, Path] | None:
        """Return the name and the file of the skill in a module; None if the name is computed.

        :param space: the file of the space.
        :param line: the line of the call of ``use_skill``: the position of an error without a file.
        :raises SkillError: if the module cannot be read, does not compile, or is not a skill.
        """
        try:
            path, text = self._read_module(module)
        except SkillError as error:
            if error.file is None:
                error.file, error.line = str(space), line
            raise
        # A Lua file is a single piece, which has the name of the skill
        name = read_lua(str(path), text).pieces[0].piece.name
        if name is not None and name.kind is NameKind.SKILL:
            return name.text, path
        for offset, message, hint in find_load_mistakes(text):
            raise SkillError(message, file=path, line=text.count("\n", 0, offset) + 1, hint=hint)
        return None

    def _read_module(self, module: str) -> tuple[Path, str]:
        """Return the path and the text of a module.

        :raises SkillError: if the module cannot be read, or does not compile.
        """
        text, _ = self._modules.read(module)
        path = self._modules.find(module)
        # Modules are read as Latin-1, which maps each byte of a Lua string to one character.
        if (problem := self._compiler.find_file_error(text.encode("latin-1"))) is not None:
            line, message = problem
            raise SkillError(message, file=path, line=line or None)
        return path, text


def _find_skill_uses(tokens: Sequence[Token]) -> Iterator[tuple[int, list[str] | None]]:
    """Yield the offset and the loaded modules of each call of ``use_skill``; None for computed names.

    The names are literal in ``use_skill("skills.say")``, and in a loop over a list of literals:
    ``for _, name in ipairs({"say", "goto"}) do use_skill("skills." .. name) end``.
    """
    skill_list: Table | None = None
    for index, token in enumerate(tokens):
        # Lua needs no brackets around a single string or table.
        is_bracketed = len(tokens) > index + 1 and tokens[index + 1].text == "("
        arguments = tokens[index + 1 + is_bracketed :]
        if token.text == "ipairs":
            skill_list = read_table(arguments)
        elif token.text == "use_skill":
            prefix = arguments[0].literal if arguments else None
            # Without a concatenation, the literal is the whole name, and nothing follows it.
            names: list[str | None] = [""]
            if [argument.text for argument in arguments[1:2]] == [".."]:
                is_loop = arguments[2].kind == "name" and skill_list is not None
                # Outside of a loop over a list, a single empty item stands for a computed name.
                items = skill_list.items if is_loop and skill_list is not None else [[]]
                names = [item[0].literal if len(item) == 1 else None for item in items]
            is_literal = prefix is not None and all(name is not None for name in names)
            yield token.offset, [f"{prefix}{name}" for name in names] if is_literal else None
