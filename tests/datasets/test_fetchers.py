"""Fetchers: what each rig must be, and how files are downloaded and checked."""

import hashlib
import os
import threading
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from itertools import product
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from scipy.io import savemat

from skarxlag import datasets
from skarxlag.bearings import bearing_orders
from skarxlag.datasets import FETCHERS, _repository, cwru

REAL = os.environ.get("SKARXLAG_DATA")
GITHUB = "https://raw.githubusercontent.com/"
HIT_SM = GITHUB + "hitwzc/Bearing-datasets/12e46cd1b4a40f396c2bd6e245be5bafe18b1989/"
UESTC = (
    GITHUB
    + "ChangLiu2024/UESTC-Bearing-Dataset/782c6ddddcd63e0ef97019dbfeec9887e36bca1e/"
)
MFPT = (
    GITHUB + "mathworks/RollingElementBearingFaultDiagnosis-Data/"
    "d3efefb6ce84fa1ee6c0311f80f7c89cf903ad1d/"
)
CWRU = "https://engineering.case.edu/sites/default/files/"
CWRU_SPEEDS = (1797, 1772, 1750, 1730)
ORDERS_OF_6205 = (3.5848, 5.4152)
#: Numbers of the files as the index pages of the data centre list them, by rising load.
CWRU_DRIVE = {
    "inner007": "105 106 107 108", "inner014": "169 170 171 172", "inner021": "209 210 211 212",
    "ball007": "118 119 120 121", "ball014": "185 186 187 188", "ball021": "222 223 224 225",
    "outer007": "130 131 132 133", "outer014": "197 198 199 200", "outer021": "234 235 236 237",
}  # fmt: skip
CWRU_FAN = {
    "inner007": "279 280 281", "inner014": "275 276 277", "inner021": "271 272 273",
    "ball007": "283 284 285", "ball014": "287 288 289", "ball021": "291 292 293",
    "outer007": "299 300 301", "outer014": "309 311 312", "outer021": "316 317 318",
}  # fmt: skip


class Expected(NamedTuple):
    """Facts of a rig: where its files lie, its recordings in order, and what it states.

    The files are (condition, rpm, recording) by their path in the repository, and the
    orders those of BPFO and BPFI as they are printed.
    """

    fetcher: str
    options: dict
    files: dict
    sampling_rate: float
    first_url: str
    phrases: tuple
    orders: tuple | None = None
    loads: dict | None = None
    converted: str | None = None

    def fetch(self, **options):
        fetch = getattr(datasets, f"fetch_{self.fetcher}")
        return fetch(**(self.options | options))


def expected_cwru(end, numbers, speeds, orders):
    files = {
        f"{number}.mat": (condition, rpm, f"{condition}_{rpm}")
        for condition, row in numbers.items()
        for number, rpm in zip(row.split(), speeds, strict=True)
    }
    loads = {rpm: CWRU_SPEEDS.index(rpm) for rpm in speeds}
    return Expected(
        *("cwru", {"end": end}, files, 12_000, CWRU + next(iter(files))),
        ("states no licence", "Case Western", "12 kHz"),
        orders,
        loads,
        f"cwru_{end}_end",
    )


def expected_hit_sm(rig, folder, phrase, orders):
    conditions = ["Normal", "IR2", "IR5", "IR8", "OR2", "OR5", "OR8"]
    files = {
        f"{folder}/{c}_{r}.mat": (c, r, f"{c}_{r}")
        for c, r in product(conditions, (600, 900, 1200))
    }
    url = HIT_SM + folder.replace(" ", "%20") + "/Normal_600.mat"
    phrases = ("publicly available and can be used by", "subdomain adaptation", phrase)
    return Expected("hit_sm", {"rig": rig}, files, 51_200, url, phrases, orders)


UESTC_FILES = {
    f"Data/{c}_{r}/{c}_{r}_1.mat": (c, r, f"{c}_{r}_1")
    for c, r in product("NBIO", (800, 1000, 1200, 1400))
}
MFPT_FILES = {
    f"{'train' if load < 6 else 'test'}_data/{c.title()}RaceFault_vload_{load}.mat": (
        (c, 1500, f"{c}_load{load}")
    )
    for c, load in product(("inner", "outer"), range(1, 8))
}
RIGS = {
    "uestc": Expected(
        *("uestc", {}, UESTC_FILES, 20_000, UESTC + "Data/N_800/N_800_1.mat"),
        ("open-source and can be used for any", "10.1109/JSEN.2025.3635217", "20 kHz"),
    ),
    "hit_sm": expected_hit_sm(
        *("spectraquest", "SpectraQuest MFS dataset", "SpectraQuest MFS rig"),
        ORDERS_OF_6205,
    ),
    "hit_sm self-built": expected_hit_sm(
        "self-built", "Self-built dataset", "self-built rig", None
    ),
    "cwru drive end": expected_cwru("drive", CWRU_DRIVE, CWRU_SPEEDS, ORDERS_OF_6205),
    "cwru fan end": expected_cwru("fan", CWRU_FAN, CWRU_SPEEDS[1:], (3.0530, 4.9469)),
    "mfpt": Expected(
        *("mfpt", {}, MFPT_FILES, 48_828),
        MFPT + "train_data/InnerRaceFault_vload_1.mat",
        ("CC BY-NC-SA 4.0", "Bechhoefer", "SHA-256"),
        (3.245, 4.755),
        converted="mfpt",
    ),
}
#: A rig with several folders. What all rigs share is tested with it.
UESTC_LAST = list(UESTC_FILES)[-1]


class Handler(SimpleHTTPRequestHandler):
    """Serves a folder, and fails as often as stated for the stated file names."""

    def do_GET(self):
        path = Path(self.translate_path(self.path))
        self.server.requests.append(self.path)
        faults = self.server.faults.get(path.name)
        if not faults:
            return super().do_GET()
        fault = faults.pop()
        if fault == 404:
            return self.send_error(404)
        body = path.read_bytes()
        self.send_response(200)
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        if fault == "truncated":
            self.wfile.write(body[: len(body) // 2])
        else:
            self.wfile.write(body[:-1] + bytes([body[-1] ^ 1]))
        self.close_connection = True

    def log_message(self, *args):
        pass


def content_of(rig, number, path, signal):
    """Variables of an original file: the signal under the name that the rig gives it."""
    column = signal[:, None]
    if rig.fetcher == "mfpt":
        return {"bearing": {"sr": 48828.0, "gs": column, "load": 25.0, "rate": 25.0}}
    if rig.fetcher == "hit_sm":
        return {f"z{number}_1": column, "Start": "x"}
    if rig.fetcher == "uestc":
        return {"Data": column, "SampleFrequency": 20_000, "Start": "x"}
    stem = Path(path).stem
    sensor, other = ("DE", "FE") if rig.options["end"] == "drive" else ("FE", "DE")
    arrays = {f"X{stem}_{sensor}_time": column, f"X{stem}_{other}_time": signal[:9] + 1}
    # One file repeats the arrays of another one, and one lacks its own number.
    if number == 1:
        return {f"X001_{sensor}_time": signal[:50]} | arrays
    if number == 2:
        return {f"X999_{sensor}_time": signal}
    return arrays | {f"X{stem}RPM": 1796.0}


class Originals(NamedTuple):
    root: Path
    checksums: dict
    signals: dict


@pytest.fixture(scope="module")
def originals(tmp_path_factory):
    """Folder with all repositories, of small files; their SHA-256 sums and their signals."""
    made = Originals(tmp_path_factory.mktemp("repositories"), {}, {})
    rng = np.random.default_rng(0)
    for name, rig in RIGS.items():
        for number, file in enumerate(rig.files):
            path = made.root / rig.fetcher / file
            path.parent.mkdir(parents=True, exist_ok=True)
            signal = rng.integers(-99, 99, size=3000)
            if name == "mfpt":
                # The length of the originals is checked.
                signal = np.resize(signal, 146_484).astype(np.int8)
            made.signals[name, file] = signal
            savemat(path, content_of(rig, number, file, signal), do_compression=True)
            sums = made.checksums.setdefault(rig.fetcher, {})
            sums[file] = hashlib.sha256(path.read_bytes()).hexdigest()
    return made


@pytest.fixture
def small_originals(originals, monkeypatch):
    """The originals, which are taken for those of the repositories."""
    for module in (_repository, cwru):
        monkeypatch.setattr(module, "checksums", originals.checksums.get)
    return originals


@pytest.fixture
def waits(monkeypatch):
    """Seconds between two attempts to download, which pass at once."""
    waits = []
    monkeypatch.setattr("time.sleep", waits.append)
    return waits


@pytest.fixture
def server(small_originals, monkeypatch, waits):
    monkeypatch.setenv("no_proxy", "127.0.0.1")
    handler = partial(Handler, directory=small_originals.root)
    with ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        server.requests = []
        server.faults = {}
        server.url = f"http://127.0.0.1:{server.server_port}"
        serve = partial(server.serve_forever, poll_interval=0.01)
        thread = threading.Thread(target=serve)
        thread.start()
        yield server
        server.shutdown()
        thread.join(timeout=10)


@pytest.fixture
def fetch(server, tmp_path):
    """Fetch a rig from the server, to an empty folder."""

    def fetch(name="uestc", **options):
        mirror = f"{server.url}/{RIGS[name].fetcher}/"
        defaults = {"data_home": tmp_path / "home", "mirror": mirror}
        return RIGS[name].fetch(**(defaults | options))

    return fetch


def files_below(folder):
    return sorted(path for path in Path(folder).rglob("*") if path.is_file())


def test_every_fetcher_is_tested_here():
    tested = {f"fetch_{rig.fetcher}" for rig in RIGS.values()}
    assert tested == {name for name in datasets.__all__ if name.startswith("fetch_")}
    assert set(FETCHERS) < set(RIGS)


@pytest.mark.parametrize("name", RIGS)
def test_downloaded_rig(name, fetch, server, originals, tmp_path, capsys):
    expected = RIGS[name]
    rig = fetch(name)
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == len(server.requests) == len(expected.files)
    assert lines[-1].startswith("downloading http://127.0.0.1")
    home = tmp_path / "home" / expected.fetcher
    assert rig.filenames == [str(home / file) for file in expected.files]
    assert rig.sampling_rate == expected.sampling_rate
    assert isinstance(rig.sampling_rate, float)
    assert rig.data.dtype == rig.rpm.dtype == np.float64

    # Every window, cut by hand from the original signals.
    signals = [originals.signals[name, file] for file in expected.files]
    n_windows = len(signals[0]) // 1200
    cut = [signal[: 1200 * n_windows] for signal in signals]
    np.testing.assert_array_equal(rig.data.ravel(), np.concatenate(cut))
    starts = 1200 * np.arange(n_windows)
    np.testing.assert_array_equal(rig.start, np.tile(starts, len(signals)))
    columns = zip(*expected.files.values(), strict=True)
    for column, values in zip(("target", "rpm", "recording"), columns, strict=True):
        np.testing.assert_array_equal(rig[column], np.repeat(values, n_windows))
    conditions = [condition for condition, *_ in expected.files.values()]
    assert rig.target_names == list(dict.fromkeys(conditions))
    np.testing.assert_array_equal(rig.specimen, rig.target)


@pytest.mark.parametrize("name", RIGS)
def test_what_the_authors_state(name, small_originals):
    """Loads, terms, source, and the orders of the bearing as they are printed."""
    expected = RIGS[name]
    before = files_below(small_originals.root)
    rig = expected.fetch(data_home=str(small_originals.root), download_if_missing=False)
    assert files_below(small_originals.root) == before
    if name == "mfpt":
        loads = [recording.split("load")[1] for recording in rig.recording]
        np.testing.assert_array_equal(rig.load, np.array(loads, dtype=float))
    elif expected.loads is None:
        assert np.isnan(rig.load).all()
    else:
        assert dict(zip(rig.rpm, rig.load, strict=True)) == expected.loads
    for phrase in expected.phrases:
        assert phrase in rig.DESCR
    if expected.orders is None:
        assert rig.bearing is None
    else:
        orders = bearing_orders(rig.bearing)
        printed = (orders["outer"], orders["inner"])
        np.testing.assert_allclose(printed, expected.orders, atol=6e-4)


@pytest.mark.parametrize("name", ["uestc", "mfpt"])
@pytest.mark.parametrize("download_if_missing", [True, False])
def test_second_call_needs_no_server(
    name, download_if_missing, fetch, tmp_path, capsys
):
    first = fetch(name)
    capsys.readouterr()
    before = {path: path.stat().st_mtime_ns for path in files_below(tmp_path)}
    nowhere = "http://127.0.0.1:1/"
    again = fetch(name, mirror=nowhere, download_if_missing=download_if_missing)
    np.testing.assert_array_equal(again.data, first.data)
    assert capsys.readouterr() == ("", "")
    assert {path: path.stat().st_mtime_ns for path in files_below(tmp_path)} == before


def test_window_length(small_originals):
    there = {"data_home": small_originals.root, "download_if_missing": False}
    rig = datasets.fetch_uestc(window_length=500, **there)
    assert rig.data.shape == (6 * len(UESTC_FILES), 500)
    np.testing.assert_array_equal(rig.start[:6], 500 * np.arange(6))
    X, y = datasets.fetch_uestc(window_length=500, return_X_y=True, **there)
    np.testing.assert_array_equal(X, rig.data)
    np.testing.assert_array_equal(y, rig.target)
    with pytest.raises(ValueError, match=r"N_800_1.mat.*window_length=300000"):
        datasets.fetch_uestc(window_length=300_000, **there)


def test_nothing_is_downloaded_or_created_unasked(fetch, server, tmp_path):
    with pytest.raises(OSError, match=r"\.mat is missing and download_if_missing is F"):
        fetch(data_home=tmp_path / "no" / "home", download_if_missing=False)
    assert server.requests == []
    assert list(tmp_path.iterdir()) == []


def test_damaged_file_is_named_or_replaced(fetch, server, tmp_path):
    expected = fetch().data
    path = tmp_path / "home" / "uestc" / UESTC_LAST
    path.write_bytes(path.read_bytes()[:-1])
    with pytest.raises(OSError, match=rf"{UESTC_LAST} is not the original"):
        fetch(download_if_missing=False)
    server.requests.clear()
    with pytest.warns(UserWarning, match=rf"{path.name}.*re-downloading"):
        np.testing.assert_array_equal(fetch().data, expected)
    assert len(server.requests) == 1


@pytest.mark.filterwarnings("ignore:Retry downloading")
@pytest.mark.parametrize(
    ("faults", "message"),
    [
        ([404] * 4, "404"),
        (["truncated"] * 4, "retrieval incomplete"),
        (["altered"], "SHA256 checksum"),
    ],
)
def test_failed_download_names_the_file_and_leaves_nothing(
    fetch, server, tmp_path, faults, message
):
    file = Path(UESTC_LAST).name
    server.faults[file] = list(faults)
    refusal = rf"{UESTC_LAST} could not be fetched from http.*{message}"
    with pytest.raises(OSError, match=refusal):
        fetch()
    assert not any(path.name.startswith(file) for path in files_below(tmp_path))
    fetch()
    assert len(files_below(tmp_path)) == len(UESTC_FILES)


def test_a_failed_download_is_repeated_three_times_after_a_second(fetch, server, waits):
    server.faults[Path(UESTC_LAST).name] = [404, "truncated", 404]
    with pytest.warns(UserWarning, match="Retry"):
        fetch()
    assert len(server.requests) == len(UESTC_FILES) + 3
    assert waits == [1.0, 1.0, 1.0]


def test_default_data_home(fetch, tmp_path, monkeypatch):
    monkeypatch.setenv("SCIKIT_LEARN_DATA", str(tmp_path / "elsewhere"))
    rig = fetch(data_home=None)
    assert Path(rig.filenames[0]).is_relative_to(tmp_path / "elsewhere" / "uestc")


@pytest.mark.filterwarnings("ignore:Retry downloading")
@pytest.mark.parametrize("name", RIGS)
def test_default_source_is_a_fixed_commit(name, monkeypatch, tmp_path, waits):
    # Nobody listens there, so that nothing is downloaded.
    monkeypatch.setenv("https_proxy", "http://127.0.0.1:1")
    url = RIGS[name].first_url
    with pytest.raises(OSError, match=f"could not be fetched from {url}: "):
        RIGS[name].fetch(data_home=tmp_path)


@pytest.mark.parametrize("name", ["uestc", "hit_sm", "cwru"])
def test_checksums_are_complete_and_distinct(name):
    sums = _repository.checksums(name)
    rigs = [rig for rig in RIGS.values() if rig.fetcher == name]
    assert list(sums) == [file for rig in rigs for file in rig.files]
    assert len(set(sums.values())) == len(sums)
    assert all(len(value) == 64 and int(value, 16) >= 0 for value in sums.values())


@pytest.mark.parametrize("name", [name for name, rig in RIGS.items() if rig.converted])
def test_converted_files_are_accepted(name, tmp_path):
    expected = RIGS[name]
    folder = tmp_path / expected.converted
    folder.mkdir()
    recordings = [recording for _, _, recording in expected.files.values()]
    for number, recording in enumerate(recordings):
        samples = np.full(1200, number, dtype=np.float32)
        np.savez(folder / f"{recording}.npz", acceleration=samples)
    rig = expected.fetch(data_home=tmp_path, download_if_missing=False)
    assert rig.data.dtype == np.float64
    np.testing.assert_array_equal(rig.recording, recordings)
    np.testing.assert_array_equal(rig.data[:, 0], np.arange(len(recordings)))
    bad = folder / f"{recordings[-1]}.npz"
    np.savez(bad, other=samples)
    with pytest.raises(ValueError, match=rf"{bad.name}: no channel 'acceleration'"):
        expected.fetch(data_home=tmp_path, download_if_missing=False)


def test_length_of_mfpt_recordings_is_checked(tmp_path):
    path = tmp_path / "mfpt" / next(iter(MFPT_FILES))
    path.parent.mkdir(parents=True)
    savemat(path, {"bearing": {"gs": np.arange(3000.0)}})
    message = r"load_1.mat has 3000 samples, but the original has 146484"
    with pytest.raises(OSError, match=message):
        datasets.fetch_mfpt(data_home=tmp_path, download_if_missing=False)


@pytest.mark.parametrize(("name", "option"), [("hit_sm", "rig"), ("cwru", "end")])
def test_unknown_part_of_a_rig(name, option):
    with pytest.raises(ValueError, match=rf"{option} must be one of \[.*, got 'other'"):
        getattr(datasets, f"fetch_{name}")(**{option: "other"})


@pytest.mark.skipif(not REAL, reason="needs the recordings of the real rigs")
@pytest.mark.parametrize("name", RIGS)
def test_real_recordings(name):
    expected = RIGS[name]
    rig = expected.fetch(
        data_home=REAL, download_if_missing=False, window_length=12_000
    )
    recordings = [recording for _, _, recording in expected.files.values()]
    assert list(dict.fromkeys(rig.recording)) == recordings
    assert np.isfinite(rig.data).all()
    assert rig.data.std(axis=1).min() > 0


@pytest.mark.parametrize("name", ["uestc", "hit_sm", "cwru", "mfpt"])
def test_shared_sections_are_documented(name):
    text = getattr(datasets, f"fetch_{name}").__doc__
    assert "{shared}" not in text
    assert "\n    mirror : str, default=None\n        URL of a copy" in text
    assert "\n\n    Returns\n    -------\n    rig : " in text
    assert "\n\n    Raises\n    ------\n    OSError\n" in text
