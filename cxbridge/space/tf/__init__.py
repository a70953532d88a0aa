"""Coordinate frames: a tree of transforms over time, from TransformInterfaces (docs/features.md)."""

from cxbridge.space.tf.buffer import StampedTransform, TransformBuffer
from cxbridge.space.tf.geometry import Quaternion, Transform, Vector
from cxbridge.space.tf.listener import TransformListener
from cxbridge.space.tf.publisher import TransformPublisher

__all__ = [
    "Quaternion",
    "StampedTransform",
    "Transform",
    "TransformBuffer",
    "TransformListener",
    "TransformPublisher",
    "Vector",
]
