"""Random tables, files and options: no traceback, a known exit status, a verdict for each file."""

import itertools

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
COUNTER = itertools.count()


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


#: Cells of each column; the last ones are wrong.
CELLS = {
    "condition": ["good", "worn", "a b", "no signal", ""],
    "RPM": ["300", "600", "1,5", "-3", ""],
    "sampling rate": [str(RATE), "1e4", "0", ""],
    "channel": ["0", "", "drive;fan", "fan"],
    "hall": ["x", "=cmd()", ""],
    "conditon": ["good"],
}


@st.composite
def tables(draw):
    """Draw the text of a table, half of them without a mistake."""
    if draw(st.booleans()):
        columns = [
            "condition",
            "sampling rate",
            *draw(st.sets(st.sampled_from(["RPM", "hall"]))),
        ]
        names, n_cells = ["good.npy", "worn.csv", "=1 ä.npy"], 1
    else:
        columns = draw(st.lists(st.sampled_from(list(CELLS)), unique=True))
        names, n_cells = draw(st.lists(st.sampled_from(FILES), max_size=4)), None
    lines = [["path", *columns]]
    for number, name in enumerate(names):
        cells = {each: st.sampled_from(CELLS[each][:n_cells]) for each in columns}
        cells |= {"condition": st.just("gw"[number % 2])} if n_cells else {}
        lines.append([name, *(draw(cells[each]) for each in columns)])
    separator = draw(st.sampled_from([",", ";"]))
    quoted = [
        [f'"{cell}"' if separator in cell else cell for cell in line] for line in lines
    ]
    return "\n".join(map(separator.join, quoted))


def check(code, out, err):
    assert code in (0, 1, 2, 3)
    assert "Traceback" not in out + err
    assert code in (0, 3) or err


@pytest.mark.slow
@QUICK
@given(
    tables(),
    options(
        diagnoser=of("diagnoser", "stretches", "detector"),
        healthy=of("good", "none", "x"),
        false_alarm_rate=of(0.2, 1),
        bearing=of("6205", "outer=3.5,inner=5.4", "x"),
        fixed_gain=FLAG,
        no_p_values=FLAG,
        window_length=of(WINDOW, 100, 5),
        resample_to=of(4_000, -1),
        rpm=of(300),
    ),
)
def test_fit_and_info_of_any_table(run, plant, text, chosen):
    table, model = plant / f"t{next(COUNTER)}.csv", plant / "any.skops"
    table.write_text(text)
    model.unlink(missing_ok=True)
    plain = ("--window-length", WINDOW, "--healthy", "g")
    code, out, err = run(
        "fit", table, "-o", model, "-q", "--n-jobs", 1, *plain, *chosen
    )
    check(code, out, err)
    assert model.exists() == (code == 0) == (f"to {model}" in out)
    if code == 0:
        code, out, err = run("info", model)
        assert code == 0 and "Limits" in out
        code, out, err = run("diagnose", model, plant / "good.npy", "-q", "--n-jobs", 1)
        check(code, out, err)
        assert len(rows_of(out)) == 2


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
    st.none() | tables(),
)
def test_diagnose_gives_each_recording_a_verdict(
    run, plant, models, data, files, chosen, text
):
    model = data.draw(st.sampled_from([*models, None]))
    arguments = [] if model is None else [model]
    arguments += [plant / name for name in files]
    if "--output" in chosen:
        place = chosen.index("--output") + 1
        chosen[place] = plant / chosen[place]
    if text is not None:
        table = plant / f"t{next(COUNTER)}.csv"
        table.write_text(text)
        chosen = [*chosen, "--table", table]
    code, out, err = run("diagnose", *arguments, "-q", "--n-jobs", 1, *chosen)
    check(code, out, err)
    if out:
        n_listed = 0 if text is None else len(text.splitlines()) - 1
        is_recording = model is not None and model.suffix != ".skops"
        n_recordings = len(files) + n_listed + (is_recording and "--bearing" in chosen)
        assert len(rows_of(out)) == 1 + n_recordings
    else:
        assert code in (1, 2)
