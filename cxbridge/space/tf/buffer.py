"""A buffer that keeps the transforms between frames for some seconds and looks up transforms at a time.

Times are microseconds since the epoch; 0 is the latest time for which all needed transforms exist. The rules
are those of tf in Fawkes and ROS: ``docs/features.md#tf``.
"""

from __future__ import annotations

import itertools
import math
import threading
from bisect import bisect_left, bisect_right
from typing import Final

from msgspec import Struct

from cxbridge.space.tf.errors import ExtrapolationError, NotConnectedError, UnknownFrameError
from cxbridge.space.tf.geometry import (
    Quaternion,
    Transform,
    Vector,
    lerp,
    multiply,
    normalize,
    rotate,
    slerp,
)

LATEST: Final = 0
"""The time argument for the latest existing time."""

MAX_DEPTH: Final = 1000
"""The number of transforms to the root above which the path counts as a loop, as in Fawkes."""


class StampedTransform(Struct, frozen=True):
    """A transform at a time.

    :param stamp_us: the time in microseconds since the epoch.
    :param child_frame: the frame positioned in the parent.
    """

    transform: Transform
    stamp_us: int
    frame: str
    child_frame: str


class _History:
    """The transforms of one frame to its parent, from the oldest."""

    __slots__ = ("is_static", "stamps_us", "transforms")

    def __init__(self, *, is_static: bool) -> None:
        self.is_static = is_static
        self.stamps_us: list[int] = []  # of the transforms, in the same order
        self.transforms: list[StampedTransform] = []

    def insert(self, stamped: StampedTransform, keep_us: int) -> bool:
        """Add a transform, and drop those that are older than the latest by more than ``keep_us``.

        :returns: whether the transform was recent enough to be added.
        """
        if self.is_static:
            self.stamps_us, self.transforms = [LATEST], [stamped]
            return True
        if self.stamps_us and stamped.stamp_us < self.stamps_us[-1] - keep_us:
            return False
        position = bisect_right(self.stamps_us, stamped.stamp_us)  # transforms may arrive out of order
        self.stamps_us.insert(position, stamped.stamp_us)
        self.transforms.insert(position, stamped)
        outdated_count = bisect_left(self.stamps_us, self.stamps_us[-1] - keep_us)
        del self.stamps_us[:outdated_count], self.transforms[:outdated_count]
        return True

    def transform_at(self, time_us: int) -> StampedTransform:
        """Return the transform at a time.

        This is the last transform for :data:`LATEST`, for a static frame, and from the last stamp on.

        :raises ExtrapolationError: if all transforms are later.
        """
        transforms = self.transforms
        if time_us == LATEST or self.is_static or time_us >= self.stamps_us[-1]:
            return transforms[-1]
        later_index = bisect_right(self.stamps_us, time_us)
        if later_index == 0:
            raise ExtrapolationError(
                "Lookup would require extrapolation into the past. Requested time "
                f"{_format_time(time_us)}, but the earliest data is at time {_format_time(self.stamps_us[0])}"
            )
        earlier, later = transforms[later_index - 1], transforms[later_index]
        # transforms to different parents cannot be interpolated
        if earlier.stamp_us == time_us or earlier.frame != later.frame:
            return earlier
        ratio = (time_us - earlier.stamp_us) / (later.stamp_us - earlier.stamp_us)
        return StampedTransform(
            Transform(
                lerp(earlier.transform.translation, later.transform.translation, ratio),
                slerp(earlier.transform.rotation, later.transform.rotation, ratio),
            ),
            time_us,
            earlier.frame,
            earlier.child_frame,
        )


class TransformBuffer:
    """Stores transforms of frames and computes the transforms between any two frames. Thread-safe.

    Leading slashes of frame names are ignored.

    :param keep_seconds: the age, relative to the latest transform of the same frame, above which transforms
        are dropped; by default that of Fawkes.
    """

    def __init__(self, keep_seconds: float = 10.0) -> None:
        self._keep_us = round(keep_seconds * 1_000_000)
        self._histories: dict[str, _History] = {}
        self._frames: set[str] = set()  # all frames, including roots, which have no history
        self._lock = threading.RLock()

    def set_transform(self, stamped: StampedTransform, *, static: bool = False) -> bool:
        """Store a transform.

        :param static: whether the transform is valid for all times; the first transform of a frame decides
            for the frame.
        :returns: whether the transform was stored; False if the name of a frame is empty, parent and child
            are equal, a coordinate of the translation is NaN, or the transform is too old.
        :raises InvalidRotationError: if the rotation is invalid.
        """
        frame, child = _strip_slash(stamped.frame), _strip_slash(stamped.child_frame)
        if not frame or not child or frame == child or any(map(math.isnan, stamped.transform.translation)):
            return False
        transform = Transform(stamped.transform.translation, normalize(stamped.transform.rotation))
        with self._lock:
            history = self._histories.get(child)
            if history is None:  # the first transform decides whether the frame is static, as in tf
                history = self._histories[child] = _History(is_static=static)
                self._frames |= {frame, child}
            self._frames.add(frame)
            return history.insert(StampedTransform(transform, stamped.stamp_us, frame, child), self._keep_us)

    def frame_exists(self, frame: str) -> bool:
        """Return whether the frame is known."""
        return _strip_slash(frame) in self._frames

    @property
    def frames(self) -> dict[str, str | None]:
        """The parent of each frame by its latest transform, None for roots."""
        with self._lock:
            return {
                name: self._histories[name].transforms[-1].frame if name in self._histories else None
                for name in sorted(self._frames)
            }

    def lookup(self, target: str, source: str, time_us: int = LATEST) -> StampedTransform:
        """Return the transform from the frame ``source`` to the frame ``target``.

        :raises UnknownFrameError: if a frame is unknown, or the tree of frames has a loop.
        :raises NotConnectedError: if the frames are in different trees.
        :raises ExtrapolationError: if the time precedes the stored transforms.
        """
        target, source = _strip_slash(target), _strip_slash(source)
        with self._lock:
            for frame in (target, source):
                if frame not in self._frames:
                    raise UnknownFrameError(f'Frame ID "{frame}" does not exist.')
            stamp_us = self._find_latest_common_time(target, source) if time_us == LATEST else time_us
            return StampedTransform(
                self._transform_via_ancestor(target, source, stamp_us),
                stamp_us,
                target,
                source,
            )

    def lookup_via(
        self, target: str, target_us: int, source: str, source_us: int, fixed_frame: str
    ) -> StampedTransform:
        """Return the transform from ``source`` at one time to ``target`` at another time.

        :param target_us: the time of ``target``, and of the result.
        :param source_us: the time of ``source``.
        :param fixed_frame: a frame that does not move between the times.
        :raises TransformError: as :meth:`lookup`.
        """
        to_fixed = self.lookup(fixed_frame, source, source_us)
        to_target = self.lookup(target, fixed_frame, target_us)
        return StampedTransform(
            to_target.transform * to_fixed.transform,
            to_target.stamp_us,
            _strip_slash(target),
            _strip_slash(source),
        )

    def can_transform(self, target: str, source: str, time_us: int = LATEST) -> bool:
        """Return whether :meth:`lookup` succeeds; True for equal frames, even for unknown frames."""
        if _strip_slash(target) == _strip_slash(source):
            return True  # as in tf, which does not search for equal frames
        try:
            self.lookup(target, source, time_us)
        except (UnknownFrameError, NotConnectedError, ExtrapolationError):
            return False
        return True

    def transform_point(
        self, target: str, point: Vector, frame: str, time_us: int = LATEST
    ) -> tuple[Vector, int]:
        """Transform a point from ``frame`` to ``target``; return the result and its time.

        :raises TransformError: if the transform is unknown.
        """
        stamped = self.lookup(target, frame, time_us)
        return stamped.transform.apply(point), stamped.stamp_us

    def transform_vector(
        self, target: str, vector: Vector, frame: str, time_us: int = LATEST
    ) -> tuple[Vector, int]:
        """Transform a direction from ``frame`` to ``target``; return the result and its time.

        :raises TransformError: if the transform is unknown.
        """
        stamped = self.lookup(target, frame, time_us)
        return rotate(stamped.transform.rotation, vector), stamped.stamp_us

    def transform_quaternion(
        self, target: str, rotation: Quaternion, frame: str, time_us: int = LATEST
    ) -> tuple[Quaternion, int]:
        """Transform a rotation from ``frame`` to ``target``; return the result and its time.

        :raises TransformError: if the transform is unknown, or the quaternion is not a rotation.
        """
        rotation = normalize(rotation)
        stamped = self.lookup(target, frame, time_us)
        return multiply(stamped.transform.rotation, rotation), stamped.stamp_us

    def transform_pose(
        self, target: str, pose: Transform, frame: str, time_us: int = LATEST
    ) -> tuple[Transform, int]:
        """Transform a pose from ``frame`` to ``target``; return the result and its time.

        :raises TransformError: if the transform is unknown.
        """
        stamped = self.lookup(target, frame, time_us)
        return stamped.transform * pose, stamped.stamp_us

    def _find_latest_common_time(self, target: str, source: str) -> int:
        """Return the latest common time of all transforms between two frames; 0 if all are static.

        :raises NotConnectedError: if the frames are in different trees.
        :raises UnknownFrameError: if the tree of frames has a loop.
        """
        source_path = self._find_path_to_root(source)
        if target == source:
            transforms = source_path[:1]
        else:
            ancestors = {source} | {stamped.frame for stamped in source_path}
            common_frame = target  # becomes the first common ancestor
            transforms = []
            for stamped in self._find_path_to_root(target):
                if common_frame in ancestors:
                    break
                transforms.append(stamped)
                common_frame = stamped.frame
            if common_frame not in ancestors:
                raise _not_connected_error(target, source)
            transforms += itertools.takewhile(
                lambda stamped: stamped.child_frame != common_frame, source_path
            )
        stamps = [
            stamped.stamp_us for stamped in transforms if not self._histories[stamped.child_frame].is_static
        ]
        return min(stamps, default=LATEST)

    def _find_path_to_root(self, frame: str) -> list[StampedTransform]:
        """Return the latest transforms from a frame to its parent, and so on to the root."""
        path: list[StampedTransform] = []
        while frame in self._histories:
            path.append(self._histories[frame].transforms[-1])
            frame = path[-1].frame
            if len(path) > MAX_DEPTH:
                raise UnknownFrameError("The tf tree is invalid because it contains a loop.")
        return path

    def _transform_via_ancestor(self, target: str, source: str, time_us: int) -> Transform:
        """Return the transform from ``source`` to ``target`` via their first common ancestor."""
        source_poses, source_error = self._climb(source, target, time_us)
        if target in source_poses:
            return source_poses[target]
        target_poses, target_error = self._climb(target, "", time_us, known_poses=source_poses)
        common_frame = next(reversed(target_poses))  # the last frame of the climb
        if common_frame not in source_poses:
            error = target_error or source_error
            if error is None:
                raise _not_connected_error(target, source)
            raise ExtrapolationError(
                f"{error.message}, when looking up transform from frame [{source}] to frame [{target}]"
            )
        return target_poses[common_frame].inverse() * source_poses[common_frame]

    def _climb(
        self, frame: str, goal: str, time_us: int, known_poses: dict[str, Transform] | None = None
    ) -> tuple[dict[str, Transform], ExtrapolationError | None]:
        """Climb from a frame to its ancestors; return the frame's pose in each of them, the nearest first.

        The first pose is that in the frame itself. The climb ends at the goal, at a frame in ``known_poses``,
        at the root, or at a frame without a transform for the time; the error of such a frame is returned,
        else None.

        :raises UnknownFrameError: if the tree of frames has a loop.
        """
        poses = {frame: Transform()}
        while (
            frame != goal and (known_poses is None or frame not in known_poses) and frame in self._histories
        ):
            try:
                stamped = self._histories[frame].transform_at(time_us)
            except ExtrapolationError as error:
                return poses, error
            if stamped.frame in poses:
                raise UnknownFrameError("The tf tree is invalid because it contains a loop.")
            poses[stamped.frame] = stamped.transform * poses[frame]
            frame = stamped.frame
        return poses, None


def _strip_slash(frame: str) -> str:
    return frame.removeprefix("/")


def _format_time(time_us: int) -> str:
    return f"{time_us // 1_000_000}.{time_us % 1_000_000:06}"


def _not_connected_error(target: str, source: str) -> NotConnectedError:
    return NotConnectedError(
        f"Could not find a connection between '{target}' and '{source}' because they are not part of the "
        "same tree. Tf has two or more unconnected trees."
    )
