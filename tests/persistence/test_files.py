"""Files are written whole, or not at all, whatever stands in their place."""

import errno
import os
import stat
import threading
from concurrent.futures import ThreadPoolExecutor

import pytest

from skarxlag.persistence.files import write_atomically

needs_posix = pytest.mark.skipif(
    os.name != "posix", reason="links and pipes as on POSIX"
)


def test_a_file_is_made_and_replaced(tmp_path):
    for content in (b"first", b"second, longer", b""):
        write_atomically(str(tmp_path / "a.json"), content)
        assert (tmp_path / "a.json").read_bytes() == content
    assert [path.name for path in tmp_path.iterdir()] == ["a.json"]


def test_threads_that_write_to_one_path_lose_nothing(tmp_path):
    path = tmp_path / "a.json"
    contents = [bytes([i]) * 100_000 for i in range(120)]
    with ThreadPoolExecutor(8) as pool:
        list(pool.map(lambda content: write_atomically(path, content), contents))
    assert path.read_bytes() in contents
    assert os.listdir(tmp_path) == ["a.json"]


def test_what_another_process_left_behind_is_in_nobodys_way(tmp_path):
    (tmp_path / f".a.json.{os.getpid()}.tmp").write_bytes(b"left over")
    write_atomically(tmp_path / "a.json", b"new")
    assert (tmp_path / "a.json").read_bytes() == b"new"


@needs_posix
def test_an_error_names_the_file_and_not_a_temporary_one(tmp_path, monkeypatch):
    """The folder is read-only, which root would not notice."""

    def refuse(path, flags, mode):
        raise PermissionError(errno.EACCES, "Permission denied", path)

    monkeypatch.setattr("skarxlag.persistence.files.os.open", refuse)
    with pytest.raises(PermissionError) as caught:
        write_atomically(tmp_path / "a.json", b"new")
    assert caught.value.filename == str(tmp_path / "a.json")


def test_the_longest_names_can_be_written(tmp_path):
    path = tmp_path / ("a" * 250 + ".json")
    write_atomically(path, b"new")
    assert path.read_bytes() == b"new"


@needs_posix
@pytest.mark.parametrize("target_exists", [True, False])
def test_a_link_stays_a_link(tmp_path, target_exists):
    (tmp_path / "folder").mkdir()
    target, link = tmp_path / "folder" / "target.json", tmp_path / "link.json"
    if target_exists:
        target.write_bytes(b"old")
    link.symlink_to("folder/target.json")
    write_atomically(link, b"new")
    assert link.is_symlink() and target.read_bytes() == b"new"
    assert os.listdir(tmp_path / "folder") == ["target.json"]


@needs_posix
def test_a_pipe_is_written_into(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    received = []
    reader = threading.Thread(
        target=lambda: received.append((tmp_path / "pipe").read_bytes())
    )
    reader.start()
    write_atomically(tmp_path / "pipe", b"new")
    reader.join(10)
    assert received == [b"new"]
    assert stat.S_ISFIFO((tmp_path / "pipe").stat().st_mode)


@needs_posix
def test_a_device_is_written_into():
    write_atomically(os.devnull, b"new")
    assert stat.S_ISCHR(os.stat(os.devnull).st_mode)


@needs_posix
def test_permissions_are_kept_and_new_files_get_the_usual_ones(tmp_path):
    path, usual = tmp_path / "a.json", tmp_path / "usual"
    usual.touch()
    write_atomically(path, b"old")
    assert path.stat().st_mode == usual.stat().st_mode
    path.chmod(0o640)
    write_atomically(path, b"new")
    assert stat.S_IMODE(path.stat().st_mode) == 0o640


@needs_posix
@pytest.mark.parametrize("mode", [0o600, 0o640, 0o666, 0o400])
def test_nobody_may_read_a_file_earlier_than_its_predecessor(
    tmp_path, monkeypatch, mode
):
    """The file under another name has no wider permissions than the one that it replaces."""
    path, seen, before = tmp_path / "a.json", [], os.umask(0o022)

    def copymode(source, target):
        seen.append(stat.S_IMODE(target.stat().st_mode))
        target.chmod(stat.S_IMODE(source.stat().st_mode))

    monkeypatch.setattr("skarxlag.persistence.files.shutil.copymode", copymode)
    try:
        write_atomically(path, b"old")
        path.chmod(mode)
        write_atomically(path, b"new")
    finally:
        os.umask(before)
    assert seen == [mode & ~0o022]
    assert stat.S_IMODE(path.stat().st_mode) == mode and path.read_bytes() == b"new"


def test_a_failure_leaves_the_old_file_and_nothing_else(tmp_path):
    path = tmp_path / "a.json"
    path.write_bytes(b"old")
    with pytest.raises(TypeError):
        write_atomically(path, "a text")
    assert path.read_bytes() == b"old"
    with pytest.raises(OSError):
        write_atomically(tmp_path / "none" / "a.json", b"new")
    with pytest.raises(OSError):
        write_atomically(tmp_path, b"new")
    assert os.listdir(tmp_path) == ["a.json"]


@needs_posix
def test_a_link_that_is_made_meanwhile_leads_nowhere(tmp_path):
    precious = tmp_path / "precious.txt"
    precious.write_bytes(b"old")
    link = tmp_path / "out.csv"
    link.symlink_to(precious)
    write_atomically(link, b"new", follows_links=False)
    assert precious.read_bytes() == b"old"
    assert not link.is_symlink() and link.read_bytes() == b"new"


def test_errors_of_the_system_name_the_file(tmp_path, monkeypatch):
    def full(*paths):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("skarxlag.persistence.files.os.replace", full)
    with pytest.raises(OSError, match=r"No space left on device: .*out\.csv"):
        write_atomically(tmp_path / "out.csv", b"new")
