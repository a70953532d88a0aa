"""The feature ``tf``: transforms between coordinate frames. See docs/features.md#tf."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

from cxbridge.errors import ClipsError, CxbridgeError, TransformError
from cxbridge.executive.feature import Feature, define_logged
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.executive.host.values import FALSE, TRUE, Value

if TYPE_CHECKING:
    from cxbridge.blackboard import BlackBoard
    from cxbridge.space.tf.listener import TransformListener
    from cxbridge.space.tf.publisher import TransformPublisher

_THREAD_NAME = "ClipsTFThread"
# the results of functions that return multifields: in Fawkes, these return a multifield after a failure, too
_FAILED: tuple[Value, ...] = (FALSE,)
_SUCCEEDED: tuple[Value, ...] = (TRUE,)


class TfFeature(Feature):
    """Provides the ``tf-*`` functions. All environments share the known frames and the publishers.

    :param board: the blackboard with the transforms.
    """

    name = "tf"

    def __init__(self, board: BlackBoard) -> None:
        self._board = board
        self._listener: TransformListener | None = None
        self._publishers: dict[str, TransformPublisher] = {}
        self._environment_names: set[str] = set()  # the environments with the feature

    def init_context(self, env: ClipsEnvironment) -> None:
        # imported on use: most agents do without transforms
        from cxbridge.space.tf import TransformListener  # noqa: PLC0415

        if self._listener is None:
            self._listener = TransformListener(self._board, owner=_THREAD_NAME)
        self._environment_names.add(env.name)
        functions, log = _TransformFunctions(self._listener), env.bus.logger(_THREAD_NAME)
        for name, function, types, failure in (
            ("quat-from-yaw", functions.quat_from_yaw, "*;ld", _FAILED),
            ("yaw-from-quat", functions.yaw_from_quat, "*;m", 0.0),
            ("frame-exists", functions.frame_exists, "*;sy", FALSE),
            ("can-transform", functions.can_transform, "*;sy;sy;m", FALSE),
            ("transform-point", functions.transform_point, "*;sy;sy;m;m", _FAILED),
            ("transform-vector", functions.transform_vector, "*;sy;sy;m;m", _FAILED),
            ("transform-quaternion", functions.transform_quaternion, "*;sy;sy;m;m", _FAILED),
            ("transform-pose", functions.transform_pose, "*;sy;sy;m;m;m", _FAILED),
        ):
            define_logged(env, f"tf-{name}", function, types, failure, lambda error: log.warn(error.message))
        env.define("tf-add-publisher", partial(self._add_publisher, env), 1, types="*;sy")
        for name, is_static in (("tf-publish-pose-static", True), ("tf-publish-pose", False)):
            env.define(name, partial(self._publish, env, is_static=is_static), 5, types="*;sy;sy;ld;ld;ld")

    def context_destroyed(self, env: ClipsEnvironment) -> None:
        """Close the interfaces if this is the last environment with the feature."""
        self._environment_names.discard(env.name)
        if not self._environment_names and self._listener is not None:
            self._listener.close()
            self._listener = None
            for publisher in self._publishers.values():
                publisher.close()
            self._publishers.clear()

    def _add_publisher(self, env: ClipsEnvironment, frame: str) -> Value:
        from cxbridge.space.tf import TransformPublisher  # noqa: PLC0415 - as in init_context

        if frame in self._publishers:  # a frame has one writer on the blackboard
            return _FAILED
        try:
            self._publishers[frame] = TransformPublisher(self._board, frame, owner=_THREAD_NAME)
        except CxbridgeError as error:
            env.bus.logger(_THREAD_NAME).warn(f"Cannot publish frame {frame}: {error}")
            return _FAILED
        return _SUCCEEDED

    def _publish(
        self,
        env: ClipsEnvironment,
        parent: str,
        frame: str,
        yaw: float,
        x: float,
        y: float,
        *,
        is_static: bool,
    ) -> Value:
        from cxbridge.space.tf import StampedTransform, Transform  # noqa: PLC0415 - as in init_context
        from cxbridge.space.tf.geometry import quaternion_from_yaw  # noqa: PLC0415 - as in init_context

        publisher = self._publishers.get(frame)
        if publisher is None:
            return _FAILED
        transform = Transform((float(x), float(y), 0.0), quaternion_from_yaw(float(yaw)))
        publisher.send(StampedTransform(transform, env.bus.clock.now_us(), parent, frame), static=is_static)
        return _SUCCEEDED


class _TransformFunctions:
    """The functions that query transforms. They raise errors for wrong arguments and missing transforms."""

    def __init__(self, listener: TransformListener) -> None:
        from cxbridge.space.tf import geometry  # noqa: PLC0415 - as in init_context

        self._buffer = listener.buffer
        self._geometry = geometry

    def quat_from_yaw(self, yaw: float) -> Value:
        return self._geometry.quaternion_from_yaw(float(yaw))

    def yaw_from_quat(self, quat: Value) -> Value:
        return self._geometry.quaternion_yaw(_to_floats("quaternion", quat, 4))

    def frame_exists(self, frame: str) -> Value:
        return self._buffer.frame_exists(frame)

    def can_transform(self, target: str, source: str, time: Value) -> Value:
        return self._buffer.can_transform(target, source, _to_microseconds(time))

    def transform_point(self, target: str, source: str, time: Value, point: Value) -> Value:
        numbers = _to_floats("point", point, 3)
        return _transform("point", self._buffer.transform_point, target, source, time, numbers)

    def transform_vector(self, target: str, source: str, time: Value, vector: Value) -> Value:
        numbers = _to_floats("vector", vector, 3)
        return _transform("vector", self._buffer.transform_vector, target, source, time, numbers)

    def transform_quaternion(self, target: str, source: str, time: Value, quat: Value) -> Value:
        numbers = _to_floats("quaternion", quat, 4)
        return _transform("quaternion", self._buffer.transform_quaternion, target, source, time, numbers)

    def transform_pose(
        self, target: str, source: str, time: Value, translation: Value, rotation: Value
    ) -> Value:
        origin, quat = _to_floats("vector", translation, 3), _to_floats("quaternion", rotation, 4)
        pose = self._geometry.Transform(origin, self._geometry.normalize(quat))
        transformed = _transform("pose", self._buffer.transform_pose, target, source, time, pose)
        return (*transformed.translation, *transformed.rotation)


def _transform(
    kind: str, transform: Callable[..., Any], target: str, source: str, time: Value, value: object
) -> Any:
    """Return a value in the target frame.

    :param kind: the noun of the value, for the error, which names the frames as Fawkes' log does.
    :param transform: the method of the buffer for such values.
    :raises ClipsError: if the time is invalid or the transform is unknown.
    """
    try:
        # without the second item, the time of the transform
        return transform(target, value, source, _to_microseconds(time))[0]
    except TransformError as error:
        raise ClipsError(f"Failed to transform {kind} from {source} to {target}: {error.message}") from None


def _to_microseconds(time: Value) -> int:
    """Return a time, given as seconds and microseconds, in microseconds.

    :raises ClipsError: if the time is not a multifield of two INTEGERs.
    """
    if not isinstance(time, tuple) or len(time) != 2:  # noqa: PLR2004 - seconds and microseconds
        raise ClipsError("Invalid time: must be list of exactly two entries")
    if not all(isinstance(number, int) for number in time):
        raise ClipsError("Invalid time: must be list of integers")
    return int(time[0]) * 1_000_000 + int(time[1])


def _to_floats(kind: str, numbers: Value, count: int) -> Any:
    """Return the numbers of a multifield as floats.

    :param kind: the noun of the value, for errors.
    :param count: the required number of fields: 3 or 4.
    :raises ClipsError: if the multifield has another number of fields, or other fields than numbers.
    """
    if not isinstance(numbers, tuple) or len(numbers) != count:
        count_words = {3: "three", 4: "four"}
        raise ClipsError(f"Invalid {kind}: must be list of exactly {count_words[count]} entries")
    if not all(isinstance(number, int | float) for number in numbers):
        raise ClipsError(f"Invalid {kind}: must be list of floats or integers")
    return tuple(map(float, numbers))
