"""A model keeps its channel and its unit, and a column of times is no signal."""

import numpy as np
import pytest

from skarxlag import load_diagnoser, load_recordings, read_recording_table
from tests.commands.watching import COLOURS, RATE, WINDOW, sound, verdicts_of

pytestmark = pytest.mark.filterwarnings("ignore:rpm is not given:UserWarning")

N = 40 * WINDOW
# A file is read for longer than that on no machine.
IDLE = ("--idle", 0.5, "--poll", 0.005, "--settle", 0.01)
OTHERS = {"good": "worn", "worn": "good"}


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


def fit(run, plant, channel, name="m.skops", suffix=""):
    rows = [f"{condition}{suffix}.csv,{condition}" for condition in COLOURS]
    (plant / "table.csv").write_text("\n".join(["path,condition", *rows]))
    options = (
        "--diagnoser",
        "diagnoser",
        "--window-length",
        WINDOW,
        "--channel",
        channel,
    )
    found = run("fit", plant / "table.csv", "-o", plant / name, "--force", *options)
    return (plant / name, *found)


@pytest.fixture(params=["acc_x", "1", "*x"])
def model(run, plant, request):
    path, code, _, err = fit(run, plant, request.param)
    assert code == 0, err
    return path


def test_the_channel_of_the_model_is_read_if_none_is_stated(run, plant, model):
    code, out, _ = run("diagnose", model, plant / "new.csv")
    assert code == 0 and " good " in out and "The channel" not in out
    write(
        plant / "moved.csv", "good", 2, "acc_y,acc_x,time", clock=sound("worn", N, 12)
    )
    code, out, _ = run("diagnose", model, plant / "moved.csv")
    assert code == 0 and " good " in out and "The channel" not in out


@pytest.mark.parametrize("channel", ["acc_x", "1", "*x"])
def test_the_same_channel_by_any_name(run, plant, model, channel):
    code, out, _ = run("diagnose", model, plant / "new.csv", "--channel", channel)
    assert code == 0 and " good " in out and "The channel" not in out


@pytest.mark.parametrize("channel", ["acc_y", "2", "*y"])
def test_another_channel_is_said(run, plant, model, channel):
    code, out, _ = run("diagnose", model, plant / "new.csv", "--channel", channel)
    assert code == 0 and " worn " in out
    assert "new.csv: The channel is acc_y, but the model was fitted on acc_x." in out
    (plant / "one.csv").write_text("path,channel\nnew.csv,acc_y\n")
    out = run("diagnose", model, "--table", plant / "one.csv")[1]
    assert "The channel is acc_y, but the model was fitted on acc_x." in out


def test_files_of_one_channel_may_call_it_as_they_like(run, plant, model):
    np.save(plant / "alone.npy", sound("good", N, 2))
    code, out, _ = run("diagnose", model, plant / "alone.npy")
    assert code == 0 and " good " in out and "The channel" not in out
    np.savez(plant / "alone.npz", velocity=sound("good", N, 2))
    code, out, _ = run("diagnose", model, plant / "alone.npz")
    assert (
        code == 0
        and "The channel is velocity, but the model was fitted on acc_x." in out
    )


def test_a_model_states_its_channel(plant, model):
    facts = load_diagnoser(model)[1]
    assert facts["channel_names"] == ["acc_x"] and facts["unit"] is None


def test_watch_reads_the_channel_of_the_model(run, plant, model, piped):
    lines = (plant / "new.csv").read_bytes()
    piped(lines)
    code, out, err = run("watch", model, "-")
    assert (
        code == 0
        and verdicts_of(out)[-1]["verdict"] == "good"
        and "The channel" not in err
    )
    for channel in ("acc_y", "2"):
        piped(lines)
        code, out, err = run("watch", model, "-", "--channel", channel)
        assert verdicts_of(out)[-1]["verdict"] == "worn"
        assert (
            err.count("The channel is acc_y, but the model was fitted on acc_x.") == 1
        )
    # Raw samples have positions only.
    raw = (
        np.stack([np.zeros(N), sound("good", N, 2), np.zeros(N)], axis=1)
        .astype("<f4")
        .tobytes()
    )
    piped(raw)
    code, out, err = run("watch", model, "-", "--dtype", "(3,)<f4", "--channel", "1")
    assert verdicts_of(out)[-1]["verdict"] == "good"
    piped(raw)
    code, out, err = run("watch", model, "-", "--dtype", "(3,)<f4")
    if load_diagnoser(model)[1]["channels"] == ["1"]:
        assert code == 0 and verdicts_of(out)[-1]["verdict"] == "good"
    else:
        assert code == 1 and "3 channels, expected 1; --channel chooses" in err


def test_watch_of_a_folder_reads_the_channel_of_the_model(run, plant, model, tmp_path):
    write(tmp_path / "a.csv", "good", 2)
    code, out, err = run("watch", model, tmp_path, *IDLE)
    assert code == 0 and verdicts_of(out)[-1]["verdict"] == "good"
    code, out, err = run("watch", model, tmp_path, *IDLE, "--channel", "acc_y")
    assert verdicts_of(out)[-1]["verdict"] == "worn"
    assert err.count("The channel is acc_y, but the model was fitted on acc_x.") == 1


CLOCKS = {
    "seconds": np.arange(N) / RATE,
    "seconds that start again": np.arange(N) / RATE % 1.5,
    "a count": np.arange(float(N)),
    "seconds back": -np.arange(N) / RATE,
}


@pytest.mark.parametrize("clock", CLOCKS)
@pytest.mark.parametrize("channel", ["0", "clock"])
def test_a_column_of_times_is_no_signal(run, plant, tmp_path, clock, channel):
    """Its windows have a spectrum like any other: `diagnose` named a condition."""
    path = write(tmp_path / "new.csv", "good", 2, "clock,acc_x,acc_y", CLOCKS[clock])
    message = "only rises or only falls: it holds times or a count, and is no signal"
    for load in (load_recordings, read_recording_table):
        with pytest.raises(
            ValueError, match=rf"new.csv: channel '{channel}' {message}"
        ):
            load(path.parent / "*.csv", channel=channel, sampling_rate=RATE)
    model, code, _, err = fit(run, plant, "1")
    assert code == 0, err
    code, out, err = run("diagnose", model, path, "--channel", channel)
    assert code == 1 and message in err and "no verdict: channel" in out
    (tmp_path / "table.csv").write_text("path,condition\nnew.csv,good\nnew2.csv,worn\n")
    write(tmp_path / "new2.csv", "worn", 2, "clock,acc_x,acc_y", CLOCKS[clock])
    options = (
        "-o",
        tmp_path / "m.skops",
        "--channel",
        channel,
        "--sampling-rate",
        RATE,
    )
    code, _, err = run("fit", tmp_path / "table.csv", *options)
    assert code == 1 and message in err


def test_a_column_of_times_is_no_signal_in_watch(run, plant, piped):
    model = fit(run, plant, "1")[0]
    piped((plant / "new.csv").read_bytes())
    _, out, err = run("watch", model, "-", "--channel", "0")
    found = verdicts_of(out)
    assert {v["quality"] for v in found} == {"ramp"} and {
        v["verdict"] for v in found
    } == {None}
    assert "The channel is time, but the model was fitted on acc_x." in err


def test_fit_on_the_column_of_times_is_refused(run, plant):
    _, code, _, err = fit(run, plant, "0", "times.skops")
    assert code == 1 and "channel '0' only rises or only falls" in err
    assert not (plant / "times.skops").exists()


def test_times_in_minutes_without_their_unit(run, plant):
    """Advice to resample the recording would be wrong."""
    model = fit(run, plant, "acc_x")[0]
    path = write(plant / "minutes.csv", "good", 2, clock=np.arange(N) / RATE)
    lines = path.read_text().splitlines()
    rows = [line.partition(",")[2] for line in lines[1:]]
    path.write_text(
        "\n".join([lines[0], *(f"{i / 6e4:.9f},{row}" for i, row in enumerate(rows))])
    )
    code, out, err = run("diagnose", model, path)
    assert code == 1 and "at 1000 Hz; times in min need the unit in their name" in err
    assert "--resample" not in out + err


def test_another_unit_is_said(run, plant, piped):
    model = fit(run, plant, "acc_x", suffix="_in_g")[0]
    assert load_diagnoser(model)[1]["unit"] == "g"
    assert "The unit" not in run("diagnose", model, plant / "good_in_g.csv")[1]
    assert "The unit" not in run("diagnose", model, plant / "good.csv")[1]
    remark = "The unit is mm/s, but the model was fitted on g. Another scale changes nothing,"
    write(plant / "v.csv", "good", 2, "time,acc_x,acc_y\ns,mm/s,g")
    code, out, _ = run("diagnose", model, plant / "v.csv")
    assert code == 0 and remark in out
    piped((plant / "v.csv").read_bytes())
    assert run("watch", model, "-")[2].count(remark) == 1
    same = write(plant / "same.csv", "good", 2, "time,acc_x,acc_y\ns, G ,g")
    assert "The unit" not in run("diagnose", model, same)[1]


def test_units_that_differ_in_fit_are_said(run, plant):
    write(plant / "worn_in_v.csv", "worn", 1, "time,acc_x,acc_y\ns,mm/s,g")
    (plant / "units.csv").write_text(
        "path,condition\ngood_in_g.csv,good\nworn_in_v.csv,worn\n"
    )
    options = (
        "--diagnoser",
        "diagnoser",
        "--window-length",
        WINDOW,
        "--channel",
        "acc_x",
    )
    path = plant / "units.skops"
    code, out, _ = run("fit", plant / "units.csv", "-o", path, *options)
    assert code == 0 and "Note: the recordings have the units g, mm/s." in out
    assert load_diagnoser(path)[1]["unit"] is None
    assert (
        "the recordings have the units"
        not in fit(run, plant, "acc_x", suffix="_in_g")[2]
    )


def test_another_scale_changes_nothing(run, plant):
    """What the documentation says of units, for all makers but with --fixed-gain."""
    scaled = plant / "scaled"
    scaled.mkdir(exist_ok=True)
    for path in (plant / "good.csv", plant / "worn.csv"):
        columns = np.loadtxt(path, delimiter=",", skiprows=1) * [1, 9.80665, 1]
        options = {"delimiter": ",", "header": "time,acc_x,acc_y", "comments": ""}
        np.savetxt(scaled / path.name, columns, fmt="%.17g", **options)
    model = fit(run, plant, "acc_x")[0]
    for name in ("good.csv", "worn.csv"):
        out, of_scaled = (
            run("diagnose", model, f / name, "-q")[1] for f in (plant, scaled)
        )
        assert out.splitlines()[1].split()[1:] == of_scaled.splitlines()[1].split()[1:]
