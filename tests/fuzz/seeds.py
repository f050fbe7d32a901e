"""Small intact files of every kind that can be written here; damage starts from them."""

import importlib.util
import io
from zipfile import ZipFile

import numpy as np
import pandas as pd
import scipy.io
import skops.io
from scipy.io import wavfile

from skarxlag import make_alpio, make_diagnoser, make_extended_state_pio, save_diagnoser
from skarxlag.recordings.formats import FORMATS

SIGNAL = np.sin(0.3 * np.arange(600)) + 0.1 * np.arange(600) % 7


def write_recordings(folder):
    """One file for each format that a library at hand can write.

    Parameters
    ----------
    folder : Path
        Where to write them.

    Returns
    -------
    list of Path
        The files.
    """
    table = pd.DataFrame({"time": np.arange(600) / 1e3, "a": SIGNAL, "b": SIGNAL**2})
    np.save(folder / "plain.npy", SIGNAL)
    np.save(folder / "channels.npy", np.stack([SIGNAL, SIGNAL]).astype(">f4"))
    np.savez(folder / "plain.npz", a=SIGNAL, fs=1000.0)
    np.savez_compressed(folder / "compressed.npz", a=SIGNAL, b=SIGNAL[:50])
    table.to_csv(folder / "table.csv", index=False)
    table.to_csv(folder / "table.csv.gz", index=False)
    table.to_csv(folder / "german.txt", index=False, sep=";", decimal=",")
    table.to_parquet(folder / "table.parquet")
    table.to_feather(folder / "table.feather")
    scipy.io.savemat(
        folder / "plain.mat", {"a": SIGNAL, "fs": 1000.0, "s": {"x": SIGNAL}}
    )
    scipy.io.savemat(folder / "packed.mat", {"a": SIGNAL}, do_compression=True)
    wavfile.write(folder / "float.wav", 8000, SIGNAL.astype(np.float32))
    wavfile.write(folder / "integer.wav", 8000, (1000 * SIGNAL).astype(np.int16))
    if importlib.util.find_spec("soundfile"):
        import soundfile

        soundfile.write(folder / "sound.flac", SIGNAL / 9, 8000)
        soundfile.write(folder / "wide.wav", SIGNAL / 9, 8000, "PCM_24")
    if importlib.util.find_spec("h5py"):
        import h5py

        with h5py.File(folder / "data.h5", "w") as file:
            file.create_dataset("group/a", data=SIGNAL, compression="gzip")
    if importlib.util.find_spec("nptdms"):
        import nptdms

        with nptdms.TdmsWriter(folder / "data.tdms") as file:
            file.write_segment(
                [nptdms.ChannelObject("g", "a", SIGNAL, {"wf_increment": 1e-3})]
            )
    if importlib.util.find_spec("pyuff"):
        import pyuff

        record = pyuff.prepare_58(
            binary=1, func_type=1, id1="a", rsp_node=1, rsp_dir=1, ref_node=1, ref_dir=1,
            data=SIGNAL, x=np.arange(600) / 1e3, num_pts=600, abscissa_spacing=1, abscissa_min=0.0,
            abscissa_inc=1e-3, ord_data_type=4, abscissa_spec_data_type=17,
            ordinate_spec_data_type=12, orddenom_spec_data_type=0, z_axis_spec_data_type=0,
        )  # fmt: skip
        pyuff.UFF(str(folder / "data.uff")).write_sets(record, "add")
    return sorted(folder.iterdir())


def unwritten():
    """Formats of which no file can be written here, for the report."""
    written = {
        ".npy",
        ".npz",
        ".csv",
        ".parquet",
        ".mat",
        ".wav",
        ".flac",
        ".h5",
        ".tdms",
        ".uff",
    }
    return [
        each.FORMAT.title for each in FORMATS if not written & set(each.FORMAT.suffixes)
    ]


def write_models(folder):
    """A small model of each diagnoser.

    Parameters
    ----------
    folder : Path
        Where to write them.

    Returns
    -------
    list of Path
        The files.
    """
    rng = np.random.default_rng(0)
    X, y = rng.normal(size=(12, 80)), np.repeat(["a", "b"], 6)
    for make in (make_alpio, make_diagnoser, make_extended_state_pio):
        diagnoser = make().fit(X, y)
        save_diagnoser(diagnoser, folder / f"{make.__name__}.skops", sampling_rate=1e3)
    return sorted(folder.glob("*.skops"))


def repack(content, change):
    """A model file with changed members and a digest that fits, as an attacker could make it.

    Parameters
    ----------
    content : bytes
        The file.
    change : callable
        Takes the name and the content of a member, gives another content.

    Returns
    -------
    bytes
        The file.
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


def forge(diagnoser):
    """A model file of a diagnoser that `save_diagnoser` might not write, with a digest that fits.

    Parameters
    ----------
    diagnoser : object
        What the file shall hold.

    Returns
    -------
    bytes
        The file.
    """
    content = {"format": "skarxlag diagnoser 1", "diagnoser": diagnoser, "facts": {}}
    return repack(skops.io.dumps(content), lambda _, member: member)
