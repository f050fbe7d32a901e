"""Text files as loggers and spreadsheets write them."""

import gzip

import numpy as np
import pytest

from skarxlag.recordings import list_channels, read_recording
from skarxlag.recordings.files import recording_blocks

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


@pytest.mark.parametrize("name", ["run.csv", "run.txt", "run.TSV", "run.csv.gz", "run.txt.gz"])
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
    np.testing.assert_array_equal(read_recording(path, channel="channel 3999")[0], [0.5] * 3)


def test_gzip_that_is_cut(tmp_path):
    path = write(tmp_path, "y\n" + "1.5\n" * 1000, "run.csv.gz")
    path.write_bytes(path.read_bytes()[:-10])
    with pytest.raises(ValueError, match=r"run.csv.gz: cannot be read as .csv.gz, damaged"):
        read_recording(path)


def test_a_row_that_is_no_number_behind_the_first_lines(tmp_path):
    path = write(tmp_path, "y;u\n" + "1,5;2\n" * 100 + "x;3\n")
    with pytest.raises(ValueError, match=r"run.csv: channel 'y' is not numeric"):
        read_recording(path, channel="y")
