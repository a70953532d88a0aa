# The shipped interface types for editors and type checkers; at run time they are made from XML.

from cxbridge.interfaces.stubs.BatteryInterface import BatteryInterface as BatteryInterface
from cxbridge.interfaces.stubs.ComponentInterface import ComponentInterface as ComponentInterface
from cxbridge.interfaces.stubs.DaemonInterface import DaemonInterface as DaemonInterface
from cxbridge.interfaces.stubs.ExplainInterface import ExplainInterface as ExplainInterface
from cxbridge.interfaces.stubs.GameInterface import GameInterface as GameInterface
from cxbridge.interfaces.stubs.GameStateInterface import GameStateInterface as GameStateInterface
from cxbridge.interfaces.stubs.GripperInterface import GripperInterface as GripperInterface
from cxbridge.interfaces.stubs.HeartbeatInterface import HeartbeatInterface as HeartbeatInterface
from cxbridge.interfaces.stubs.JointInterface import JointInterface as JointInterface
from cxbridge.interfaces.stubs.KeyValueInterface import KeyValueInterface as KeyValueInterface
from cxbridge.interfaces.stubs.Laser360Interface import Laser360Interface as Laser360Interface
from cxbridge.interfaces.stubs.LedInterface import LedInterface as LedInterface
from cxbridge.interfaces.stubs.MongoDBManagedReplicaSetInterface import (
    MongoDBManagedReplicaSetInterface as MongoDBManagedReplicaSetInterface,
)
from cxbridge.interfaces.stubs.MotorInterface import MotorInterface as MotorInterface
from cxbridge.interfaces.stubs.NavigatorInterface import NavigatorInterface as NavigatorInterface
from cxbridge.interfaces.stubs.ObjectPositionInterface import (
    ObjectPositionInterface as ObjectPositionInterface,
)
from cxbridge.interfaces.stubs.OrderInterface import OrderInterface as OrderInterface
from cxbridge.interfaces.stubs.PddlGenInterface import PddlGenInterface as PddlGenInterface
from cxbridge.interfaces.stubs.PddlPlannerInterface import PddlPlannerInterface as PddlPlannerInterface
from cxbridge.interfaces.stubs.Position3DInterface import Position3DInterface as Position3DInterface
from cxbridge.interfaces.stubs.RequestInterface import RequestInterface as RequestInterface
from cxbridge.interfaces.stubs.RobotMemoryInterface import RobotMemoryInterface as RobotMemoryInterface
from cxbridge.interfaces.stubs.SkillBoardInterface import SkillBoardInterface as SkillBoardInterface
from cxbridge.interfaces.stubs.SkillerDebugInterface import SkillerDebugInterface as SkillerDebugInterface
from cxbridge.interfaces.stubs.SkillerInterface import SkillerInterface as SkillerInterface
from cxbridge.interfaces.stubs.SkillExecutorInterface import SkillExecutorInterface as SkillExecutorInterface
from cxbridge.interfaces.stubs.SpeechSynthInterface import SpeechSynthInterface as SpeechSynthInterface
from cxbridge.interfaces.stubs.SwitchInterface import SwitchInterface as SwitchInterface
from cxbridge.interfaces.stubs.TestInterface import TestInterface as TestInterface
from cxbridge.interfaces.stubs.TransformInterface import TransformInterface as TransformInterface
