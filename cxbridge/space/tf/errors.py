"""Errors of transform lookups."""

from __future__ import annotations

from cxbridge.errors import TransformError


class UnknownFrameError(TransformError):
    """A frame is unknown, or the tree of frames has a loop."""


class NotConnectedError(TransformError):
    """Two frames are in different trees."""


class ExtrapolationError(TransformError):
    """The requested time precedes the stored transforms."""


class InvalidRotationError(TransformError):
    """A quaternion is not a rotation: it has a NaN, or its length is not about 1."""
