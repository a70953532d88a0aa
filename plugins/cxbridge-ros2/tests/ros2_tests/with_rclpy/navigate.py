"""A robot with straight drives: a server of NavigateToPose by the real rclpy."""

import math
import time

import rclpy
from nav2_msgs.action import NavigateToPose
from rclpy.action import ActionServer, CancelResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import MultiThreadedExecutor

SPEED = 4.0
STEP_S = 0.02
position = [0.0, 0.0]


def drive(goal):
    pose = goal.request.pose
    place = pose.pose.position
    print("drive to", pose.header.frame_id, place.x, place.y, pose.pose.orientation.w, flush=True)  # noqa: T201
    while (left := math.dist(position, (place.x, place.y))) > SPEED * STEP_S:
        if goal.is_cancel_requested:
            goal.canceled()
            return NavigateToPose.Result()
        for axis, target in enumerate((place.x, place.y)):
            position[axis] += (target - position[axis]) * SPEED * STEP_S / left
        goal.publish_feedback(NavigateToPose.Feedback(distance_remaining=left))
        time.sleep(STEP_S)
    position[:] = place.x, place.y
    goal.succeed()
    return NavigateToPose.Result()


rclpy.init()
node = rclpy.create_node("robot")
server = ActionServer(
    node,
    NavigateToPose,
    "/navigate_to_pose",
    drive,
    callback_group=ReentrantCallbackGroup(),
    cancel_callback=lambda _goal: CancelResponse.ACCEPT,
)
executor = MultiThreadedExecutor()
executor.add_node(node)
print("ready", flush=True)  # noqa: T201
executor.spin()
