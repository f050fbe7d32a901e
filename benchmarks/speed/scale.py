"""Rows of the speed benchmark on the number of recordings: lists, journal, results and report."""

import tempfile
from pathlib import Path

from benchmarks.speed.children import write_model
from benchmarks.speed.timing import take_turns
from skarxlag.plant.commands.diagnosis import diagnose_file
from skarxlag.plant.commands.journal import Journal
from skarxlag.plant.commands.models import SavedModel
from skarxlag.plant.commands.results import recording_rows, window_rows, write_tables
from skarxlag.plant.pages.report import html_report
from skarxlag.plant.readers.listing import list_files, list_recordings

_COUNTS = (100, 1_000, 10_000, 100_000)


def scale(counts=_COUNTS):
    """Measure microseconds a recording, of most recordings over a tenth of them."""
    with tempfile.TemporaryDirectory() as folder:
        model, recording = write_model(Path(folder), 1200, n_windows=4)
        seconds = [steps(SavedModel(model), recording, n) for n in counts]
    lines = []
    for what in seconds[0]:
        each = [
            of_count[what] / n * 1e6
            for of_count, n in zip(seconds, counts, strict=True)
        ]
        lines.append(
            {
                "what": f"{what}: processor time for {counts[-1]} recordings over that for "
                f"{counts[-2]}, each divided by the number",
                "ours": ", ".join(f"{value:.3g}" for value in each) + " us a recording",
                "peer": f"{', '.join(map(str, counts))} recordings",
                "reached": each[-1] / each[-2],
                "target": 1.5,
                "at_most": True,
            }
        )
    return lines


def steps(model, recording, n):
    """Return the seconds of each step with n recordings, all of which have one diagnosis.

    Parameters
    ----------
    model : SavedModel
        The model.
    recording : Path
        A recording. Files are written next to it.
    n : int
        Number of recordings.
    """
    folder = recording.parent / str(n)
    folder.mkdir()
    for number in range(n):
        (folder / f"{number}.npy").touch()
    table = folder / "table.csv"
    lines = [f"{recording},{number % 4},900,20000,{number}" for number in range(n)]
    table.write_text(
        "\n".join(["path,condition,rpm,sampling_rate,channel", *lines, ""])
    )
    listed = list_recordings(table)
    [measured] = list_files(recording, sampling_rate=20e3)
    diagnoses = [diagnose_file(measured, model.load)] * n
    rows, windows = (
        recording_rows(listed, diagnoses, model),
        window_rows(listed, diagnoses),
    )

    def with_journal():
        with Journal(folder / "results", []) as journal:
            for each, diagnosis in zip(listed, diagnoses, strict=True):
                journal.add(each, diagnosis)
                journal.result(each)

    tasks = {
        "files of a folder": lambda: list_files(folder),
        "recordings of a table": lambda: list_recordings(table),
        "journal": with_journal,
        "rows of results": lambda: window_rows(listed, diagnoses),
        "results as json": lambda: write_tables(
            folder / "results.json", rows, windows, model.summary
        ),
        "report": lambda: html_report(model, listed, diagnoses, rows),
    }
    return {what: float(each[0]) for what, each in take_turns(tasks, 1).items()}
