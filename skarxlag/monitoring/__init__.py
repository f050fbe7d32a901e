"""A fitted diagnoser on a running sensor."""

from .monitor import ConditionMonitor, MonitorVerdict

__all__ = ["ConditionMonitor", "MonitorVerdict"]
