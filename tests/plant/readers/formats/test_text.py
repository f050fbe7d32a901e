"""Text files as loggers and spreadsheets write them."""

import gzip

import numpy as np
import pytest

from skarxlag import list_channels, read_recording

from .reading import in_blocks, truncate

Y = [1.5, -2.0, 0.25]
U = [10.0, 20.0, 30.5]
ROWS = "1.5;10\n-2;20\n.25;30.5\n"


@pytest.fixture
def write(tmp_path):
    def write(text, name="run.csv", encoding="utf-8"):
        path = tmp_path / name
        content = text.encode(encoding)
        path.write_bytes(gzip.compress(content) if name.endswith(".gz") else content)
        return path

    return write


def names_of(path):
    return list_channels(path)["channel"].tolist()


def units_of(path):
    return list_channels(path)["unit"].tolist()


def check_samples(path, channel=("y", "u")):
    """Compare two channels with Y and U, read whole and in parts."""
    for n_samples, longest in ((None, 3), (2, 2)):
        read = in_blocks(path, n_samples, channel=list(channel))
        np.testing.assert_array_equal(read[0], [Y, U])
        assert read[2] == longest


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
    "name", ["run.csv", "run.txt", "run.TSV", "run.DAT", "run.csv.gz", "run.txt.gz"]
)
@pytest.mark.parametrize("layout", LAYOUTS)
def test_layouts(write, layout, name):
    path = write(LAYOUTS[layout], name)
    check_samples(path)
    assert units_of(path) == (["m/s2", "Nm"] if "units" in layout else [None, None])


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "latin-1", "utf-16"])
def test_encodings(write, encoding):
    path = write("Größe (µm);u\n1,5;2\n-2;3\n", encoding=encoding)
    np.testing.assert_array_equal(read_recording(path, channel="Größe*")[0], [1.5, -2])
    assert units_of(path) == ["µm", None]


@pytest.mark.parametrize(
    ("text", "names"),
    [
        ("1,2\n3,4\n", ["0", "1"]),
        ("1 2\n3 4\n", ["0", "1"]),
        ("a,a,\n1,2,3\n", ["a", "a.1", "Unnamed: 2"]),
        ("name\nabc\ndef\n", ["name"]),
        # A comma separates unless something else does.
        ("1,5\n2,5\n", ["0", "1"]),
        ("512,498\n511,7\n513,12\n", ["0", "1"]),
        ("a,b\n1,05\n2,10\n", ["a", "b"]),
        ("1,-5\n+2,05\n", ["0", "1"]),
        ("1.5,25\n2.5,05\n", ["0", "1"]),
    ],
)
def test_names(write, text, names):
    assert names_of(write(text)) == names


@pytest.mark.parametrize("text", ["", "\n\n", "# only a comment\n"])
def test_files_without_a_line(write, text):
    with pytest.raises(ValueError, match=r"run.csv: No columns to parse"):
        read_recording(write(text))


def test_long_lines(write):
    names = [f"channel {i}" for i in range(4000)]
    row = ",".join(["0.5"] * len(names))
    path = write("\n".join([",".join(names), *[row] * 3]))
    signal, _ = read_recording(path, channel="channel 3999")
    np.testing.assert_array_equal(signal, [0.5] * 3)


def test_gzip_that_is_cut(write):
    path = write("y\n" + "1.5\n" * 1000, "run.csv.gz")
    truncate(path, path.stat().st_size - 10)
    with pytest.raises(ValueError, match=r"run.csv.gz: .*damaged"):
        read_recording(path)


@pytest.mark.parametrize(
    ("last", "message"),
    [
        ("x;3", "line 102: 'x' in column 'y' is no number"),
        ("1." * 100_000 + ";3", "a field has more than 131072 characters"),
    ],
)
def test_a_row_that_is_no_number_behind_the_first_lines(write, last, message):
    path = write("y;u\n" + "1.5;2\n" * 100 + last + "\n")
    with pytest.raises(ValueError, match=message) as refused:
        read_recording(path, channel="y")
    assert len(str(refused.value)) < 300


PREAMBLES = {
    "none": "",
    "one field": "Logger 7\nExported by me\n\n",
    "as many fields as a sample": "Serial;1234\nDate;2026-11-22\nRange;5 V\n",
    "more fields": "a;b;c;d\nLogger;7;;\n",
    "a quoted line": '"Remark: bearing\n1.5;2;3"\n',
    "texts before numbers": "Logger;X7\nSerial;1234\n",
    "numbers among texts": "Rate;25600;Hz\nLogger\n",
    "a row of more numbers": "1;2;3;4;5\n",
    "a row of few more numbers": "25600;0.5;7\n",
    "a row of more numbers and a text": "x;1;2\n",
}


@pytest.mark.parametrize("preamble", PREAMBLES)
@pytest.mark.parametrize("has_units", [False, True])
def test_preambles(write, preamble, has_units):
    header = "y;u\nm/s2;Nm\n" if has_units else "y;u\n"
    path = write(PREAMBLES[preamble] + header + ROWS)
    assert units_of(path) == (["m/s2", "Nm"] if has_units else [None, None])
    check_samples(path)


@pytest.mark.parametrize(
    "preamble", [*("1;2;3;4;5\n", "25600;0.5;7\n", "x;1;2\n"), "Logger 7\n"]
)
def test_preambles_without_names(write, preamble):
    check_samples(write(preamble + ROWS), ["0", "1"])


@pytest.mark.parametrize("row", ["x;10", "1.5;x", "1.5", "1.5;10;3"])
@pytest.mark.parametrize("n_before", [0, 1, 2])
def test_a_damaged_first_row_is_not_a_preamble(write, row, n_before):
    text = "y;u\n" + "1;2\n" * n_before + row + "\n" + "1;2\n" * 30
    with pytest.raises(ValueError, match=r"run.csv: "):
        read_recording(write(text), channel=["y", "u"])


def test_samples_that_begin_with_a_date_are_no_names(write):
    lines = [f"2026-11-22T07:00:00.{i:03};{y}" for i, y in enumerate(Y)]
    path = write("\n".join(lines))
    np.testing.assert_array_equal(read_recording(path, channel="1")[0], Y)


@pytest.mark.parametrize("header", ['"acc\n(g)",u\n', '"acc\r\n(g)",u\r\n'])
def test_an_end_of_line_within_a_name(write, header):
    path = write(header + ROWS.replace(";", ","))
    check_samples(path, [0, 1])
    assert units_of(path) == ["g", None]


@pytest.mark.parametrize("end", ["", ";"])
@pytest.mark.parametrize("at", [0, 1, 150])
@pytest.mark.parametrize("n_samples", [None, 40])
def test_a_row_that_lacks_its_first_field(write, at, end, n_samples):
    """pandas fills the row at its end: the first channel would have the value of the second."""
    lines = [f"{y};{2 * y}{end}" for y in range(200)]
    lines[at] = f"{2 * at}{end}"
    path = write("\n".join(["y;u" + end, *lines]))
    with pytest.raises(ValueError, match=rf"run.csv: line {at + 2} has . fields"):
        in_blocks(path, n_samples, channel="y")


def test_a_last_column_with_gaps(write):
    path = write("y;note\n1.5;\n-2;b\n.25;\n")
    np.testing.assert_array_equal(read_recording(path, channel="y")[0], Y)


@pytest.mark.parametrize("text", ["y;u\n1.5;10;\n", "y;u;\n1.5;10\n"])
@pytest.mark.parametrize("n_rows", [1, 100])
def test_lines_that_end_with_a_separator(write, text, n_rows):
    header, row, _ = text.split("\n")
    path = write("\n".join([header, *[row] * n_rows, ""]))
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
def test_decimal_commas_of_one_column(write, text):
    """The comma would cut each sample in two channels of integers."""
    lines = DECIMAL_COMMAS[text].replace('"', "").replace(",", ".").split()
    path = write(DECIMAL_COMMAS[text])
    np.testing.assert_array_equal(
        read_recording(path)[0], np.array(lines[-3:], dtype=float)
    )
    assert units_of(path) == ["m/s2" if "unit" in text else None]


def test_an_ambiguous_comma_is_stated(write):
    """Advice to choose a channel alone would cut the samples at the comma."""
    message = r"'0', '1'; the comma may separate .* or be the decimal"
    with pytest.raises(ValueError, match=message):
        read_recording(write("512,498\n511,732\n513,121\n"))
    with pytest.raises(ValueError, match=r"available: 'a', 'b'$"):
        read_recording(write("a,b\n512,498\n511,732\n"))


def test_raw_samples_in_a_dat_file(write):
    path = write("", "run.DAT")
    np.array([1, 2, 3], "<i2").tofile(path)
    message = r"run.DAT: holds no text; raw samples need their dtype"
    with pytest.raises(ValueError, match=message):
        read_recording(path)
    np.testing.assert_array_equal(read_recording(path, dtype="<i2")[0], [1, 2, 3])
