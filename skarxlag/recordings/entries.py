"""Recordings of a list: the file, and the facts that are stated outside it."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Self

from numpy.typing import NDArray

from .files import recording_blocks, recording_speed, recording_start
from .monotonic import Direction
from .rates import NO_RATE, rates_agree, unit_advice
from .speeds import TACHO, SpeedProfile


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
            speed = self._speed()
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
        from ..core.measured_speeds import pulse_speeds

        pulses = self.pulses_per_revolution
        if pulses % 1:
            raise ValueError(f"pulses_per_revolution is {pulses}, not an integer")
        tachometer = replace(self, channel=self.speed_source.removeprefix(TACHO))
        ((signal, rate),) = tachometer.blocks()
        if rate is None:
            raise ValueError(NO_RATE)
        return SpeedProfile(*pulse_speeds(signal, rate, int(pulses)))

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
        sizes = [(signal.shape[-1], rate) for signal, rate in self.blocks(2**20)]
        n_samples = sum(size for size, _ in sizes)
        rate = sizes[0][1]
        missing = "the date of its first sample" if start is None else None
        missing = missing or ("its sampling rate" if rate is None else None)
        if missing:
            raise ValueError(
                f"the recording does not state {missing}, which a log of speeds needs"
            )
        return start, start + n_samples / rate

    def blocks(
        self, n_samples: int | None = None
    ) -> Iterator[tuple[NDArray[Any], float | None]]:
        """Yield blocks of the recording and its sampling rate, like `recording_blocks`.

        Parameters
        ----------
        n_samples : int or None, default=None
            Samples in a block, at most. None: one block of all.

        Raises
        ------
        FileNotFoundError, ImportError, ValueError
            As there; if the stated rate differs from the rate in the file; and, after
            the last block, if the first channel only rises or only falls. The message
            names the entry.
        """
        stated = self.sampling_rate
        direction = Direction()
        with self.named():
            blocks = recording_blocks(
                self.path,
                n_samples,
                channel=self.channel,
                dtype=self.dtype,
                stated_rate=stated,
            )
            for signal, rate in blocks:
                if not rates_agree(stated, rate):
                    raise ValueError(
                        f"{self.path}: sampling_rate is {stated:g} Hz but the file "
                        f"states {rate:g} Hz{unit_advice(rate, stated)}"
                    )
                direction.add(signal if signal.ndim == 1 else signal[0])
                yield signal, rate if stated is None else stated
            if direction.is_monotonic:
                is_named = isinstance(self.channel, str)
                channel = f"channel {self.channel!r}" if is_named else "the channel"
                raise ValueError(
                    f"{self.path}: {channel} only rises or only falls: it holds times or "
                    "a count, and is no signal; choose another channel"
                )

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
