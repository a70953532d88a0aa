"""Definitions of messages and services that rosbags lacks, so that users do not need their packages.

The constants of the messages of ``plansys2_msgs`` and ``cx_msgs`` are left out, since constants are neither
on the wire nor in type hashes. :mod:`cxbridge_ros2.hub.protocol` has the constants as enums.
"""

from __future__ import annotations

from typing import Final

CANCEL_GOAL_TYPE: Final = "action_msgs/srv/CancelGoal"

# Texts of definitions, as in .msg and .srv files, by type.
BUILT_IN_DEFINITIONS: Final = {
    CANCEL_GOAL_TYPE: """int8 ERROR_NONE=0
int8 ERROR_REJECTED=1
int8 ERROR_UNKNOWN_GOAL_ID=2
int8 ERROR_GOAL_TERMINATED=3
action_msgs/GoalInfo goal_info
---
int8 return_code
action_msgs/GoalInfo[] goals_canceling
""",
    "std_srvs/srv/Empty": "---\n",
    "std_srvs/srv/SetBool": """bool data
---
bool success
string message
""",
    "std_srvs/srv/Trigger": """---
bool success
string message
""",
    "rcl_interfaces/srv/GetParameters": """string[] names
---
rcl_interfaces/ParameterValue[] values
""",
    "rcl_interfaces/srv/GetParameterTypes": """string[] names
---
uint8[] types
""",
    "rcl_interfaces/srv/SetParameters": """rcl_interfaces/Parameter[] parameters
---
rcl_interfaces/SetParametersResult[] results
""",
    "rcl_interfaces/srv/SetParametersAtomically": """rcl_interfaces/Parameter[] parameters
---
rcl_interfaces/SetParametersResult result
""",
    "rcl_interfaces/srv/ListParameters": """uint64 DEPTH_RECURSIVE=0
string[] prefixes
uint64 depth
---
rcl_interfaces/ListParametersResult result
""",
    "rcl_interfaces/srv/DescribeParameters": """string[] names
---
rcl_interfaces/ParameterDescriptor[] descriptors
""",
    "lifecycle_msgs/srv/ChangeState": """lifecycle_msgs/Transition transition
---
bool success
""",
    "lifecycle_msgs/srv/GetState": """---
lifecycle_msgs/State current_state
""",
    "lifecycle_msgs/srv/GetAvailableStates": """---
lifecycle_msgs/State[] available_states
""",
    "lifecycle_msgs/srv/GetAvailableTransitions": """---
lifecycle_msgs/TransitionDescription[] available_transitions
""",
    "plansys2_msgs/msg/ActionExecution": """int16 type         # a MessageKind
string node_id     # the caller in a REQUEST, otherwise the performer
string action
string[] arguments
bool success       # of FINISH
float32 completion # from 0 to 1
string status      # the current work, or the reason of a failure
""",
    "plansys2_msgs/msg/ActionPerformerStatus": """builtin_interfaces/Time status_stamp
int8 state                      # a PerformerState
string action
string[] specialized_arguments  # the only possible arguments; empty for any
string node_name
""",
    "cx_msgs/msg/SkillExecution": """int16 type                 # a MessageKind
string node_id             # the caller in a REQUEST, otherwise the performer
string action
string[] action_parameters
string agent_id            # empty unless there are several robots
string mapped_action       # the skill string that the action is mapped to
string status              # the current work, or the reason of a failure
bool success               # of FINISH
float32 progress           # from 0 to 1
""",
    "cx_msgs/msg/SkillExecutionerInformation": """int8 state           # a PerformerState
string action_name
string node_name
""",
}
