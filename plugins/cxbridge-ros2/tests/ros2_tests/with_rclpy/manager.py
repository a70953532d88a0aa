"""Read the parameters of the node `managed`, change its state, and print the responses as JSON."""

import json
import time

import rclpy
from lifecycle_msgs.srv import ChangeState, GetState
from rcl_interfaces.msg import Log
from rcl_interfaces.srv import DescribeParameters, SetParametersAtomically
from rclpy.parameter import Parameter
from rclpy.parameter_client import AsyncParameterClient
from rclpy.qos import DurabilityPolicy, QoSProfile

rclpy.init()
node = rclpy.create_node("manager")
lines = []
node.create_subscription(
    Log, "/rosout", lines.append, QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)
)
parameters = AsyncParameterClient(node, "/managed")
assert parameters.wait_for_services(20.0)


def wait(future):
    rclpy.spin_until_future_complete(node, future, timeout_sec=10.0)
    return future.result()


def call(kind, name, request):
    client = node.create_client(kind, name)
    assert client.wait_for_service(10.0)
    return wait(client.call_async(request))


results = {}
results["names"] = sorted(wait(parameters.list_parameters([], 0)).result.names)
results["types"] = list(wait(parameters.get_parameter_types(["speed", "names", "limits.low"])).types)
described = call(
    DescribeParameters, "/managed/describe_parameters", DescribeParameters.Request(names=["speed", "fixed"])
)
results["described"] = [[each.name, each.type, each.read_only] for each in described.descriptors]
changes = [Parameter("speed", value=2.0), Parameter("fixed", value="no")]
results["set"] = [each.successful for each in wait(parameters.set_parameters(changes)).results]
values = wait(parameters.get_parameters(["speed", "fixed"])).values
results["values"] = [values[0].double_value, values[1].string_value]
changes = [
    Parameter("speed", value=9.0).to_parameter_msg(),
    Parameter("fixed", value="no").to_parameter_msg(),
]
request = SetParametersAtomically.Request(parameters=changes)
results["atomically"] = call(
    SetParametersAtomically, "/managed/set_parameters_atomically", request
).result.successful
states = []
for label in ("", "configure", "activate", "activate"):
    if label:
        request = ChangeState.Request()
        request.transition.label = label
        call(ChangeState, "/managed/change_state", request)
    states.append(call(GetState, "/managed/get_state", GetState.Request()).current_state.label)
results["states"] = states
end = time.monotonic() + 10
while not lines and time.monotonic() < end:
    rclpy.spin_once(node, timeout_sec=0.1)
results["log"] = lines[0].msg if lines else ""
print(json.dumps(results))  # noqa: T201
