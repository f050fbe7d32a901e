"""Random files and options: no traceback, a known exit status, a verdict for each file."""

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.io import wavfile
from scipy.signal import lfilter

WINDOW = 200
RATE = 5_000
QUICK = settings(
    max_examples=40,
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
FILES = [
    "good.npy",
    "worn.csv",
    "both.npz",
    "sound.wav",
    "=1 ä.npy",
    "dead.npy",
    "nan.npy",
]
FILES += ["short.npy", "text.txt", "lost.mat"]


@pytest.fixture(scope="module")
def plant(tmp_path_factory):
    """Recordings of several formats, some of which are damaged."""
    folder = tmp_path_factory.mktemp("plant")
    good, again, worn = np.random.default_rng(0).normal(size=(3, 12 * WINDOW))
    worn = lfilter([1.0], [1.0, -0.9], worn)
    np.save(folder / "good.npy", good)
    np.save(folder / "=1 ä.npy", again)
    np.savetxt(folder / "worn.csv", worn)
    np.savez(folder / "both.npz", drive=worn, fan=good, fs=RATE, rpm=300)
    wavfile.write(folder / "sound.wav", 2 * RATE, good.astype(np.float32))
    np.save(folder / "dead.npy", np.zeros(12 * WINDOW))
    np.save(
        folder / "nan.npy", np.where(np.arange(12 * WINDOW) < 3 * WINDOW, np.nan, good)
    )
    np.save(folder / "short.npy", good[: WINDOW // 2])
    (folder / "text.txt").write_text("no numbers\nat all\n")
    (folder / "broken.skops").write_bytes(b"PK\x03\x04 and no more")
    lines = f"path,condition,rpm,sampling_rate\ngood.npy,good,300,{RATE}\nworn.csv,worn,300,{RATE}"
    (folder / "table.csv").write_text(lines)
    return folder


@pytest.fixture(scope="module")
def models(plant):
    """A diagnoser with all that belongs to it, a detector, and files that are no models."""
    from skarxlag.plant.commands import main

    paths = []
    for kind in ("diagnoser", "detector"):
        paths.append(plant / f"{kind}.skops")
        fit = ["fit", plant / "table.csv", "-o", paths[-1], "--window-length", WINDOW]
        assert main([str(each) for each in (*fit, "--diagnoser", kind)]) == 0
    return [*paths, plant / "broken.skops", plant / "lost.skops", plant / "good.npy"]


def options(**values):
    """Draw up to three options, each with one of its values or as a flag."""
    each = [
        [f"--{name.replace('_', '-')}", *value]
        for name, own in values.items()
        for value in own
    ]
    some = st.lists(
        st.sampled_from(each), max_size=3, unique_by=lambda option: option[0]
    )
    return some.map(lambda chosen: [part for option in chosen for part in option])


def of(*values):
    return [[str(value)] for value in values]


FLAG = [[]]
FACTS = {
    "channel": of("0", "drive;fan", "*an", "none", ""),
    "sampling_rate": of(RATE, 0, "fast", 1e400),
    "rpm": of(300, 1e-3, 1e9, "nan"),
    "dtype": of("<i2", "complex"),
    "pattern": of(r"(?P<condition>\w+)\.", r"(?P<rpm>\w+)", "(", "none"),
}


def check(code, out, err):
    assert code in (0, 1, 2, 3)
    assert "Traceback" not in out + err
    assert code in (0, 3) or err


def rows_of(out):
    """Return the lines of the table; the remarks behind it are sentences."""
    return [line for line in out.splitlines() if not line.endswith(".")]


@pytest.mark.slow
@QUICK
@given(
    st.data(),
    st.lists(st.sampled_from(FILES), max_size=3),
    options(
        output=of(
            "out.csv", "out.json", "out.parquet", "out.html", "out.x", "good.npy"
        ),
        fail_on=of("alarm"),
        resample=FLAG,
        bearing=of("6205", "x"),
        force=FLAG,
        **FACTS,
    ),
)
def test_diagnose_gives_each_recording_a_verdict(
    run, plant, models, data, files, chosen
):
    model = data.draw(st.sampled_from([*models, None]))
    arguments = [] if model is None else [model]
    arguments += [plant / name for name in files]
    if "--output" in chosen:
        place = chosen.index("--output") + 1
        chosen[place] = plant / chosen[place]
    code, out, err = run("diagnose", *arguments, "-q", "--n-jobs", 1, *chosen)
    check(code, out, err)
    if out:
        is_recording = model is not None and model.suffix != ".skops"
        n_recordings = len(files) + (is_recording and "--bearing" in chosen)
        assert len(rows_of(out)) == 1 + n_recordings
    else:
        assert code in (1, 2)
