"""Source of the samples of one sensor of ``skarxlag watch``, with their speeds."""

import argparse
import sys
from collections import Counter
from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from ..commands.arguments import refuse
from ..commands.channels import are_compared, channel_remarks
from ..commands.messages import CommandError, counted
from ..commands.models import SavedModel
from ..readers.entries import ListedRecording
from ..readers.files import chosen_channels
from ..readers.speeds import TACHO
from ..readers.tacho import TachoStream
from .live import Block, Blocks, from_folder, from_growing_file, from_stream
from .live_samples import RawSamples
from .live_text import TextSamples
from .live_times import StreamTimes

#: Arguments on which the meaning of a state depends.
_READING = ("channel", "dtype", "time_column", "rpm_column", "pulses_per_revolution")


class SensorSource:
    """Blocks of samples from a folder, a growing file, a pipe or standard input.

    Parameters
    ----------
    args : argparse.Namespace
        Arguments of the command.
    model : SavedModel
        The model, whose channels are read.
    sampling_rate : float
        In Hz.
    say : callable
        Prints a line on the source.

    Attributes
    ----------
    model : SavedModel
        The model.
    is_folder : bool
        Whether the source is a folder.
    can_reopen : bool
        Whether it is a file or a folder, no pipe or device.
    facts : dict
        Facts of which a state must have the same.
    blocks : iterator of Block or None
        Blocks of samples; None if nothing new has come.
    unread : Counter
        Lines and bytes that were not read, by reason.
    """

    def __init__(
        self,
        args: argparse.Namespace,
        model: SavedModel,
        sampling_rate: float,
        say: Callable[[str], None],
    ) -> None:
        self._args = args
        self.model = model
        self._rate = sampling_rate
        self._say = say
        self._path = Path(args.source)
        is_stdin = args.source == "-"
        if not is_stdin and not self._path.exists():
            raise CommandError(f"{self._path}: no such file or folder")
        self.is_folder = not is_stdin and self._path.is_dir()
        self.can_reopen = self.is_folder or (not is_stdin and self._path.is_file())
        if self.is_folder or args.dtype is not None:
            refuse(args, ["time_column", "rpm_column"], "belongs to csv lines")
        self._pulses = args.pulses_per_revolution or 1
        self._tacho = None
        self._speed_column = args.rpm_column
        speeds = args.rpm.get("speed_source")
        if speeds and not self.is_folder:
            if not speeds.startswith(TACHO):
                advice = f"is for a folder; use {TACHO}CHANNEL, --rpm-column"
                refuse(args, ["rpm"], f"{speeds} {advice}")
            self._tacho = TachoStream(self._rate, self._pulses)
            self._speed_column = speeds.removeprefix(TACHO)
        self.facts = {name: getattr(args, name) for name in _READING}
        self.facts["source"] = args.source if is_stdin else str(self._path.resolve())
        self.unread: Counter[str] = Counter()
        self._parser: TextSamples | RawSamples | None = None
        self._remarks: list[str] = []
        self.blocks: Any = None

    def open(self, position: list[Any] | None) -> None:
        """Open the source at a position; None: at its beginning."""
        self.blocks = self._folder(position) if self.is_folder else self._file(position)

    def signals_of(self, block: Block) -> tuple[NDArray[Any], Any]:
        """Return the channels of the model in a block, and their speed.

        Raises
        ------
        ValueError
            If the block has another number of channels.
        """
        samples = block.samples
        rpm = block.rpm if self.is_folder else self._args.rpm.get("rpm")
        if self._speed_column is not None:
            rpm = samples[-1]
            samples = samples[:-1]
            if self._tacho is not None:
                rpm = self._tacho.speeds(rpm)
        n_channels = self.model.n_channels
        if len(samples) != n_channels:
            advice = "--channel chooses" if self.is_folder else self._parser.advice
            raise ValueError(
                f"{counted(len(samples), 'channel')}, expected {n_channels}; {advice}"
            )
        if self._parser is not None:
            channels = self._parser.channels[:n_channels]
            remarks = channel_remarks(channels, self.model.facts, self._args.channel)
            self._note([*remarks])
        return samples, rpm

    def _folder(self, position) -> Blocks:
        args = self._args
        return from_folder(
            self._path,
            self._entry_of,
            self.model.capabilities,
            args.settle,
            args.timed_files,
            self._say,
            position,
        )

    def _entry_of(self, path):
        """Return a file of a folder with its channels, and print remarks that are new."""
        args = self._args
        recording = ListedRecording(
            None,
            path.name,
            path,
            channel=args.channel,
            dtype=args.dtype,
            sampling_rate=self._rate,
            pulses_per_revolution=self._pulses,
            **args.rpm,
        )
        facts = self.model.facts
        choices = self.model.channel_choices(recording)
        channel, channels = chosen_channels(path, choices=choices, dtype=args.dtype)
        is_compared = are_compared(facts, args.channel)
        remarks = channel_remarks(channels, facts, args.channel)
        self._note([*remarks] if is_compared else [])
        return replace(recording, channel=channel)

    def _file(self, position) -> Blocks:
        args = self._args
        length = self.model.window_length
        usual = self.model.usual_channels
        if args.dtype is None:
            tolerance = args.gap_tolerance or 0.5 * length / self._rate
            times = StreamTimes(args.time_column, self._rate, tolerance, length)
            parser = TextSamples(args.channel, times, self._speed_column, usual)
        else:
            parser = RawSamples(args.dtype, args.channel, self._speed_column, usual)
        self.unread = parser.unread
        self._parser = parser
        path = self._path
        if args.source == "-":
            if sys.stdin is None:
                raise CommandError("-: there is no standard input")
            return from_stream(lambda: nullcontext(sys.stdin.buffer.raw), parser)
        if path.is_fifo() or path.is_char_device():
            return from_stream(lambda: path.open("rb", buffering=0), parser)
        return from_growing_file(path, parser, self._say, position)

    def _note(self, remarks):
        """Print remarks on the channels, unless they are those before."""
        if remarks != self._remarks:
            self._remarks = remarks
            for remark in remarks:
                self._say(remark)
