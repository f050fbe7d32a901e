import hashlib
import os
import shutil
import threading
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from types import ModuleType
from typing import NamedTuple

import numpy as np
import pytest
from scipy.io import loadmat, savemat

from skarxlag.datasets import FETCHERS, hit_sm, uestc


class Expected(NamedTuple):
    """What a rig must be: its conditions, the healthy one first; where its files lie."""

    module: ModuleType
    conditions: list
    speeds: list
    sampling_rate: float
    path: str
    url_of_first_file: str
    phrases_of_its_terms: tuple


RIGS = {
    "uestc": Expected(
        uestc,
        ["N", "B", "I", "O"],
        [800, 1000, 1200, 1400],
        20_000,
        "Data/{c}_{r}/{c}_{r}_1.mat",
        "https://raw.githubusercontent.com/ChangLiu2024/UESTC-Bearing-Dataset/"
        "782c6ddddcd63e0ef97019dbfeec9887e36bca1e/Data/N_800/N_800_1.mat",
        ("open-source and can be used for any", "10.1109/JSEN.2025.3635217", "20 kHz"),
    ),
    "hit_sm": Expected(
        hit_sm,
        ["Normal", "IR2", "IR5", "IR8", "OR2", "OR5", "OR8"],
        [600, 900, 1200],
        51_200,
        "SpectraQuest MFS dataset/{c}_{r}.mat",
        "https://raw.githubusercontent.com/hitwzc/Bearing-datasets/"
        "12e46cd1b4a40f396c2bd6e245be5bafe18b1989/SpectraQuest%20MFS%20dataset/Normal_600.mat",
        ("publicly available and can be used by", "subdomain adaptation", "51.2 kHz"),
    ),
}


def test_every_fetcher_is_tested_here():
    assert list(RIGS) == list(FETCHERS)


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


@pytest.fixture(scope="module")
def originals(tmp_path_factory):
    """Folder with both repositories: the real files where they are at hand, else small ones."""
    root = os.environ.get("SKARXLAG_DATA")
    if root and all((Path(root) / name).is_dir() for name in RIGS):
        return Path(root), None
    root = tmp_path_factory.mktemp("repositories")
    rng = np.random.default_rng(0)
    checksums = {}
    for name, rig in RIGS.items():
        table = {}
        for i, (c, r) in enumerate((c, r) for c in rig.conditions for r in rig.speeds):
            path = root / name / rig.path.format(c=c, r=r)
            path.parent.mkdir(parents=True, exist_ok=True)
            variable = "Data" if name == "uestc" else f"z{i}_1"
            content = {
                variable: rng.normal(size=(3000, 1)),
                "SampleFrequency": 20_000,
                "Start": "x",
            }
            savemat(path, content, do_compression=name == "hit_sm")
            table[path.name] = hashlib.sha256(path.read_bytes()).hexdigest()
        assert list(table) == list(rig.module.CHECKSUMS)
        checksums[name] = table
    return root, checksums


@pytest.fixture(params=list(RIGS))
def rig_name(request, originals, monkeypatch):
    name = request.param
    if originals[1] is not None:
        monkeypatch.setattr(RIGS[name].module, "CHECKSUMS", originals[1][name])
    monkeypatch.setenv("no_proxy", "127.0.0.1")
    return name


@pytest.fixture
def server(originals):
    def handler(*args):
        return Handler(*args, directory=originals[0])

    with ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        server.requests, server.faults = [], {}
        server.url = f"http://127.0.0.1:{server.server_port}"
        thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
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
            "mirror": f"{server.url}/{rig_name}",
            "n_retries": 0,
            "delay": 0,
            "verbose": False,
        }
        return FETCHERS[rig_name](**(defaults | options))

    return fetch


def files_below(folder):
    return sorted(path for path in Path(folder).rglob("*") if path.is_file())


def last_file(rig_name):
    expected = RIGS[rig_name]
    return expected.path.format(c=expected.conditions[-1], r=expected.speeds[-1])


def test_downloaded_rig(fetch, rig_name, originals, tmp_path, server):
    rig = fetch()
    expected = RIGS[rig_name]
    conditions, speeds = expected.conditions, expected.speeds
    root = originals[0] / rig_name
    assert rig.target_names == conditions
    assert rig.sampling_rate == expected.sampling_rate
    assert isinstance(rig.sampling_rate, float)
    assert rig.data.dtype == rig.rpm.dtype == np.float64
    names = [expected.path.format(c=c, r=r) for c in conditions for r in speeds]
    assert rig.filenames == [str(tmp_path / "home" / rig_name / name) for name in names]
    assert len(server.requests) == len(names)

    # Every window, cut by hand from the original files.
    row = 0
    for name, (c, r) in zip(names, ((c, r) for c in conditions for r in speeds), strict=True):
        content = loadmat(root / name)
        (signal,) = (v for v in content.values() if np.size(v) > 1000)
        n = signal.size // 1200
        rows = slice(row, row + n)
        np.testing.assert_array_equal(rig.data[rows].ravel(), signal.ravel()[: n * 1200])
        np.testing.assert_array_equal(rig.start[rows], 1200 * np.arange(n))
        assert set(rig.target[rows]) == {c}
        assert set(rig.rpm[rows]) == {r}
        assert set(rig.recording[rows]) == {Path(name).stem}
        row += n
    assert row == len(rig.data) == len(rig.target) == len(rig.recording)


def test_second_call_needs_no_server(fetch, rig_name, tmp_path):
    first = fetch()
    before = {path: path.stat().st_mtime_ns for path in files_below(tmp_path)}
    nowhere = "http://127.0.0.1:1/"
    for options in ({"mirror": nowhere}, {"mirror": nowhere, "download_if_missing": False}):
        again = fetch(**options)
        np.testing.assert_array_equal(again.data, first.data)
    assert {path: path.stat().st_mtime_ns for path in files_below(tmp_path)} == before


def test_return_X_y(fetch):
    X, y = fetch(return_X_y=True)
    rig = fetch()
    np.testing.assert_array_equal(X, rig.data)
    np.testing.assert_array_equal(y, rig.target)


@pytest.mark.parametrize("window_length", [500, 1000])
def test_window_length(fetch, rig_name, window_length):
    rig = fetch(window_length=window_length)
    assert rig.data.shape[1] == window_length
    first = rig.recording == rig.recording[0]
    np.testing.assert_array_equal(np.diff(rig.start[first]), window_length)


def test_window_longer_than_a_recording(fetch, rig_name):
    expected = RIGS[rig_name]
    first = Path(expected.path.format(c=expected.conditions[0], r=expected.speeds[0])).name
    with pytest.raises(ValueError, match=rf"{first}.*window_length=300000"):
        fetch(window_length=300_000)


def test_nothing_is_downloaded_unasked(fetch, rig_name, server, tmp_path):
    with pytest.raises(OSError, match=r"\.mat is missing and download_if_missing is False"):
        fetch(download_if_missing=False)
    assert server.requests == []
    assert files_below(tmp_path) == []


def test_damaged_file_is_named_or_replaced(fetch, rig_name, server, tmp_path):
    expected = fetch().data
    name = last_file(rig_name)
    path = tmp_path / "home" / rig_name / name
    path.write_bytes(path.read_bytes()[:1000])
    with pytest.raises(OSError, match=rf"{name} is not the original"):
        fetch(download_if_missing=False)
    server.requests.clear()
    with pytest.warns(UserWarning, match=rf"{path.name}.*re-downloading"):
        np.testing.assert_array_equal(fetch().data, expected)
    assert len(server.requests) == 1


@pytest.mark.parametrize(
    ("fault", "message"),
    [(404, "404"), ("truncated", "retrieval incomplete"), ("altered", "SHA256 checksum")],
)
def test_failed_download_names_the_file_and_leaves_nothing(
    fetch, rig_name, server, tmp_path, fault, message
):
    name = last_file(rig_name)
    server.faults[Path(name).name] = fault
    with pytest.raises(OSError, match=rf"{name} could not be fetched from http.*{message}"):
        fetch()
    assert not any(path.name.startswith(Path(name).name) for path in files_below(tmp_path))
    fetch()
    assert len(files_below(tmp_path)) == len(RIGS[rig_name].module.CHECKSUMS)


def test_a_data_home_that_gets_no_file_is_not_created(fetch, rig_name, server, tmp_path):
    home = tmp_path / "no" / "such" / "home"
    with pytest.raises(OSError, match="is missing and download_if_missing is False"):
        fetch(data_home=home, download_if_missing=False)
    server.faults |= {Path(name).name: 404 for name in RIGS[rig_name].module.CHECKSUMS}
    with pytest.raises(OSError, match="could not be fetched"):
        fetch(data_home=home)
    assert not (tmp_path / "no").exists()


@pytest.mark.parametrize("fault", [404, "truncated"])
def test_retries(fetch, rig_name, server, fault):
    name = Path(last_file(rig_name)).name
    server.faults[name] = fault
    with pytest.warns(UserWarning, match="Retry"):
        fetch(n_retries=1)
    assert sum(request.endswith(name) for request in server.requests) == 2


def test_delay_is_the_time_between_tries(fetch, rig_name, server, monkeypatch):
    waits = []
    monkeypatch.setattr("time.sleep", waits.append)
    server.faults[Path(last_file(rig_name)).name] = 404
    with pytest.warns(UserWarning, match="Retry"):
        fetch(n_retries=1, delay=7.5)
    assert waits == [7.5]


def test_verbose_writes_a_line_for_every_download(fetch, rig_name, capsys):
    n_files = len(RIGS[rig_name].module.CHECKSUMS)
    fetch(verbose=True)
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == n_files
    assert lines[-1].startswith(f"[{n_files}/{n_files}] downloading http://127.0.0.1")
    fetch(verbose=True)
    assert capsys.readouterr().err == ""


def test_silent_when_not_verbose(fetch, capsys):
    fetch()
    captured = capsys.readouterr()
    assert captured.out == captured.err == ""


def test_default_data_home(fetch, rig_name, tmp_path, monkeypatch):
    monkeypatch.setenv("SCIKIT_LEARN_DATA", str(tmp_path / "elsewhere"))
    rig = fetch(data_home=None)
    assert Path(rig.filenames[0]).is_relative_to(tmp_path / "elsewhere" / rig_name)


def test_copy_of_the_repository_is_a_data_home(fetch, rig_name, originals, server, tmp_path):
    shutil.copytree(originals[0] / rig_name, tmp_path / "copy" / rig_name)
    rig = fetch(data_home=str(tmp_path / "copy"), download_if_missing=False)
    assert set(rig.target) == set(RIGS[rig_name].conditions)
    assert server.requests == []


def test_default_source_is_a_fixed_commit(fetch, rig_name, monkeypatch, tmp_path):
    urls = []

    def refuse(url, **options):
        urls.append(url)
        raise OSError("no network in this test")

    monkeypatch.setattr("skarxlag.datasets._repository.fetch_file", refuse)
    with pytest.raises(OSError, match="no network in this test"):
        fetch(mirror=None)
    assert urls == [RIGS[rig_name].url_of_first_file]


def test_description_states_terms_and_source(fetch, rig_name):
    text = fetch().DESCR
    for phrase in RIGS[rig_name].phrases_of_its_terms:
        assert phrase in text


@pytest.mark.parametrize("rig", RIGS.values(), ids=RIGS)
def test_checksums_are_complete_and_distinct(rig):
    sums = list(rig.module.CHECKSUMS.values())
    assert len(set(sums)) == len(sums)
    assert all(len(value) == 64 and int(value, 16) >= 0 for value in sums)
