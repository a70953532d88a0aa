"""The skill files of checkouts, their dependencies, and the folders of interface definitions."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

LUA = Path("src/lua")


@dataclass(frozen=True)
class SkillFile:
    """A skill file of a checkout.

    :param module: the name of the file's module.
    :param skill: the name of the skill, empty for files that only use other skills.
    :param uses: the names of the skills in ``depends_skills``.
    """

    root: Path
    module: str
    skill: str
    uses: tuple[str, ...]


def skill_files(root: Path | None, *groups: str) -> list[SkillFile]:
    """Find the skill files of a checkout in the given groups."""
    files: list[SkillFile] = []
    for group in groups if root else ():
        assert root is not None
        for path in sorted((root / LUA / "skills" / group).rglob("*.lua")):
            text = path.read_text(errors="replace")
            name = re.search(r'^name\s*=\s*"([^"]+)"', text, re.MULTILINE)
            uses = re.search(r"^depends_skills\s*=\s*\{(.*?)\}", text, re.MULTILINE | re.DOTALL)
            module = ".".join(path.relative_to(root / LUA).with_suffix("").parts)
            files.append(
                SkillFile(
                    root,
                    module,
                    name.group(1) if name else "",
                    tuple(re.findall(r'"([^"]+)"', uses.group(1))) if uses else (),
                )
            )
    return files


def with_dependencies(file: SkillFile, files: list[SkillFile]) -> list[str]:
    """Return the modules of a file and its dependencies in the order of use; own group first."""
    group = file.module.split(".")[1]
    order: list[str] = []

    def visit(current: SkillFile) -> None:
        for skill in current.uses:
            candidates = [file_ for file_ in files if file_.skill == skill]
            candidates.sort(key=lambda file_: (file_.module.split(".")[1] != group, "fake" in file_.module))
            if candidates[0].module not in order:
                visit(candidates[0])
        order.append(current.module)

    visit(file)
    return list(dict.fromkeys(order))


def all_interfaces(*roots: Path) -> list[Path]:
    """Return the folders of all interface definitions in checkouts."""
    return sorted({path.parent for root in roots for path in root.rglob("*Interface.xml")})
