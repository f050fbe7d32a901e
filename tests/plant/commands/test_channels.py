"""A model keeps its channel and its unit, and a column of times is no signal."""

from functools import cache

import numpy as np
import pytest

from skarxlag import load_diagnoser
from skarxlag.plant.commands import main
from tests.plant.watch.watching import COLOURS, RATE, WINDOW, sound

pytestmark = pytest.mark.filterwarnings("ignore:rpm is not given:UserWarning")

N = 40 * WINDOW
OTHERS = {"good": "worn", "worn": "good"}
ANOTHER = "No alarm: the channel is acc_y, but the model was fitted on acc_x."


def write(path, condition, seed, header="time,acc_x,acc_y", clock=None):
    """A csv file whose second sensor shows the other condition."""
    clock = np.arange(N) / RATE + 0.0005 if clock is None else clock
    columns = [clock, sound(condition, N, seed), sound(OTHERS[condition], N, seed + 10)]
    table = np.stack(columns, axis=1)
    np.savetxt(path, table, fmt="%.6f", delimiter=",", header=header, comments="")
    return path


@pytest.fixture(scope="module")
def plant(tmp_path_factory):
    folder = tmp_path_factory.mktemp("plant")
    for condition in COLOURS:
        write(folder / f"{condition}.csv", condition, 1)
        write(folder / f"{condition}_in_g.csv", condition, 1, "time,acc_x,acc_y\ns,g,g")
    write(folder / "new.csv", "good", 2)
    return folder


def fit(plant, output, channel, files=("good.csv", "worn.csv")):
    """Arguments that fit a model on a channel of a file of each condition."""
    rows = [
        f"{file},{condition}" for file, condition in zip(files, COLOURS, strict=True)
    ]
    (plant / "table.csv").write_text("\n".join(["path,condition", *rows]))
    options = ("--diagnoser", "diagnoser", "--window-length", WINDOW)
    return "fit", plant / "table.csv", "-o", output, "--channel", channel, *options


@pytest.fixture(scope="module")
def saved(plant):
    """Fit a model on a channel, once for all tests."""

    @cache
    def model(channel):
        path = plant / f"{len([*plant.glob('*.skops')])}.skops"
        assert main([str(argument) for argument in fit(plant, path, channel)]) == 0
        return path

    return model


@pytest.fixture(params=["acc_x", "1", "*x"])
def model(saved, request):
    return saved(request.param)


@pytest.fixture
def verdict(run):
    """Diagnose one recording: its verdict, and all that is printed."""

    def diagnose(model, path, *options):
        code, out, err = run("diagnose", model, path, *options)
        assert code == 0, err
        return out.splitlines()[2].split()[1], out

    return diagnose


def test_a_model_states_its_channel(model):
    facts = load_diagnoser(model)[1]
    assert facts["channel_names"] == ["acc_x"] and facts["unit"] is None


def test_the_channel_of_the_model_is_read_if_none_is_stated(verdict, plant, model):
    clock = sound("worn", N, 12)
    moved = write(plant / "moved.csv", "good", 2, "acc_y,acc_x,time", clock)
    for path in (plant / "new.csv", moved):
        condition, out = verdict(model, path)
        assert condition == "good" and "the channel is" not in out


@pytest.mark.parametrize("channel", ["acc_x", "1", "*x"])
def test_the_same_channel_by_any_name(verdict, plant, model, channel):
    condition, out = verdict(model, plant / "new.csv", "--channel", channel)
    assert condition == "good" and "the channel is" not in out


@pytest.mark.parametrize("channel", ["acc_y", "2", "*y"])
def test_another_channel_is_said(verdict, plant, model, channel):
    condition, out = verdict(model, plant / "new.csv", "--channel", channel)
    assert condition == "worn" and f"new.csv: {ANOTHER}" in out


def test_files_of_one_channel_may_call_it_as_they_like(verdict, plant, model):
    np.save(plant / "alone.npy", sound("good", N, 2))
    condition, out = verdict(model, plant / "alone.npy")
    assert condition == "good" and "the channel is" not in out
    np.savez(plant / "alone.npz", velocity=sound("good", N, 2))
    out = verdict(model, plant / "alone.npz")[1]
    assert (
        "No alarm: the channel is velocity, but the model was fitted on acc_x." in out
    )


def test_times_in_minutes_without_their_unit(run, plant, saved):
    """Advice to resample the recording would be wrong."""
    path = write(plant / "minutes.csv", "good", 2, clock=np.arange(N) / RATE)
    head, *lines = path.read_text().splitlines()
    rows = [f"{i / 6e4:.9f},{line.partition(',')[2]}" for i, line in enumerate(lines)]
    path.write_text("\n".join([head, *rows]))
    code, out, err = run("diagnose", saved("acc_x"), path)
    assert code == 1 and "at 1000 Hz; times in min need the unit in their name" in err
    assert "--resample" not in out + err


def test_another_unit_is_said(run, verdict, plant, piped):
    model = plant / "in_g.skops"
    code, out, _ = run(*fit(plant, model, "acc_x", ("good_in_g.csv", "worn_in_g.csv")))
    assert code == 0 and "the recordings have the units" not in out
    assert load_diagnoser(model)[1]["unit"] == "g"
    same = write(plant / "same.csv", "good", 2, "time,acc_x,acc_y\ns, G ,g")
    for path in (plant / "good_in_g.csv", plant / "good.csv", same):
        assert "the unit is" not in verdict(model, path)[1]
    remark = "the unit is mm/s, but the model was fitted on g."
    path = write(plant / "v.csv", "good", 2, "time,acc_x,acc_y\ns,mm/s,g")
    assert remark in verdict(model, path)[1]
    piped(path.read_bytes())
    assert run("watch", model, "-")[2].count(remark) == 1


def test_units_that_differ_in_fit_are_said(run, plant):
    write(plant / "worn_in_v.csv", "worn", 1, "time,acc_x,acc_y\ns,mm/s,g")
    model = plant / "units.skops"
    code, out, _ = run(*fit(plant, model, "acc_x", ("good_in_g.csv", "worn_in_v.csv")))
    assert code == 0 and "Note: the recordings have the units g, mm/s." in out
    assert load_diagnoser(model)[1]["unit"] is None
