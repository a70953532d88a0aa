"""The executor of the recording in which the action goes away: it was asked for less feedback."""

from cxbridge_ros2cx.executors import ThesisDummyExecutor


class Slow(ThesisDummyExecutor):
    """Sends feedback every two seconds."""

    skills = ("move",)
    period = 2.0
