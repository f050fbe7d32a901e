"""Damage files for a while: ``python -m tests.fuzz --seconds 60``.

Every execution takes an intact file, damages it and hands it to its reader. Some files
share a process, which is replaced after a failure. What dies, hangs, takes more than 2
GB, raises an error of another type than promised, or one that does not name the file,
is a failure: it is kept in the folder `corpus`, which the suite replays. Exit status: 0
without a failure, 1 with one.
"""

import argparse
import random
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

from skarxlag.plant.readers.formats import FORMATS

from .damage import damaged, forged
from .executions import run_apart, run_until_failure
from .seeds import write_models, write_recordings

CORPUS = Path(__file__).with_name("corpus")

#: Files that one child handles before the next is started; most of the time goes into
#: starting.
_BATCH = 400


def main():
    """Run the command."""
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz", description=__doc__)
    parser.add_argument(
        "--seconds", type=float, default=60, help="how long; default 60"
    )
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument(
        "--only", choices=["recordings", "models"], help="one kind of files"
    )
    args = parser.parse_args()
    source = random.Random(args.seed)
    n_failures = 0
    counts = Counter()
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        (folder / "seeds").mkdir()
        files = [] if args.only == "models" else write_recordings(folder / "seeds")
        files += [] if args.only == "recordings" else write_models(folder / "seeds")
        for path in files:
            assert run_apart(path) is None, f"{path.name}: {run_apart(path)}"
        end = time.monotonic() + args.seconds
        while time.monotonic() < end:
            batch = [
                _damaged_file(source.choice(files), folder, i, source)
                for i in range(_BATCH)
            ]
            while batch:
                n_handled, problem = run_until_failure(batch)
                counts.update(_seed_name(path) for path in batch[: n_handled + 1])
                if problem is not None:
                    n_failures += 1
                    label = f"{args.seed}_{counts.total()}"
                    _keep(batch[: n_handled + 1], problem, label)
                batch = batch[n_handled + 1 :]
    for name, count in sorted(counts.items()):
        print(f"{name}: {count} executions")
    print(f"{counts.total()} executions, {n_failures} failures")
    names = tuple(path.name for path in files)
    unwritten = [
        module.FORMAT.suffixes[0]
        for module in FORMATS
        if not any(name.endswith(module.FORMAT.suffixes) for name in names)
    ]
    if args.only != "models" and unwritten:
        print(f"Not tried, no writer at hand: {', '.join(unwritten)}")
    return 1 if n_failures else 0


def _damaged_file(seed, folder, number, source):
    """Write a damaged copy of a file."""
    is_model = seed.suffix == ".skops"
    damage = forged if is_model and source.random() < 0.8 else damaged
    path = folder / f"{number}_{seed.name}"
    path.write_bytes(damage(seed.read_bytes(), source))
    return path


def _seed_name(path):
    return path.name.partition("_")[2]


def _keep(handled, problem, label):
    """Keep the last file in the corpus; all of them if the last one by itself does no harm."""
    alone = run_apart(handled[-1])
    for path in handled if alone is None else handled[-1:]:
        stem, dot, suffixes = _seed_name(path).partition(".")
        name = f"{stem}_{label}_{path.name.partition('_')[0]}{dot}{suffixes}"
        (CORPUS / name).write_bytes(path.read_bytes())
    note = " (only after the files before it)" if alone is None else ""
    print(f"{name}: {problem}{note}", flush=True)


if __name__ == "__main__":
    sys.exit(main())
