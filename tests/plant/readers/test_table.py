import numpy as np
import pandas as pd
import pytest
from scipy.io import savemat, wavfile

from skarxlag import load_recordings, read_recording_table

RNG = np.random.default_rng(0)
# Multiples of 2**-10, which a decimal text holds exactly.
SIGNALS = {
    name: RNG.integers(-3000, 3000, size=n) / 1024
    for name, n in (("a", 11), ("b", 9), ("c", 8))
}
GOOD = """\
path,condition,rpm,sampling_rate,channel
a.npy,normal,300,50e3,
sub/b.mat,ball,400.5,50000,y
c.csv,inner race,300,50000.0,1
"""


@pytest.fixture
def folder(tmp_path):
    np.save(tmp_path / "a.npy", SIGNALS["a"])
    (tmp_path / "sub").mkdir()
    savemat(tmp_path / "sub" / "b.mat", {"y": SIGNALS["b"], "u": -SIGNALS["b"]})
    pd.DataFrame({"t": range(8), "y": SIGNALS["c"]}).to_csv(
        tmp_path / "c.csv", index=False
    )
    wavfile.write(tmp_path / "d.wav", 50_000, RNG.normal(size=7))
    return tmp_path


def write(folder, text):
    (folder / "table.csv").write_text(text, encoding="utf-8")
    return folder / "table.csv"


def test_table(folder):
    table = read_recording_table(str(write(folder, GOOD)))
    for signal, expected in zip(table.recordings, SIGNALS.values(), strict=True):
        np.testing.assert_array_equal(signal, expected)
    assert table.condition.tolist() == ["normal", "ball", "inner race"]
    assert table.rpm.tolist() == [300, 400.5, 300]
    assert table.recording == ["a.npy", "sub/b.mat", "c.csv"]
    assert table.sampling_rate == 50_000
    assert table.channels == [[("0", None)], [("y", None)], [("y", None)]]
    assert table.filenames == [
        str(folder / name) for name in ("a.npy", "sub/b.mat", "c.csv")
    ]


def test_condition_and_speed_are_optional(folder):
    table = read_recording_table(write(folder, "path,sampling_rate\na.npy,5\n"))
    assert table.condition is None
    assert table.rpm is None
    rig = load_recordings(folder / "table.csv", window_length=4)
    assert rig.target is None
    assert rig.rpm is None
    assert rig.target_names == []
    assert rig.data.shape == (2, 4)


def test_a_specimen_is_the_condition_if_none_is_stated(folder):
    path = write(folder, GOOD)
    expected = ["normal", "ball", "inner race"]
    assert read_recording_table(path).specimen.tolist() == expected
    rig = load_recordings(path, window_length=4)
    assert rig.specimen.tolist() == rig.target.tolist()
    write(folder, "path,sampling_rate\na.npy,5\n")
    assert load_recordings(path, window_length=4).specimen is None


def test_stated_specimens_and_loads_reach_every_window(folder):
    text = (
        "path,specimen,condition,sampling_rate,Load\na.npy,B1,N,5,1.5\nc.csv:,B2,N,5,\n"
    )
    path = write(folder, text.replace("c.csv:", "d.wav").replace(",5,", ",50e3,"))
    table = read_recording_table(path)
    assert table.specimen.tolist() == ["B1", "B2"]
    np.testing.assert_array_equal(table.load, [1.5, np.nan])
    assert list(table.further) == []
    rig = load_recordings(path, window_length=4)
    assert rig.specimen.tolist() == ["B1", "B1", "B2"]
    np.testing.assert_array_equal(rig.load, [1.5, 1.5, np.nan])


@pytest.mark.parametrize(
    ("loads", "expected"),
    [
        (["2", "1e3"], [2.0, 1000.0]),
        (["2", "full"], ["2", "full"]),
        (["half", ""], ["half", ""]),
        (["2", "nan"], ["2", "nan"]),
    ],
)
def test_loads_are_numbers_if_all_that_are_stated_are(folder, loads, expected):
    path = write(
        folder,
        f"path,load,sampling_rate\na.npy,{loads[0]},50e3\nd.wav,{loads[1]},50e3\n",
    )
    assert read_recording_table(path).load.tolist() == expected


def test_paths_may_be_absolute(folder, tmp_path_factory):
    elsewhere = tmp_path_factory.mktemp("elsewhere")
    text = f"path,sampling_rate\n{folder / 'a.npy'},5\n"
    (signal,) = read_recording_table(write(elsewhere, text)).recordings
    np.testing.assert_array_equal(signal, SIGNALS["a"])


@pytest.mark.parametrize(
    "text",
    [
        "\ufeff" + GOOD,
        GOOD.replace(",", " , "),
        GOOD.replace("\n", "\n\n"),
        GOOD + "\n,,,,\n",
        GOOD.rstrip(),
        GOOD.replace("\n", "\r\n"),
    ],
)
def test_spelling_of_the_table_does_not_matter(folder, text):
    table = read_recording_table(write(folder, text))
    assert len(table.recordings) == 3
    assert table.condition.tolist() == ["normal", "ball", "inner race"]


def test_conditions_are_texts(folder):
    text = "path,condition,sampling_rate\na.npy,NA,50e3\nd.wav,1,50e3\n"
    assert read_recording_table(write(folder, text)).condition.tolist() == ["NA", "1"]


def test_several_channels(folder):
    text = "path,sampling_rate,channel\nsub/b.mat,5,u; y\n"
    table = read_recording_table(write(folder, text))
    np.testing.assert_array_equal(table.recordings[0], [-SIGNALS["b"], SIGNALS["b"]])
    rig = load_recordings(folder / "table.csv", window_length=4)
    np.testing.assert_array_equal(rig.data[1], [-SIGNALS["b"][4:8], SIGNALS["b"][4:8]])


def test_one_file_may_hold_several_recordings(folder):
    text = "path,sampling_rate,channel\nsub/b.mat,5,u\nsub/b.mat,5,y\na.npy,5,\n"
    table = read_recording_table(write(folder, text))
    assert table.recording == ["sub/b.mat:u", "sub/b.mat:y", "a.npy"]


def test_rig(folder):
    rig = load_recordings(write(folder, GOOD), window_length=4)
    assert rig.target_names == ["normal", "ball", "inner race"]
    assert rig.target.tolist() == ["normal"] * 2 + ["ball"] * 2 + ["inner race"] * 2
    assert rig.rpm.tolist() == [300, 300, 400.5, 400.5, 300, 300]
    assert rig.recording.tolist() == ["a.npy"] * 2 + ["sub/b.mat"] * 2 + ["c.csv"] * 2
    assert rig.start.tolist() == [0, 4] * 3
    assert rig.data.dtype == rig.rpm.dtype == np.float64
    assert rig.sampling_rate == 50_000
    assert str(folder / "table.csv") in rig.DESCR
    expected = [signal[k : k + 4] for signal in SIGNALS.values() for k in (0, 4)]
    np.testing.assert_array_equal(rig.data, expected)


def test_healthy_condition(folder):
    rig = load_recordings(write(folder, GOOD), window_length=4, healthy="inner race")
    assert rig.target_names == ["inner race", "normal", "ball"]
    message = r"healthy is 'worn', which is not a condition of .*table.csv"
    with pytest.raises(ValueError, match=message):
        load_recordings(folder / "table.csv", window_length=4, healthy="worn")


OF_C = "c.csv,inner race,300,50000.0,1"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("sub/b.mat", "b.mat", r"line 3: .*b.mat: no such file"),
        ("sub/b.mat", "", r"line 3: path is empty"),
        ("sub/b.mat", "d.mp3", r"line 3: .*d.mp3: unknown suffix"),
        ("50000,y", "50000,", r"line 3: .*b.mat: several channels.*'y', 'u'"),
        ("50000,y", "50000,x", r"line 3: .*b.mat: no channel 'x'"),
        ("50000,y", "50000,y;u", r"line 3: .* channels: 2, but 1 in .*line 2"),
        (",50000,", ",20000,", r"line 3: .* \(Hz\): 20000, but 50000 in .*line 2"),
        (",50000,", ",,", r"line 3: sampling_rate is missing; expected --sampling"),
        (",50000,", ",fast,", r"line 3: sampling_rate is 'fast', expected a positive"),
        (OF_C, "d.wav,x,1,1,", r"line 4: .*d.wav.* 1 Hz .* 50000 Hz"),
        ("400.5", "", r"line 3: rpm is empty"),
        ("400.5", "0", r"line 3: rpm is '0', expected a positive number"),
        ("ball", " ", r"line 3: condition is empty"),
        (GOOD, "path,specimen\na.npy,\n", r"line 2: specimen is empty"),
        (",condition", ",specimens", r"the column 'specimens' meant to be specimen"),
        (OF_C, "a.npy,x,1,1,", r"line 4: .*a.npy is the same recording as"),
        ("condition", "conditon", r"columns are path, conditon.*expected path, and"),
        ("path,", "file,", r"columns are file.*expected path"),
        ("path,", "path,path,", r"columns are path, path.*expected path, and any of"),
        ("50e3,\n", "50e3,,,,\n", r"cannot be read as a csv table"),
        ("50000,y", "50000,y,u", r"cannot be read as a csv table .*line 3"),
        (GOOD, "path,condition\n\n,\n", r"lists no recording"),
        (GOOD, "", r"cannot be read as a csv table"),
    ],
)
def test_errors_name_the_table_and_the_line(folder, old, new, message):
    assert old in GOOD
    path = write(folder, GOOD.replace(old, new, 1))
    errors = (ValueError, FileNotFoundError)
    with pytest.raises(errors, match=rf"table\.csv.*({message})"):
        read_recording_table(path)


@pytest.mark.parametrize("separator", [";", "\t"])
def test_separator_is_inferred_from_the_first_line(folder, separator):
    lines = ["path,condition,rpm,sampling_rate,channel", "sub/b.mat,good,400.5,50e3,y"]
    text = "\n".join(lines).replace(",", separator).replace("400.5", "400,5")
    assert read_recording_table(write(folder, text)).rpm.tolist() == [400.5]


def test_columns_in_any_case_and_further_columns(folder):
    text = "Path,Load,RPM,Sampling Rate,technician\na.npy,3 kN,300,50e3,\nc.csv,,300,50e3,NA\n"
    text = text.replace("technician", "channel,technician").replace("50e3,", "50e3,0,")
    table = read_recording_table(write(folder, text))
    assert table.rpm.tolist() == [300, 300]
    assert table.sampling_rate == 50_000
    assert table.further.index.tolist() == ["a.npy", "c.csv"]
    assert table.load.tolist() == ["3 kN", ""]
    assert table.further.to_dict("list") == {"technician": ["", "NA"]}
    rig = load_recordings(folder / "table.csv", window_length=4)
    assert rig.further.equals(table.further)


def test_type_of_raw_files(folder):
    np.arange(5, dtype="<i2").tofile(folder / "e.bin")
    text = "path,sampling_rate,dtype\ne.bin,50e3,<i2\na.npy,50e3,\n"
    table = read_recording_table(write(folder, text))
    assert table.recordings[0].tolist() == [0, 1, 2, 3, 4]


def test_rates_that_differ_by_rounding(folder):
    text = "path,sampling_rate\nd.wav,49999.9\na.npy,50001\n"
    assert read_recording_table(write(folder, text)).sampling_rate == 49999.9


@pytest.mark.slow
def test_resampling_is_reported(folder):
    wavfile.write(folder / "slow.wav", 25_000, RNG.normal(size=100))
    text = "path,sampling_rate,channel\nslow.wav,,\nsub/b.mat,50e3,y\n"
    message = r"line 3: different sampling rates \(Hz\): 50000, but"
    with pytest.raises(ValueError, match=message):
        read_recording_table(write(folder, text))
    table = read_recording_table(folder / "table.csv", resample=50_000)
    assert [len(signal) for signal in table.recordings] == [200, 9]
    np.testing.assert_array_equal(table.recordings[1], SIGNALS["b"])
    assert table.resampled == {"slow.wav": 25_000}
    rig = load_recordings(folder / "table.csv", window_length=8, resample=50_000)
    np.testing.assert_allclose(rig.data[:25].ravel(), table.recordings[0], atol=1e-12)
    assert rig.sampling_rate == 50_000
    assert "slow.wav resampled from 25000 to 50000 Hz" in rig.DESCR


def test_windows_to_keep_at_most(folder):
    alternating = np.arange(100) * np.where(np.arange(100) % 2, -1, 1)
    np.save(folder / "long.npy", alternating)
    np.save(folder / "short.npy", alternating[:10])
    path = write(folder, "path,sampling_rate\nlong.npy,5\nshort.npy,5\n")
    some = load_recordings(path, window_length=5, max_windows=6)
    assert some.available.tolist() == [20, 2]
    assert some.start.tolist() == [0, 20, 40, 60, 80, 0, 5]
    np.testing.assert_array_equal(np.abs(some.data[:, 0]), some.start)
    assert "fewer than there are in 1" in some.DESCR
    assert "fewer" not in load_recordings(path, window_length=5).DESCR


@pytest.mark.parametrize(("name", "value"), [("max_windows", 0), ("max_windows", 2.5)])
def test_wrong_numbers_are_named(folder, name, value):
    with pytest.raises((ValueError, TypeError), match=name):
        load_recordings(write(folder, GOOD), **{name: value})


def test_tables_that_are_none(tmp_path):
    path = tmp_path / "table.csv"
    with pytest.raises(FileNotFoundError, match=r"table.csv: no such file"):
        read_recording_table(path)
    path.write_bytes(b"\x93NUMPY\0")
    with pytest.raises(ValueError, match=r"table.csv: cannot be read as a csv table"):
        read_recording_table(path)
