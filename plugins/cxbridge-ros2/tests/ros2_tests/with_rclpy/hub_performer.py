"""Performers of the action move on a hub, by the real rclpy: what PlanSys2's ActionExecutorClient does, or
the thesis' SkillExecution. The last argument says how it goes. Prints what happens.

hub_performer.py PROTOCOL NODE...
"""

import sys

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node

ACTION = "move"
PERIOD_S = 0.05
STEPS = 10

if sys.argv[1] == "plansys2":
    from plansys2_msgs.msg import ActionExecution as Message
    from plansys2_msgs.msg import ActionPerformerStatus as Status

    HUB, SIGNS, ARGUMENTS, PROGRESS = "actions_hub", "performers_status", "arguments", "completion"
    SIGN_ACTION = "action"
else:
    from cx_msgs.msg import SkillExecution as Message
    from cx_msgs.msg import SkillExecutionerInformation as Status

    HUB, SIGNS, ARGUMENTS, PROGRESS = (
        "/skill_board",
        "/skill_executioner_status",
        "action_parameters",
        "progress",
    )
    SIGN_ACTION = "action_name"

SAYS_CANCELLED = sys.argv[1] != "plansys2"


class Performer(Node):
    def __init__(self, name):
        super().__init__(name)
        self.active, self.committed, self.arguments, self.steps = False, False, [], 0
        self.hub = self.create_publisher(Message, HUB, 100)
        self.signs = self.create_publisher(Status, SIGNS, 100)
        self.create_subscription(Message, HUB, self.heard, 100)
        self.create_timer(1.0, self.sign)
        self.create_timer(PERIOD_S, self.work)

    def note(self, *words):
        print(self.get_name(), *words, flush=True)  # noqa: T201

    def sign(self):
        status = Status(node_name=self.get_name(), state=Status.RUNNING if self.active else Status.READY)
        setattr(status, SIGN_ACTION, ACTION)
        self.signs.publish(status)

    def say(self, kind, **fields):
        message = Message(type=kind, node_id=self.get_name(), action=ACTION, **fields)
        setattr(message, ARGUMENTS, self.arguments)
        self.hub.publish(message)

    def heard(self, message):
        mine = message.node_id == self.get_name()
        if message.type == Message.REQUEST:
            if not self.active and not self.committed and message.action == ACTION:
                self.committed = True
                message.type, message.node_id = Message.RESPONSE, self.get_name()
                self.hub.publish(message)
        elif message.type == Message.CONFIRM:
            if mine and self.committed and not self.active:
                self.arguments, self.active, self.committed, self.steps = (
                    list(getattr(message, ARGUMENTS)),
                    True,
                    False,
                    0,
                )
                self.note("performs", *self.arguments, getattr(message, "mapped_action", ""))
        elif message.type == Message.REJECT:
            if mine:
                self.committed = False
                self.note("rejected")
        elif message.type == Message.CANCEL and mine and self.active:
            self.active = False
            self.note("cancelled")
            if SAYS_CANCELLED:
                self.say(Message.FINISH, success=False, status="CANCELLED", **{PROGRESS: 0.0})

    def work(self):
        if not self.active:
            return
        how = self.arguments[-1] if self.arguments else ""
        if self.steps < STEPS or how == "long":
            self.say(Message.FEEDBACK, status="running", **{PROGRESS: min(1.0, self.steps / STEPS)})
            self.steps += 1
            return
        self.active = False
        done = how != "fail"
        status = "completed" if done else "door closed"
        self.say(Message.FINISH, success=done, status=status, **{PROGRESS: 1.0 if done else 0.5})


rclpy.init()
executor = SingleThreadedExecutor()
nodes = [Performer(name) for name in sys.argv[2:]]
for each in nodes:
    executor.add_node(each)
print("ready", flush=True)  # noqa: T201
executor.spin()
