"""Recordings of a list: the file, and the facts that are stated outside it."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, NamedTuple, Self

from numpy.typing import NDArray

from .files import open_file, recording_speed, recording_start
from .formats.rates import NO_RATE, rates_agree
from .speeds import TACHO, SpeedProfile


class OpenRecording(NamedTuple):
    """Recording whose facts are read, and whose samples follow.

    Attributes
    ----------
    entry : ListedRecording
        The recording, with its channels, and with its speed if it was requested.
    channels : list of tuple of str
        Name and unit of each channel. The unit is None if the file states none.
    sampling_rate : float or None
        In Hz; None if it is not known.
    old_rate : float or None
        Sampling rate before resampling; None if the samples are as they were recorded.
    blocks : iterator of ndarray of shape (n_samples,) or (n_channels, n_samples)
        The samples.
    """

    entry: "ListedRecording"
    channels: list[tuple[str, str | None]]
    sampling_rate: float | None
    old_rate: float | None
    blocks: Iterator[NDArray[Any]]


@dataclass(frozen=True)
class ListedRecording:
    """Recording in a list: its file, and the facts that are stated outside the file.

    Parameters
    ----------
    where : str or None
        Entry that error messages name, such as the line of a table. None: they name the
        path.
    name : str
        Its name in results.
    path : Path
        The file.
    channel : str, list of str or None
        As in :func:`read_recording`.
    sampling_rate : float or None
        In Hz, if it was stated outside the file.
    condition : str or None
        State of the machine, if known.
    specimen : str or None
        The bearing, if stated.
    load : str or None
        Load of the machine, a number or a text, if stated.
    rpm : float or None
        Mean shaft speed, rev/min, if known.
    dtype : str or None
        As in :func:`read_recording`.
    speed_source : str or None
        Where the speed is stated if `rpm` is None: ``tacho:CHANNEL``, or a csv file.
        None: in the file of the recording.
    pulses_per_revolution : float
        Pulses of the tachometer in a revolution of the shaft.
    further : dict of str to str
        Other facts in the table or the file name, by the name of the column or the
        group.
    profile : SpeedProfile or None
        Speed over time, if a source states it.
    """

    where: str | None
    name: str
    path: Path
    channel: str | list[Any] | None = None
    sampling_rate: float | None = None
    condition: str | None = None
    specimen: str | None = None
    load: str | None = None
    rpm: float | None = None
    dtype: str | None = None
    speed_source: str | None = None
    pulses_per_revolution: float = 1
    further: dict[str, Any] = field(default_factory=dict)
    profile: SpeedProfile | None = None

    @property
    def states_speed(self) -> bool:
        """True if the speed, or a source of it, is stated outside the file."""
        return self.rpm is not None or self.speed_source is not None

    def with_speed(self) -> Self:
        """Return the recording with its shaft speed, if a file states it.

        Raises
        ------
        FileNotFoundError, ImportError, ValueError
            As `recording_speed` and `logged_speed` do; and if a tachometer has fewer
            than two pulses, no sampling rate, or no integer number of pulses in a
            revolution. The message names the entry.
        """
        if self.rpm is not None:
            return self
        with self.named():
            return self._at(self._speed())

    def _at(self, speed):
        """Return the recording with a speed, or with speeds over time."""
        if isinstance(speed, SpeedProfile):
            return replace(self, rpm=speed.mean(), profile=speed)
        return replace(self, rpm=speed)

    def _speed(self):
        """Return the shaft speed from the source of speeds."""
        if self.speed_source is None:
            return recording_speed(
                self.path,
                channel=self.channel,
                dtype=self.dtype,
                sampling_rate=self.sampling_rate,
            )
        if self.speed_source.startswith(TACHO):
            return self._tachometer_speed()
        # This import takes longer than the listing of recordings.
        from .speed_logs import logged_speed

        names = {self.name, str(self.path), self.path.name, self.path.stem}
        return logged_speed(self.speed_source, names, self._span)

    def _tachometer_speed(self):
        from ...measures.measured_speeds import pulse_speeds

        pulses = self.pulses_per_revolution
        if pulses % 1:
            raise ValueError(f"pulses_per_revolution is {pulses}, not an integer")
        tachometer = replace(self, channel=self.speed_source.removeprefix(TACHO))
        opened = tachometer.open()
        (signal,) = opened.blocks
        if opened.sampling_rate is None:
            raise ValueError(NO_RATE)
        return SpeedProfile(*pulse_speeds(signal, opened.sampling_rate, int(pulses)))

    def speeds(self, start: Any, n_samples: int, sampling_rate: float) -> Any:
        """Return the speeds of rows, see `SpeedProfile.rows`; `rpm` if there is no profile."""
        if self.profile is None:
            return self.rpm
        return self.profile.rows(start, n_samples, sampling_rate)

    def _span(self, is_date):
        """Times of the first and the last sample, since 1970 or since the start."""
        start = 0.0
        if is_date:
            start = recording_start(self.path, channel=self.channel, dtype=self.dtype)
        opened = self.open(2**20)
        rate = opened.sampling_rate
        if start is None or rate is None:
            missing = "its sampling rate" if rate is None else "the date of its start"
            raise ValueError(
                f"the recording does not state {missing}, which a log of speeds needs"
            )
        n_samples = sum(signal.shape[-1] for signal in opened.blocks)
        return start, start + n_samples / rate

    def open(
        self,
        n_samples: int | None = None,
        *,
        channels: Sequence[Any] | None = None,
        reads_speed: bool = False,
        resample: float | None = None,
    ) -> OpenRecording:
        """Read the facts of the recording, and return them with its samples.

        Parameters
        ----------
        n_samples : int or None, default=None
            Samples in a block, at most. None: one block of all.
        channels : sequence or None, default=None
            Ways to state the channels, of which the first that the file has is taken.
            None: as the entry states them.
        reads_speed : bool, default=False
            Whether the speed is read, too, see `with_speed`.
        resample : float or None, default=None
            Sampling rate in Hz to which the samples are brought. None leaves them as
            they are.

        Raises
        ------
        FileNotFoundError, ImportError, ValueError
            As in :func:`read_recording`, when the samples in question are reached; and
            if the stated rate differs from the rate in the file. The message names the
            entry.
        """
        reads_file = reads_speed and not self.states_speed
        entry = self.with_speed() if reads_speed and self.states_speed else self
        with self.named():
            facts, blocks = open_file(
                self.path,
                n_samples,
                choices=[self.channel] if channels is None else channels,
                dtype=self.dtype,
                stated_rate=self.sampling_rate,
                reads_speed=reads_file,
            )
            rate = facts.sampling_rate or self.sampling_rate
        entry = entry._at(facts.speed) if reads_file else entry
        entry = replace(entry, channel=facts.channel)
        if resample is None:
            return OpenRecording(entry, facts.channels, rate, None, blocks)
        # Usage errors need no library that computes.
        from .resampling import resampled_blocks

        old_rate = None if rates_agree(rate, resample) else rate
        blocks = resampled_blocks(blocks, rate, resample)
        return OpenRecording(entry, facts.channels, resample, old_rate, blocks)

    @contextmanager
    def named(self) -> Iterator[None]:
        """Put the entry at the beginning of error messages."""
        where = self.where or str(self.path)
        try:
            yield
        except (FileNotFoundError, ImportError, ValueError) as error:
            if str(error).startswith(where):
                raise
            raise type(error)(f"{where}: {error}") from error
