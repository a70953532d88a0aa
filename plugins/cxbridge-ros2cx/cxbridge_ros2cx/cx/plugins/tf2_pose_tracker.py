"""The plug-in ``cx::Tf2PoseTrackerPlugin``: facts with the poses of coordinate frames.

Rules start lookups of a child frame relative to a parent frame. Each lookup updates its fact at a fixed rate
from the transforms on ``/tf`` and ``/tf_static``.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Final

from msgspec import Struct

from cxbridge.clock import MICROSECONDS
from cxbridge.errors import ClipsError, TransformError
from cxbridge.executive.host.values import FALSE, TRUE, ExternalAddress, value_text
from cxbridge.rights import Right
from cxbridge.space.tf.buffer import TransformBuffer
from cxbridge_ros2.frames import FRAME_TOPICS, TF_MESSAGE_TYPE, decode_transform
from cxbridge_ros2.qos import PROFILES
from cxbridge_ros2cx.cx.ros.plugin import HandleTable, RosPlugin
from cxbridge_ros2cx.refresh import RefreshTimer

if TYPE_CHECKING:
    from cxbridge.executive.host.environment import ClipsEnvironment
    from cxbridge.executive.host.values import Value
    from cxbridge.space.tf.buffer import StampedTransform
    from cxbridge_ros2.messages import Message

_POSE_TEMPLATE: Final = "tf2-tracked-pose"
_SLOTS: Final = (
    "(slot parent (type STRING)) (slot child (type STRING)) (slot stamp (type FLOAT))"
    " (multislot translation (type FLOAT) (cardinality 3 3))"
    " (multislot rotation (type FLOAT) (cardinality 4 4)) (slot timer (type EXTERNAL-ADDRESS))"
)
# the start of a separate range of addresses, as HandleTable requires
_FIRST_ADDRESS: Final = 0x5300_0000_1000


class _PeriodicLookup(Struct, eq=False):
    """A lookup that a rule has started.

    :param address: the handle of the lookup, which is set when the table allocates it.
    :param fact_index: the index of the fact; None before the first successful lookup.
    :param pose_slots: the pose in the fact.
    """

    env: ClipsEnvironment
    parent: str
    child: str
    timer: RefreshTimer
    address: ExternalAddress = ExternalAddress(0)
    fact_index: int | None = None
    pose_slots: dict[str, Value] = {}


class Tf2PoseTrackerPlugin(RosPlugin):
    """Defines ``tf2-start-periodic-lookup`` and ``tf2-stop-periodic-lookup``."""

    def initialize(self) -> None:
        """Subscribe to the transforms."""
        self._buffer = TransformBuffer()
        self._lookups: HandleTable[_PeriodicLookup] = HandleTable("timer", _FIRST_ADDRESS)
        for topic, profile_name, is_static in FRAME_TOPICS:
            self.ros.node.subscribe(
                topic,
                TF_MESSAGE_TYPE,
                partial(self._receive, is_static=is_static),
                PROFILES[profile_name],
                right=Right.CONTROL,
            )

    def _receive(self, message: Message, *, is_static: bool) -> None:
        for transform in message["transforms"]:
            try:
                self._buffer.set_transform(decode_transform(transform), static=is_static)
            except TransformError as error:  # the other frames of the message may be valid
                self.log.warn(f"a frame is ignored: {error.message}")

    def init_context(self, env: ClipsEnvironment) -> None:
        if not env.has_template(_POSE_TEMPLATE):
            env.build(f"(deftemplate {_POSE_TEMPLATE} {_SLOTS})")
        self.define_function(env, "tf2-start-periodic-lookup", partial(self._start_lookup, env), "sy;sy;d")
        self.define_function(env, "tf2-stop-periodic-lookup", self._stop_lookup, "e")

    def _start_lookup(self, env: ClipsEnvironment, parent: str, child: str, rate_hz: float) -> Value:
        # the shortest period is a microsecond, the resolution of the clock
        if not 0 < rate_hz <= MICROSECONDS:
            raise ClipsError(f"the rate cannot be {rate_hz} Hz")
        lookup = _PeriodicLookup(
            env,
            str(parent),
            str(child),
            RefreshTimer(self.context.clock, round(MICROSECONDS / rate_hz)),
        )
        lookup.address = self._lookups.add(lookup)
        return TRUE

    def _stop_lookup(self, address: ExternalAddress) -> Value:
        try:
            self._lookups.find(address)
        except ClipsError:
            self.log.warn("no lookup has this timer")
            return FALSE
        self._lookups.destroy(address)
        return TRUE

    def tick(self) -> None:
        """Do the lookups that are due."""
        for lookup in self._lookups.objects():
            if lookup.timer.advance_if_due():
                try:
                    pose = self._buffer.lookup(lookup.parent, lookup.child)
                except TransformError as error:
                    self.log.warn(f"TF lookup failed: {error.message}")
                else:
                    with lookup.env.lock:
                        self._update_fact(lookup, pose)

    def _update_fact(self, lookup: _PeriodicLookup, pose: StampedTransform) -> None:
        """Assert the fact of a lookup, or modify the changed slots of the present fact."""
        env, pose_slots = lookup.env, _make_pose_slots(pose)
        previous_slots, lookup.pose_slots = lookup.pose_slots, pose_slots
        if lookup.fact_index is not None and env.has_fact(lookup.fact_index):
            changed_slots = " ".join(
                f"({name} {value_text(value)})"
                for name, value in pose_slots.items()
                if previous_slots.get(name) != value
            )
            env.eval(f"(modify {lookup.fact_index} {changed_slots})")
            return
        if lookup.fact_index is not None:
            # the text of the original, for a retracted fact
            self.log.warn(
                f"TF lookup from {lookup.parent} to {lookup.child}: "
                "fact was retained but does not exist anymore"
            )
        lookup.fact_index = env.assert_fact(
            _POSE_TEMPLATE,
            {"parent": lookup.parent, "child": lookup.child, **pose_slots, "timer": lookup.address},
        )

    def context_destroyed(self, env: ClipsEnvironment) -> None:
        """Stop the lookups of an environment."""
        for lookup in self._lookups.objects():
            if lookup.env is env:
                self._lookups.destroy(lookup.address)


def _make_pose_slots(pose: StampedTransform) -> dict[str, Value]:
    """Return the slots of a pose; as in the ROS 2 CX, coordinates that are whole numbers are INTEGERs."""
    return {
        "stamp": pose.stamp_us / MICROSECONDS,
        "translation": tuple(map(_to_clips_number, pose.transform.translation)),
        "rotation": tuple(map(_to_clips_number, pose.transform.rotation)),
    }


def _to_clips_number(value: float) -> int | float:
    return int(value) if value.is_integer() else value
