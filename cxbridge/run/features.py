"""The table of features for CLIPS environments."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Final

from cxbridge.errors import CxbridgeError
from cxbridge.executive.feature import Feature, LazyFeature
from cxbridge.executive.features.blackboard import BlackBoardFeature
from cxbridge.executive.features.config import ConfigFeature, RedefineWarningFeature
from cxbridge.plugins import PluginError, Row, Table, always, configured

if TYPE_CHECKING:
    from collections.abc import Callable

    from cxbridge.run.agent import Run
    from cxbridge.skiller.board.service import LocalSkillCalls


def _make_blackboard(context: Run) -> Feature:
    retract_early = context.config.get_bool("/clips/retract-early", default=False)
    return BlackBoardFeature(context.board, retract_early=retract_early)


def _make_config(context: Run) -> Feature:
    return ConfigFeature(context.config)


def _make_redefine_warning(_context: Run) -> Feature:
    return RedefineWarningFeature()


def _make_pddl_parser(context: Run) -> Feature:
    return context.pddl_parser


# The features below are imported when an agent requests them, which keeps the start of other agents fast.


def _make_tf(context: Run) -> Feature:
    from cxbridge.executive.features.tf import TfFeature  # noqa: PLC0415

    return TfFeature(context.board)


def _make_navgraph(context: Run) -> Feature:
    from cxbridge.executive.features.navgraph import NavGraphFeature  # noqa: PLC0415

    return NavGraphFeature(lambda: context.navgraph)


def _make_skill_board(context: Run) -> Feature:
    from cxbridge.executive.features.skill_board import SkillBoardFeature  # noqa: PLC0415

    def local_calls() -> LocalSkillCalls | None:
        service = context.skill_service
        return None if service is None else service.local_calls

    return SkillBoardFeature(local_calls)


FEATURES: Final[Table[Callable[[Run], Feature]]] = Table(
    "FEATURES",
    callable,
    "a function that makes a feature from the context of a run",
    Row("blackboard", f"{__name__}:_make_blackboard", early=always),
    Row("config", f"{__name__}:_make_config", early=always),
    Row("redefine-warning", f"{__name__}:_make_redefine_warning", early=always),
    Row("pddl-parser", f"{__name__}:_make_pddl_parser", early=always),
    Row("tf", f"{__name__}:_make_tf"),
    Row("navgraph", f"{__name__}:_make_navgraph"),
    Row("skill-board", f"{__name__}:_make_skill_board", configured("/skill-board")),
)
"""Features in the order of Fawkes' feature facts. Features that most agents use are made early."""


def run_features(context: Run) -> list[Feature | LazyFeature]:
    """Return the features of a run. Features that are not early are made on request of an environment.

    :raises CxbridgeError: if two features have the same name or an early feature's configuration is wrong.
    """
    # another executive, such as the executive for ROS 2, has other features than cxbridge; only the features
    # of plug-ins, whose rows have an origin, serve both
    source_features = context.source.features(context)
    if source_features is not None:
        return [*source_features, *(_make_lazy_feature(row, context) for row in FEATURES.rows if row.origin)]
    return [
        _make_feature(row, context) if row.early(context) else _make_lazy_feature(row, context)
        for row in FEATURES.rows
        if row.needed(context)
    ]


def _make_lazy_feature(row: Row, context: Run) -> LazyFeature:
    return LazyFeature(row.name, partial(_make_feature, row, context), str(row) if row.origin else "")


def _make_feature(row: Row, context: Run) -> Feature:
    make_feature = FEATURES.load_target(row)
    if not row.origin:
        return make_feature(context)
    # the feature of a plug-in, which the error must name
    try:
        feature = make_feature(context)
    except CxbridgeError:
        raise
    except Exception as error:
        raise PluginError(
            f"the feature '{row.name}' ({row}) cannot be made: {type(error).__name__}: {error}"
        ) from error
    if not isinstance(feature, Feature):
        raise PluginError(f"the feature '{row.name}' ({row}) made {feature!r}, not a Feature")
    return feature
