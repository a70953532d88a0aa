"""Agents of clips_manager, the node of the CLIPS Executive for ROS 2.

Measured are a cold start, an idle tick, twenty environments, a minute of driving, and steps of an agent that
learns.

The rival of the start is cxbridge's smallest scenario. The rival of the tick is that of `bench_tick` in bare
clipspy: a time fact, a rule that calls Python, a rule that retracts the fact. Seconds are processor time,
because other processes may use the machine as well; the tick is timed by the clock, in turn with its rival.
"""

from __future__ import annotations

import math
import os
import random
import statistics
import sys
import tempfile
import time
from pathlib import Path

from benchmarks.bench_cold import processor_seconds
from benchmarks.bench_tick import make_bare_tick
from benchmarks.harness import paired_ratio, report
from cxbridge.mainloop import Hook
from cxbridge.run import Run, run_scenario
from cxbridge.run.program.plain_options import options_from_keywords
from cxbridge_ros2cx.cx.node import CxNode

PAIRS = 9
BATCH = 500
ENVIRONMENTS = 20
TICKS_A_SECOND = 30
TURTLE_S = 60.0
STEPS = 2000
NO_TIMEOUT_S = 1e9

HELLO = "(defrule hello => (printout t hello crlf))"
CLOCK = "(defrule look (time ?) => (now))"
DRIVER = """
(deffacts corners (corner 1.0 1.0) (corner 9.0 1.0) (corner 9.0 9.0) (corner 1.0 9.0))
(defrule begin => (ros-msgs-create-publisher "/cmd_vel" "geometry_msgs/msg/Twist")
  (ros-msgs-create-subscription "/pose" "geometry_msgs/msg/Pose2D"))
(defrule drive ?f <- (ros-msgs-message (msg-ptr ?m)) ?c <- (corner ?x ?y)
  => (bind ?dx (- ?x (ros-msgs-get-field ?m "x"))) (bind ?dy (- ?y (ros-msgs-get-field ?m "y")))
  (bind ?turn (- (atan2 ?dy ?dx) (ros-msgs-get-field ?m "theta")))
  (bind ?far (sqrt (+ (* ?dx ?dx) (* ?dy ?dy))))
  (if (< ?far 0.2) then (retract ?c) (assert (corner ?x ?y)))
  (bind ?t (ros-msgs-create-message "geometry_msgs/msg/Twist"))
  (bind ?l (ros-msgs-get-field ?t "linear")) (bind ?a (ros-msgs-get-field ?t "angular"))
  (ros-msgs-set-field ?l "x" (min 2.0 ?far)) (ros-msgs-set-field ?a "z" (sin ?turn))
  (ros-msgs-publish ?t "/cmd_vel") (ros-msgs-destroy-message ?t)
  (ros-msgs-destroy-message ?m) (retract ?f))
; destroys messages that drive has not used
(defrule late (declare (salience -1)) ?f <- (ros-msgs-message (msg-ptr ?m))
  => (ros-msgs-destroy-message ?m) (retract ?f))
"""


def write_parameters(folder: Path, program: str, environments: int = 1, rate_hz: int = 10) -> Path:
    """Write an agent and its parameters; return the file of the parameters.

    :param program: the agent in CLIPS, which each environment loads.
    """
    (folder / "agent.clp").write_text(program)
    names = [f"e{number}" for number in range(environments)]
    rows = "".join(f"    {name}: {{plugins: [executive, ros, files]}}\n" for name in names)
    (folder / "agent.yaml").write_text(
        f"/**:\n  ros__parameters:\n    environments: [{', '.join(names)}]\n{rows}"
        f"    executive: {{plugin: 'cx::ExecutivePlugin', refresh_rate: {rate_hz}}}\n"
        "    ros: {plugin: 'cx::RosMsgsPlugin'}\n"
        f"    files: {{plugin: 'cx::FileLoadPlugin', load: ['{folder / 'agent.clp'}']}}\n"
    )
    return folder / "agent.yaml"


def measure_cold_start(folder: Path) -> None:
    """Measure hello_world as a process, in turn with the smallest scenario of cxbridge."""
    repository = Path(__file__).resolve().parent.parent
    hello = repository / "plugins/cxbridge-ros2cx/cxbridge_ros2cx/examples/params/hello.yaml"
    command = [sys.executable, "-m", "cxbridge", "run"]
    hello_run = [*command, str(hello), "--timeout", "2"]
    smallest_run = [*command, "waypoints"]
    environment = {**os.environ, "PYTHONPYCACHEPREFIX": str(folder / "bytecode")}
    environment.pop("PYTHONDONTWRITEBYTECODE", None)
    for run in (hello_run, smallest_run):
        processor_seconds(run, environment)  # writes the bytecode
    pairs = [
        (processor_seconds(hello_run, environment), processor_seconds(smallest_run, environment))
        for _ in range(PAIRS)
    ]
    hello_s, smallest_s = (statistics.median(seconds) for seconds in zip(*pairs, strict=True))
    print(f"  {hello_s:.3f} s against {smallest_s:.3f} s of processor time (medians of {PAIRS})")
    report("hello_world cold / our smallest scenario", hello_s / smallest_s, limit=1.2)


def measure_idle_tick(folder: Path) -> None:
    """Measure a tick of an agent that does nothing else than its time fact and `now`."""
    with Run(
        options_from_keywords(write_parameters(folder, CLOCK, rate_hz=TICKS_A_SECOND), timeout=NO_TIMEOUT_S)
    ) as run:
        run.start()
        clock, node, period_us = run.clock, run.executive, run.loop.period_us

        def tick():
            clock.sleep_until(clock.now_us() + period_us)
            node.loop()

        report("idle tick / bare clipspy", paired_ratio(tick, make_bare_tick(), BATCH), limit=1.3)


def measure_environments(folder: Path) -> None:
    """Measure a second of twenty environments, the mean of ten seconds."""
    file = write_parameters(folder, HELLO, ENVIRONMENTS, TICKS_A_SECOND)
    with Run(options_from_keywords(file, timeout=NO_TIMEOUT_S)) as run:
        run.start()
        clock, node, period_us = run.clock, run.executive, run.loop.period_us
        start = time.process_time()
        for _ in range(TICKS_A_SECOND * 10):
            clock.sleep_until(clock.now_us() + period_us)
            node.loop()
        seconds = (time.process_time() - start) / 10
    print(f"  {seconds * 1000:.1f} ms of processor time a second")
    report(f"a second of {ENVIRONMENTS} environments / a second", seconds, limit=1.0)


def measure_turtle(folder: Path) -> None:
    """Measure a minute in which a turtle drives from corner to corner."""
    pose_count = 0

    def attach(run):
        assert isinstance(run.executive, CxNode)
        node = run.executive.manager.context.ros.graph.join("turtle")
        # pose: x and y in metres, theta in radians; speeds: metres and radians a second
        pose, publisher = [5.5, 5.5, 0.0], node.create_publisher("/pose", "geometry_msgs/msg/Pose2D")
        speeds = [0.0, 0.0]

        def command(message):
            speeds[:] = [message["linear"]["x"], message["angular"]["z"]]

        def step():
            nonlocal pose_count
            passed_s = run.loop.period_us / 1e6
            pose[2] += speeds[1] * passed_s
            pose[0] += speeds[0] * passed_s * math.cos(pose[2])
            pose[1] += speeds[0] * passed_s * math.sin(pose[2])
            pose_count += 1
            publisher.publish({"x": pose[0], "y": pose[1], "theta": pose[2]})

        node.subscribe("/cmd_vel", "geometry_msgs/msg/Twist", command)
        run.loop.add(Hook.PRE_LOOP, step)

    start = time.process_time()
    result = run_scenario(
        options_from_keywords(write_parameters(folder, DRIVER), timeout=TURTLE_S), attach=attach
    )
    seconds = time.process_time() - start
    print(f"  {seconds:.2f} s of processor time, {pose_count} poses, {result.firings} rules")
    report(f"{TURTLE_S:g} s of the turtle / 2 s", seconds / 2.0, limit=1.0)


def measure_learning(checkout: Path) -> None:
    """Measure random steps and resets of the blocks world agent of a checkout of the original."""
    import gymnasium

    import cxbridge_ros2cx.rl

    agent = checkout / "extensions/reinforment_learning/cx_rl_bringup/params/rl_agent.yaml"
    env = gymnasium.make(cxbridge_ros2cx.rl.ENVIRONMENT_ID, parameters=agent, ros2cx=checkout).unwrapped
    rng = random.Random(1)
    _, info = env.reset()
    start = time.process_time()
    for _ in range(STEPS):
        action = rng.choice([number for number, is_allowed in enumerate(info["action_mask"]) if is_allowed])
        *_, is_over, _, info = env.step(action)
        if is_over:
            _, info = env.reset()
    seconds = time.process_time() - start
    env.close()
    print(f"  {STEPS / seconds:.0f} steps in a second of processor time")
    report("a step / 1 ms", seconds / STEPS * 1000, limit=1.0)


def main() -> None:
    """Measure and print."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        measure_cold_start(folder)
        measure_idle_tick(folder)
        measure_environments(folder)
        measure_turtle(folder)
    if "ROS2CX_DIR" in os.environ:
        measure_learning(Path(os.environ["ROS2CX_DIR"]))
    else:
        print("learning is not measured: ROS2CX_DIR names no checkout")


if __name__ == "__main__":
    main()
