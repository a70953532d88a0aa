"""Mirrors of interfaces between two blackboards with any transport.

::

    with Gateway(left, right, ["SkillerInterface::*"]) as gateway:
        gateway.start()
        ...
"""

from cxbridge.blackboard.gateway.gateway import Gateway, MirrorInfo
from cxbridge.blackboard.patterns import Pattern

__all__ = ["Gateway", "MirrorInfo", "Pattern"]
