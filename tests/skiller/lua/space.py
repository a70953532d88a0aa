"""The skill files of checkouts: which there are, which need which, and all interfaces that they know."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

LUA = Path("src/lua")


@dataclass(frozen=True)
class SkillFile:
    """A skill file of a checkout.

    :param module: its module's name.
    :param skill: the name of its skill, empty for files that only use others.
    :param uses: the names of the skills that it depends on.
    """

    root: Path
    module: str
    skill: str
    uses: tuple[str, ...]


def skill_files(root: Path | None, *groups: str) -> list[SkillFile]:
    """Find the skill files of a checkout, all of the groups that are named."""
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


def with_needed(file: SkillFile, files: list[SkillFile]) -> list[str]:
    """Return the modules of a file and all that it needs, in the order to use them; its own group first."""
    group = file.module.split(".")[1]
    order: list[str] = []

    def visit(current: SkillFile) -> None:
        for skill in current.uses:
            known = [other for other in files if other.skill == skill]
            known.sort(key=lambda other: (other.module.split(".")[1] != group, "fake" in other.module))
            if known[0].module not in order:
                visit(known[0])
        order.append(current.module)

    visit(file)
    return list(dict.fromkeys(order))


def all_interfaces(*roots: Path) -> list[Path]:
    """Return the folders of all interface definitions in checkouts."""
    return sorted({path.parent for root in roots for path in root.rglob("*Interface.xml")})
