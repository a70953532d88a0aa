"""Mirror interfaces between two blackboards, whatever they are reached through.

::

    with Gateway(left, right, ["SkillerInterface::*"]) as gateway:
        gateway.start()
        ...
"""

from cxbridge.gateway.gateway import Gateway, MirrorInfo, Pattern

__all__ = ["Gateway", "MirrorInfo", "Pattern"]
