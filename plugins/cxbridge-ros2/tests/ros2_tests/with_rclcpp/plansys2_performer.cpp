// Performers of the action move, with the client of PlanSys2: plansys2_performer NODE...
#include "performing.hpp"
#include "plansys2_executor/ActionExecutorClient.hpp"

class Performer : public plansys2::ActionExecutorClient {
public:
  explicit Performer(const std::string &name) : ActionExecutorClient(name, PERIOD) {
    set_parameter(rclcpp::Parameter("action_name", "move"));
  }

protected:
  CallbackReturnT on_activate(const rclcpp_lifecycle::State &state) override {
    steps_ = 0;
    note(get_name(), get_arguments());
    return ActionExecutorClient::on_activate(state);
  }

  CallbackReturnT on_deactivate(const rclcpp_lifecycle::State &state) override {
    if (steps_ < STEPS || is_long()) std::cout << get_name() << " cancelled" << std::endl;
    return ActionExecutorClient::on_deactivate(state);
  }

  void do_work() override {
    if (steps_ < STEPS || is_long()) {
      send_feedback(std::min(1.0f, static_cast<float>(steps_++) / STEPS), "running");
    } else if (get_arguments().back() == "fail") {
      finish(false, 0.5, "door closed");
    } else {
      finish(true, 1.0, "completed");
    }
  }

private:
  bool is_long() const { return get_arguments().back() == "long"; }
  int steps_ = 0;
};

int main(int count, char **words) { return perform<Performer>(count, words); }
