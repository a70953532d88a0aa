// The common code of callers, which request each ACTION,ARGUMENT,... in turn and print the results.
#pragma once
#include <chrono>
#include <iostream>
#include <sstream>
#include <string>
#include <thread>
#include <vector>
#include "rclcpp/rclcpp.hpp"

constexpr int FEEDBACKS = 2;  // then "long" is cancelled

inline std::vector<std::string> split(const std::string &text) {
  std::vector<std::string> found;
  std::istringstream stream(text);
  for (std::string word; std::getline(stream, word, ',');) found.push_back(word);
  return found;
}

inline std::string joined(const std::vector<std::string> &words, size_t from) {
  std::string text;
  for (size_t at = from; at < words.size(); ++at) text += (at > from ? " " : "") + words[at];
  return text;
}

// an earlier node that has discovered the hub, as in the process of the original
inline rclcpp::Node::SharedPtr make_base(const std::string &hub) {
  auto base = std::make_shared<rclcpp::Node>("base");
  for (int tries = 0; tries < 400 && base->count_subscribers(hub) == 0; ++tries) {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  return base;
}

inline void print(bool first, const std::string &state, const std::string &performer, int feedback,
                  const std::string &status) {
  std::cout << (first ? "[" : ", ") << "{\"state\": \"" << state << "\", \"performer\": \"" << performer
            << "\", \"feedback\": " << feedback << ", \"status\": \"" << status << "\"}";
}
