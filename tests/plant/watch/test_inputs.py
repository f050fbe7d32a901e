"""Inputs of ``watch`` that are not as they should be."""

import sys

import numpy as np
import pytest

from tests.plant.watch.watching import RATE, expected, lines_of, parsed, sound

pytestmark = pytest.mark.filterwarnings("ignore:rpm is not given:UserWarning")

SIGNAL = np.round(sound("good", 600, 3), 4)
LINES = lines_of(SIGNAL).splitlines()
PAIRS = lines_of([SIGNAL, SIGNAL]).splitlines()
TIMES = np.arange(600) / RATE


def european(time, value):
    return f"{time:.3f};{value:+.4f};7".replace(".", ",")


@pytest.mark.parametrize(
    ("data", "options"),
    [
        (b"\n".join([b"a,b", *PAIRS[:300], b"a,b", *PAIRS[300:]]), ("--channel", "0")),
        (b"\r\n".join([b"e-05", *PAIRS]), ("--channel", "0")),
        (b"\xef\xbb\xbf17\r\n" + b"\r\n".join(PAIRS), ("--channel", "0")),
        (b"\xef\xbb\xbfacc\r\n" + b"\r\n".join(LINES), ()),
        (b"\r\r\n\n".join(LINES), ()),
        ("\n".join(f"{v:+.4f}".replace(".", ",") for v in SIGNAL).encode(), ()),
        (
            "\n".join(
                ["Zeit;Lager A;Drehzahl\r\ns;m/s2;1/min", *map(european, TIMES, SIGNAL)]
            ).encode(),
            (),
        ),
    ],
    ids=["names again", "cut", "mark and cut", "mark", "blank", "commas", "european"],
)
def test_lines_that_are_read(watch, fitted, data, options):
    code, verdicts, _ = watch(data, *options)
    assert code == 0 and verdicts == expected(fitted, SIGNAL)


@pytest.mark.parametrize(
    "text", [b"NaN", b"-inf", b"1e999", b"1_000", b"\0\0", b"0.1,0.2", b"\xff", b'"']
)
def test_a_value_that_is_no_sample(watch, text):
    code, verdicts, _ = watch(b"\n".join([*LINES[:300], text, *LINES[301:]]))
    assert code == 0
    assert [v["quality"] for v in verdicts] == ["good", "not finite", "good"]
    assert verdicts[1]["window_verdict"] is None


BANNER = b"""ets Jun  8 2016 00:22:57

rst:0x1 (POWERON_RESET),boot:0x13 (SPI_FAST_FLASH_BOOT)
clk_drv:0x00,q_drv:0x00,d_drv:0x00,cs0_drv:0x00,hd_drv:0x00,wp_drv:0x00
mode:DIO, clock div:1
load:0x3fff0030,len:1184
entry 0x400805e4
I (312) adxl: range 16 g, rate 3200 Hz
ready
"""


@pytest.mark.parametrize("size", [10**9, 41])
@pytest.mark.parametrize("banner", [BANNER, b"Logger 7\n" * 100 + b"a,b\ng,g\n"])
def test_lines_that_a_board_prints_at_its_start(banner, size):
    samples = parsed(banner + lines_of([SIGNAL, -SIGNAL]), size)
    np.testing.assert_allclose(samples, [SIGNAL, -SIGNAL])


def test_the_layout_does_not_depend_on_how_the_lines_come():
    data = b"1 2\n" * 200 + b"3;4\n" * 70
    whole = parsed(data)
    np.testing.assert_array_equal(parsed(data, 5), whole)
    assert whole[:, 0].tolist() == [1.0, 2.0]
    assert np.isnan(whole[:, -70:]).all()


RAW = "expected csv lines in UTF-8; raw samples need --dtype"


@pytest.mark.parametrize(
    ("data", "options", "message"),
    [
        (np.random.default_rng(0).bytes(100_000), "", RAW),
        (bytes(1_400_000), "", RAW),
        (b"1\n2\n3\n4\n" + b"7" * 1_400_000, "", "'77777777"),
        (b"<html>\n<p>No\n</p>\n</html>\n", "", "'<html>' is no line of numbers"),
        ("1.5\n2.5\n".encode("utf-16"), "", RAW),
        (b"1.5,5\n" * 300, "", "2 channels, expected 1; --channel chooses"),
        (b"512,498\n" * 300, "", "1; the comma may separate two columns"),
        (b"1.0\n2.0\n", "--channel a", "no channel 'a'; available: '0'"),
        (b"1.0\n2.0\n", "--rpm-column n", "no channel 'n'"),
        (b"1234", "--channel 1 --dtype <i2", "no channel '1'; available: '0'"),
        (b"1234", "--dtype text", "dtype is 'text', expected real numbers such as"),
        (b"1234", "--dtype <c8", "dtype is '<c8', expected real numbers"),
    ],
)
def test_what_is_not_the_signal(watch, data, options, message):
    code, verdicts, err = watch(data, *options.split())
    assert code == 1 and verdicts == []
    assert "error: " in err and message in err and "Traceback" not in err


def test_no_standard_input(run, models, monkeypatch):
    monkeypatch.setattr(sys, "stdin", None)
    code, _, err = run("watch", models[0], "-")
    assert code == 1 and "-: there is no standard input" in err


RPM = np.repeat([900.0, 905.5], [400, 200])


@pytest.mark.parametrize(
    ("header", "columns", "options"),
    [
        (b"acc,speed of shaft\n", [SIGNAL, RPM], ("speed*",)),
        (b"", [SIGNAL, RPM], ("1",)),
        (b"n,acc\n", [RPM, SIGNAL], ("n", "--channel", "acc")),
    ],
)
def test_a_column_of_shaft_speeds(watch, header, columns, options):
    code, verdicts, err = watch(header + lines_of(columns), "--rpm-column", *options)
    assert code == 0, err
    assert [v["rpm"] for v in verdicts] == [900.0, 900.0, 905.5]
