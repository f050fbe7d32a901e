"""Small intact files of every kind that can be written here; damage starts from them."""

import importlib.util
import io
from zipfile import ZipFile

import numpy as np
import pandas as pd
import scipy.io
from scipy.io import wavfile

from skarxlag import make_alpio, make_diagnoser, make_extended_state_pio, save_diagnoser

SIGNAL = np.sin(0.3 * np.arange(600)) + 0.1 * np.arange(600) % 7


def write_recordings(folder):
    """Write a file of each format that a library at hand can write, and return the paths."""
    table = pd.DataFrame({"time": np.arange(600) / 1e3, "a": SIGNAL, "b": SIGNAL**2})
    matlab = {"a": SIGNAL, "fs": 1000.0, "s": {"x": SIGNAL}}
    np.save(folder / "plain.npy", SIGNAL)
    np.save(folder / "channels.npy", np.stack([SIGNAL, SIGNAL]).astype(">f4"))
    np.savez(folder / "plain.npz", a=SIGNAL, fs=1000.0)
    np.savez_compressed(folder / "compressed.npz", a=SIGNAL, b=SIGNAL[:50])
    table.to_csv(folder / "table.csv", index=False)
    table.to_csv(folder / "table.csv.gz", index=False)
    table.to_csv(folder / "german.txt", index=False, sep=";", decimal=",")
    table.to_parquet(folder / "table.parquet")
    table.to_feather(folder / "table.feather")
    scipy.io.savemat(folder / "plain.mat", matlab)
    scipy.io.savemat(folder / "packed.mat", {"a": SIGNAL}, do_compression=True)
    wavfile.write(folder / "float.wav", 8000, SIGNAL.astype(np.float32))
    wavfile.write(folder / "integer.wav", 8000, (1000 * SIGNAL).astype(np.int16))
    for library, write in WRITERS.items():
        if importlib.util.find_spec(library):
            write(folder)
    return sorted(folder.iterdir())


def _write_sound(folder):
    import soundfile

    soundfile.write(folder / "sound.flac", SIGNAL / 9, 8000)
    soundfile.write(folder / "wide.wav", SIGNAL / 9, 8000, "PCM_24")


def _write_hdf5(folder):
    import h5py

    with h5py.File(folder / "data.h5", "w") as file:
        file.create_dataset("group/a", data=SIGNAL, compression="gzip")


def _write_tdms(folder):
    import nptdms

    channel = nptdms.ChannelObject("g", "a", SIGNAL, {"wf_increment": 1e-3})
    with nptdms.TdmsWriter(folder / "data.tdms") as file:
        file.write_segment([channel])


def _write_uff(folder):
    import pyuff

    record = pyuff.prepare_58(
        binary=1, func_type=1, id1="a", rsp_node=1, rsp_dir=1, ref_node=1, ref_dir=1,
        data=SIGNAL, x=np.arange(600) / 1e3, num_pts=600, abscissa_spacing=1, abscissa_min=0.0,
        abscissa_inc=1e-3, ord_data_type=4, abscissa_spec_data_type=17,
        ordinate_spec_data_type=12, orddenom_spec_data_type=0, z_axis_spec_data_type=0,
    )  # fmt: skip
    pyuff.UFF(str(folder / "data.uff")).write_sets(record, "add")


#: Writers by the library that they need.
WRITERS = {
    "soundfile": _write_sound,
    "h5py": _write_hdf5,
    "nptdms": _write_tdms,
    "pyuff": _write_uff,
}


def write_models(folder):
    """Write a small model of each diagnoser, and return the paths."""
    X = np.random.default_rng(0).normal(size=(12, 80))
    y = np.repeat(["good", "worn"], 6)
    for make in (make_alpio, make_diagnoser, make_extended_state_pio):
        path = folder / f"{make.__name__}.skops"
        save_diagnoser(make().fit(X, y), path, sampling_rate=1e3)
    return sorted(folder.glob("*.skops"))


def repack(content, change):
    """Return a model file with changed members and a digest that fits, as of an attacker.

    `change` takes the name and the content of a member, and returns another content.
    """
    from skarxlag.core.files import read_members
    from skarxlag.persistence.archives import digest

    members, _ = read_members(content)
    members = {name: change(name, member) for name, member in members.items()}
    stream = io.BytesIO()
    with ZipFile(stream, "w") as file:
        for name, member in members.items():
            file.writestr(name, member)
        file.comment = digest(members)
    return stream.getvalue()
