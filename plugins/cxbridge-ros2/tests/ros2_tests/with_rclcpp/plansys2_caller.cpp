// Requests actions with the action executor of PlanSys2: plansys2_caller ACTION,ARGUMENT,... ...
#include <map>
#include "calling.hpp"
#include "plansys2_executor/ActionExecutor.hpp"

using plansys2::ActionExecutor;
using Message = plansys2_msgs::msg::ActionExecution;

int main(int count, char **words) {
  rclcpp::init(count, words);
  auto base = make_base("/actions_hub");
  auto node = std::make_shared<rclcpp_lifecycle::LifecycleNode>("executor");
  rclcpp::executors::SingleThreadedExecutor executor;
  executor.add_node(node->get_node_base_interface());
  const std::map<int, std::string> names = {
      {ActionExecutor::IDLE, "IDLE"},       {ActionExecutor::DEALING, "DEALING"},
      {ActionExecutor::RUNNING, "RUNNING"}, {ActionExecutor::SUCCESS, "SUCCESS"},
      {ActionExecutor::FAILURE, "FAILURE"}, {ActionExecutor::CANCELLED, "CANCELLED"}};
  for (int number = 1; number < count; ++number) {
    auto call = split(words[number]);
    auto action = ActionExecutor::make_shared("(" + joined(call, 0) + ")", node);
    int feedback = 0, after_cancel = 0;
    std::string performer;
    while (!action->is_finished() && after_cancel < 20) {
      action->last_msg = Message();
      action->tick(node->now());
      executor.spin_once(std::chrono::milliseconds(50));
      if (action->last_msg.type == Message::FEEDBACK && action->get_internal_status() == ActionExecutor::RUNNING) {
        ++feedback;
        performer = action->last_msg.node_id;
      }
      if (action->get_internal_status() == ActionExecutor::CANCELLED) {
        ++after_cancel;
      } else if (call.back() == "long" && feedback > FEEDBACKS) {
        action->cancel();
      }
    }
    bool cancelled = after_cancel > 0;
    print(number == 1, names.at(action->get_internal_status()), performer, feedback,
          cancelled ? "" : action->get_feedback());
  }
  std::cout << "]" << std::endl;
  return 0;
}
