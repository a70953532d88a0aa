"""The feature ``tf``: transforms between coordinate frames. See docs/features.md#tf."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from cxbridge.errors import CxbridgeError, TransformError
from cxbridge.executive.feature import Feature
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.executive.host.values import FALSE, TRUE, Value

if TYPE_CHECKING:
    from cxbridge.blackboard import BlackBoard
    from cxbridge.space.tf.listener import TransformListener
    from cxbridge.space.tf.publisher import TransformPublisher

_LOG = "ClipsTFThread"
# Results of failure and success: multifields, as in Fawkes, rather than symbols.
_NO: tuple[Value, ...] = (FALSE,)

_YES: tuple[Value, ...] = (TRUE,)


class TfFeature(Feature):
    """Provides the ``tf-*`` functions. Environments share known frames and publishers.

    :param board: the blackboard with the transforms.
    """

    name = "tf"

    def __init__(self, board: BlackBoard) -> None:
        self._board = board
        self._listener: TransformListener | None = None
        self._publishers: dict[str, TransformPublisher] = {}
        self._users: set[str] = set()

    def init_context(self, env: ClipsEnvironment) -> None:
        # imported on use: most agents do without transforms
        from cxbridge.space.tf import TransformListener  # noqa: PLC0415

        if self._listener is None:
            self._listener = TransformListener(self._board, owner=_LOG)
        self._users.add(env.name)
        self._define(env, _TransformFunctions(env, self._listener))

    def context_destroyed(self, env: ClipsEnvironment) -> None:
        """Close the interfaces after the last environment."""
        self._users.discard(env.name)
        if self._users:
            return
        if self._listener is not None:
            self._listener.close()
            self._listener = None
        for publisher in self._publishers.values():
            publisher.close()
        self._publishers.clear()

    def _define(self, env: ClipsEnvironment, functions: _TransformFunctions) -> None:
        define = env.define
        define("tf-quat-from-yaw", functions.quat_from_yaw, 1, types="*;ld")
        define("tf-yaw-from-quat", functions.yaw_from_quat, 1, types="*;m")
        define("tf-frame-exists", functions.frame_exists, 1, types="*;sy")
        define("tf-can-transform", functions.can_transform, 3, types="*;sy;sy;m")
        for name in ("point", "vector", "quaternion"):
            define(f"tf-transform-{name}", getattr(functions, name), 4, types="*;sy;sy;m;m")
        define("tf-transform-pose", functions.pose, 5, types="*;sy;sy;m;m;m")
        define("tf-add-publisher", lambda frame: self._add_publisher(env, frame), 1, types="*;sy")
        for name, static in (("tf-publish-pose-static", True), ("tf-publish-pose", False)):

            def publish(*given: Value, static: bool = static) -> Value:
                return self._publish(env, *given, static=static)

            define(name, publish, 5, types="*;sy;sy;ld;ld;ld")

    def _add_publisher(self, env: ClipsEnvironment, frame: str) -> Value:
        from cxbridge.space.tf import TransformPublisher  # noqa: PLC0415

        if frame in self._publishers:
            return _NO
        try:
            self._publishers[frame] = TransformPublisher(self._board, frame, owner=_LOG)
        except CxbridgeError as error:
            env.bus.logger(_LOG).warn(f"Cannot publish frame {frame}: {error}")
            return _NO
        return _YES

    def _publish(
        self, env: ClipsEnvironment, parent: str, frame: str, yaw: float, x: float, y: float, *, static: bool
    ) -> Value:
        from cxbridge.space.tf import StampedTransform, Transform  # noqa: PLC0415
        from cxbridge.space.tf.geometry import quaternion_from_yaw  # noqa: PLC0415

        publisher = self._publishers.get(frame)
        if publisher is None:
            return _NO
        transform = Transform((float(x), float(y), 0.0), quaternion_from_yaw(float(yaw)))
        publisher.send(StampedTransform(transform, env.bus.clock.now_us(), parent, frame), static=static)
        return _YES


class _TransformFunctions:
    """The functions that query transforms."""

    def __init__(self, env: ClipsEnvironment, listener: TransformListener) -> None:
        from cxbridge.space.tf import geometry  # noqa: PLC0415

        self._log = env.bus.logger(_LOG)
        self._buffer = listener.buffer
        self._geometry = geometry

    def quat_from_yaw(self, yaw: float) -> Value:
        return self._geometry.quaternion_from_yaw(float(yaw))

    def yaw_from_quat(self, quat: Value) -> Value:
        x, y, z, w = self._numbers("quaternion", quat, 4) or (0.0, 0.0, 0.0, 1.0)
        return self._geometry.yaw_of((x, y, z, w))

    def frame_exists(self, frame: str) -> Value:
        return self._buffer.frame_exists(frame)

    def can_transform(self, target: str, source: str, time: Value) -> Value:
        when = self._time(time)
        return when is not None and self._buffer.can_transform(target, source, when)

    def point(self, target: str, source: str, time: Value, point: Value) -> Value:
        return self._three("point", self._buffer.transform_point, target, source, time, point)

    def vector(self, target: str, source: str, time: Value, vector: Value) -> Value:
        return self._three("vector", self._buffer.transform_vector, target, source, time, vector)

    def _three(
        self, kind: str, transform: Callable[..., Any], target: str, source: str, time: Value, given: Value
    ) -> Value:
        when, numbers = self._time(time), self._numbers(kind, given, 3)
        if when is None or numbers is None:
            return _NO
        return self._answer(kind, target, source, lambda: transform(target, numbers, source, when)[0])

    def quaternion(self, target: str, source: str, time: Value, quat: Value) -> Value:
        when, rotation = self._time(time), self._numbers("quaternion", quat, 4)
        if when is None or rotation is None:
            return _NO
        x, y, z, w = rotation
        return self._answer(
            "quaternion",
            target,
            source,
            lambda: self._buffer.transform_quaternion(target, (x, y, z, w), source, when)[0],
        )

    def pose(self, target: str, source: str, time: Value, translation: Value, rotation: Value) -> Value:
        when = self._time(time)
        origin, quat = self._numbers("vector", translation, 3), self._numbers("quaternion", rotation, 4)
        if when is None or origin is None or quat is None:
            return _NO

        def transform() -> tuple[float, ...]:
            normalized = self._geometry.normalized((quat[0], quat[1], quat[2], quat[3]))
            given = self._geometry.Transform((origin[0], origin[1], origin[2]), normalized)
            pose, _ = self._buffer.transform_pose(target, given, source, when)
            return (*pose.translation, *pose.rotation)

        return self._answer("pose", target, source, transform)

    def _answer(
        self, kind: str, target: str, source: str, transform: Callable[[], tuple[float, ...]]
    ) -> Value:
        try:
            return transform()
        except TransformError as error:
            self._log.warn(f"Failed to transform {kind} from {source} to {target}: {error.message}")
            return _NO

    def _time(self, time: Value) -> int | None:
        """Return a time in microseconds; None after a warning."""
        if not isinstance(time, tuple) or len(time) != 2:  # noqa: PLR2004 - seconds and microseconds
            self._log.warn("Invalid time: must be list of exactly two entries")
            return None
        if not all(isinstance(part, int) for part in time):
            self._log.warn("Invalid time: must be list of integers")
            return None
        return int(time[0]) * 1_000_000 + int(time[1])

    def _numbers(self, kind: str, given: Value, count: int) -> tuple[float, ...] | None:
        if not isinstance(given, tuple) or len(given) != count:
            words = {3: "three", 4: "four"}
            self._log.warn(f"Invalid {kind}: must be list of exactly {words[count]} entries")
            return None
        if not all(isinstance(part, int | float) for part in given):
            self._log.warn(f"Invalid {kind}: must be list of floats or integers")
            return None
        return tuple(float(part) for part in given)
