"""Inputs of ``watch`` that are not as they should be."""

import sys

import numpy as np
import pytest

from tests.plant.watch.watching import (
    expected,
    lines_of,
    parsed,
    sound,
    text_parser,
)

pytestmark = pytest.mark.filterwarnings("ignore:rpm is not given:UserWarning")


SIGNAL = sound("good", 600, 3)


@pytest.mark.parametrize(
    ("text", "quality"),
    [
        (b"NaN", "not finite"),
        (b"-inf", "not finite"),
        (b"1e999", "not finite"),
        (b"1e308", "held"),
        (b"1_000", "not finite"),
        (b"\0\0", "not finite"),
        (b"0.1,0.2", "not finite"),
        (b"\xff", "not finite"),
        (b'"', "not finite"),
    ],
)
def test_a_value_that_is_no_sample(watch, text, quality):
    lines = lines_of(SIGNAL).splitlines()
    lines[300] = text
    code, verdicts, _ = watch(b"\n".join(lines))
    assert code == 0
    assert [v["quality"] for v in verdicts] == ["good", quality, "good"]
    assert verdicts[1]["window_verdict"] is None


def test_decimal_commas_of_one_column(watch, fitted):
    signal = np.round(SIGNAL, 4)
    lines = [f"{value:+.4f}".replace(".", ",") for value in signal.tolist()]
    code, verdicts, _ = watch("\n".join(lines).encode())
    assert code == 0
    assert verdicts == expected(fitted, signal)


def test_names_that_come_again(watch, fitted):
    lines = lines_of([SIGNAL, SIGNAL]).splitlines()
    data = b"\n".join([b"a,b", *lines[:300], b"a,b", *lines[300:]])
    code, verdicts, _ = watch(data, "--channel", "0")
    assert code == 0
    assert verdicts == expected(fitted, SIGNAL)


@pytest.mark.parametrize("cut", [b".25", b"e-05", b"\xef\xbb\xbf17"])
def test_a_first_line_that_was_cut(watch, fitted, cut):
    data = b"\r\n".join([cut, *lines_of([SIGNAL, SIGNAL]).splitlines()])
    code, verdicts, _ = watch(data, "--channel", "0")
    assert code == 0
    assert verdicts == expected(fitted, SIGNAL)


BANNERS = {
    "esp32": b"""ets Jun  8 2016 00:22:57

rst:0x1 (POWERON_RESET),boot:0x13 (SPI_FAST_FLASH_BOOT)
configsip: 0, SPIWP:0xee
clk_drv:0x00,q_drv:0x00,d_drv:0x00,cs0_drv:0x00,hd_drv:0x00,wp_drv:0x00
mode:DIO, clock div:1
load:0x3fff0030,len:1184
load:0x40078000,len:12812
load:0x40080400,len:3032
entry 0x400805e4
I (312) adxl: range 16 g, rate 3200 Hz
ready
""",
    "names and a long text": b"Logger 7\n" * 100 + b"a,b\ng,g\n",
}


@pytest.mark.parametrize("size", [10**9, 41])
@pytest.mark.parametrize("banner", BANNERS)
def test_lines_that_a_board_prints_at_its_start(banner, size):
    data = BANNERS[banner] + lines_of([SIGNAL, -SIGNAL])
    parser = text_parser()
    parts = [
        parsed(parser, data[start : start + size])
        for start in range(0, len(data), size)
    ]
    samples = np.concatenate([part for part in parts if part.size], axis=1)
    np.testing.assert_allclose(samples, [SIGNAL, -SIGNAL])


def test_blank_lines_are_no_samples(watch, fitted):
    code, verdicts, _ = watch(lines_of(SIGNAL).replace(b"\n", b"\r\r\n\n"))
    assert code == 0
    assert verdicts == expected(fitted, SIGNAL)


@pytest.mark.parametrize("first", [b"", b"\xef\xbb\xbf", b"\xef\xbb\xbfacc\r\n"])
def test_a_byte_order_mark_and_two_signs_at_the_end_of_a_line(watch, fitted, first):
    code, verdicts, _ = watch(first + lines_of(SIGNAL).replace(b"\n", b"\r\n"))
    assert code == 0
    assert verdicts == expected(fitted, SIGNAL)


RAW = "expected csv lines in UTF-8; raw samples need --dtype"


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (np.random.default_rng(0).bytes(100_000), RAW),
        (bytes(1_400_000), RAW),
        (b"1" * 1_400_000, RAW),
        (b"<html>\n<p>No\n</p>\n</html>\n", "'<html>' is no line of numbers"),
        ("1.5\n2.5\n".encode("utf-16"), "expected csv lines in UTF-8"),
        (b"1.5,5\n" * 300, "2 channels, expected 1; --channel chooses"),
        (b"512,498\n" * 300, "2 channels, expected 1; the comma may separate two col"),
    ],
)
def test_what_is_no_text_with_numbers(watch, data, message):
    code, verdicts, err = watch(data)
    assert code == 1
    assert verdicts == []
    assert "error: -: " in err
    assert message in err


def test_the_layout_does_not_depend_on_how_the_lines_come():
    data = b"1 2\n" * 6 + b"3,4\n" * 70
    whole = parsed(text_parser(), data)
    pieces = text_parser()
    parts = [parsed(pieces, data[i : i + 5]) for i in range(0, len(data), 5)]
    parts = [samples for samples in parts if samples.size]
    np.testing.assert_array_equal(np.concatenate(parts, axis=1), whole)
    assert whole[:, 0].tolist() == [1.0, 2.0]
    assert np.isnan(whole[:, -70:]).all()


def test_a_line_without_an_end_takes_no_memory():
    parser = text_parser()
    noise = b"7" * 2**18
    assert parsed(parser, b"1\n2\n3\n4\n").shape == (1, 4)
    with pytest.raises(ValueError, match=r"'77777777.*is no line of numbers"):
        for _ in range(40):
            assert parsed(parser, noise).size == 0


def test_raw_samples_that_are_none(run, models, piped):
    piped(np.ones(50, "<f4").tobytes() + b"abc")
    *_, err = run("watch", models[0], "-", "--dtype", "<f4")
    assert "50 samples" in err
    code, _, err = run("watch", models[0], "-", "--dtype", "<c8")
    assert code == 1 and "dtype is '<c8', expected real numbers" in err


def test_no_standard_input(run, models, monkeypatch):
    monkeypatch.setattr(sys, "stdin", None)
    code, _, err = run("watch", models[0], "-")
    assert code == 1 and "-: there is no standard input" in err


RPM = np.repeat([900.0, 905.5], [400, 200])


@pytest.mark.parametrize(
    ("header", "columns", "options"),
    [
        (b"acc,n\n", [SIGNAL, RPM], ("n",)),
        (b"acc,speed of shaft\n", [SIGNAL, RPM], ("speed*",)),
        (b"", [SIGNAL, RPM], ("1",)),
        (b"n,acc\n", [RPM, SIGNAL], ("n", "--channel", "acc")),
    ],
)
def test_a_column_of_shaft_speeds(watch, header, columns, options):
    code, verdicts, err = watch(header + lines_of(columns), "--rpm-column", *options)
    assert code == 0, err
    assert [v["rpm"] for v in verdicts] == [900.0, 900.0, 905.5]


@pytest.mark.parametrize(
    ("code", "options", "message"),
    [
        (1, ("--rpm-column", "n"), "-: no channel 'n'"),
        (2, ("--rpm-column", "n", "--dtype", "<f4"), "belongs to csv lines"),
        (2, ("--rpm-column", "n", "--rpm", 900), "not allowed with argument"),
        (2, ("--rpm", "log.csv"), "log.csv is for a folder; use tacho:CHANNEL, --rpm-"),
    ],
)
def test_speeds_that_cannot_be_read(watch, code, options, message):
    result = watch(lines_of(SIGNAL), *options)
    assert result[0] == code
    assert message in result[2]
