"""Learning agents of the ROS 2 CX as environments of Gymnasium, the interface of libraries for learning.

A learning agent loads the package ``cx_rl_clips`` of carologistics/clips_executive. The import of this
package registers the environment; ``gymnasium.make("cxbridge/CXRL-v0", parameters=FILE, ros2cx=DIR)`` makes
the environment of an agent.
"""

from __future__ import annotations

from typing import Final

from cxbridge.errors import CxbridgeError
from cxbridge.extras import install_command

try:
    from gymnasium.envs.registration import register
except ImportError:
    raise CxbridgeError(
        "learning needs the package gymnasium", hint=install_command("rl", "cxbridge-ros2cx")
    ) from None

ENVIRONMENT_ID: Final = "cxbridge/CXRL-v0"  # the id for `gymnasium.make`

register(ENVIRONMENT_ID, entry_point=f"{__name__}.gym:ClipsGym")
