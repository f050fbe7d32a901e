"""A fitted diagnoser on a running sensor."""

from .monitor import ConditionMonitor, MonitorVerdict
from .saved_state import load_monitor_state, save_monitor_state

__all__ = ["ConditionMonitor", "MonitorVerdict", "load_monitor_state", "save_monitor_state"]
