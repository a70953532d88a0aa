"""Skills over one topic that all share, the hub, as PlanSys2 has it and the thesis after it.

One side asks on it who can perform an action, confirms one that answers, and follows it to the end. Here are
both sides; what differs is in :mod:`cxbridge_ros2.plansys2` and :mod:`cxbridge_ros2.skill_execution`.
"""
