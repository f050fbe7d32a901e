"""Sensors that one ``skarxlag watch`` follows, from a table or alone."""

import argparse
import csv
import time
from collections import Counter
from pathlib import Path
from typing import Any, NamedTuple

from ..commands.arguments import refuse
from ..commands.messages import CommandError, UsageError, as_command_error, counted, say
from ..readers.recording_tables import channel_names, speed_facts
from ..readers.speeds import TACHO
from .sensor import ModelFiles, Sensor, file_version

_NEEDED = ["name", "source", "model"]
_FURTHER = ["channel", "rpm"]


class ListedSensor(NamedTuple):
    """Line of the table.

    Parameters
    ----------
    args : argparse.Namespace
        Arguments of the command for the sensor.
    mistake : str or None
        Why the line cannot be used.
    """

    args: argparse.Namespace
    mistake: str | None


def listed_sensors(args: argparse.Namespace) -> dict[str, ListedSensor]:
    """Read the table in the arguments.

    Returns
    -------
    dict of str to ListedSensor
        By name; a line without a unique name has its number after a slash, which no
        name contains.

    Raises
    ------
    CommandError, FileNotFoundError, ValueError
        If the table cannot be read or has other columns.
    UsageError
        If an option is given that a column of the table replaces.
    """
    path = args.model
    columns, lines = _parsed(path)
    if not {*_NEEDED} <= {*columns} <= {*_NEEDED, *_FURTHER} or not lines:
        raise CommandError(
            f"{path}: {counted(len(lines), 'sensor')} with the columns "
            f"{', '.join(columns)}; expected {', '.join(_NEEDED)}, and if needed "
            f"{', '.join(_FURTHER)}"
        )
    refuse(args, ["sensor"], f"{path} has a column name")
    if "rpm" in columns:
        refuse(args, ["rpm_column"], f"{path} has a column rpm")
    column = columns.index("name")
    n_columns = len(columns)
    names = Counter(
        fields[column] for fields in lines.values() if len(fields) == n_columns
    )
    listed = {}
    for number, fields in lines.items():
        where = f"{path}, line {number}"
        key = f"/{number}"
        sensor = argparse.Namespace(**vars(args))
        sensor.sensor = f"line {number}"
        mistake = None
        if len(fields) != n_columns:
            n_fields = counted(len(fields), "field")
            mistake = f"{where}: {n_fields}, expected {n_columns}"
        elif not (name := fields[column]) or Path(name).name != name or names[name] > 1:
            mistake = f"{where}: name {name!r}, expected a unique name without slashes"
        else:
            key = sensor.sensor = name
            mistake = _mistake(sensor, where, dict(zip(columns, fields, strict=True)))
        listed[key] = ListedSensor(sensor, mistake)
    return listed


def _mistake(sensor, where, row):
    """Set the arguments of a sensor that its line states, and return what is wrong with them."""
    folder = sensor.model.parent
    sensor.model = folder / row["model"]
    sensor.source = str(folder / row["source"])
    sensor.state = sensor.state and sensor.state / f"{row['name']}.json"
    if row.get("channel"):
        sensor.channel = channel_names(row["channel"])
    if row["source"] in ("", "-"):
        return f"{where}: source {row['source']!r}, expected a file or a folder"
    if not row["model"]:
        return f"{where}: the model is empty, expected a file"
    if row.get("rpm"):
        try:
            sensor.rpm = speed_facts(where, row["rpm"])
        except ValueError as error:
            return str(error)
    return None


def _parsed(path):
    """Return the columns of a table, and the fields of each line by its number.

    Each line is parsed by itself, so that a quote that is not closed spoils no other
    line.
    """
    first, *lines = path.read_bytes().splitlines() or [b""]
    try:
        header = first.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise CommandError(
            f"{path}: cannot be read as a csv table ({error})"
        ) from error
    separator = max(",;\t", key=header.count)
    texts = {
        number: line.decode(errors="backslashreplace")
        for number, line in enumerate(lines, start=2)
        if line.strip()
    }
    fields = {number: _fields(text, separator) for number, text in texts.items()}
    return _fields(header, separator), fields


def _fields(line, separator):
    try:
        return next(csv.reader([line], delimiter=separator), [])
    except csv.Error:
        return []


class Plant:
    """Sensors that are watched together.

    Those of a table are started, restarted or ended when their lines have changed.

    Parameters
    ----------
    args : argparse.Namespace
        Arguments of the command. Without a source, its model is a table.
    """

    def __init__(self, args: argparse.Namespace) -> None:
        self._args = args
        self._models = ModelFiles()
        self._sensors: dict[str, Sensor] = {}
        self._has_failed = False
        if args.source is not None:
            _check_pulses(args, [args])
            self._sensors[""] = Sensor(args, self._models, is_alone=True)
            return
        with as_command_error():
            if args.state is not None:
                args.state.mkdir(parents=True, exist_ok=True)
            self._read()

    def _read(self):
        """Read the table, and start, restart or end sensors by their lines."""
        version = file_version(self._args.model)
        lines = listed_sensors(self._args)
        _check_pulses(self._args, [line.args for line in lines.values()])
        for key, sensor in [*self._sensors.items()]:
            line = lines.get(key)
            is_same = line == (sensor.args, sensor.mistake)
            if line is None or not (is_same or sensor.is_pipe):
                sensor.save()
                sensor.finish()
                del self._sensors[key]
            elif not is_same:
                sensor.say(
                    "a pipe or a device cannot be opened again; its line was not read"
                )
        for key, line in lines.items():
            if key not in self._sensors:
                self._sensors[key] = Sensor(
                    line.args, self._models, mistake=line.mistake
                )
        self._version = version
        self._look_at = time.monotonic() + self._args.retry

    def _look(self):
        """Read the table if it has changed."""
        if self._args.source is not None or time.monotonic() < self._look_at:
            return
        try:
            with as_command_error():
                if file_version(self._args.model) != self._version:
                    self._read()
            self._has_failed = False
        except (CommandError, UsageError) as error:
            if not self._has_failed:
                say(f"error: {error}; the sensors are watched as before")
            self._has_failed = True
        self._look_at = time.monotonic() + self._args.retry

    def start(self) -> None:
        """Start all sensors."""
        for sensor in self._sensors.values():
            sensor.look()

    def follow(self, signals: list[Any]) -> None:
        """Watch until all sources have ended, nothing new has come for long, or a signal came.

        Parameters
        ----------
        signals : list
            Signals so far. They end the command where a later run can continue.
        """
        args = self._args
        since = time.monotonic()
        while watched := [
            sensor for sensor in self._sensors.values() if _is_watched(sensor, signals)
        ]:
            is_news = [sensor.step() for sensor in watched]
            if any(is_news):
                since = time.monotonic()
            elif args.idle is not None and time.monotonic() - since >= args.idle:
                break
            elif not signals and not any(sensor.has_ended for sensor in watched):
                time.sleep(args.poll)
            if not signals:
                self._look()

    def save(self) -> None:
        """Save all states."""
        for sensor in self._sensors.values():
            sensor.save()

    def finish(self) -> bool:
        """Print all summaries, and return whether a problem remains."""
        for sensor in self._sensors.values():
            sensor.finish()
        return self._has_failed or any(
            sensor.problem for sensor in self._sensors.values()
        )


def _is_watched(sensor, signals):
    return not sensor.has_ended and not (signals and sensor.is_at_position)


def _check_pulses(args, sensors):
    if not any("speed_source" in sensor.rpm for sensor in sensors):
        refuse(args, ["pulses_per_revolution"], f"belongs to --rpm {TACHO}CHANNEL")
