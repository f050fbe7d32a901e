"""Accuracy of diagnosers at shaft speeds that they were not fitted at, next to their peers.

Run ``python -m benchmarks.cross_speed`` from the root of the repository.
"""

import argparse
import sys
from functools import partial
from pathlib import Path

from benchmarks.cross_speed import reporting
from benchmarks.cross_speed.overview import DIFFERENCES, differences, overview
from benchmarks.cross_speed.peers import LEFT_OUT, METHODS, OURS, PEERS
from benchmarks.cross_speed.plots import accuracy_figure
from benchmarks.cross_speed.protocol import leave_one_speed_in
from benchmarks.cross_speed.rigs import RIGS, find, find_rig, split_by_crack
from benchmarks.pages.blocks import write_blocks
from benchmarks.recipe.left_out import choices, diagnoser_without

DEFAULTS = {
    "rig": list(RIGS),
    "method": [*OURS, *PEERS],
    "window_length": [1200, 4800],
}


def parse(arguments):
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--rig",
        nargs="+",
        default=DEFAULTS["rig"],
        help=f"of {list(RIGS)}, or module:function",
    )
    parser.add_argument(
        "--method",
        nargs="*",
        default=DEFAULTS["method"],
        help=f"of {list(METHODS)}, or module:function",
    )
    parser.add_argument(
        "--window-length", nargs="+", type=int, default=DEFAULTS["window_length"]
    )
    parser.add_argument("--data-home", help="folder of the downloaded rigs")
    parser.add_argument(
        "--output",
        type=Path,
        default=Path("skarxlag-results/cross-speed"),
        help="folder of the CSV files; results of other runs in it are kept",
    )
    parser.add_argument(
        "--resume",
        action="store_true",
        help="keep results of the same method, rig and length",
    )
    parser.add_argument(
        "--write",
        type=Path,
        nargs="+",
        default=[],
        metavar="FILE",
        help="Markdown files to put the tables into, those whose marks they hold",
    )
    parser.add_argument(
        "--figure",
        type=Path,
        metavar="FILE",
        help="SVG file for the chart of mean accuracies",
    )
    return parser.parse_args(arguments)


def say(text, end="\n"):
    print(text, end=end, file=sys.stderr, flush=True)


def with_progress(pairs):
    for pair in pairs:
        if pair["train_rpm"] == pair["test_rpm"]:
            say(" *", end="")
        say(
            f" {pair['train_rpm']:g}>{pair['test_rpm']:g} {pair['window']['accuracy']:.2f}",
            end="",
        )
        yield pair
    say("")


def run(rig_name, rig, method, make_classifier, window_length, output):
    """Score one method on one rig; update the CSV files; return all pairs of speeds in them."""
    say(f"{rig_name} | {window_length} | {method}:", end="")
    pairs = list(with_progress(leave_one_speed_in(make_classifier, rig, window_length)))
    key = {"rig": rig_name, "window_length": window_length, "method": method}
    reporting.merge(output / "confusion.csv", reporting.confusion_frame(pairs), key)
    reporting.merge(output / "recordings.csv", reporting.recording_frame(pairs), key)
    return reporting.merge(output / "pairs.csv", reporting.pair_frame(pairs), key)


def check_installed(methods):
    """Raise an error for a missing library before the first score, not after an hour."""
    for name, make_classifier in methods.items():
        try:
            make_classifier()
        except ModuleNotFoundError as error:
            raise SystemExit(
                f"--method {name!r} needs {error.name!r}: pip install 'skarxlag[benchmark]', or "
                "name other methods."
            ) from error


def chosen_for(rig_name, methods):
    """Methods of a rig: constants chosen without it are known for real rigs alone."""
    chosen = dict(methods)
    if LEFT_OUT in chosen:
        del chosen[LEFT_OUT]
        if rig_name in choices().index:
            chosen[LEFT_OUT] = partial(diagnoser_without, rig_name)
    return chosen


def main(arguments=None):
    options = parse(arguments)
    methods = {name: find(name, METHODS, "--method") for name in options.method}
    check_installed(methods)
    rigs = {name: find_rig(name, options.data_home) for name in options.rig}
    options.output.mkdir(parents=True, exist_ok=True)
    for name, make_rig in rigs.items():
        for window_length in options.window_length:
            for label, rig in split_by_crack(name, make_rig(window_length)).items():
                for method, make_classifier in chosen_for(label, methods).items():
                    key = (label, window_length, method)
                    if not (options.resume and reporting.has_run(options.output, *key)):
                        run(
                            label,
                            rig,
                            method,
                            make_classifier,
                            window_length,
                            options.output,
                        )
    pairs, recordings = (
        reporting.mean_of_seeds(reporting.with_stored(options.output / name))
        for name in ("pairs.csv", "recordings.csv")
    )
    summary = reporting.summarise(pairs)
    summary.to_csv(options.output / "summary.csv", index=False)
    blocks = {
        reporting.OVERVIEW: overview(summary, recordings),
        reporting.TABLES: reporting.report(summary),
        DIFFERENCES: differences(recordings),
    }
    tables = "\n\n".join(blocks.values()) + "\n"
    (options.output / "tables.md").write_text(tables, encoding="utf-8")
    if options.figure:
        accuracy_figure(summary, options.figure, OURS)
    for path in options.write:
        write_blocks(path, blocks)
    print(tables)
