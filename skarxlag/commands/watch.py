"""``skarxlag watch``: verdicts on a running sensor."""

import argparse
import sys
import time
from contextlib import nullcontext
from pathlib import Path

from .._answers import answers
from ..monitoring import ConditionMonitor
from ..recordings.formats._contents import ContentError
from ..recordings.live import (
    Patience,
    Stopping,
    StopRequestedError,
    from_folder,
    from_growing_file,
    from_stream,
)
from ..recordings.live_samples import RawSamples, TextSamples
from ..recordings.live_times import StreamTimes
from ..recordings.rates import rates_agree
from ..verdicts import HOLD
from .arguments import positive_number
from .messages import CommandError, UsageError, as_command_error, printable
from .models import SavedModel
from .watch_output import VerdictLines, sentence, summary
from .watch_state import WatchState

_DESCRIPTION = """\
Diagnose a running sensor with a diagnoser that `fit` saved. SOURCE is - for standard input, a file
that grows, a named pipe or serial device, or a folder into which a logger drops files. Streams and
growing files hold csv lines, or raw samples with --dtype; files in a folder are of any format that
diagnose reads. Writes one line of JSON for each window to standard output, or fewer with --every,
and a summary to standard error. The alarm takes the healthy limits that `fit` saved in the model.
Ends with the input, or on Ctrl-C.
"""
#: Seconds between two savings of the state.
_SAVE_EVERY = 60.0


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.description = _DESCRIPTION
    parser.add_argument("model", type=Path, metavar="MODEL.skops", help="what fit has saved")
    parser.add_argument("source", metavar="SOURCE", help="- or a file or a folder")
    parser.add_argument(
        "--dtype", help="of raw samples: <i2, or '(4,)<f4' for four interleaved channels"
    )
    parser.add_argument(
        "--channel",
        metavar="NAME",
        help="name, position counted from 0, or pattern such as *DE_time of the column or channel; "
        "several are separated by ; with the output first; default: all but a column of times",
    )
    parser.add_argument(
        "--sampling-rate", type=positive_number, metavar="HZ", help="default: the model's"
    )
    speed = parser.add_mutually_exclusive_group()
    speed.add_argument("--rpm", type=positive_number, help="shaft speed, where the model uses it")
    speed.add_argument(
        "--rpm-column",
        metavar="NAME",
        help="name, position or pattern of the column of shaft speeds of csv lines; a window has "
        "the speed at its middle",
    )
    parser.add_argument(
        "--hop", type=int, metavar="SAMPLES", help="between windows; default: their length"
    )
    parser.add_argument(
        "--half-life",
        type=positive_number,
        default=10.0,
        metavar="SECONDS",
        help="in which the weight of evidence halves; default: %(default)g",
    )
    parser.add_argument(
        "--false-alarm-interval",
        type=positive_number,
        default=1000.0,
        metavar="HOURS",
        help="of signal between false alarms, in the mean; default: %(default)g",
    )
    parser.add_argument(
        "--time-column",
        metavar="NAME",
        help="name, position or pattern of the column of times of csv lines, in seconds or as ISO "
        "dates; none: there is none; default: the column that is called time, t or alike",
    )
    parser.add_argument(
        "--timed-files",
        action="store_true",
        help="there may be gaps between the files of a folder: a file begins at the date that it "
        "states, or else its time of modification is that of its last sample",
    )
    parser.add_argument(
        "--gap-tolerance",
        type=positive_number,
        metavar="SECONDS",
        help="by which a time may be late without a gap; default: half a window",
    )
    parser.add_argument(
        "--state", type=Path, metavar="FILE.json", help="continue from here, and save every minute"
    )
    parser.add_argument(
        "--idle",
        type=positive_number,
        metavar="SECONDS",
        help="end when a file or a folder has had nothing new for so long; default: never",
    )
    parser.add_argument(
        "--poll",
        type=positive_number,
        default=0.2,
        metavar="SECONDS",
        help="between looks at a file or a folder; default: %(default)g",
    )
    parser.add_argument(
        "--settle",
        type=positive_number,
        default=2.0,
        metavar="SECONDS",
        help="without a change after which a file in a folder is finished; default: %(default)g",
    )
    parser.add_argument(
        "--every",
        type=positive_number,
        metavar="SECONDS",
        help="of the sensor's time between lines of JSON; a window with another verdict, alarm or "
        "quality than the line before is written at once; default: every window",
    )
    parser.add_argument(
        "--heartbeat",
        type=positive_number,
        metavar="SECONDS",
        help='without a line after which a line of the kind "heartbeat" is written; default: never',
    )
    parser.add_argument(
        "--sensor",
        metavar="NAME",
        help="stated in each line; default: name of SOURCE, for standard input that of the model",
    )
    parser.add_argument("-v", "--verbose", action="store_true", help="a line a second for people")
    parser.set_defaults(run=run, fail=parser.error)


def run(args: argparse.Namespace) -> int:
    """Run the command."""
    model = SavedModel(args.model)
    sampling_rate = args.sampling_rate or model.sampling_rate
    if sampling_rate is None:
        raise UsageError(f"argument --sampling-rate: needed, {args.model} states none")
    if not rates_agree(sampling_rate, model.sampling_rate):
        raise UsageError(
            f"argument --sampling-rate: {sampling_rate:g}, but {args.model} was fitted at "
            f"{model.sampling_rate:g} Hz"
        )
    monitor = _monitor(args, model, sampling_rate)
    with as_command_error():
        reading = {
            "channel": args.channel,
            "dtype": args.dtype,
            "time column": args.time_column,
            "rpm column": args.rpm_column,
            "sampling rate": sampling_rate,
        }
        state = WatchState(args.state, args.source, args.model, reading)
        place = state.restore(monitor)
        # A file that cannot be written is told now, not in a minute.
        state.save(monitor, place)
    _warn(printable(model.heading))
    sensor = args.sensor or (args.model if args.source == "-" else Path(args.source)).stem
    lines = VerdictLines(args.every, model.healthy, sensor, args.heartbeat)
    with as_command_error(), Stopping() as stopping, lines:
        parser, blocks = _source(args, model, sampling_rate, stopping, place)
        try:
            _follow(args, model, monitor, lines, blocks, stopping, state, place)
        except StopRequestedError:
            pass
        except ContentError as error:
            raise CommandError(f"{printable(args.source)}: {error}") from error
        finally:
            blocks.close()
    _warn(summary(monitor, parser, lines.last))
    return 0


def _monitor(args, model, sampling_rate):
    can = answers(model.diagnoser)
    is_stated = args.rpm is not None or args.rpm_column is not None
    if can.needs_rpm and not is_stated:
        listed = ", ".join(f"{speed:g}" for speed in model.train_rpm or can.speeds)
        raise UsageError(f"argument --rpm: needed, {args.model} was fitted at {listed} rpm")
    with as_command_error():
        return ConditionMonitor(
            model.diagnoser,
            sampling_rate,
            conditions=None if model.healthy is None else model.conditions,
            detector=model.detector,
            window_length=model.window_length,
            hop=args.hop,
            half_life=args.half_life,
            false_alarm_interval=args.false_alarm_interval,
            gap_tolerance=args.gap_tolerance,
            train_rpm=model.train_rpm or (),
        )


def _source(args, model, sampling_rate, stopping, place):
    """Parser of a stream, if there is one, and the blocks."""
    path = Path(args.source)
    channel = args.channel
    if channel is not None and ";" in channel:
        channel = [name.strip() for name in channel.split(";")]
    patience = Patience(stopping, args.poll, args.idle)
    if args.source != "-" and path.is_dir():
        _check_columns(args, "a folder")
        options = {
            "channel": channel,
            "dtype": args.dtype,
            "sampling_rate": sampling_rate,
            "n_channels": model.n_channels,
            "window_length": model.window_length,
            "settle": args.settle,
            "has_times": args.timed_files,
        }
        return None, from_folder(path, options, patience, _warn_printable, place)
    if args.dtype is None:
        tolerance = args.gap_tolerance or 0.5 * model.window_length / sampling_rate
        times = StreamTimes(args.time_column, sampling_rate, tolerance, model.window_length)
        parser = TextSamples(channel, times, args.rpm_column)
    else:
        _check_columns(args, "raw samples")
        parser = RawSamples(args.dtype, channel)
    if args.source == "-":
        if sys.stdin is None:
            raise CommandError("-: there is no standard input")
        return parser, from_stream(lambda: nullcontext(sys.stdin.buffer), parser, stopping)
    if path.is_fifo() or path.is_char_device():
        return parser, from_stream(lambda: path.open("rb"), parser, stopping)
    if not path.is_file():
        raise FileNotFoundError(f"{printable(path)}: no such file or folder")
    return parser, from_growing_file(path, parser, patience, _warn_printable, place)


def _check_columns(args, source):
    for name in ("time_column", "rpm_column"):
        if getattr(args, name) is not None:
            option = "--" + name.replace("_", "-")
            raise UsageError(f"argument {option}: belongs to csv lines, not to {source}")


def _follow(args, model, monitor, lines, blocks, stopping, state, place):
    told = saved = time.monotonic()
    is_at_place, limits = True, None
    try:
        for block in blocks:
            if block.samples.shape[1] > 0:
                samples, rpm = block.samples, args.rpm
                if args.rpm_column is not None:
                    samples, rpm = samples[:-1], samples[-1]
                if len(samples) != model.n_channels:
                    raise ContentError(
                        f"{len(samples)} channels, but {args.model} was fitted on "
                        f"{model.n_channels}; --channel chooses"
                    )
                is_at_place = False
                verdicts = monitor.update(samples, time=block.time, rpm=rpm)
                lines.write(verdicts, block.source)
                for verdict in verdicts:
                    if verdict.limits not in (HOLD, limits):
                        limits = verdict.limits
                        _warn(f"No alarm: {limits}.")
                if verdicts and args.verbose and time.monotonic() - told >= 1.0:
                    told = time.monotonic()
                    _warn(sentence(verdicts[-1]))
            if not block.is_last:
                continue
            place, is_at_place = block.place, True
            if time.monotonic() - saved >= _SAVE_EVERY:
                saved = time.monotonic()
                state.save(monitor, place)
            if stopping.requested:
                return
    finally:
        # A later run would read twice what was read behind the place.
        if is_at_place:
            state.save(monitor, place)


def _warn_printable(text):
    _warn(printable(text))


def _warn(text):
    print(text, file=sys.stderr, flush=True)
