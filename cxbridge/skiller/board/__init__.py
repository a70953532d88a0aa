"""The skill board: skills of several robots, executed by programs on any machine.

See docs/skill-board.md.
"""

from __future__ import annotations

from cxbridge.skiller.board.executor import (
    ExecutorContext as ExecutorContext,
)
from cxbridge.skiller.board.executor import (
    Progress as Progress,
)
from cxbridge.skiller.board.executor import (
    SkillExecutor as SkillExecutor,
)
from cxbridge.skiller.board.executor import (
    SkillFailedError as SkillFailedError,
)
from cxbridge.skiller.board.executor import (
    Steps as Steps,
)
from cxbridge.skiller.board.protocol import SkillCall as SkillCall
