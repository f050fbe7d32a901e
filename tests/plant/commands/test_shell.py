"""Random files and options: no traceback, a known exit status, a verdict for each file."""

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.io import wavfile
from scipy.signal import lfilter

from skarxlag.plant.commands import main

WINDOW = 200
RATE = 5_000
QUICK = settings(
    max_examples=30,
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
FILES = ["good.npy", "worn.csv", "both.npz", "sound.wav", "=1 ä.npy", "dead.npy"]
FILES += ["nan.npy", "short.npy", "text.txt", "lost.mat"]
MODELS = ["model.skops", "broken.skops", "lost.skops", "good.npy", None]


@pytest.fixture(scope="module")
def plant(tmp_path_factory):
    """Recordings of several formats, some of which are damaged, and models."""
    folder = tmp_path_factory.mktemp("plant")
    good, again, worn = np.random.default_rng(0).normal(size=(3, 12 * WINDOW))
    worn = lfilter([1.0], [1.0, -0.9], worn)
    np.save(folder / "good.npy", good)
    np.save(folder / "=1 ä.npy", again)
    np.savetxt(folder / "worn.csv", worn)
    np.savez(folder / "both.npz", drive=worn, fan=good, fs=RATE, rpm=300)
    wavfile.write(folder / "sound.wav", 2 * RATE, good.astype(np.float32))
    np.save(folder / "dead.npy", 0 * good)
    np.save(folder / "nan.npy", np.append(good, np.nan))
    np.save(folder / "short.npy", good[: WINDOW // 2])
    (folder / "text.txt").write_text("no numbers\nat all\n")
    (folder / "broken.skops").write_bytes(b"PK\x03\x04 and no more")
    lines = f"path,condition,rpm,sampling_rate\ngood.npy,good,300,{RATE}\nworn.csv,worn,300,{RATE}"
    (folder / "table.csv").write_text(lines)
    fit = ("fit", folder / "table.csv", "-o", folder / "model.skops")
    assert main([*map(str, fit), "--window-length", str(WINDOW)]) == 0
    return folder


#: Options and their values; None is a flag.
OPTIONS = {
    "--output": ("out.csv", "out.json", "out.parquet", "out.html", "out.x", "good.npy"),
    "--fail-on": ("alarm",),
    "--resample": (None,),
    "--force": (None,),
    "--bearing": ("6205", "x"),
    "--channel": ("0", "drive;fan", "*an", "none", ""),
    "--sampling-rate": (RATE, 0, "fast", 1e400),
    "--rpm": (300, 1e-3, 1e9, "nan"),
    "--dtype": ("<i2", "complex"),
    "--pattern": (r"(?P<condition>\w+)\.", r"(?P<rpm>\w+)", "(", "none"),
}


@pytest.mark.slow
@QUICK
@given(
    st.sampled_from(MODELS),
    st.lists(st.sampled_from(FILES), max_size=3),
    st.lists(st.sampled_from([*OPTIONS]), max_size=3, unique=True),
    st.data(),
)
def test_diagnose_gives_each_recording_a_verdict(
    run, plant, monkeypatch, model, files, names, data
):
    monkeypatch.chdir(plant)
    arguments = [name for name in (model, *files) if name is not None]
    for name in names:
        value = data.draw(st.sampled_from(OPTIONS[name]))
        arguments += [name] if value is None else [name, value]
    command = ("diagnose", *arguments, "-q", "--n-jobs", 1)
    code, out, err = run(*command, force=False)
    assert code in (0, 1, 2, 3)
    assert "Traceback" not in out + err
    assert code in (0, 3) or err
    if out:
        # The lines behind the table are sentences.
        rows = [line for line in out.splitlines() if not line.endswith(".")]
        is_recording = model == "good.npy" and "--bearing" in names
        assert len(rows) == 1 + len(files) + is_recording
    else:
        assert code in (1, 2)
