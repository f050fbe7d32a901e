"""Sensors of ``skarxlag watch``: they start, fail, are tried again, and get other models."""

import argparse
import os
import time
from contextlib import suppress
from pathlib import Path

from ..commands.messages import CommandError, UsageError, as_command_error, say
from ..commands.models import SavedModel
from .lines import SensorLines
from .stream import Memory, SensorStream


def file_version(path: Path) -> tuple[int, int, int]:
    """Return numbers that change with the contents of a file."""
    try:
        status = path.stat()
    except FileNotFoundError as error:
        raise FileNotFoundError(f"{path}: no such file") from error
    return status.st_mtime_ns, status.st_size, status.st_ino


class ModelFiles:
    """Models of the sensors. A file is loaded once, and again after it has changed."""

    def __init__(self) -> None:
        self._loaded: dict[Path, tuple[object, SavedModel]] = {}
        self._announced: dict[Path, str] = {}

    def load(self, path: Path) -> SavedModel:
        """Return the model in a file."""
        with as_command_error():
            version = file_version(path)
        if path not in self._loaded or self._loaded[path][0] != version:
            self._loaded[path] = version, SavedModel(path)
        return self._loaded[path][1]

    def announce(self, stream: SensorStream) -> None:
        """Print what the model of a stream is, and the delay of its alarm, once for each model."""
        model = stream.model
        if self._announced.get(model.path) != model.identity:
            self._announced[model.path] = model.identity
            say(model.heading)
            if alarm := stream.alarm():
                say(alarm)


class Sensor:
    """Sensor that is watched, or will be as soon as its source and its model permit it.

    Parameters
    ----------
    args : argparse.Namespace
        Arguments of the command for the sensor.
    models : ModelFiles
        Models of all sensors.
    is_alone : bool, default=False
        Whether an error ends the command. Otherwise the sensor is tried again.
    mistake : str or None, default=None
        Why the arguments cannot be used.

    Attributes
    ----------
    args : argparse.Namespace
        The arguments.
    problem : str or None
        Why the sensor is not watched, or not with the present model.
    has_ended : bool
        Whether the source has ended.
    """

    def __init__(
        self,
        args: argparse.Namespace,
        models: ModelFiles,
        is_alone: bool = False,
        mistake: str | None = None,
    ) -> None:
        self.args = args
        self.mistake = mistake
        self.problem: str | None = None
        self.has_ended = self._is_mended = False
        self._models = models
        self._is_alone = is_alone
        path = args.model if args.source == "-" else args.source
        # The path of a folder may be a dot.
        name = args.sensor or Path(os.path.abspath(path)).stem
        self._lines = SensorLines(args, name)
        self._stream: SensorStream | None = None
        self._memory: Memory | None = None
        self._look_at = 0.0

    @property
    def is_at_position(self) -> bool:
        """Return whether a later run can continue after the last block."""
        return self._stream is None or self._stream.is_at_position

    @property
    def is_pipe(self) -> bool:
        """Return whether the source is open and cannot be opened again."""
        return self._stream is not None and not self._stream.source.can_reopen

    def look(self) -> None:
        """Start to watch; if the file of the model has changed, exchange the model."""
        self._look_at = time.monotonic() + self.args.retry
        try:
            if self.mistake is not None:
                raise CommandError(self.mistake)
            model = self._models.load(self.args.model)
            if self._stream is None:
                self._stream = SensorStream(self.args, model, self._lines, self._memory)
                self._memory = None
            elif model.identity != self._stream.model.identity:
                self._stream = self._stream.with_model(model)
            self._models.announce(self._stream)
            self._is_mended = True
        except (CommandError, UsageError) as error:
            if self._is_alone and self._stream is None:
                raise
            self._report(error)

    def step(self) -> bool:
        """Process the next block, and return whether there was one."""
        is_news: bool | None = False
        if time.monotonic() >= self._look_at and self.is_at_position:
            self.look()
        if self._stream is not None:
            try:
                with as_command_error():
                    if self.args.latch:
                        self._stream.acknowledge()
                    is_news = self._stream.step()
                self.has_ended = is_news is None
                self._note_success(is_news)
            except CommandError as error:
                if self._is_alone:
                    raise
                self._memory = self._stream.memory()
                with suppress(OSError):
                    self._stream.save()
                self._stream.close()
                self._stream = None
                self._look_at = time.monotonic() + self.args.retry
                self._report(error)
        self._lines.beat(self.problem)
        return bool(is_news)

    def _note_success(self, is_news):
        """Print that a problem is over. A pipe that is open may still hold what cannot be read."""
        is_over = self._is_mended and (is_news or not self.is_pipe)
        if self.problem is not None and is_over:
            self.problem = None
            self.say("watched again")

    def _report(self, error):
        """Print a problem when it begins, not at each attempt."""
        self._is_mended = False
        if str(error) != self.problem:
            self.problem = str(error)
            kept = "" if self._stream is None else "; the model before is used"
            self.say(f"error: {error}{kept}; tried again every {self.args.retry:g} s")

    def save(self) -> None:
        """Save the state. If it cannot be written, the states of the others still are."""
        try:
            with as_command_error():
                if self._stream is not None:
                    self._stream.save()
        except CommandError as error:
            self.problem = str(error)
            self.say(f"error: {error}")

    def finish(self) -> None:
        """Print the summary."""
        if self._stream is not None:
            self._stream.close()
            self._stream.say(self._stream.summary())

    def say(self, text: str) -> None:
        """Print a line to standard error, after the name of the sensor if the user stated one."""
        say(text if self.args.sensor is None else f"{self.args.sensor}: {text}")
