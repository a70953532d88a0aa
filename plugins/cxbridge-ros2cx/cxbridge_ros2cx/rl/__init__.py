"""Agents of ``cx_rl_clips`` as Gymnasium environments; importing this package registers them.

``gymnasium.make("cxbridge/CXRL-v0", parameters=FILE, ros2cx=DIR)`` creates one.
"""

from __future__ import annotations

from typing import Final

from cxbridge.errors import CxbridgeError

try:
    from gymnasium.envs.registration import register
except ImportError:
    raise CxbridgeError(
        "learning needs the package gymnasium", hint="pip install 'cxbridge-ros2cx[rl]'"
    ) from None

ID: Final = "cxbridge/CXRL-v0"  # id for `gymnasium.make`

register(ID, entry_point=f"{__name__}.gym:ClipsGym")
