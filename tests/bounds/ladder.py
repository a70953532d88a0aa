"""Parts of a formula that share their children: a walk without a memory takes 2 ** LEVELS steps."""

from __future__ import annotations

LEVELS = 40


def twice(level: int, part_of: str) -> list[dict[str, str]]:
    """Return two formulas of one id, each with the formulas of the next level in it."""
    return [{"id": f"f{level}", "part-of": part_of, "type": "conjunction"} for _ in range(2)]


LADDER = [slots for level in range(LEVELS) for slots in twice(level, f"f{level - 1}" if level else "go")]
LEAF = {
    "id": "leaf",
    "part-of": f"f{LEVELS - 1}",
    "predicate": "at",
    "param-names": "",
    "param-constants": "",
}
