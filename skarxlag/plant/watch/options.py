"""Options of ``skarxlag watch`` for one sensor."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any


@dataclass(frozen=True)
class SensorOptions:
    """Options of one sensor, or of all sensors of a table.

    Parameters
    ----------
    model : Path
        Saved model, or a table of sensors if there is no source.
    source : str or None
        ``-`` for standard input, a named pipe, a device or a folder.
    name : str or None, default=None
        Name of the sensor in a table.
    state : Path or None, default=None
        File of the state, or a folder of a table.
    rpm : dict, default={}
        Speed, or its source, as facts of a recording.
    rpm_column, channel, dtype, sampling_rate, pulses_per_revolution, \
false_alarm_interval, alarm_delay, latch, half_life, idle, retry, settle, heartbeat
        As in ``skarxlag watch``.
    """

    model: Path
    source: str | None
    name: str | None = None
    state: Path | None = None
    rpm: dict[str, Any] = field(default_factory=dict)
    rpm_column: str | None = None
    channel: Any = None
    dtype: str | None = None
    sampling_rate: float | None = None
    pulses_per_revolution: int | None = None
    false_alarm_interval: float | None = None
    alarm_delay: int | None = None
    latch: bool = False
    half_life: float = 10.0
    idle: float | None = None
    retry: float = 60.0
    settle: float = 2.0
    heartbeat: float | None = None
