"""An idle tick of the executive against the same tick in bare clipspy with builders; and a soak.

The tick: a time fact comes in, two rules fire (one calls Python, one retracts the fact). The rival does just
that and nothing else: a bare clipspy environment with these two rules, the fact made by clipspy's builder.
Ours is the executive with the whole built-in core and the test scenario's agent, idle after its end, its
interface of the Skiller read on every tick.
"""

from __future__ import annotations

import resource
import statistics
import time
from pathlib import Path

import clips
from clips._clips import ffi, lib

from benchmarks.harness import paired_ratio, report
from cxbridge.run import Run, RunOptions

SCENARIO = Path(__file__).resolve().parent.parent / "scenarios" / "test-scenario"
BATCH = 500  # ticks that are timed together
SOAK_TICKS = 100_000


def make_bare_tick():
    """Return a function that makes a tick in bare clipspy.

    The fact is made by the builder itself, not by ``template.assert_fact``: that leaks each fact that it
    returns, and CLIPS then walks all of them after each firing.
    """
    environment = clips.Environment()
    env = environment._env
    environment.define_function(lambda: None, "read_interfaces")
    environment.build("(deftemplate time (multislot now (type INTEGER)))")
    environment.build("(defrule read-all (declare (salience 1000)) (time) => (read_interfaces))")
    environment.build("(defrule retract-time (declare (salience -10000)) ?f <- (time) => (retract ?f))")
    builder = lib.CreateFactBuilder(env, b"time")
    numbers = lib.CreateMultifieldBuilder(env, 2)

    def tick(_environment=environment):  # keeps it alive
        lib.MBReset(numbers)
        for number in divmod(time.time_ns() // 1000, 1_000_000):
            lib.MBAppend(numbers, clips.values.clips_value(env, number))
        value = ffi.new("CLIPSValue *")
        value.value = lib.MBCreate(numbers)
        lib.FBPutSlot(builder, b"now", value)
        lib.FBAssert(builder)
        lib.Run(env, -1)

    return tick


def make_executive_tick(run):
    """Return a function that makes a tick of an executive whose agent is finished."""
    run.start()
    run.loop.run(lambda: run.is_over)
    executive, clock = run.executive, run.clock

    def tick():
        clock.sleep_until(clock.now_us() + run.loop.period_us)
        executive.loop()

    return tick


def soak(tick):
    """Run SOAK_TICKS ticks after 5,000 ticks that do not count.

    :returns: the median time in us of the first 20,000 and of the last 20,000 ticks, and the growth of the
        memory in KiB.
    """

    def measure_tick_us():
        started = time.perf_counter()
        for _ in range(1000):
            tick()
        return (time.perf_counter() - started) * 1e6 / 1000

    for _ in range(5):
        measure_tick_us()
    before_kib = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    times_us = [measure_tick_us() for _ in range(SOAK_TICKS // 1000)]
    growth_kib = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before_kib
    return statistics.median(times_us[:20]), statistics.median(times_us[-20:]), growth_kib


def main():
    """Measure and print."""
    with Run(RunOptions(scenario=SCENARIO)) as run:
        tick = make_executive_tick(run)
        report(
            "idle tick / bare clipspy with builders", paired_ratio(tick, make_bare_tick(), BATCH), limit=1.3
        )
        first_us, last_us, growth_kib = soak(tick)
        print(f"soak of {SOAK_TICKS} ticks: {first_us:.1f} us a tick at first, {last_us:.1f} at the end")
        report("last tick / first tick", last_us / first_us, limit=1.1)
        print(f"memory grew by {growth_kib} KiB (limit 1024)")


if __name__ == "__main__":
    main()
