"""The states of a skill string."""

from __future__ import annotations

from enum import IntEnum


class Status(IntEnum):
    """The values of SkillStatusEnum in SkillerInterface."""

    S_INACTIVE = 0
    S_FINAL = 1
    S_RUNNING = 2
    S_FAILED = 3
