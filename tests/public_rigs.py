"""Data sets in the schema of bearing-datasets, made by the writer of that package."""

import json
import os

import numpy as np
import pandas as pd


def write_dataset(root, name, signals):
    """Write a data set.

    Parameters
    ----------
    root : Path
        Folder of the data sets.
    name : str
        Name of the data set.
    signals : iterable of (dict, ndarray)
        Metadata and samples of each signal. The metadata need "recording_id",
        "channel", "fs", "fault_type" and "speed_rpm".
    """
    import pyarrow as pa
    import pyarrow.parquet as pq
    from bearing_datasets.build import SignalWriter
    from bearing_datasets.schema import SCHEMA_VERSION

    folder = root / name
    folder.mkdir(parents=True)
    writer = SignalWriter(folder / "signals")
    rows = []
    for facts, samples in signals:
        signal = f"{facts['recording_id']}/{facts['channel']}"
        writer.add(signal, samples)
        rows.append({"dataset": name, "signal_id": signal, **facts})
    writer.close()
    places = ["signal_file", "signal_row_group", "signal_row"]
    located = pd.DataFrame.from_dict(writer.locations, orient="index", columns=places)
    table = pd.DataFrame(rows).join(located, on="signal_id")
    pq.write_table(pa.Table.from_pandas(table), folder / "metadata.parquet")
    manifest = {
        "dataset": name,
        "title": name.title(),
        "citation": "Nobody 2026",
        "license": "CC0",
        "schema_version": SCHEMA_VERSION,
    }
    (folder / "manifest.json").write_text(json.dumps(manifest))


def write_real_rigs(root):
    """Write the recordings of the folder SKARXLAG_DATA that the examples load."""
    from benchmarks.recordings import fetch_hit_sm, fetch_mfpt, fetch_uestc

    home = os.environ["SKARXLAG_DATA"]
    faults = {"N": "normal", "I": "inner", "O": "outer", "B": "rolling_element"}
    arcs = {"2": "slight", "5": "moderate", "8": "severe"}

    def of_rig(rig, further):
        for row, recording in enumerate(rig.recording):
            label = str(rig.target[row])
            facts = {
                "recording_id": str(recording),
                "channel": "vibration",
                "fs": rig.sampling_rate,
                "fault_type": faults[label[0].upper()],
                "speed_rpm": float(rig.rpm[row]),
                **further(label, rig.load[row]),
            }
            yield facts, np.asarray(rig.data[row], dtype=np.float32)

    rig = fetch_uestc(data_home=home, window_length=262_144)
    write_dataset(root, "uestc", of_rig(rig, lambda label, load: {}))
    rig = fetch_hit_sm(data_home=home, window_length=262_144)
    size = {"rig": "spectraquest"}
    signals = of_rig(
        rig, lambda label, load: size | {"fault_severity": arcs.get(label[-1], "none")}
    )
    write_dataset(root, "hit_sm", signals)
    rig = fetch_mfpt(data_home=home, window_length=146_484)
    write_dataset(root, "mfpt", of_rig(rig, lambda label, load: {"load": load}))
