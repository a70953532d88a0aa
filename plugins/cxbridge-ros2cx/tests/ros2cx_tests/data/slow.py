"""The executor of the recording of a removed action, with less feedback."""

from cxbridge_ros2cx.executors import ThesisDummyExecutor


class Slow(ThesisDummyExecutor):
    """An executor with feedback every two seconds."""

    skills = ("move",)
    period = 2.0
