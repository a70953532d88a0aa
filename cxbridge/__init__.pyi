# The types of the public names; __init__.py imports them when they are first used.

from cxbridge.blackboard.base import BlackBoard as BlackBoard
from cxbridge.blackboard.connection import connect as connect
from cxbridge.errors import CxbridgeError as CxbridgeError
from cxbridge.executive.feature import Feature as Feature
from cxbridge.executive.host.environment import ClipsEnvironment as ClipsEnvironment
from cxbridge.interfaces.instance import Interface as Interface
from cxbridge.interfaces.stubs import *  # noqa: F403 - every shipped interface type
from cxbridge.run.program.finished import Run as Run
from cxbridge.run.program.finished import open_run as open_run
from cxbridge.run.program.run import run as run
from cxbridge.skiller.board.executor import Progress as Progress
from cxbridge.skiller.board.executor import SkillExecutor as SkillExecutor
from cxbridge.skiller.board.executor import SkillFailedError as SkillFailedError
from cxbridge.skiller.board.protocol import SkillCall as SkillCall

Skill = SkillExecutor
__version__: str
