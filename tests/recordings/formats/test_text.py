"""Text files as loggers and spreadsheets write them."""

import gzip

import numpy as np
import pytest

from skarxlag import list_channels, read_recording
from tests.recordings.blocks import recording_blocks

Y, U = [1.5, -2.0, 0.25], [10.0, 20.0, 30.5]


def write(tmp_path, text, name="run.csv", encoding="utf-8"):
    path = tmp_path / name
    content = text.encode(encoding)
    path.write_bytes(gzip.compress(content) if name.endswith(".gz") else content)
    return path


LAYOUTS = {
    "commas": "y,u\n1.5,10\n-2,20\n.25,30.5\n",
    "commas and blanks": "y, u\n1.5, 10\n-2, 20\n.25, 30.5\n",
    "semicolons": "y;u\n1.5;10\n-2;20\n.25;30.5\n",
    "decimal commas": "y;u\n1,5;10\n-2;20\n,25;3,05e1\n",
    "tabulators": "y\tu\n1.5\t10\n-2\t20\n.25\t30.5\n",
    "tabulators, decimal commas": "y\tu\n1,5\t10\n-2,0\t20\n0,25\t30,5\n",
    "white space": "y u\n 1.5   10\n -2.0   20\n  .25   30.5\n",
    "white space, decimal commas": "y u\n1,5 10\n-2,0 20\n0,25 30,5\n",
    "units": "y,u\nm/s2,Nm\n1.5,10\n-2,20\n.25,30.5\n",
    "units in brackets": "y;u\n[m/s2];(Nm)\n1,5;10\n-2;20\n,25;30,5\n",
    "comments": "# logger 7\n# y u\n1.5 10\n-2 20\n.25 30.5\n",
    "quotes": '"y","u"\n"1.5","10"\n"-2","20"\n".25","30.5"\n',
    "lines of Windows": "y;u\r\n1,5;10\r\n-2;20\r\n,25;30,5\r\n",
    "no end of line": "y,u\n1.5,10\n-2,20\n.25,30.5",
}


@pytest.mark.parametrize(
    "name", ["run.csv", "run.txt", "run.TSV", "run.csv.gz", "run.txt.gz"]
)
@pytest.mark.parametrize("layout", LAYOUTS)
def test_layouts(tmp_path, layout, name):
    path = write(tmp_path, LAYOUTS[layout], name)
    np.testing.assert_array_equal(read_recording(path, channel=["y", "u"])[0], [Y, U])
    blocks = [block for block, _ in recording_blocks(path, 2, channel=["u", "y"])]
    assert [block.shape for block in blocks] == [(2, 2), (2, 1)]
    np.testing.assert_array_equal(np.concatenate(blocks, axis=1), [U, Y])
    expected = ["m/s2", "Nm"] if "units" in layout else [None, None]
    assert list_channels(path)["unit"].tolist() == expected


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "latin-1", "utf-16"])
def test_encodings(tmp_path, encoding):
    path = write(tmp_path, "Größe (µm);u\n1,5;2\n-2;3\n", encoding=encoding)
    np.testing.assert_array_equal(read_recording(path, channel="Größe*")[0], [1.5, -2])
    assert list_channels(path)["unit"].tolist() == ["µm", None]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("1,2\n3,4\n", ["0", "1"]),
        ("1 2\n3 4\n", ["0", "1"]),
        ("a,a,\n1,2,3\n", ["a", "a.1", "Unnamed: 2"]),
        ("name\nabc\ndef\n", ["name"]),
        ("1,5\n2,5\n", ["0", "1"]),  # a comma separates unless something else does
    ],
)
def test_names(tmp_path, text, expected):
    assert list_channels(write(tmp_path, text))["channel"].tolist() == expected


@pytest.mark.parametrize("text", ["", "\n\n", "# only a comment\n"])
def test_files_without_a_line(tmp_path, text):
    with pytest.raises(ValueError, match=r"run.csv: No columns to parse"):
        read_recording(write(tmp_path, text))


def test_long_lines(tmp_path):
    names = [f"channel {i}" for i in range(4000)]
    row = ",".join(["0.5"] * len(names))
    path = write(tmp_path, "\n".join([",".join(names), *[row] * 3]))
    np.testing.assert_array_equal(
        read_recording(path, channel="channel 3999")[0], [0.5] * 3
    )


def test_gzip_that_is_cut(tmp_path):
    path = write(tmp_path, "y\n" + "1.5\n" * 1000, "run.csv.gz")
    path.write_bytes(path.read_bytes()[:-10])
    with pytest.raises(ValueError, match=r"run.csv.gz: .*damaged"):
        read_recording(path)


def test_a_row_that_is_no_number_behind_the_first_lines(tmp_path):
    path = write(tmp_path, "y;u\n" + "1,5;2\n" * 100 + "x;3\n")
    with pytest.raises(ValueError, match=r"run.csv: channel 'y' is not numeric"):
        read_recording(path, channel="y")


def test_a_message_does_not_repeat_a_long_field(tmp_path):
    path = write(tmp_path, "y\n" + "1\n" * 100 + "1." * 100_000 + "\n")
    with pytest.raises(ValueError, match=r"is not numeric: '1\.1\.1") as refused:
        read_recording(path)
    assert len(str(refused.value)) < 300


HEADERS = {"names": "y;u\n", "names and units": "y;u\nm/s2;Nm\n"}
PREAMBLES = {
    "one field": "Logger 7\nExported by me\n\n",
    "as many fields as a sample": "Serial;1234\nDate;2026-11-22\nRange;5 V\n",
    "more fields": "a;b;c;d\nLogger;7;;\n",
    "a quoted line": '"Remark: bearing\n1.5;2;3"\n',
    "texts before numbers": "Logger;X7\nSerial;1234\n",
    "numbers among texts": "Rate;25600;Hz\nLogger\n",
}


@pytest.mark.parametrize("preamble", PREAMBLES)
@pytest.mark.parametrize("header", ["names", "names and units"])
def test_preambles(tmp_path, preamble, header):
    text = PREAMBLES[preamble] + HEADERS[header] + "1.5;10\n-2;20\n.25;30.5\n"
    path = write(tmp_path, text)
    expected = ["m/s2", "Nm"] if "units" in header else [None, None]
    assert list_channels(path)["unit"].tolist() == expected
    for n_samples in (None, 2):
        blocks = [b for b, _ in recording_blocks(path, n_samples, channel=["y", "u"])]
        np.testing.assert_array_equal(np.concatenate(blocks, axis=1), [Y, U])


@pytest.mark.parametrize("row", ["x;10", "1.5;x", "1.5", "1.5;10;3"])
@pytest.mark.parametrize("n_before", [0, 1, 2])
def test_a_damaged_first_row_is_not_a_preamble(tmp_path, row, n_before):
    text = "y;u\n" + "1;2\n" * n_before + row + "\n" + "1;2\n" * 30
    with pytest.raises(ValueError, match=r"run.csv: "):
        read_recording(write(tmp_path, text), channel=["y", "u"])


def test_a_preamble_without_names(tmp_path):
    path = write(tmp_path, "Logger 7\n1.5\t10\n-2\t20\n.25\t30.5\n")
    np.testing.assert_array_equal(read_recording(path, channel=["0", "1"])[0], [Y, U])


def test_samples_that_begin_with_a_date_are_no_names(tmp_path):
    lines = [f"2026-11-22T07:00:00.{i:03};{y}" for i, y in enumerate(Y)]
    path = write(tmp_path, "\n".join(lines))
    np.testing.assert_array_equal(read_recording(path, channel="1")[0], Y)


@pytest.mark.parametrize("text", ['"acc\n(g)",u\n', '"acc\r\n(g)",u\r\n'])
def test_an_end_of_line_within_a_name(tmp_path, text):
    path = write(tmp_path, text + "1.5,10\n-2,20\n.25,30.5\n")
    for n_samples in (None, 2):
        blocks = [b for b, _ in recording_blocks(path, n_samples, channel=[0, 1])]
        np.testing.assert_array_equal(np.concatenate(blocks, axis=1), [Y, U])
    assert list_channels(path)["unit"].tolist() == ["g", None]


@pytest.mark.parametrize("end", ["", ";"])
@pytest.mark.parametrize("at", [0, 1, 150])
def test_a_row_that_lacks_its_first_field(tmp_path, at, end):
    """pandas fills the row at its end: the first channel would have the value of the second."""
    lines = [f"{y};{2 * y}{end}" for y in range(200)]
    lines[at] = f"{2 * at}{end}"
    path = write(tmp_path, "\n".join(["y;u" + end, *lines]))
    for n_samples in (None, 40):
        with pytest.raises(
            ValueError, match=rf"run.csv: sample {at} has . of . fields"
        ):
            list(recording_blocks(path, n_samples, channel="y"))


def test_a_last_column_with_gaps(tmp_path):
    path = write(tmp_path, "y;note\n1.5;\n-2;b\n.25;\n")
    np.testing.assert_array_equal(read_recording(path, channel="y")[0], Y)


@pytest.mark.parametrize("n_rows", [1, 100])
def test_lines_that_end_with_a_separator(tmp_path, n_rows):
    path = write(tmp_path, "y;u\n" + "1.5;10;\n" * n_rows)
    np.testing.assert_array_equal(read_recording(path, channel="u")[0], [10.0] * n_rows)
    path = write(tmp_path, "y;u;\n" + "1.5;10\n" * n_rows)
    np.testing.assert_array_equal(read_recording(path, channel="u")[0], [10.0] * n_rows)


DECIMAL_COMMAS = {
    "a plus": "+23,9168\n+1,5210\n-7,1000\n",
    "a zero before the comma": "-0,5\n1,5\n-2,5\n",
    "a zero after the comma": "23,05\n1,52\n-7,10\n",
    "no digit before the comma": "1,5\n,25\n-2,5\n",
    "a name": "acc\n1,5\n2,5\n3,5\n",
    "a name and a unit": "acc\nm/s2\n1,5\n2,5\n3,5\n",
    "quotes": '"23,05"\n"1,52"\n"-7,10"\n',
    "an integer": "23,05\n24\n-7,10\n",
}


@pytest.mark.parametrize("text", DECIMAL_COMMAS)
def test_decimal_commas_of_one_column(tmp_path, text):
    """The comma would cut each sample in two channels of integers."""
    lines = DECIMAL_COMMAS[text].replace('"', "").split()
    numbers = [
        float(line.replace(",", ".")) for line in lines if line not in ("acc", "m/s2")
    ]
    path = write(tmp_path, DECIMAL_COMMAS[text])
    signal, _ = read_recording(path)
    np.testing.assert_array_equal(signal, numbers)
    assert list_channels(path)["unit"].tolist() == ["m/s2" if "unit" in text else None]


@pytest.mark.parametrize(
    ("text", "names"),
    [
        ("512,498\n511,7\n513,12\n", ["0", "1"]),
        ("a,b\n1,05\n2,10\n", ["a", "b"]),
        ("1,-5\n+2,05\n", ["0", "1"]),
        ("1.5,25\n2.5,05\n", ["0", "1"]),
    ],
)
def test_commas_that_separate(tmp_path, text, names):
    assert list_channels(write(tmp_path, text))["channel"].tolist() == names


def test_an_ambiguous_comma_is_said(tmp_path):
    """Advice to choose a channel alone would cut the samples at the comma."""
    path = write(tmp_path, "512,498\n511,732\n513,121\n")
    with pytest.raises(
        ValueError, match=r"'0', '1'; the comma may separate .* or be the decimal"
    ):
        read_recording(path)
    with pytest.raises(ValueError, match=r"available: 'a', 'b'$"):
        read_recording(write(tmp_path, "a,b\n512,498\n511,732\n"))


@pytest.mark.parametrize("long", ["1;2;3;4;5", "25600;0.5;7", "x;1;2"])
def test_a_first_row_of_more_fields_is_skipped(tmp_path, long):
    path = write(tmp_path, long + "\n1.5;10\n-2;20\n.25;30.5\n")
    np.testing.assert_array_equal(read_recording(path, channel=["0", "1"])[0], [Y, U])
    path = write(tmp_path, long + "\ny;u\n1.5;10\n-2;20\n.25;30.5\n")
    np.testing.assert_array_equal(read_recording(path, channel=["y", "u"])[0], [Y, U])


def test_dat_files(tmp_path):
    """They hold text, or raw samples if their type is stated."""
    path = write(tmp_path, "y u\n1.5 10\n-2 20\n.25 30.5\n", "run.DAT")
    np.testing.assert_array_equal(read_recording(path, channel="u")[0], U)
    np.array([1, 2, 3], "<i2").tofile(path)
    with pytest.raises(
        ValueError, match=r"run.DAT: holds no text; raw samples need their dtype"
    ):
        read_recording(path)
    np.testing.assert_array_equal(read_recording(path, dtype="<i2")[0], [1, 2, 3])
