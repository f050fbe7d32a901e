"""Options of ``skarxlag watch``: of one sensor, or of the sensors of a table."""

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from ..commands.messages import CommandError, as_command_error, refuse
from ..readers.recording_tables import channel_names, read_cells, speed_facts

_NEEDED = ("name", "source", "model")
_FURTHER = ("channel", "rpm")


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


def listed_sensors(options: SensorOptions) -> list[SensorOptions]:
    """Return the options of each sensor of a table: those of the command and of its line.

    Raises
    ------
    CommandError
        If the table cannot be read, or a line cannot be used.
    UsageError
        If an option is given that a column of the table replaces.
    """
    path = options.model
    with as_command_error():
        columns, rows = read_cells(path, "name")
        if not {*_NEEDED} <= {*columns} <= {*_NEEDED, *_FURTHER} or not rows:
            raise CommandError(
                f"{path}: {len(rows)} sensors with the columns {', '.join(columns)}; "
                f"expected {', '.join(_NEEDED)}, and if needed {', '.join(_FURTHER)}"
            )
        if "rpm" in columns:
            refuse(options, ["rpm_column"], f"{path} has a column rpm")
        sensors: dict[str, SensorOptions] = {}
        for number, cells in rows.items():
            row = dict(zip(columns, cells, strict=True))
            name = row["name"]
            if name in sensors:
                raise CommandError(f"{path}: two sensors of the name {name!r}")
            sensors[name] = _of_line(options, f"{path}, line {number}", row)
        return [*sensors.values()]


def _of_line(options, where, row):
    name = row["name"]
    if Path(name).name != name or not all(row[column] for column in _NEEDED):
        raise CommandError(
            f"{where}: {row}, expected a name without slashes, a source and a model"
        )
    folder = options.model.parent
    changes = {"name": name, "model": folder / row["model"]}
    changes["source"] = str(folder / row["source"])
    if options.state is not None:
        changes["state"] = options.state / f"{name}.json"
    if row.get("channel"):
        changes["channel"] = channel_names(row["channel"])
    if row.get("rpm"):
        changes["rpm"] = speed_facts(where, row["rpm"])
    return replace(options, **changes)
