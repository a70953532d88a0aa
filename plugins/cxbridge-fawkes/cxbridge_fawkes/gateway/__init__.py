"""Mirrors of interfaces between two blackboards with any transport.

::

    with Gateway(left, right, ["SkillerInterface::*"]) as gateway:
        gateway.start()
        ...
"""

from cxbridge.blackboard.patterns import Pattern
from cxbridge_fawkes.gateway.gateway import Gateway, MirrorInfo

__all__ = ["Gateway", "MirrorInfo", "Pattern"]
