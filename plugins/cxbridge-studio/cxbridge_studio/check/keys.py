"""The configuration keys that the program reads, as docs/configuration.md lists them.

A test compares this list with the page. The list is in the code, because an installed program has no pages.
"""

from __future__ import annotations

from functools import cache
from typing import Final

# Each line has a path and the keys below that path. A key in capitals stands for any name, ``...`` for any
# further keys.
_KNOWN_KEYS: Final = """
clips-executive: spec clips-dirs assert-time-each-loop automatic-goal-retraction steal-skiller-control
clips-executive: exact-retry request-redefine-warning-feature refresh-rate
clips-executive/pddl: strict
clips-executive/debug: enable level unwatch-facts unwatch-rules
clips-executive/specs/SPEC: blackboard-preload action-mapping/ACTION parameters/...
clips-executive/specs/SPEC/init/STAGE/N: name feature-request file files wait-for
clips: retract-early
clips-motor-switch: interface-id
clips-protobuf: proto-dirs server-address
cxbridge: clock executive skiller speech core on-failure remote-control remote-programs
cxbridge/agents/NAME: spec config/...
cxbridge/robot-memory: backend file uri
cxbridge/zmq: endpoints secret-key clients insecure
cxbridge/fawkes: enable host port allow
cxbridge/foxglove: allow-origins enable host insecure port
cxbridge/web: enable host port token tls-cert tls-key allow-origins
cxbridge/record: trace files level log bblog
fawkes: agent/name agent/team bbsync/peers/ROBOT/... mainapp/desired_loop_time
navgraph: graph_file allow_multi_graph
planner: planner timeout at-once memory check-plans options/KEY write-problem
plugins: ...
frames: ...
clips_executive: ros__parameters/...
clips_features_manager: ...
ros2: clock/... experts/... interfaces/NAME/... node/... performers/NAME/... skiller/... tf/...
ros2cx: unsensed mode removal-blocks
game: seed minutes
llsfrb: comm/server-port mps/stations/STATION/connection
skill-board: name in-process timeouts/start timeouts/silence timeouts/cancel
skill-board/agents/NAME: skiller executors/KEY/...
skiller: skillspace mode watch_files features/navgraph/enable
skiller/instances/NAME: kind skillspace mode
"""


@cache
def list_known_keys() -> tuple[tuple[str, ...], ...]:
    """Return the paths of all keys, split at the slashes."""
    lines = (line.partition(": ") for line in _KNOWN_KEYS.split("\n") if line)
    return tuple(split_path(f"{parent}/{key}") for parent, _, keys in lines for key in keys.split())


def find_unknown_name(path: tuple[str, ...]) -> tuple[int, set[str]] | None:
    """Return the index of the first unknown name in a path, and the known names at this index.

    The result is None if all names are known, or if the path continues below a value.
    """
    keys = list(list_known_keys())
    for index, name in enumerate(path):
        if any(key[index] == "..." for key in keys):
            return None
        matching_keys = [key for key in keys if key[index] == name or _is_wildcard(key[index])]
        if not matching_keys:
            return index, {key[index] for key in keys if not _is_wildcard(key[index])}
        keys = [key for key in matching_keys if len(key) > index + 1]
        if not keys:
            return None  # keys below a value are a mistake in the type, not in a name
    return None


def _is_wildcard(name: str) -> bool:
    """Return whether a name in the list stands for any name."""
    return name.isupper() or name == "..."


def split_path(path: str) -> tuple[str, ...]:
    return tuple(name for name in path.split("/") if name)
