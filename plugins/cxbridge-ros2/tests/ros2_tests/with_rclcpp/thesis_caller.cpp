// Requests actions with the master of the thesis, with a node for each action: thesis_caller ACTION,ARGUMENT,... ...
#include "calling.hpp"
#include "cx_msgs/msg/skill_execution.hpp"
#include "cx_skill_execution/SkillExecutionMaster.hpp"

using cx::SkillExecutionMaster;
using Message = cx_msgs::msg::SkillExecution;

int main(int count, char **words) {
  rclcpp::init(count, words);
  auto base = make_base("/skill_board");
  int feedback = 0;
  std::string performer;
  auto listener = base->create_subscription<Message>(
      "/skill_board", rclcpp::QoS(100).reliable(), [&](const Message::SharedPtr message) {
        feedback += message->type == Message::FEEDBACK;
        if (message->type == Message::CONFIRM) performer = message->node_id;
      });
  for (int number = 1; number < count; ++number) {
    auto call = split(words[number]);
    feedback = 0;
    performer = "";
    auto name = call[0] + "_gen" + std::to_string(number);
    // the header and the source disagree about the order of the fourth and fifth parameters
    auto master = std::make_shared<SkillExecutionMaster>(name, name, call[0], "", joined(call, 1), "");
    rclcpp::executors::SingleThreadedExecutor executor;
    executor.add_node(master);
    executor.add_node(base);
    master->request_skill_execution();
    bool cancelled = false;
    auto state = master->get_exec_status();
    while (state == SkillExecutionMaster::IDLE || state == SkillExecutionMaster::RUNNING) {
      executor.spin_once(std::chrono::milliseconds(50));
      master->check_idle_time();
      if (call.back() == "long" && feedback > FEEDBACKS && !cancelled) {
        cancelled = true;
        master->cancel_execution();
      }
      state = master->get_exec_status();
    }
    auto info = master->get_exec_info();
    bool done = state == SkillExecutionMaster::SUCESS;
    print(number == 1, done ? "SUCCESS" : "FAILURE", performer, feedback, done ? "arrived" : info.error_msg);
  }
  std::cout << "]" << std::endl;
  return 0;
}
