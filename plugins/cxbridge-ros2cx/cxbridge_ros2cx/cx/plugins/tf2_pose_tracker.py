"""``cx::Tf2PoseTrackerPlugin``: keeps the pose of a frame relative to another in a fact."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Final

from msgspec import Struct

from cxbridge.clock import MICROSECONDS
from cxbridge.errors import ClipsError, TransformError
from cxbridge.executive.host.values import FALSE, TRUE, ExternalAddress, show
from cxbridge.rights import Right
from cxbridge.space.tf.buffer import TransformBuffer
from cxbridge_ros2.frames import TF_MESSAGE_TYPE, decode_transform
from cxbridge_ros2.qos import PROFILES
from cxbridge_ros2cx.cx.ros.plugin import Handles, RosPlugin
from cxbridge_ros2cx.refresh import RefreshTimer

if TYPE_CHECKING:
    from cxbridge.executive.host.environment import ClipsEnvironment
    from cxbridge.executive.host.values import Value
    from cxbridge.space.tf.buffer import StampedTransform
    from cxbridge_ros2.messages import Message

_TEMPLATE: Final = "tf2-tracked-pose"
_SLOTS: Final = (
    "(slot parent (type STRING)) (slot child (type STRING)) (slot stamp (type FLOAT))"
    " (multislot translation (type FLOAT) (cardinality 3 3))"
    " (multislot rotation (type FLOAT) (cardinality 4 4)) (slot timer (type EXTERNAL-ADDRESS))"
)
# addresses of different kinds have different ranges, so a mixed-up handle is unknown
_FIRST_TIMER: Final = 0x5300_0000_1000
_TOPICS: Final = (("/tf", "tf", False), ("/tf_static", "tf_static", True))


class _Lookup(Struct, eq=False):
    """A tracked frame.

    :param fact: the index of the fact; None before the first success.
    :param values: the slot values of the fact.
    """

    env: ClipsEnvironment
    parent: str
    child: str
    timer: RefreshTimer
    address: ExternalAddress = ExternalAddress(0)
    fact: int | None = None
    values: dict[str, Value] = {}


class Tf2PoseTrackerPlugin(RosPlugin):
    """Defines ``tf2-start-periodic-lookup`` and ``tf2-stop-periodic-lookup``."""

    def initialize(self) -> None:
        """Subscribe to the transforms."""
        self._buffer = TransformBuffer()
        self._timers: Handles[_Lookup] = Handles("timer", _FIRST_TIMER)
        self._lookups: list[_Lookup] = []
        for topic, profile, is_static in _TOPICS:
            receive = partial(self._receive, is_static=is_static)
            self.ros.node.subscribe(topic, TF_MESSAGE_TYPE, receive, PROFILES[profile], right=Right.CONTROL)

    def _receive(self, message: Message, *, is_static: bool) -> None:
        for transform in message["transforms"]:
            try:
                self._buffer.set_transform(decode_transform(transform), static=is_static)
            except TransformError as error:  # the other frames of the message are valid
                self.log.warn(f"a frame is left out: {error.message}")

    def init_context(self, env: ClipsEnvironment) -> None:
        if not env.has_template(_TEMPLATE):
            env.build(f"(deftemplate {_TEMPLATE} {_SLOTS})")
        self.define(env, "tf2-start-periodic-lookup", partial(self._start, env), "sy;sy;d", "b")
        self.define(env, "tf2-stop-periodic-lookup", self._stop, "e", "b")

    def _start(self, env: ClipsEnvironment, parent: str, child: str, rate: float) -> Value:
        # the shortest period is a microsecond, the resolution of the clock
        if not 0 < rate <= MICROSECONDS:
            raise ClipsError(f"a rate cannot be {rate} Hz")
        timer = RefreshTimer(self.context.clock, round(MICROSECONDS / rate))
        lookup = _Lookup(env, str(parent), str(child), timer)
        lookup.address = self._timers.add(lookup)
        self._lookups.append(lookup)
        return TRUE

    def _stop(self, address: ExternalAddress) -> Value:
        try:
            self._lookups.remove(self._timers.find(address))
        except ClipsError:
            self.log.warn("the timer to stop is unknown")
            return FALSE
        self._timers.destroy(address)
        return TRUE

    def tick(self) -> None:
        """Look up the frames that are due."""
        for lookup in list(self._lookups):
            if lookup.timer.advance_if_due():
                try:
                    pose = self._buffer.lookup(lookup.parent, lookup.child)
                except TransformError as error:
                    self.log.warn(f"TF lookup failed: {error.message}")
                else:
                    with lookup.env.lock:
                        self._update_fact(lookup, pose)

    def _update_fact(self, lookup: _Lookup, pose: StampedTransform) -> None:
        """Assert or modify the fact of a tracked frame."""
        env, values = lookup.env, _values(pose)
        previous_values, lookup.values = lookup.values, values
        if lookup.fact is not None and env.has_fact(lookup.fact):
            slots = " ".join(
                f"({name} {' '.join(map(show, value)) if isinstance(value, tuple) else show(value)})"
                for name, value in values.items()
                if previous_values.get(name) != value
            )
            env.eval(f"(modify {lookup.fact} {slots})")
            return
        if lookup.fact is not None:
            self.log.warn("fact was retained but does not exist anymore")
        lookup.fact = env.assert_fact(
            _TEMPLATE,
            {"parent": lookup.parent, "child": lookup.child, **values, "timer": lookup.address},
        )

    def context_destroyed(self, env: ClipsEnvironment) -> None:
        """Stop the lookups of an environment."""
        self._lookups = [lookup for lookup in self._lookups if lookup.env is not env]


def _values(pose: StampedTransform) -> dict[str, Value]:
    """Return stamp, translation and rotation; as in the original, whole numbers are INTEGERs."""
    return {
        "stamp": pose.stamp_us / MICROSECONDS,
        "translation": tuple(map(_number, pose.transform.translation)),
        "rotation": tuple(map(_number, pose.transform.rotation)),
    }


def _number(value: float) -> int | float:
    return int(value) if value.is_integer() else value
