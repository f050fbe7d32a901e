"""Damaged files of each format are read, or refused by an error that names them."""

import h5py
import nptdms
import numpy as np
import pandas as pd
import pytest
import pyuff
import soundfile
from hypothesis import given
from hypothesis import strategies as st
from scipy.io import savemat, wavfile

from skarxlag import read_recording
from tests.damage import damaged, some_examples

SIGNAL = np.sin(0.3 * np.arange(600)) + 0.1 * np.arange(600) % 7
TABLE = pd.DataFrame({"time": np.arange(600) / 1e3, "a": SIGNAL})


def write_hdf5(path):
    with h5py.File(path, "w") as file:
        file.create_dataset("group/a", data=SIGNAL, compression="gzip")


def write_tdms(path):
    channel = nptdms.ChannelObject("g", "a", SIGNAL, {"wf_increment": 1e-3})
    with nptdms.TdmsWriter(path) as file:
        file.write_segment([channel])


def write_uff(path):
    record = pyuff.prepare_58(
        binary=1, func_type=1, id1="a", rsp_node=1, rsp_dir=1, ref_node=1, ref_dir=1,
        data=SIGNAL, x=np.arange(600) / 1e3, num_pts=600, abscissa_spacing=1, abscissa_min=0.0,
        abscissa_inc=1e-3, ord_data_type=4, abscissa_spec_data_type=17,
        ordinate_spec_data_type=12, orddenom_spec_data_type=0, z_axis_spec_data_type=0,
    )  # fmt: skip
    pyuff.UFF(str(path)).write_sets(record, "add")


WRITERS = {
    "npy": lambda path: np.save(path, SIGNAL),
    "npz": lambda path: np.savez_compressed(path, a=SIGNAL, fs=1000.0),
    "csv": lambda path: TABLE.to_csv(path, index=False),
    "csv.gz": lambda path: TABLE.to_csv(path, index=False),
    "txt": lambda path: TABLE.to_csv(path, index=False, sep=";", decimal=","),
    "parquet": TABLE.to_parquet,
    "feather": TABLE.to_feather,
    "mat": lambda path: savemat(path, {"a": SIGNAL, "s": {"x": SIGNAL}}),
    "wav": lambda path: wavfile.write(path, 8000, SIGNAL.astype(np.float32)),
    "flac": lambda path: soundfile.write(path, SIGNAL / 9, 8000),
    "h5": write_hdf5,
    "tdms": write_tdms,
    "uff": write_uff,
}


# The writer of universal files leaves them open.
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.filterwarnings("ignore::ResourceWarning")
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize("suffix", WRITERS)
@some_examples
@given(data=st.data())
def test_a_damaged_file_is_read_or_refused_by_name(tmp_path, suffix, data):
    intact = tmp_path / f"intact.{suffix}"
    if not intact.exists():
        WRITERS[suffix](intact)
        assert read_recording(intact, channel=0)[0].shape == (600,)
    path = tmp_path / f"damaged.{suffix}"
    path.write_bytes(data.draw(damaged(intact.read_bytes())))
    try:
        signal, _ = read_recording(path, channel=0)
    except (ValueError, OSError) as error:
        assert path.name in str(error)
    else:
        assert signal.ndim in (1, 2) and signal.dtype == np.float64
