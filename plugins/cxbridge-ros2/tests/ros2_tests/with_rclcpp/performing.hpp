// The common code of performers. The last argument of an action selects the end.
#pragma once
#include <iostream>
#include <memory>
#include <string>
#include <vector>
#include "lifecycle_msgs/msg/transition.hpp"
#include "rclcpp/rclcpp.hpp"

constexpr int STEPS = 10;
constexpr auto PERIOD = std::chrono::milliseconds(50);

inline void note(const std::string &node, const std::vector<std::string> &arguments, const std::string &more = "") {
  std::cout << node << " performs";
  for (const auto &each : arguments) std::cout << " " << each;
  std::cout << " " << more << std::endl;
}

template <typename Performer> int perform(int count, char **words) {
  rclcpp::init(count, words);
  rclcpp::executors::SingleThreadedExecutor executor;
  std::vector<std::shared_ptr<Performer>> nodes;
  for (int number = 1; number < count; ++number) {
    nodes.push_back(std::make_shared<Performer>(words[number]));
    nodes.back()->trigger_transition(lifecycle_msgs::msg::Transition::TRANSITION_CONFIGURE);
    executor.add_node(nodes.back()->get_node_base_interface());
  }
  std::cout << "ready" << std::endl;
  executor.spin();
  return 0;
}
