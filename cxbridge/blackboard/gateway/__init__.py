"""Mirror interfaces between two blackboards, whatever they are reached through.

::

    with Gateway(left, right, ["SkillerInterface::*"]) as gateway:
        gateway.start()
        ...
"""

from cxbridge.blackboard.gateway.gateway import Gateway, MirrorInfo
from cxbridge.blackboard.patterns import Pattern

__all__ = ["Gateway", "MirrorInfo", "Pattern"]
