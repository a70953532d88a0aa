"""The agent runs on the virtual clock, without a robot; its own files stay in the checkout."""

import os

CHECKOUT = os.environ.get("ROS2CX_DIR", @DIR_TEXT@)


def test_it_starts_and_makes_a_goal(cx):
    # strict=True fails the test when a construct of the checkout does not load
    run = cx.run(ros2cx=CHECKOUT, config="config.yaml", strict=False)
    run.until(lambda: run.goals(), timeout=60)
    run.advance(10)
    # next: run.to_end(), run.assert_outcomes(...), run.assert_golden()
