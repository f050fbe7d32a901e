"""Files as loggers, oscilloscopes and spreadsheets write them, read right or refused."""

import struct

import numpy as np
import pytest
from scipy.io import wavfile

from skarxlag import (
    list_channels,
    read_recording,
    read_recording_table,
    signal_quality,
)
from skarxlag.plant.readers.resampling import resampled_blocks

N = 300
RATE = 2000
Y, U = np.random.default_rng(3).normal(size=(2, N)).round(4)
COUNTS = np.rint(1000 * Y).astype(int)
T = np.arange(N) / RATE


def lines(*columns, form="{}", separator=","):
    """Return the lines of some columns, whose values are written in a form."""
    forms = form if isinstance(form, tuple) else (form,) * len(columns)
    return "".join(
        separator.join(f.format(value) for f, value in zip(forms, row, strict=True))
        + "\n"
        for row in zip(*columns, strict=True)
    )


def commas(text):
    return text.replace(".", ",")


PLAIN = lines(T, Y, form=("{:.6f}", "{:.4f}"))
SEMICOLONS = commas(lines(T, Y, form=("{:.6f}", "{:.4f}"), separator=";"))
THREE = lines(T, Y, U, form=("{:.6f}", "{:.4f}", "{:.4f}"))
SECONDS_OF_DAY = (np.arange(N) * 500 - 50_000) % 86_400_000_000
CLOCK = [
    f"{s // 3_600_000_000:02}:{s // 60_000_000 % 60:02}:{s // 1_000_000 % 60:02}.{s % 1_000_000:06}"
    for s in SECONDS_OF_DAY.tolist()
]
LABVIEW = (
    "LabVIEW Measurement\t\nSeparator\tTab\n***End_of_Header***\t\n\t\nChannels\t2\t\t\n"
    "X_Dimension\tTime\tTime\t\nDelta_X\t5,0E-4\t5,0E-4\t\n***End_of_Header***\t\t\t\n"
)

#: Content of a text, by what is unusual in it: 300 samples of Y at 2000 Hz.
READ = {
    "blank line after the units": "Time,A\n(ms),(mV)\n\n"
    + lines(1000 * T, Y, form=("{:.6f}", "{}")),
    "two ends of line": "time,acc\r\r\n" + PLAIN.replace("\n", "\r\r\n"),
    "a blank line after each row": "time,acc\n\n" + PLAIN.replace("\n", "\n\n"),
    "statistics": "Time (s),acc (g)\n" + PLAIN + "\nSamples,300\nMaximum,2.9\n",
    "statistics of other fields": "time;acc\n" + SEMICOLONS + "Mittel;0,1;g;x\n",
    "a first column of texts": "sensor,acc\n" + lines(["DE"] * 3000, Y.repeat(10)),
    "a comment at the end": "time,acc\n" + PLAIN + "# end of the recording\n",
    "a line of signs at the end": "time,acc\n" + PLAIN + "-----\nMean 0.1\n",
    "LabVIEW": LABVIEW
    + "X_Value\tacc\tforce\tComment\n"
    + commas(THREE.replace(",", "\t")),
    "LabVIEW without times": LABVIEW
    + "x\tacc\tComment\n"
    + lines(U, Y, separator="\t"),
    "a tag before the names": ";Title, logger\n;Headers, time,Ax,Ay\n" + THREE,
    "a tag without a comment": "Headers,time,Ax,Ay\n" + THREE,
    "semicolons as comments": "; logger 7\ntime,acc\n; sampled by hand\n" + PLAIN,
    "names of an oscilloscope": "x-axis,1\nsecond,Volt\n" + lines(T, Y, form="{:+.6E}"),
    "two lines of names": "Time,DE bearing,NDE bearing\ns,g,g\ns,X,Y\n" + THREE,
    "quoted decimal commas": '"Zeit (s)","Beschl. (g)"\n'
    + commas(lines(T, Y, form='"{:.6f}"').replace(",", "|")).replace("|", ","),
    "days of a spreadsheet": "Time,acc\n"
    + lines(45352.5 + T / 86400, Y, form=("{:.12f}", "{}")),
    "days of MATLAB": "Time,acc\n"
    + lines(739000.25 + 20 * T / 86400, Y, form=("{:.12f}", "{}")),
    "milliseconds since 1970": "timestamp,acc\n"
    + lines(1698541200000 + 1000 * T, Y, form=("{:.3f}", "{}")),
    "microseconds since 1970": "timestamp,acc\n"
    + lines(1698541200000000 + np.arange(N) * 500, Y),
    "nanoseconds since 1970": "t,acc\n"
    + lines(1698541200000000000 + np.arange(N) * 500_000, Y),
    "a time of day": "Time,acc\n" + lines(CLOCK, Y),
    "a time of day of the afternoon": "Time,acc\n"
    + lines([f"1{time[2:]} PM".replace("1:", "11:") for time in CLOCK[110:]], Y[110:]),
    "a unit at the end of a name": "t_ms,acc\n" + lines(1000 * T, Y),
    "microseconds in a name": "Time_us,acc\n" + lines(np.arange(N) * 500, Y),
    "seconds that have passed": "acc,seconds_elapsed\n" + lines(Y, T),
    "a rate in the head": "Sample rate: 2000 Hz\nSensor: 7\nacc\n" + lines(Y),
    "a rate in kHz": "Sampling Frequency;2;kHz\nn;acc\n"
    + lines(np.arange(N), Y, separator=";"),
    "a rate after a sign of equality": "SamplingRate=2000\nacc\n" + lines(Y),
    "an interval in the head": '"Sample Interval",5e-4,s\nn,CH1\n' + lines(range(N), Y),
    "a rate in the unit of its name": "Abtastrate [kHz];2\nacc\n" + lines(Y),
    "a rate with its unit": "Fréquence d'échantillonnage,2.0 kS/s\nacc\n" + lines(Y),
    "a period": "Sample Period;500;us\nacc\n" + lines(Y),
    "dates with slashes": "Time,acc\n"
    + lines([f"2024/03/05 10:00:{t:09.6f}" for t in T], Y),
    "dates of the US": "time,acc\n"
    + lines([f"01/25/2024 10:00:{t:09.6f} AM" for t in T], Y),
    "minutes and seconds": "time,acc\n" + lines([f"59:{t:09.6f}" for t in T], Y),
    "units below the second line of names": "A,B,B\nTime,a,b\ns,g,g\n" + THREE,
    "signs of thousands between quotes": "time,acc\n"
    + lines(T, 1000 * Y, form=("{:.6f}", '"{:,.1f}"')),
    "sep=": "sep=;\ntime;acc\n" + SEMICOLONS,
    "facts next to the samples": lines(
        ["Record Length,300,", "Sample Interval,5e-4,", *[",,"] * (N - 2)],
        T,
        Y,
        form=("{}", "{:.6f}", "{},"),
    ),
    "lines without a name": '"TraceName","acc"\n"BlockSize",300\n"VUnit","V"\n'
    '"SampleRate",2000\n"Date","2024/03/05"\n\n' + lines([""] * N, Y),
    "tags before names and units": "logger 7\nKanal\tZeit 1\tacc\nEinheit\ts\tg\n"
    + commas(lines(T, Y, separator="\t")),
    "a rate in a sentence": "# Sample Rate: 2000 Hz. Values on linear scale.\n"
    + lines(Y),
    "a date and a time of day of a controller": "sep=;\nDatum;Uhrzeit;acc [mm/s];n [1/min]\n"
    + commas(
        lines(
            ["05/03/2024"] * N,
            [f"10:11:{t:09.6f}" for t in T],
            Y,
            [1490] * N,
            separator=";",
        )
    ),
    "a rate between words": "# Fs = 2000\n" + lines(U, Y, separator=" "),
    "a footer below white space": "time acc\n" + PLAIN.replace(",", " ") + "Mean\n",
    "minus of typesetters": "time,acc\n" + PLAIN.replace("-", "\u2212"),
}
#: Rows of another number than 300, and rates of another number than 2000.
OTHERS = {
    "a first column of texts": (3000, None),
    "a time of day of the afternoon": (N - 110, 2000),
    "days of MATLAB": (N, 100),
}


def write(folder, text, name="run.csv", encoding="utf-8"):
    path = folder / name
    path.write_bytes(text.encode(encoding))
    return path


@pytest.mark.parametrize("kind", READ)
def test_read(tmp_path, kind):
    n, rate = OTHERS.get(kind, (N, RATE))
    path = write(tmp_path, READ[kind])
    names = list_channels(path)["channel"].tolist()
    channel = 4 if "next to" in kind else min(1, len(names) - 1)
    channel = next((name for name in names if name.startswith("acc")), channel)
    signal, stated = read_recording(path, channel=channel)
    expected = Y.repeat(10) if n > N else Y[-n:]
    scale = 1000 if "thousands" in kind else 1
    np.testing.assert_allclose(signal / scale, expected, rtol=1e-5, atol=1e-4)
    assert stated == rate
    assert "Comment" not in names and "Headers" not in names


@pytest.mark.parametrize(
    ("decimal", "thousands"), [(".", ","), (",", "."), (",", "\u202f"), (".", "'")]
)
def test_thousands_are_read_if_the_decimal_sign_is_shown(tmp_path, decimal, thousands):
    text = lines(T, COUNTS, form=("{:.6f}", "{:_}"), separator="\t")
    text = text.replace(".", decimal).replace("_", thousands)
    signal, rate = read_recording(write(tmp_path, "Time (s)\tacc\n" + text))
    np.testing.assert_array_equal(signal, COUNTS)
    assert rate == RATE


REFUSED = {
    "thousands or decimals": (
        "n;acc\n" + lines(range(N), COUNTS, form="{:,}", separator=";"),
        r"line \d+: the value is '-?\d,\d{3}', which means -?\d{4} or -?\d\.\d{3}; write",
    ),
    "thousands far from the head": (
        "n;acc\n" + "0;567\n" * 1000 + "0;1.234\n" * 5,
        r"line 1002: the value is '1.234', which means 1234 or 1.234",
    ),
    "a row of a text": (
        "time,acc\n" + PLAIN + "Max,Min\n2.9,-2.5\n",
        "line 302: 'Max' in column 'time' is no number",
    ),
    "a second block": (
        "time,acc\n" + PLAIN + "time,acc\n" + PLAIN,
        "line 302: 'time' in column 'time' is no number",
    ),
    "a repeated row": (
        "time,acc\n" + "".join(2 * row for row in PLAIN.splitlines(keepends=True)),
        "'time' is 0 s in samples 0 and 1, .* remove rows that are repeated",
    ),
    "some repeated rows, with times in steps of their last digit": (
        "time,acc\n"
        + "".join(
            (1 + (i % 10 == 5)) * row
            for i, row in enumerate(lines(np.arange(N) / 100, Y).splitlines(True))
        ),
        "'time' is 0.05 s in samples 5 and 6",
    ),
    "rows of two sensors": (
        "Time (s),Sensor,acc (g)\n"
        + lines(T.repeat(2), ["DE", "NDE"] * N, np.ravel([Y, U], "F")),
        "0 s in samples 0 and 1, .* and make one column of each 'Sensor'",
    ),
    "rows of three axes": (
        "time,axis,acc\n" + lines(T.repeat(3), [1, 2, 3] * N, np.resize(Y, 3 * N)),
        "0 s in samples 0 and 1, .* and make one column of each 'axis'",
    ),
    "rows of two sensors without their names": (
        "time,acc\n" + lines(T.repeat(2), np.ravel([Y, U], "F")),
        "'time' is 0 s in samples 0 and 1, .* one column of each sensor",
    ),
    "rows of two sensors in steps of the last digit but three": (
        "time,acc\n"
        + lines(
            np.arange(N).repeat(2) / 1000, np.ravel([Y, U], "F"), form=("{:.6f}", "{}")
        ),
        "'time' is 0 s in samples 0 and 1",
    ),
    "a gap between dates with a zone": (
        "time,acc\n"
        + lines([f"2024-03-05T10:00:{t:09.6f}+01:00" for t in T + (T > 0.1) / 5], Y),
        "'time' is not evenly spaced: 0.2005 s before sample 201",
    ),
    "repeated rows with dates of a zone": (
        "time,acc\n"
        + "".join(
            (1 + (i == 9)) * f"2024-03-05T10:00:{t:09.6f}+01:00,{y}\n"
            for i, (t, y) in enumerate(zip(T, Y, strict=True))
        ),
        "in samples 9 and 10, though times are written more finely",
    ),
    "two rates": (
        "Sample rate,25600,Hz\ntime,acc\n" + PLAIN,
        "states several sampling rates: Sample rate 25600 Hz, the times 'time' 2000 Hz",
    ),
}


@pytest.mark.parametrize("kind", REFUSED)
def test_refused(tmp_path, kind):
    text, message = REFUSED[kind]
    path = write(tmp_path, text)
    with pytest.raises(ValueError, match=rf"run.csv: .*{message}"):
        read_recording(path, channel=2 if "Sensor" in text or "axis" in text else 1)


def test_a_rate_of_an_unlikely_unit_is_not_stated(tmp_path):
    """Milliseconds would give 2 Hz; a rate that is stated shows the unit."""
    path = write(tmp_path, "time,acc\n" + lines(1000 * T, Y))
    assert read_recording(path, channel="acc")[1] is None
    table = write(tmp_path, "path,channel,sampling_rate\nrun.csv,acc,2000\n", "t.csv")
    assert read_recording_table(table).sampling_rate == RATE


@pytest.mark.parametrize("rounding", [np.round, np.floor])
def test_pairs_of_equal_milliseconds_are_rounded_times(tmp_path, rounding):
    times = rounding(np.arange(3000) / RATE * 1000) / 1000
    path = write(tmp_path, "time,acc\n" + lines(times, np.resize(Y, 3000)))
    assert read_recording(path, channel="acc")[1] == RATE


@pytest.mark.parametrize("n_digits", [3, 4, 6])
@pytest.mark.parametrize("rate", [51.7, 512.0])
def test_times_that_lose_decimals(tmp_path, rate, n_digits):
    times = np.arange(700) / rate * (1 if n_digits < 6 else 30)
    expected = rate if n_digits < 6 else rate / 30
    form = (f"{{:.{n_digits - 1}E}}", "{}")
    path = write(
        tmp_path, "Time (s),acc\n" + lines(times, np.resize(Y, 700), form=form)
    )
    assert read_recording(path)[1] == pytest.approx(expected, rel=2e-4)


@pytest.mark.parametrize("separator", [",", ";", "\t", " "])
@pytest.mark.parametrize("n_rows", [1, 2])
def test_rows_of_numbers_are_channels(tmp_path, separator, n_rows):
    rows = np.stack([Y, U])[:n_rows]
    text = "\n".join(separator.join(map(str, row)) for row in rows.tolist())
    path = write(tmp_path, text)
    assert list_channels(path)["channel"].tolist() == ["0", "1"][:n_rows]
    np.testing.assert_array_equal(read_recording(path, channel=0)[0], Y)


def test_a_row_that_is_longer_than_the_head(tmp_path):
    values = np.random.default_rng(0).normal(size=5000)
    path = write(tmp_path, ",".join(map(str, values.tolist())))
    np.testing.assert_array_equal(read_recording(path)[0], values)


def test_letters_of_windows(tmp_path):
    path = write(tmp_path, "Zeit (s);Beschl. „g“ (€)\n" + SEMICOLONS, encoding="cp1252")
    assert list_channels(path)["channel"][1] == "Beschl. „g“ (€)"
    table = write(
        tmp_path, "path;condition\nrun.csv;Außenring „grün“\n", "t.csv", "cp1252"
    )
    assert read_recording_table(table).condition.tolist() == ["Außenring „grün“"]


@pytest.mark.parametrize("length", [0, 0xFFFF_FFFF, 0x7FFF_FFFF])
def test_sound_without_a_length(tmp_path, length):
    """A recorder that was stopped by a power cut, or that wrote to a pipe."""
    pytest.importorskip("soundfile")
    samples = Y.astype("<f4")
    wavfile.write(tmp_path / "run.wav", RATE, samples)
    content = bytearray((tmp_path / "run.wav").read_bytes())
    place = content.index(b"data") + 4
    content[place : place + 4] = content[4:8] = struct.pack("<I", length)
    (tmp_path / "run.wav").write_bytes(content + b"\1")
    if length == 0:
        with pytest.raises(ValueError, match=r"run.wav: .* states no samples"):
            read_recording(tmp_path / "run.wav")
        return
    signal, rate = read_recording(tmp_path / "run.wav")
    np.testing.assert_array_equal(signal, samples)
    assert rate == RATE


@pytest.mark.parametrize("text", ["102.400", "102,400", "51.200", "1,000"])
def test_a_rate_with_a_sign_of_thousands_is_refused(tmp_path, text):
    np.save(tmp_path / "run.npy", Y)
    table = write(tmp_path, f"path;sampling_rate\nrun.npy;{text}\n", "table.csv")
    message = f"line 2: sampling_rate is '{text}', which means .* write"
    with pytest.raises(ValueError, match=message):
        read_recording_table(table)
    table.write_text(f"path;sampling_rate;sampling_rate_unit\nrun.npy;{text};kHz\n")
    expected = 1000 * float(text.replace(",", "."))
    assert read_recording_table(table).sampling_rate == expected


@pytest.mark.parametrize("sentinel", [-9999.0, 9.9e37, -999.25, "OL", "Overflow"])
@pytest.mark.parametrize("suffix", [".npy", ".csv"])
def test_an_overflow_is_read_and_spoils_its_rows_only(tmp_path, sentinel, suffix):
    values = np.random.default_rng(0).normal(size=1000)
    values[17:20] = 9.9e37 if isinstance(sentinel, str) else sentinel
    path = tmp_path / f"run{suffix}"
    if suffix == ".npy":
        np.save(path, values)
    else:
        texts = [sentinel if 17 <= i < 20 else y for i, y in enumerate(values)]
        write(tmp_path, "acc\n" + lines(texts))
    samples = read_recording(path)[0]
    np.testing.assert_array_equal(samples, values)
    quality = signal_quality(samples.reshape(4, 250)).tolist()
    assert quality == ["overflow", "good", "good", "good"]
    resampled = np.concatenate([*resampled_blocks([samples], 1000, 500)])
    assert signal_quality(resampled.reshape(2, 250)).tolist() == ["not finite", "good"]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("acc\n" + "1\n" * 500 + "9" * 400 + "\n", "infinite values, .* sample 500"),
        ("time,acc\n" + PLAIN + "0.15,\n", "missing, NaN .* sample 300"),
        ("acc;n\n" + "0,5;1\n" * 9 + ";1\n", "missing, NaN .* sample 9"),
        ("acc;n\n" + "0,5;1\n" * 9 + "err;1\n", "line 11: 'err' in column 'acc'"),
    ],
)
def test_values_that_are_none(tmp_path, text, message):
    path = write(tmp_path, text)
    with pytest.raises(ValueError, match=rf"run.csv: .*{message}"):
        read_recording(path, channel="acc")


def test_a_year_that_overflows_is_no_time(tmp_path):
    path = write(tmp_path, "time,acc\n" + "0001-01-01T00:00+14:00,1\n" * 3)
    assert read_recording(path, channel="acc")[1] is None


def test_letters_of_another_encoding_far_from_the_head(tmp_path):
    path = write(tmp_path, "time,acc\n" + PLAIN)
    path.write_bytes(path.read_bytes() + "# 20 °C\n".encode("cp1252"))
    assert read_recording(path)[1] == RATE


def test_names_from_files_are_printable(tmp_path):
    np.savez(tmp_path / "run.npz", **{"acc\x1b[2J": Y})
    assert list_channels(tmp_path / "run.npz")["channel"].tolist() == ["acc\\x1b[2J"]
    assert len(read_recording(tmp_path / "run.npz", channel="acc*")[0]) == N
    with pytest.raises(ValueError, match=r"available: 'acc\\+x1b\[2J'"):
        read_recording(tmp_path / "run.npz", channel="y")


def test_what_libraries_say_is_not_printed(tmp_path):
    (tmp_path / "run.wav").write_bytes(b"RIFF\1\0\0\0WAVEdata")
    message = (
        r"run.wav: cannot be read as .wav, damaged\? Or is it of another format\?$"
    )
    with pytest.raises(ValueError, match=message):
        read_recording(tmp_path / "run.wav")
