// Performers of the action move, with the class of the thesis: thesis_performer NODE...
#include "performing.hpp"
#include "cx_skill_execution/SkillExecution.hpp"

class Performer : public cx::SkillExecution {
public:
  explicit Performer(const std::string &name) : SkillExecution(name, "move", PERIOD) {
    commited_to_skill_ = false;  // the original does not initialise the member
  }

protected:
  CallbackReturn on_activate(const rclcpp_lifecycle::State &state) override {
    steps_ = 0;
    note(get_name(), action_parameters_, mapped_action_);
    return SkillExecution::on_activate(state);
  }

  CallbackReturn on_deactivate(const rclcpp_lifecycle::State &state) override {
    if (steps_ < STEPS || is_long()) std::cout << get_name() << " cancelled" << std::endl;
    return SkillExecution::on_deactivate(state);
  }

  void perform_execution() override {
    if (steps_ < STEPS || is_long()) {
      send_feedback(std::min(1.0f, static_cast<float>(steps_++) / STEPS), "running");
    } else if (action_parameters_.back() == "fail") {
      finish_execution(false, 0.5, "door closed");
    } else {
      finish_execution(true, 1.0, "completed");
    }
  }

private:
  bool is_long() const { return action_parameters_.back() == "long"; }
  int steps_ = 0;
};

int main(int count, char **words) { return perform<Performer>(count, words); }
