"""Has actions performed on a hub by the real rclpy: what PlanSys2's ActionExecutor does, or the thesis'
SkillExecutionMaster, a new node for each action. Prints the results as JSON.

hub_caller.py PROTOCOL ACTION,ARGUMENT,... ...  With the last argument "long" it is cancelled in the middle.
"""

import json
import sys
import time

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node

PLANSYS2 = sys.argv[1] == "plansys2"
if PLANSYS2:
    from plansys2_msgs.msg import ActionExecution as Message

    HUB, ARGUMENTS, PROGRESS, LIMIT_S = "actions_hub", "arguments", "completion", 30.0
else:
    from cx_msgs.msg import SkillExecution as Message

    HUB, ARGUMENTS, PROGRESS, LIMIT_S = "/skill_board", "action_parameters", "progress", 4.0


class Caller(Node):
    def __init__(self, number, action, arguments):
        super().__init__("executor" if PLANSYS2 else f"{action}_gen{number}")
        self.action, self.arguments = action, arguments
        self.state, self.performer, self.feedback, self.status = "DEALING", "", [], ""
        self.hub = self.create_publisher(Message, HUB, 100)
        self.create_subscription(Message, HUB, self.heard, 100)

    def say(self, kind, node):
        message = Message(type=kind, node_id=node, action=self.action)
        setattr(message, ARGUMENTS, self.arguments)
        self.hub.publish(message)

    def request(self):
        self.say(Message.REQUEST, self.get_name())

    def heard(self, message):
        if message.action != self.action or list(getattr(message, ARGUMENTS)) != self.arguments:
            return
        if message.type == Message.RESPONSE:
            if self.state == "DEALING" or not PLANSYS2:
                self.state, self.performer = "RUNNING", message.node_id
                self.say(Message.CONFIRM, message.node_id)
            else:
                self.say(Message.REJECT, message.node_id)
        elif message.node_id != self.performer:
            return
        elif message.type == Message.FEEDBACK and self.state == "RUNNING":
            self.feedback.append(getattr(message, PROGRESS))
        elif message.type == Message.FINISH:
            self.state = "SUCCESS" if message.success else "FAILURE"
            self.status = message.status


def run(number, action, arguments):
    node, executor = Caller(number, action, arguments), SingleThreadedExecutor()
    executor.add_node(node)
    begin = asked = time.monotonic()
    node.request()
    cancelled_at = None
    while node.state in ("DEALING", "RUNNING") or (cancelled_at and time.monotonic() - cancelled_at < 1):
        executor.spin_once(timeout_sec=0.05)
        now = time.monotonic()
        if node.state == "DEALING" and now - begin > LIMIT_S:
            break
        if PLANSYS2 and node.state == "DEALING" and now - asked >= 1.0:
            asked = now
            node.request()
        if arguments[-1:] == ["long"] and len(node.feedback) > 1 and cancelled_at is None:
            node.say(Message.CANCEL, node.performer)
            cancelled_at = now
            if PLANSYS2:
                node.state = "CANCELLED"
    found = {
        "state": node.state,
        "performer": node.performer,
        "feedback": len(node.feedback),
        "status": node.status,
    }
    executor.shutdown()
    node.destroy_node()
    return found


rclpy.init()
# the thesis' masters share their process with nodes that have lived long, and know the graph
base = rclpy.create_node("base")
begin = time.monotonic()
while not base.count_subscribers(f"/{HUB.strip('/')}") and time.monotonic() - begin < 20:
    time.sleep(0.05)
calls = [each.split(",") for each in sys.argv[2:]]
found = [run(number, action, arguments) for number, (action, *arguments) in enumerate(calls)]
print(json.dumps(found))  # noqa: T201
