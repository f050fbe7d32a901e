"""A folder whose files appear, grow, are renamed, replaced and removed while they are read."""

import io
import json
import os
import threading
import time
from collections import Counter

import numpy as np
import pytest

from tests.plant.commands.watching import WINDOW, blocks_of, drained, sound

N_WINDOWS = 5


def content(condition, seed):
    buffer = io.BytesIO()
    np.save(buffer, sound(condition, N_WINDOWS * WINDOW, seed))
    return buffer.getvalue()


def replace(path, samples):
    """Move a new file to the place of another, as a logger does that writes under another name."""
    np.save(path.with_name(".new.npy"), samples)
    os.replace(path.with_name(".new.npy"), path)


@pytest.fixture
def source(tmp_path, monkeypatch):
    """Blocks of 5 samples of the files in a folder, and the warnings."""
    monkeypatch.setattr("skarxlag.plant.watch.live.block_length", lambda length: length)
    for number, name in enumerate("ab"):
        np.save(tmp_path / f"{name}.npy", np.full(10, number))
        os.utime(tmp_path / f"{name}.npy", (number, number))
    warnings = []
    blocks = blocks_of(tmp_path, warnings.append)
    while next(blocks) is None:
        pass
    # The first half of a.npy was read.
    return tmp_path, blocks, warnings


def read(blocks):
    return [
        (block.source, block.samples[0, 0], len(block.samples[0]))
        for block in drained(blocks)
    ]


def test_a_file_that_is_replaced_before_its_turn_is_read_once(source):
    folder, blocks, warnings = source
    replace(folder / "b.npy", np.full(5, 7))
    assert read(blocks) == [("a.npy", 0, 5), ("b.npy", 7, 5)] and not warnings


@pytest.mark.parametrize("n_samples", [5, 10, 15])
def test_a_file_that_is_replaced_while_it_is_read(source, n_samples):
    """Old and new samples are not mixed, and the new ones are read whole."""
    folder, blocks, warnings = source
    replace(folder / "a.npy", np.full(n_samples, 7))
    new = [("a.npy", 7, 5)] * (n_samples // 5)
    assert read(blocks) == [("b.npy", 1, 5)] * 2 + new
    assert len(warnings) == 1
    assert warnings[0].startswith(f"skipped: {folder / 'a.npy'}: ")


def test_files_that_vanish_or_get_another_name_before_their_turn(source):
    folder, blocks, warnings = source
    (folder / "b.npy").rename(folder / "c.npy")
    (folder / "a.npy").unlink()
    assert read(blocks) == [("c.npy", 1, 5)] * 2
    assert len(warnings) == 1
    assert warnings[0].startswith(f"skipped: {folder / 'a.npy'}: ")


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:rpm is not given:UserWarning")
def test_each_file_that_stays_is_diagnosed_once(run, models, tmp_path):
    folder, names, whole = tmp_path / "logger", [], content("good", 1)
    folder.mkdir()
    rng = np.random.default_rng(0)

    def churn():
        for number in range(40):
            names.append(name := f"{number}.npy")
            path, how = folder / name, number % 5
            if how == 0:  # written slowly
                with path.open("wb") as file:
                    for at in range(0, len(whole), 3000):
                        file.write(whole[at : at + 3000])
                        file.flush()
                        time.sleep(0.004)
            elif how == 1:  # moved into place
                (folder / f"{number}.part").write_bytes(whole)
                (folder / f"{number}.part").rename(path)
            elif how == 2:  # replaced later
                path.write_bytes(whole)
                replace(
                    folder / f"{max(number - 5, 2)}.npy",
                    sound("worn", N_WINDOWS * WINDOW, 2),
                )
            elif how == 3:  # removed later
                path.write_bytes(whole)
                (folder / f"{number - 5}.npy").unlink(missing_ok=True)
            else:  # a copy with an old date
                path.write_bytes(whole)
                os.utime(path, (1000 + number, 1000 + number))
            time.sleep(float(rng.uniform(0, 0.02)))

    logger = threading.Thread(target=churn)
    logger.start()
    options = ("--idle", 0.6, "--poll", 0.005, "--settle", 0.1)
    code, out, err = run("watch", models[0], folder, *options)
    logger.join()
    assert code == 0 and "Traceback" not in err
    n_windows = Counter(json.loads(line)["source"] for line in out.splitlines())
    for number, name in enumerate(names):
        # A file that was replaced counts once for each of its contents that stayed long
        # enough.
        allowed = {0: {5}, 1: {5}, 2: {5, 10}, 3: {0, 5}, 4: {5}}[number % 5]
        assert n_windows.pop(name, 0) in allowed, (name, err)
    # Names of files on their way to their place.
    assert all(count == N_WINDOWS for count in n_windows.values())
