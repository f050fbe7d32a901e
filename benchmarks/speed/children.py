"""Tasks that the speed benchmark runs in fresh processes.

Usage: ``python -m benchmarks.speed.children TASK ...``.
"""

import sys
import time
from pathlib import Path

_STATUS = Path("/proc/self/status")


def first_prediction(maker):
    """Import, fit and predict once: processor seconds beyond the import of scikit-learn."""
    import numpy as np
    import sklearn  # noqa: F401

    start = time.process_time()
    if maker == "MiniRocket":
        from benchmarks.speed.peers import minirocket as make
    else:
        import skarxlag

        make = getattr(skarxlag, maker)
    X = np.random.default_rng(0).normal(size=(40, 1200))
    make().fit(X, np.arange(40) % 4).predict(X)
    print("seconds", time.process_time() - start)


def peak_of_command(folder, n_windows, window_length):
    """Return the peak memory above the imports while the command diagnoses one long recording."""
    # The names of the package are imported when they are used, so its root alone
    # imports nothing.
    import skops.io  # noqa: F401

    import benchmarks.speed.rows  # noqa: F401
    import skarxlag
    import skarxlag.plant.commands.diagnose

    imported = _peak()
    paths = write_model(Path(folder), int(window_length), int(n_windows))
    skarxlag.plant.commands.main(["diagnose", *map(str, paths)])
    print("MiB", _peak() - imported)


def write_model(folder, window_length, n_windows):
    """Write a model and a recording of so many windows into a folder, and return their paths."""
    import skarxlag

    X, y = _windows(400, window_length)
    diagnoser = skarxlag.make_diagnoser().fit(X, y)
    facts = {
        "conditions": ["0", "1", "2", "3"],
        "diagnoser": "diagnoser",
        "n_channels": 1,
        "sampling_rate": 20e3,
        "train_rpm": None,
        "window_length": window_length,
    }
    skarxlag.save_diagnoser(diagnoser, folder / "model.skops", **facts)
    _write_recording(folder / "long.npy", X, n_windows)
    return folder / "model.skops", folder / "long.npy"


def peak_of_predict(maker, n_windows, window_length):
    """Peak memory above the imports and the windows while a diagnoser predicts all of them."""
    import numpy as np

    import benchmarks.speed.rows  # noqa: F401
    import skarxlag

    make = getattr(skarxlag, maker)
    imported = _peak()
    few, y = _windows(400, int(window_length))
    X = np.empty((int(n_windows), int(window_length)))
    for start in range(0, len(X), len(few)):
        X[start : start + len(few)] = few[: len(X) - start]
    make().fit(few, y).predict(X)
    print("MiB", _peak() - imported - X.nbytes / 2**20)


def peak_of_fit(maker, folder, n_windows, window_length):
    """Measure the peak memory of a fit above the imports, without the mapped windows."""
    import benchmarks.speed.rows
    import skarxlag

    make, load = getattr(skarxlag, maker), skarxlag.load_recordings
    imported = _peak()
    folder, length = Path(folder), int(window_length)
    for seed in range(0, int(n_windows), 400):
        # No window is repeated, or it would be counted instead of used twice.
        windows, y = benchmarks.speed.rows.coloured_windows(400, length, seed=seed)
        for name in range(4):
            with (folder / f"{name}.bin").open("ab") as file:
                windows[y == name].tofile(file)
    rig = load(
        folder / "?.bin",
        pattern=r"(?P<condition>\d).bin",
        dtype="<f8",
        sampling_rate=20e3,
        window_length=length,
        memory_map=folder / "windows",
    )
    make().fit(rig.data, rig.target)
    print("MiB", _peak() - imported - rig.data.nbytes / 2**20)


def _windows(n_windows, window_length):
    from benchmarks.speed.rows import coloured_windows

    windows, target = coloured_windows(n_windows, window_length)
    return windows, target.astype(str)


def _write_recording(path, windows, n_windows):
    import numpy as np

    header = {
        "descr": "<f8",
        "fortran_order": False,
        "shape": (n_windows * windows.shape[1],),
    }
    with path.open("wb") as file:
        np.lib.format.write_array_header_1_0(file, header)
        for start in range(0, n_windows, len(windows)):
            windows[: n_windows - start].tofile(file)


def has_peak():
    """Return whether the system reports the peak memory of a process as Linux does."""
    return _STATUS.exists()


def _peak():
    """Return the peak resident memory of this process, in MiB."""
    return int(_STATUS.read_text().split("VmHWM:")[1].split()[0]) / 1024


if __name__ == "__main__":
    task, *arguments = sys.argv[1:]
    globals()[task](*arguments)
