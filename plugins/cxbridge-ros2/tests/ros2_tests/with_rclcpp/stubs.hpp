// The parts of further packages that the action executor and the performer of PlanSys2 need here.
#pragma once
#include <string>
#include "rclcpp_lifecycle/lifecycle_node.hpp"

namespace BT {
enum class NodeStatus { IDLE, RUNNING, SUCCESS, FAILURE };
}
namespace parser::pddl {
inline std::string getReducedString(const std::string &text) { return text; }
}
namespace rclcpp_cascade_lifecycle {
class CascadeLifecycleNode : public rclcpp_lifecycle::LifecycleNode {
public:
  explicit CascadeLifecycleNode(const std::string &name) : LifecycleNode(name) {}
};
}
