"""Skills over a shared topic, the hub, as in PlanSys2 and in the thesis.

A caller requests an action on the hub, confirms one performer that responds, and follows it to the end. This
package has both sides; :mod:`cxbridge_ros2.plansys2` and :mod:`cxbridge_ros2.skill_execution` have the
differences of the protocols.
"""
