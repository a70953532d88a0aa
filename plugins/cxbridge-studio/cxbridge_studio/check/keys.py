"""The configuration keys that the program reads, as listed in docs/configuration.md."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

_KEYS: Final = """
clips-executive: spec clips-dirs assert-time-each-loop automatic-goal-retraction steal-skiller-control
clips-executive: exact-retry request-redefine-warning-feature refresh-rate
clips-executive/pddl: strict
clips-executive/debug: enable level unwatch-facts unwatch-rules
clips-executive/specs/SPEC: blackboard-preload action-mapping/ACTION parameters/...
clips-executive/specs/SPEC/init/STAGE/N: name feature-request file files wait-for
clips: retract-early
clips-motor-switch: interface-id
clips-protobuf: proto-dirs modules frame-version max-message-size max-outbound max-waiting server-address
cxbridge: clock executive skiller speech core on-failure remote-control remote-programs watchdog
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
clips_features_manager: ...
ros2: clock/... experts/... interfaces/NAME/... node/... performers/NAME/... skiller/... tf/...
ros2cx: unsensed mode removal-blocks
game: seed minutes
llsfrb: comm/server-port mps/stations/STATION/connection
skill-board: name in-process timeouts/start timeouts/silence timeouts/cancel
skill-board/agents/NAME: skiller executors/KEY/...
skiller: skillspace mode watch_files features/navgraph/enable
skiller/limits: seconds_per_loop instructions_per_loop memory_per_loop
skiller/limits: instructions_to_load seconds_to_load memory
skiller/instances/NAME: kind skillspace mode
"""


def known_keys() -> tuple[tuple[str, ...], ...]:
    """Return all keys, split into parts; a part in capitals is any name, ``...`` is any key below."""
    lines = (line.partition(": ") for line in _KEYS.split("\n") if line)
    return tuple(tuple(f"{base}/{key}".split("/")) for base, _, keys in lines for key in keys.split())


class KeyCheck:
    """Finder of unknown keys."""

    def __init__(self) -> None:
        self._known = known_keys()

    def sections(self) -> set[str]:
        """Return the top-level keys."""
        return {key[0] for key in self._known}

    def first_unknown(self, path: tuple[str, ...]) -> tuple[int, set[str]] | None:
        """Return the index of the first unknown part and the known names there, or None."""
        keys = list(self._known)
        for index, part in enumerate(path):
            if any(key[index] == "..." for key in keys):
                return None
            after = [key for key in keys if _fits(key[index], part)]
            if not after:
                return index, {key[index] for key in keys if not _is_any(key[index])}
            keys = [key for key in after if len(key) > index + 1]
            if not keys:
                return None  # a value with keys below it is an error of type, not of name
        return None


def _is_any(part: str) -> bool:
    return part.isupper() or part == "..."


def _fits(part: str, name: str) -> bool:
    return part == name or _is_any(part)


def parts_of(path: str) -> tuple[str, ...]:
    return tuple(part for part in path.split("/") if part)


def prefixes(path: tuple[str, ...]) -> Iterator[str]:
    """Yield a path and its parents, longest first."""
    for end in range(len(path), 0, -1):
        yield "/" + "/".join(path[:end])
