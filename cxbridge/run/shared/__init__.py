"""What the components of a run share, each made by the first who asks for it."""

from __future__ import annotations

from cxbridge.run.shared.navgraph import SharedNavGraph
from cxbridge.run.shared.skill_board import SharedSkillBoard

__all__ = ["SharedNavGraph", "SharedSkillBoard"]
