"""Mirror interfaces between two blackboards, whatever they are reached through.

::

    with Gateway(left, right, ["SkillerInterface::*"]) as gateway:
        gateway.start()
        ...
"""

from cxbridge.blackboard.patterns import Pattern
from cxbridge.gateway.gateway import Gateway, MirrorInfo

__all__ = ["Gateway", "MirrorInfo", "Pattern"]
