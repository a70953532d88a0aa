"""Quality of service (QoS) of topics, services and actions: profiles with the names that ROS gives them."""

from __future__ import annotations

from typing import Final, Literal

from msgspec import Struct

Reliability = Literal["reliable", "best_effort"]
Durability = Literal["volatile", "transient_local"]


class QosProfile(Struct, frozen=True):
    """The QoS that a publisher offers or a subscription requests.

    :param reliability: whether lost messages are sent again.
    :param durability: ``transient_local`` also sends the last messages to late subscriptions.
    :param depth: the number of kept messages.
    """

    reliability: Reliability = "reliable"
    durability: Durability = "volatile"
    depth: int = 10


# Profiles by name. The values are those of ROS: rmw's qos_profiles.h, rcl_action for `action_status`, rclcpp
# for `clock` and `rosout`, tf2_ros for `tf` and `tf_static`. `latched` is a term of ROS 1.
PROFILES: Final = {
    "default": QosProfile(),
    "sensor_data": QosProfile(reliability="best_effort", depth=5),
    "services_default": QosProfile(depth=1000),  # an exception: ROS' depth of 10 loses requests of a burst
    "parameters": QosProfile(depth=1000),
    "action_status": QosProfile(durability="transient_local", depth=1),
    "latched": QosProfile(durability="transient_local", depth=1),
    "clock": QosProfile(reliability="best_effort", depth=1),
    "tf": QosProfile(depth=100),
    "tf_static": QosProfile(durability="transient_local", depth=100),
    "rosout": QosProfile(durability="transient_local", depth=1000),
}
