"""The main loop."""

from __future__ import annotations

import random
from functools import partial

from cxbridge.clock import VirtualClock
from cxbridge.mainloop import Hook, MainLoop


def test_hooks_run_in_order_of_fawkes():
    loop = MainLoop(VirtualClock())
    done: list[str] = []
    hooks = list(Hook)
    random.Random(1).shuffle(hooks)
    for hook in hooks:
        loop.add(hook, partial(done.append, hook.value))
    loop.run_once()
    assert done == [
        "pre_loop",
        "sensor_acquire",
        "sensor_prepare",
        "sensor_process",
        "worldstate",
        "think",
        "skill",
        "act",
        "act_exec",
        "post_loop",
    ]


def test_loops_start_one_period_apart():
    clock = VirtualClock(0)
    loop = MainLoop(clock, 100)
    times = []
    loop.add(Hook.THINK, lambda: times.append(clock.now_us()))
    loop.run(lambda: loop.cycle_count == 4)
    assert times == [0, 100, 200, 300]


def test_next_loop_follows_slow_loop_at_once():
    clock = VirtualClock(0)
    loop = MainLoop(clock, 100)
    times = []

    def work():
        times.append(clock.now_us())
        clock.sleep_until(clock.now_us() + (250 if len(times) == 1 else 0))

    loop.add(Hook.THINK, work)
    loop.run(lambda: loop.cycle_count == 3)
    assert times == [0, 250, 350]
