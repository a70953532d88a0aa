"""Coordinate frames: a tree of transforms over time, fed from TransformInterfaces. See ``docs/tf.md``."""

from cxbridge.tf.buffer import StampedTransform, TransformBuffer
from cxbridge.tf.geometry import Quaternion, Transform, Vector
from cxbridge.tf.listener import TransformListener
from cxbridge.tf.publisher import TransformPublisher

__all__ = [
    "Quaternion",
    "StampedTransform",
    "Transform",
    "TransformBuffer",
    "TransformListener",
    "TransformPublisher",
    "Vector",
]
