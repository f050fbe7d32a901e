"""A fitted diagnoser on a running sensor."""

from .monitor import ConditionMonitor
from .verdict import MonitorVerdict

__all__ = ["ConditionMonitor", "MonitorVerdict"]
