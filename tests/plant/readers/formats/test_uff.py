"""Universal files as pyuff writes them."""

import numpy as np
import pytest

from skarxlag import list_channels, read_recording

from .reading import truncate

pyuff = pytest.importorskip("pyuff")

# pyuff's writer of binary sets leaves a file open.
pytestmark = pytest.mark.filterwarnings(
    "ignore::ResourceWarning", "ignore::pytest.PytestUnraisableExceptionWarning"
)

Y, U = np.random.default_rng(0).normal(size=(2, 103))


@pytest.fixture
def path(tmp_path):
    return tmp_path / "run.uff"


def write(path, data, *, rate=51_200, **facts):
    record = {"binary": 1, "func_type": 1, "id1": "NONE", "rsp_node": 1, "rsp_dir": 3}
    record |= {"ref_node": 1, "ref_dir": 1, "data": data, "num_pts": len(data)}
    record |= {"x": np.arange(len(data)) / rate, "abscissa_spacing": 1}
    record |= {"abscissa_min": 0.0, "abscissa_inc": 1 / rate, "ord_data_type": 4}
    record |= {"abscissa_spec_data_type": 17, "ordinate_spec_data_type": 12}
    record |= {"ordinate_axis_units_lab": "m/s^2", "orddenom_spec_data_type": 0}
    record |= {"z_axis_spec_data_type": 0} | facts
    pyuff.UFF(str(path)).write_sets(pyuff.prepare_58(**record), "add")


@pytest.mark.parametrize("binary", [0, 1])
@pytest.mark.parametrize("suffix", [".uff", ".UNV"])
def test_samples_rate_and_unit(path, binary, suffix):
    path = path.with_suffix(suffix)
    write(path, Y, binary=binary, id1="drive end")
    write(path, U, binary=binary, id1="free end", rate=48_000)
    write(path, U, binary=binary, id1="spectrum", func_type=2)
    channels = list_channels(path)
    assert channels["channel"].tolist() == ["drive end", "free end"]
    assert channels["sampling_rate"].tolist() == [51_200, 48_000]
    assert channels["unit"].tolist() == ["m/s^2", "m/s^2"]
    signal, rate = read_recording(path, channel="free*")
    # The text has 13 digits.
    np.testing.assert_allclose(signal, U, rtol=1e-11 if binary == 0 else 0)
    assert rate == 48_000


def test_functions_that_repeat_their_description_go_by_position(path):
    write(path, Y, rsp_node=7, rsp_dir=-2)
    write(path, U, rsp_node=12)
    assert list_channels(path)["channel"].tolist() == ["0", "1"]
    np.testing.assert_array_equal(read_recording(path, channel="1")[0], U)


@pytest.mark.parametrize("kept", [0, 100, 1200])
def test_truncated_files(path, kept):
    write(path, Y)
    truncate(path, kept)
    with pytest.raises(ValueError, match=r"run.uff: "):
        read_recording(path)


def test_an_uneven_abscissa_is_refused(path):
    write(path, Y, id1="acc", abscissa_spacing=0)
    write(path, U, id1="force")
    message = "run.uff: the abscissa of acc is not evenly spaced"
    with pytest.raises(ValueError, match=message):
        read_recording(path, channel="acc")
    np.testing.assert_array_equal(read_recording(path, channel="force")[0], U)
