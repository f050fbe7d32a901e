import hashlib
import os
import shutil
import threading
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from itertools import product
from pathlib import Path
from types import ModuleType
from typing import NamedTuple

import numpy as np
import pytest
from scipy.io import savemat

from skarxlag import datasets
from skarxlag.bearings import bearing_orders
from skarxlag.datasets import FETCHERS, _repository, cwru, hit_sm, mfpt, uestc

REAL = os.environ.get("SKARXLAG_DATA")


class Expected(NamedTuple):
    """What a rig must be: its recordings in order, where its files lie, and what it states."""

    module: ModuleType
    options: dict
    folder: str
    files: dict  # path in the repository: (condition, rpm, recording)
    sampling_rate: float
    first_url: str
    phrases: tuple
    converted: str | None = None

    @property
    def fetch(self):
        name = self.module.__name__.rpartition(".")[2]
        return partial(getattr(datasets, f"fetch_{name}"), **self.options)


GITHUB = "https://raw.githubusercontent.com/"
HIT_SM = GITHUB + "hitwzc/Bearing-datasets/12e46cd1b4a40f396c2bd6e245be5bafe18b1989/"
ARCS = ["Normal", "IR2", "IR5", "IR8", "OR2", "OR5", "OR8"]
CWRU_SPEEDS = (1797, 1772, 1750, 1730)
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


def cwru_files(numbers, speeds):
    return {
        f"{number}.mat": (condition, rpm, f"{condition}_{rpm}")
        for condition, row in numbers.items()
        for number, rpm in zip(row.split(), speeds, strict=True)
    }


def hit_sm_files(folder):
    return {
        f"{folder}/{c}_{r}.mat": (c, r, f"{c}_{r}")
        for c, r in product(ARCS, (600, 900, 1200))
    }


RIGS = {
    "uestc": Expected(
        uestc,
        {},
        "uestc",
        {
            f"Data/{c}_{r}/{c}_{r}_1.mat": (c, r, f"{c}_{r}_1")
            for c, r in product("NBIO", (800, 1000, 1200, 1400))
        },
        20_000,
        GITHUB + "ChangLiu2024/UESTC-Bearing-Dataset/"
        "782c6ddddcd63e0ef97019dbfeec9887e36bca1e/Data/N_800/N_800_1.mat",
        ("open-source and can be used for any", "10.1109/JSEN.2025.3635217", "20 kHz"),
    ),
    "hit_sm": Expected(
        hit_sm,
        {},
        "hit_sm",
        hit_sm_files("SpectraQuest MFS dataset"),
        51_200,
        HIT_SM + "SpectraQuest%20MFS%20dataset/Normal_600.mat",
        (
            "publicly available and can be used by",
            "subdomain adaptation",
            "SpectraQuest MFS rig",
        ),
    ),
    "hit_sm self-built": Expected(
        hit_sm,
        {"rig": "self-built"},
        "hit_sm",
        hit_sm_files("Self-built dataset"),
        51_200,
        HIT_SM + "Self-built%20dataset/Normal_600.mat",
        (
            "publicly available and can be used by",
            "subdomain adaptation",
            "self-built rig",
        ),
    ),
    "cwru drive end": Expected(
        cwru,
        {},
        "cwru",
        cwru_files(CWRU_DRIVE, CWRU_SPEEDS),
        12_000,
        "https://engineering.case.edu/sites/default/files/105.mat",
        ("states no licence", "Case Western", "12 kHz"),
        "cwru_drive_end",
    ),
    "cwru fan end": Expected(
        cwru,
        {"end": "fan"},
        "cwru",
        cwru_files(CWRU_FAN, CWRU_SPEEDS[1:]),
        12_000,
        "https://engineering.case.edu/sites/default/files/279.mat",
        ("states no licence", "Case Western", "12 kHz"),
        "cwru_fan_end",
    ),
    "mfpt": Expected(
        mfpt,
        {},
        "mfpt",
        {
            f"{'train' if load < 6 else 'test'}_data/{c.title()}RaceFault_vload_{load}.mat": (
                (c, 1500, f"{c}_load{load}")
            )
            for c, load in product(("inner", "outer"), range(1, 8))
        },
        48_828,
        GITHUB + "mathworks/RollingElementBearingFaultDiagnosis-Data/"
        "d3efefb6ce84fa1ee6c0311f80f7c89cf903ad1d/train_data/InnerRaceFault_vload_1.mat",
        ("CC BY-NC-SA 4.0", "Bechhoefer", "SHA-256"),
        "mfpt",
    ),
}
N_SAMPLES = 3000


def test_every_fetcher_is_tested_here():
    tested = {
        f"fetch_{rig.module.__name__.rpartition('.')[2]}" for rig in RIGS.values()
    }
    assert tested == {name for name in datasets.__all__ if name.startswith("fetch_")}
    assert set(FETCHERS) < set(RIGS)


class Handler(SimpleHTTPRequestHandler):
    """Serves a folder, and fails in the stated way for the stated file names."""

    def do_GET(self):
        name = Path(self.translate_path(self.path)).name
        self.server.requests.append(self.path)
        fault = self.server.faults.pop(name, None)
        if fault is None:
            return super().do_GET()
        if fault == 404:
            return self.send_error(404)
        body = Path(self.translate_path(self.path)).read_bytes()
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


def content_of(name, number, signal):
    """Variables of an original file: the signal under the name that the rig gives it."""
    rig, path = RIGS[name], list(RIGS[name].files)[number]
    if rig.module is mfpt:
        return {
            "bearing": {
                "sr": 48828.0,
                "gs": signal[:, None],
                "load": 25.0,
                "rate": 25.0,
            }
        }
    if rig.module is cwru:
        own, sensor = Path(path).stem, "FE" if rig.options else "DE"
        other = {"DE": "FE", "FE": "DE"}[sensor]
        arrays = {
            f"X{own}_{sensor}_time": signal[:, None],
            f"X{own}_{other}_time": signal[:9] + 1,
        }
        # One file repeats the arrays of another one, and one lacks its own number.
        if number == 1:
            return {f"X001_{sensor}_time": signal[:50]} | arrays
        if number == 2:
            return {f"X999_{sensor}_time": signal}
        return arrays | {f"X{own}RPM": 1796.0}
    if rig.module is hit_sm:
        return {f"z{number}_1": signal[:, None], "Start": "x"}
    return {"Data": signal[:, None], "SampleFrequency": 20_000, "Start": "x"}


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
            path = made.root / rig.folder / file
            path.parent.mkdir(parents=True, exist_ok=True)
            signal = made.signals[name, file] = rng.normal(size=N_SAMPLES)
            savemat(path, content_of(name, number, signal), do_compression=number % 2)
            sums = made.checksums.setdefault(rig.folder, {})
            sums[file] = hashlib.sha256(path.read_bytes()).hexdigest()
    return made


@pytest.fixture(params=list(RIGS))
def rig_name(request, originals, monkeypatch):
    module = RIGS[request.param].module
    monkeypatch.setattr(_repository, "N_RETRIES", 0)
    if module is mfpt:
        monkeypatch.setattr(mfpt, "N_SAMPLES", N_SAMPLES)
    for each in (_repository, cwru):
        monkeypatch.setattr(each, "checksums", originals.checksums.get)
    monkeypatch.setenv("no_proxy", "127.0.0.1")
    return request.param


@pytest.fixture
def server(originals):
    def handler(*args):
        return Handler(*args, directory=originals.root)

    with ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        server.requests, server.faults = [], {}
        server.url = f"http://127.0.0.1:{server.server_port}"
        thread = threading.Thread(
            target=server.serve_forever, kwargs={"poll_interval": 0.01}
        )
        thread.start()
        yield server
        server.shutdown()
        thread.join(timeout=10)


@pytest.fixture
def fetch(rig_name, server, tmp_path):
    """The fetcher of a rig, downloading from the server to an empty folder, without patience."""

    def fetch(**options):
        defaults = {
            "data_home": tmp_path / "home",
            "mirror": f"{server.url}/{RIGS[rig_name].folder}",
        }
        return RIGS[rig_name].fetch(**(defaults | options))

    return fetch


def files_below(folder):
    return sorted(path for path in Path(folder).rglob("*") if path.is_file())


def last_file(rig_name):
    return list(RIGS[rig_name].files)[-1]


def test_downloaded_rig(fetch, rig_name, originals, tmp_path, server, capsys):
    rig = fetch()
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == len(RIGS[rig_name].files)
    assert lines[-1].startswith("downloading http://127.0.0.1")
    expected = RIGS[rig_name]
    assert rig.target_names == list(
        dict.fromkeys(c for c, _, _ in expected.files.values())
    )
    assert rig.sampling_rate == expected.sampling_rate
    assert isinstance(rig.sampling_rate, float)
    assert rig.data.dtype == rig.rpm.dtype == np.float64
    home = tmp_path / "home" / expected.folder
    assert rig.filenames == [str(home / file) for file in expected.files]
    assert len(server.requests) == len(expected.files)

    # Every window, cut by hand from the original signals.
    signals = [originals.signals[rig_name, file][:2400] for file in expected.files]
    np.testing.assert_array_equal(rig.data.ravel(), np.concatenate(signals))
    np.testing.assert_array_equal(rig.start, np.tile([0, 1200], len(signals)))
    for column, values in zip(
        ("target", "rpm", "recording"),
        zip(*expected.files.values(), strict=True),
        strict=True,
    ):
        np.testing.assert_array_equal(rig[column], np.repeat(values, 2))
    np.testing.assert_array_equal(rig.specimen, rig.target)


def test_loads_are_those_that_the_authors_state(fetch, rig_name, originals):
    rig = fetch(data_home=originals.root, download_if_missing=False)
    if rig_name == "mfpt":
        assert [f"load{load:g}" for load in rig.load] == [
            n.split("_")[1] for n in rig.recording
        ]
    elif rig_name.startswith("cwru"):
        assert dict(zip(rig.rpm, rig.load, strict=True)) == {
            rpm: load for load, rpm in enumerate(CWRU_SPEEDS) if rpm in rig.rpm
        }
    else:
        assert np.isnan(rig.load).all()


def test_second_call_needs_no_server(fetch, rig_name, tmp_path, capsys):
    first = fetch()
    capsys.readouterr()
    before = {path: path.stat().st_mtime_ns for path in files_below(tmp_path)}
    nowhere = "http://127.0.0.1:1/"
    for options in (
        {"mirror": nowhere},
        {"mirror": nowhere, "download_if_missing": False},
    ):
        again = fetch(**options)
        np.testing.assert_array_equal(again.data, first.data)
    assert capsys.readouterr() == ("", "")
    assert {path: path.stat().st_mtime_ns for path in files_below(tmp_path)} == before


def test_window_length(fetch, rig_name, originals):
    there = {"data_home": originals.root, "download_if_missing": False}
    for window_length in (500, 1000):
        rig = fetch(window_length=window_length, **there)
        assert rig.data.shape[1] == window_length
        first = rig.recording == rig.recording[0]
        np.testing.assert_array_equal(np.diff(rig.start[first]), window_length)
    X, y = fetch(window_length=1000, return_X_y=True, **there)
    np.testing.assert_array_equal(X, rig.data)
    np.testing.assert_array_equal(y, rig.target)
    first = Path(next(iter(RIGS[rig_name].files))).name
    with pytest.raises(ValueError, match=rf"{first}.*window_length=300000"):
        fetch(window_length=300_000, **there)


def test_nothing_is_downloaded_unasked(fetch, rig_name, server, tmp_path):
    with pytest.raises(
        OSError, match=r"\.mat is missing and download_if_missing is False"
    ):
        fetch(download_if_missing=False)
    assert server.requests == []
    assert files_below(tmp_path) == []


def test_damaged_file_is_named_or_replaced(fetch, rig_name, server, tmp_path):
    if rig_name == "mfpt":
        return  # the SHA-256 sums of its files are unknown
    expected = fetch().data
    name = last_file(rig_name)
    path = tmp_path / "home" / RIGS[rig_name].folder / name
    path.write_bytes(path.read_bytes()[:-1])
    with pytest.raises(OSError, match=rf"{name} is not the original"):
        fetch(download_if_missing=False)
    server.requests.clear()
    with pytest.warns(UserWarning, match=rf"{path.name}.*re-downloading"):
        np.testing.assert_array_equal(fetch().data, expected)
    assert len(server.requests) == 1


def test_failed_download_names_the_file_and_leaves_nothing(
    fetch, rig_name, server, tmp_path
):
    faults = {
        404: "404",
        "truncated": "retrieval incomplete",
        "altered": "SHA256 checksum",
    }
    if rig_name == "mfpt":
        del faults["altered"]  # the SHA-256 sums of its files are unknown
    name = last_file(rig_name)
    for fault, message in faults.items():
        server.faults[Path(name).name] = fault
        with pytest.raises(
            OSError, match=rf"{name} could not be fetched from http.*{message}"
        ):
            fetch()
        assert not any(
            path.name.startswith(Path(name).name) for path in files_below(tmp_path)
        )
    fetch()
    assert len(files_below(tmp_path)) == len(RIGS[rig_name].files)


def test_a_data_home_is_not_created_unasked(fetch, tmp_path):
    with pytest.raises(OSError, match="is missing and download_if_missing is False"):
        fetch(data_home=tmp_path / "no" / "home", download_if_missing=False)
    assert not (tmp_path / "no").exists()


def test_a_failed_download_is_repeated_after_a_second(
    fetch, rig_name, server, monkeypatch, originals, tmp_path
):
    folder, name = RIGS[rig_name].folder, last_file(rig_name)
    shutil.copytree(originals.root / folder, tmp_path / "home" / folder)
    waits = []
    monkeypatch.setattr("time.sleep", waits.append)
    monkeypatch.setattr(_repository, "N_RETRIES", 1)
    for fault in (404, "truncated"):
        (tmp_path / "home" / folder / name).unlink()
        server.faults[Path(name).name] = fault
        with pytest.warns(UserWarning, match="Retry"):
            fetch()
    assert len(server.requests) == 4
    assert waits == [1.0, 1.0]


def test_default_data_home(fetch, rig_name, tmp_path, monkeypatch):
    monkeypatch.setenv("SCIKIT_LEARN_DATA", str(tmp_path / "elsewhere"))
    rig = fetch(data_home=None)
    assert Path(rig.filenames[0]).is_relative_to(
        tmp_path / "elsewhere" / RIGS[rig_name].folder
    )


def test_copy_of_the_repository_is_a_data_home(fetch, rig_name, originals, server):
    """The rig states its terms, its source, and the orders of its bearing as they are printed."""
    before = files_below(originals.root)
    rig = fetch(data_home=str(originals.root), download_if_missing=False)
    assert set(rig.recording) == {name for _, _, name in RIGS[rig_name].files.values()}
    assert server.requests == [] and files_below(originals.root) == before
    for phrase in RIGS[rig_name].phrases:
        assert phrase in rig.DESCR
    orders = {
        "hit_sm": (3.5848, 5.4152),
        "cwru drive end": (3.5848, 5.4152),
        "cwru fan end": (3.0530, 4.9469),
        "mfpt": (3.245, 4.755),
    }
    if rig_name in orders:
        found = bearing_orders(rig.bearing)
        np.testing.assert_allclose(
            (found["outer"], found["inner"]), orders[rig_name], atol=6e-4
        )
    else:
        assert rig.bearing is None


def test_default_source_is_a_fixed_commit(fetch, rig_name, monkeypatch, tmp_path):
    urls = []

    def refuse(url, **options):
        urls.append(url)
        raise OSError("no network in this test")

    monkeypatch.setattr("skarxlag.datasets._repository.fetch_file", refuse)
    with pytest.raises(OSError, match="no network in this test"):
        fetch(mirror=None)
    assert urls == [RIGS[rig_name].first_url]


@pytest.mark.parametrize("name", ["uestc", "hit_sm", "cwru"])
def test_checksums_are_complete_and_distinct(name):
    sums = _repository.checksums(name)
    expected = [
        file for rig in RIGS.values() if rig.folder == name for file in rig.files
    ]
    assert list(sums) == expected
    assert len(set(sums.values())) == len(sums)
    assert all(len(value) == 64 and int(value, 16) >= 0 for value in sums.values())


@pytest.mark.parametrize("name", [name for name, rig in RIGS.items() if rig.converted])
def test_converted_files_are_accepted(name, tmp_path):
    expected = RIGS[name]
    (tmp_path / expected.converted).mkdir()
    recordings = [recording for _, _, recording in expected.files.values()]
    for number, recording in enumerate(recordings):
        signal = np.full(2400, number, dtype=np.float32)
        np.savez(
            tmp_path / expected.converted / f"{recording}.npz", acceleration=signal
        )
    rig = expected.fetch(data_home=tmp_path, download_if_missing=False)
    assert rig.data.dtype == np.float64
    np.testing.assert_array_equal(rig.recording, np.repeat(recordings, 2))
    np.testing.assert_array_equal(
        rig.data[:, 0], np.repeat(np.arange(len(recordings)), 2)
    )
    bad = tmp_path / expected.converted / f"{recordings[-1]}.npz"
    np.savez(bad, other=signal)
    with pytest.raises(ValueError, match=rf"{bad.name}: no channel 'acceleration'"):
        expected.fetch(data_home=tmp_path, download_if_missing=False)
    bad.write_bytes(b"no archive")
    with pytest.raises(ValueError, match=rf"{bad.name}: .*damaged"):
        expected.fetch(data_home=tmp_path, download_if_missing=False)


def test_length_of_mfpt_recordings_is_checked(originals):
    with pytest.raises(
        OSError, match=r"load_1.mat has 3000 samples, but the original has 146484"
    ):
        datasets.fetch_mfpt(data_home=originals.root, download_if_missing=False)


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
    assert list(dict.fromkeys(rig.recording)) == [
        each for _, _, each in expected.files.values()
    ]
    assert np.isfinite(rig.data).all()
    assert rig.data.std(axis=1).min() > 0


def test_shared_sections_are_documented():
    for name in ("uestc", "hit_sm", "cwru", "mfpt"):
        text = getattr(datasets, f"fetch_{name}").__doc__
        assert "{shared}" not in text
        assert "\n    mirror : str, default=None\n        URL of a copy" in text
        assert "\n\n    Returns\n    -------\n    rig : " in text
        assert "\n\n    Raises\n    ------\n    OSError\n" in text
