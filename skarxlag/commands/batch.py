"""Many recordings: each is diagnosed by itself, on whatever workers there are."""

import argparse
import math
import os
from dataclasses import replace

from ..recordings.listing import ListedRecording
from .diagnosis import Diagnosis, Task
from .journal import Journal
from .messages import Progress
from .workers import WorkerDied, executors, run_tasks


def diagnose_all(
    args: argparse.Namespace, recordings: list[ListedRecording], journal: Journal | None = None
) -> list[Diagnosis]:
    """Diagnose recordings; what is wrong with one does not touch the others.

    Parameters
    ----------
    args : argparse.Namespace
        With ``model``, ``resample``, ``n_jobs``, ``processes``, ``dask``, ``quiet``
        and ``verbose``.
    recordings : list of ListedRecording or similar
        What to diagnose.
    journal : Journal or None, default=None
        Knows what an earlier run has finished, and keeps what this one finishes.

    Returns
    -------
    list of Diagnosis
        One for each recording, in order.
    """
    diagnoses = [None] * len(recordings)
    with Progress(len(recordings), "recordings", args) as progress:

        def finish(place, diagnosis, said):
            diagnoses[place] = diagnosis
            progress.step(f"{recordings[place].name}: {said}", _more(diagnosis))

        # All names are looked at before the first file is read.
        for place, recording in enumerate(recordings):
            if not recording.path.is_file():
                finish(place, Diagnosis.failed(f"{recording.path}: no such file"), "no such file")
            elif journal is not None and (known := journal.result(recording)) is not None:
                finish(place, known, f"{known.verdict['verdict']} (from an earlier run)")
        places = [place for place, known in enumerate(diagnoses) if known is None]
        with executors(args) as workers:
            tasks = _tasks(args, [recordings[place] for place in places], workers.count())
            for number, outcome in run_tasks(tasks, workers):
                place = places[number]
                if isinstance(outcome, WorkerDied):
                    path = recordings[place].path
                    outcome = Diagnosis.failed(f"{path}: every process that read it died")
                if journal is not None:
                    journal.add(recordings[place], outcome)
                finish(place, outcome, outcome.error or outcome.verdict["verdict"])
    return diagnoses


def _more(diagnosis):
    """Details of a recording for --verbose."""
    verdict, rate = diagnosis.verdict, diagnosis.sampling_rate
    if diagnosis.error is not None:
        return ""
    parts = [f"{verdict['windows']} windows"]
    parts += [f"{verdict['no signal']} without a signal"] if verdict["no signal"] else []
    if not math.isnan(verdict["probability"]):
        parts.append(f"probability {verdict['probability']:.0%}")
    parts.append(f"alarm {verdict['alarm']}")
    parts.append("no sampling rate stated" if rate is None else f"{rate:g} Hz")
    return ", ".join(parts)


def _tasks(args, recordings, n_workers):
    is_elsewhere = args.processes or args.dask is not None
    # Few recordings leave threads to each of them.
    n_jobs = 1 if is_elsewhere else max(n_workers // max(len(recordings), 1), 1)
    model = os.path.abspath(args.model), os.stat(args.model).st_mtime_ns, n_jobs
    if args.dask is not None:
        # A worker may run in another folder.
        recordings = [replace(each, path=each.path.absolute()) for each in recordings]
    return [Task(recording, model, args.resample) for recording in recordings]
