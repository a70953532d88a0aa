"""Execute skill strings by the action of cxbridge, and read SkillerInterface; the argument is the domain."""

import sys

import rclpy
from cxbridge_msgs.action import ExecSkill
from cxbridge_msgs.msg import SkillerInterface
from rclpy.action import ActionClient
from rclpy.qos import QoSDurabilityPolicy, QoSProfile


def main() -> None:
    rclpy.init(read_domain_id=int(sys.argv[1]))
    node = rclpy.create_node("user")
    seen = []
    latched = QoSProfile(depth=1, durability=QoSDurabilityPolicy.TRANSIENT_LOCAL)
    topic = "/blackboard/SkillerInterface/Skiller"
    node.create_subscription(
        SkillerInterface, topic, lambda message: seen.append(message.skill_string), latched
    )
    client = ActionClient(node, ExecSkill, "/skiller/execute")
    client.wait_for_server()

    def wait(future):
        rclpy.spin_until_future_complete(node, future)
        return future.result()

    for text in ('say{text="hello", wait=true}', "fly{}"):
        goal = wait(client.send_goal_async(ExecSkill.Goal(skill_string=text)))
        answer = wait(goal.get_result_async())
        print(answer.status, answer.result.success, answer.result.error[:0])  # noqa: T201
    while "say" not in "".join(seen):
        rclpy.spin_once(node)
    print(next(text for text in seen if text))  # noqa: T201
    node.destroy_node()
    rclpy.shutdown()


main()
