"""Arguments of the commands, declared without the libraries that they compute with.

The docstring of a function is the description of its command. `checks` has what is
checked of the arguments.
"""

from argparse import ArgumentParser
from pathlib import Path
from typing import Any

from ..readers.recording_tables import channel_names
from . import arguments
from .arguments import (
    job_count,
    positive_int,
    positive_number,
    rate,
    sampling_rate,
    window_length,
)

#: Options that several commands share: help, type and placeholder of the value.
_SHARED: dict[str, tuple[str, Any, str]] = {
    "--bearing": (arguments.BEARING, arguments.bearing, "BEARING"),
    "--channel": (
        "name, position, or pattern such as *DE_time; several separated by ;, the "
        "output first",
        channel_names,
        "NAME",
    ),
    "--dtype": (
        "samples of raw binary data: <i2, or '(4,)<f4' for 4 channels",
        str,
        "TYPE",
    ),
    "--n-jobs": ("number of workers; default: all cores", job_count, "N"),
    "--outputs": ("the first N channels are sensors; default: 1", positive_int, "N"),
    "--pattern": (
        "for a folder or a glob; its named groups state facts in a file's name",
        str,
        "REGEX",
    ),
    "--pulses-per-revolution": ("of the tachometer; default: 1", positive_int, "N"),
    "--rpm": (
        "shaft speed, a channel of pulses as tacho:CHANNEL, or a csv log of speeds",
        arguments.speed_or_source,
        "RPM",
    ),
    "--sampling-rate": ("if the data do not state it", sampling_rate, "HZ"),
    "--table": ("csv table of further recordings", Path, "FILE.csv"),
    "--unit": ("of signals whose files state none: m/s2, g, mm/s", str, "UNIT"),
    "--window-length": (
        "samples in a window; default: as the recordings allow",
        window_length,
        "N",
    ),
}
_FACTS = (
    "--pattern",
    "--channel",
    "--sampling-rate",
    "--rpm",
    "--pulses-per-revolution",
    "--dtype",
)
_RECORDINGS = "a file, a folder, or a glob such as 'runs/*/acc_*.tdms'"


def _option(
    group: Any, names: str, text: str, kind: Any = None, metavar: str = "N"
) -> None:
    """Add an option with a value; names are separated by a blank."""
    group.add_argument(*names.split(), help=text, type=kind, metavar=metavar)


def _flag(group, names, text):
    """Add an option without a value; names are separated by a blank."""
    group.add_argument(*names.split(), help=text, action="store_true")


def _shared(group, *names):
    """Add options that several commands share."""
    for name in names:
        _option(group, name, *_SHARED[name])


def _facts(parser, of):
    """Add facts of recordings that a table, a file or its name does not state."""
    _shared(parser.add_argument_group(f"facts of {of}"), *_FACTS)
    parser.set_defaults(rpm={})


def _quiet(parser):
    _flag(parser, "-q --quiet", "print no progress")


def _force(parser):
    _flag(parser, "--force", "let -o replace a file")


def fit(parser: ArgumentParser) -> None:
    """Calibrate a diagnoser on the recordings that a table lists, and save it.

    The table is a csv file with the columns path, condition, specimen, load, rpm,
    sampling_rate and channel. Only path is always needed, see
    skarxlag.read_recording_table. Without --healthy, the only condition is taken that is
    called healthy, normal, good, ok, intact, nominal, baseline, n or h. The detector needs
    healthy recordings only, best of several speeds, and names no fault; it is the default
    if the only condition is healthy. Otherwise the rows are stretches of a second, or of
    ten revolutions if they take longer, or windows of 1200 samples if the recordings are too
    short or an option cuts windows (of 4800 for the detector). With --bearing and
    recordings of faults, orders and spectra make one verdict; without faults, healthy
    recordings set the limits.
    """
    text = "csv table of the recordings, a folder, or a glob"
    parser.add_argument("table", type=Path, help=text)
    parser.add_argument(
        "-o",
        "--output",
        type=Path,
        required=True,
        metavar="FILE.skops",
        help="the saved model",
    )
    text = "healthy condition, or none if no recording is"
    _option(parser, "--healthy", text, str, "LABEL")
    text = "of healthy rows; default: 0.01"
    _option(parser, "--false-alarm-rate", text, rate, "SHARE")
    _shared(parser, "--n-jobs", "--bearing", "--outputs", "--window-length")
    parser.add_argument(
        "--diagnoser",
        choices=("diagnoser", "stretches", "detector"),
        help="default: as the recordings allow",
    )
    text = "healthy limits use the level; it needs the same sensor and gain"
    _flag(parser, "--fixed-gain", text)
    _option(parser, "--resample-to", "sampling rate of all", sampling_rate, "HZ")
    _quiet(parser)
    _force(parser)
    _facts(parser, "recordings whose line in the table lacks them")
    parser.set_defaults(false_alarm_rate=0.01, n_jobs=-1)


def diagnose(parser: ArgumentParser) -> None:
    """Diagnose recordings with a model that `fit` or `save_diagnoser` saved.

    Each recording gets one verdict from the evidence of all its windows. With --bearing and
    without a model, the orders of the bearing (BPFO, BPFI, BSF, FTF) name the location of a
    fault. A model that was fitted with another bearing takes these orders instead of its
    own, and raises no alarm. A .csv among RECORDING holds samples; a table of recordings,
    with the columns that `fit` takes, is given with --table. With -o, results are written
    as .csv or .parquet (rows of windows in a second file, FILE_windows), .json, or .html, a
    report to read and print. An interrupted run goes on where it stopped if it is started
    again with the same file. Exit status: 0 if all recordings were diagnosed, 1 if some
    could not be, 2 if an argument is wrong, 3 with --fail-on alarm if a verdict is not the
    healthy condition.
    """
    text = "or --bearing"
    parser.add_argument("model", nargs="?", type=Path, metavar="MODEL.skops", help=text)
    parser.add_argument("recordings", nargs="*", metavar="RECORDING", help=_RECORDINGS)
    _shared(parser, "--table", "--bearing", "--unit")
    _option(parser, "-o --output", "write .csv, .parquet, .json or .html", Path, "FILE")
    text = "exit status 3 if one is not healthy"
    parser.add_argument("--fail-on", choices=["alarm"], help=text)
    _flag(parser, "--resample", "bring recordings to the model's sampling rate")
    _quiet(parser)
    _force(parser)
    _facts(parser, "each RECORDING, or of lines of the table without them")
    _shared(parser, "--n-jobs")
    where = parser.add_mutually_exclusive_group()
    _flag(where, "--processes", "a process for each worker; for text files")
    text = "workers of a dask.distributed scheduler, such as tcp://host:8786"
    _option(where, "--dask", text, str, "ADDRESS")
    parser.set_defaults(n_jobs=-1)


def evaluate(parser: ArgumentParser) -> None:
    """Compare diagnosers: train at some speeds, and test at others.

    Without a table, the diagnosers are those of the paper and the recommended one, on the
    simulated rig or on a public one: ALPIO, the baseline of Piltan and Kim (2019); their
    proposal, as repaired; and make_diagnoser. Each is trained on the first half of every
    recording of a speed, which is 500 rpm on the simulated rig and each in turn on a public
    one, and tested on the second halves at other speeds. With a table of
    your own recordings (columns path, condition and rpm), a folder or a glob, make_diagnoser is
    trained as skarxlag fit would train it, next to a plain classifier of spectra. If the
    table states specimens or loads, another bearing and another load are tested, too. The
    recordings of one value of the column campaign are not split between training and test
    across speeds. All verdicts are written to the output folder.
    """
    text = "your own recordings; default: the simulated rig"
    parser.add_argument("table", nargs="?", type=Path, help=text)
    rig = parser.add_argument_group("public rig")
    text = "a data set that bearing-datasets has built, such as paderborn"
    _option(rig, "--dataset", text, str, "NAME")
    text = "of the built data sets; default: as bearing-datasets is set"
    _option(rig, "--data-home", text, Path, "FOLDER")
    text = "metadata that the recordings must have, such as 'fs == 12000'"
    _option(rig, "--where", text, str, "CONDITION")
    text = "of simulated recordings; default: 120000"
    _option(parser, "--n-samples", text, positive_int)
    _shared(parser, "--window-length", "--bearing", "--outputs", "--n-jobs")
    _option(parser, "-o --output", "default: skarxlag-results", Path, "FOLDER")
    _quiet(parser)
    _facts(parser, "recordings whose line in the table lacks them")
    parser.set_defaults(n_jobs=-1, output=Path("skarxlag-results"))


def show(parser: ArgumentParser) -> None:
    """Draw recordings without a diagnosis: signal, spectrum, envelope spectrum over orders.

    The page is one file of HTML that needs no network. With --bearing and a known speed,
    the lines of the bearing (BPFO, BPFI, BSF, FTF) are marked. Of a long recording, the first
    million samples are drawn. Exit status: 0 if all were drawn, 1 if some could not be read,
    2 if an argument is wrong.
    """
    parser.add_argument("recordings", nargs="*", metavar="RECORDING", help=_RECORDINGS)
    _shared(parser, "--table", "--bearing", "--unit")
    text = "the page; default: named like the first recording, in this folder"
    _option(parser, "-o --output", text, Path, "FILE.html")
    _force(parser)
    _facts(parser, "each RECORDING")


def bearings(parser: ArgumentParser) -> None:
    """List the bearings of the catalogue with their orders, or those that fit a recording.

    With RECORDING and its speed, the envelope spectrum is searched for the lines of every
    bearing in the catalogue, and the best are printed first. Bearings of nearly equal
    orders cannot be told apart. A bearing that is not listed is given by dimensions or by
    orders wherever a command takes --bearing.
    """
    text = "a file of which the bearings that fit are printed"
    parser.add_argument("recording", nargs="?", metavar="RECORDING", help=text)
    _facts(parser, "RECORDING")


def watch(parser: ArgumentParser) -> None:
    """Diagnose running sensors with a diagnoser that `fit` saved.

    SOURCE is - for standard input, a named pipe or a serial device, or a folder into which a
    logger drops recordings. Pipes hold csv lines, or raw samples with --dtype. A pipe has a
    verdict for each window, and a folder one for each recording, as diagnose has. Writes one
    line of JSON for each verdict to standard output. The alarm takes the healthy limits that
    `fit` saved in the model. Ends with the input, or on Ctrl-C. Instead of MODEL.skops and
    SOURCE, a csv table names several sensors in the columns name, source and model, and
    optionally channel and rpm. A sensor of a table that cannot be watched is reported and
    tried again. Several channels are separated by ; with the output first. With --state, a
    later run continues from there.
    """
    parser.add_argument(
        "model", type=Path, metavar="MODEL.skops", help="or a csv table"
    )
    text = "default: standard input"
    parser.add_argument("source", nargs="?", metavar="SOURCE", help=text)
    _shared(
        parser, "--channel", "--dtype", "--sampling-rate", "--pulses-per-revolution"
    )
    speed = parser.add_mutually_exclusive_group()
    _shared(speed, "--rpm")
    _option(speed, "--rpm-column", "csv column of shaft speeds", str, "NAME")
    alarm = parser.add_mutually_exclusive_group()
    text = "least mean of signal between false alarms of a pipe; default: 1000"
    _option(alarm, "--false-alarm-interval", text, positive_number, "HOURS")
    text = (
        "windows of a pipe, or snapshots of a folder, that exceed the limits in a row "
        "and raise the alarm; default: by the interval above, or 1 snapshot"
    )
    _option(alarm, "--alarm-delay", text, positive_int)
    text = "keep an alarm on until skarxlag acknowledge; needs --state"
    _flag(parser, "--latch", text)
    text = "save every minute; with a table, a folder"
    _option(parser, "--state", text, Path, "FILE.json")
    texts = {
        "--half-life": "of the evidence in a pipe; default: 10",
        "--idle": "end after so long without anything new; default: never",
        "--retry": "between attempts to watch a sensor; default: 60",
        "--settle": "pause after which a file in a folder is finished; default: 2",
        "--heartbeat": "without a verdict after which a line of JSON says that the command "
        "runs; default: none does",
    }
    for name, text in texts.items():
        _option(parser, name, text, positive_number, "SECONDS")
    parser.set_defaults(half_life=10.0, rpm={}, retry=60.0, settle=2.0)


def acknowledge(parser: ArgumentParser) -> None:
    """Acknowledge a latched alarm of a sensor that ``watch --latch`` follows.

    The alarm goes off at once, or as soon as the signal is within the healthy limits again.
    If the command watch does not run, the alarm is acknowledged when it starts.
    """
    text = "the file of watch --state; with a table, that of the sensor in the folder"
    parser.add_argument("states", nargs="+", type=Path, metavar="STATE.json", help=text)


def info(parser: ArgumentParser) -> None:
    """Print what a saved model is, what it was calibrated on, and what it cannot do.

    Of a recording, print its channels with their sampling rates, units and shaft speeds.
    """
    text = "a saved model, or a recording"
    parser.add_argument("path", type=Path, metavar="FILE", help=text)
    _flag(parser, "--json", "print JSON, for programs")
