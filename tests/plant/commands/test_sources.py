import numpy as np
import pandas as pd
import pytest
from scipy.io import wavfile
from scipy.signal import lfilter

from skarxlag import load_diagnoser

WINDOW = 200
FIT = ("--window-length", WINDOW, "--diagnoser", "diagnoser")
PATTERN = r"(?P<condition>[a-z]+)_(?P<rpm>\d+)_(?P<hall>\w)"


def signal(condition, seed, n_samples=10 * WINDOW):
    noise = np.random.default_rng(seed).normal(size=n_samples)
    return lfilter([1.0], [1.0, -0.9 if condition == "worn" else 0.0], noise)


@pytest.fixture
def folder(tmp_path):
    """A folder of recordings whose names say what they are of."""
    runs = tmp_path / "runs"
    for place, hall in enumerate("ab"):
        (runs / hall).mkdir(parents=True)
        for seed, condition in enumerate(["good", "worn"]):
            for rpm in (300, 310, 500):
                name = f"{condition}_{rpm}_{hall}.npy"
                np.save(
                    runs / hall / name, signal(condition, seed + rpm + 1000 * place)
                )
    return tmp_path


@pytest.fixture
def model(run, folder):
    path = folder / "m.skops"
    options = ("--pattern", PATTERN, "--sampling-rate", "5e3")
    assert run("fit", folder / "runs", "-o", path, *FIT, *options)[0] == 0
    return path


def test_a_folder_whose_names_say_everything_needs_no_table(run, folder, model):
    facts = load_diagnoser(model)[1]
    assert facts["train_rpm"] == [300, 310, 500] and facts["n_windows"] == [60, 60]
    assert facts["n_recordings"] == [6, 6] and facts["sampling_rate"] == 5e3
    output = folder / "out.csv"
    code, out, _ = run(
        "diagnose", model, folder / "runs", "--pattern", PATTERN, "-o", output
    )
    rows = pd.read_csv(output)
    assert code == 0 and len(rows) == 12 and rows["recording"].is_unique
    assert (rows["verdict"] == rows["condition"]).all()
    assert set(rows["rpm"]) == {300, 310, 500}
    assert set(rows["stated_hall"]) == {"a", "b"}
    code, out, _ = run("diagnose", model, folder / "runs" / "*" / "worn_3*.npy", "-q")
    assert code == 0 and sum(".npy " in line for line in out.splitlines()) == 4


def test_another_sampling_rate_is_resampled_on_request_and_this_is_reported(
    run, folder, model
):
    path = folder / "run.wav"
    wavfile.write(path, 10_000, signal("worn", 5).astype(np.float32))
    code, _, err = run("diagnose", model, path)
    assert code == 1 and "--resample brings it to that" in err
    code, out, _ = run("diagnose", model, path, "--resample")
    assert code == 0 and "run.wav: Resampled from 10000 to 5000 Hz." in out
    assert (
        next(line for line in out.splitlines() if line.startswith(str(path))).split()[1]
        == "worn"
    )
    wavfile.write(
        folder / "runs" / "worn_300_c.wav", 10_000, signal("worn", 5).astype(np.float32)
    )
    fit = ("fit", folder / "runs", "-o", model, *FIT, "--pattern", PATTERN)
    (folder / "runs" / "good_300_c.npy").unlink(missing_ok=True)
    code, _, err = run(*fit, "--sampling-rate", "5e3")
    assert code == 1 and "worn_300_c.wav" in err
