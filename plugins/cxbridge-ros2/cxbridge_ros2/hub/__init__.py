"""Skills over a hub: a topic on which callers find performers for actions.

A caller sends a REQUEST for an action, and performers that can execute the action send a RESPONSE. The caller
sends CONFIRM to one performer, and REJECT to every other performer. The confirmed performer sends FEEDBACK
during the execution and FINISH at the end. The caller may send CANCEL before the end.

PlanSys2 and ros2-clips-executive (the executive of a thesis of 2021) have such hubs. This package has both
sides; :mod:`cxbridge_ros2.plansys2` and :mod:`cxbridge_ros2.skill_execution` have the differences of the two
protocols.
"""
