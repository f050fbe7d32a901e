"""Several accelerometers in one model, from the shell."""

import json

import numpy as np
import pytest
from scipy.signal import lfilter

RATE, WINDOW = 10_000, 1200


@pytest.fixture(scope="module")
def workshop(tmp_path_factory):
    """Recordings of two accelerometers and a torque, at two speeds, and their table."""
    folder, lines = (
        tmp_path_factory.mktemp("two"),
        ["path,condition,rpm,sampling_rate,channel"],
    )
    for rpm in (600, 900):
        for number, (condition, pole) in enumerate({"good": 0.2, "worn": 0.8}.items()):
            noise = np.random.default_rng([number, rpm]).normal(size=(3, 20 * WINDOW))
            x, y = (lfilter([1], [1, -pole], each) for each in noise[:2])
            # The second sensor of the worn machine hears nothing at the other speed.
            y = (
                lfilter([1], [1, -0.2], noise[1])
                if (rpm, condition) == (900, "worn")
                else y
            )
            np.savez(folder / f"{condition}_{rpm}.npz", x=x, y=y, torque=noise[2])
            lines.append(f"{condition}_{rpm}.npz,{condition},{rpm},{RATE},x;y;torque")
    (folder / "table.csv").write_text("\n".join(lines))
    return folder


@pytest.fixture
def model(run, workshop):
    path = workshop / "two.skops"
    options = ("--window-length", WINDOW, "--outputs", 2)
    lines = (workshop / "table.csv").read_text().splitlines()
    (workshop / "600.csv").write_text("\n".join(lines[:3]))
    code, out, err = run("fit", workshop / "600.csv", "-o", path, *options)
    assert code == 0, err
    assert "Outputs: x, y. Inputs: torque\n" in out and "for the first output" in out
    return path


def test_one_verdict_and_that_of_each_output(run, workshop, model):
    file, results = workshop / "worn_900.npz", workshop / "two.json"
    facts = ("--channel", "x;y;torque", "--sampling-rate", RATE, "--rpm", 900)
    code, out, err = run("diagnose", model, file, *facts, "-o", results)
    assert code == 0, err
    (found,) = json.loads(results.read_text())["recordings"]
    assert (found["verdict_of_x"], found["verdict_of_y"]) == ("worn", "good")
    assert found["window_rows"][0]["verdict_of_x"] == "worn"
    assert found["verdict"] in ("good", "worn", "unknown condition", "changed")
    code, out, err = run("diagnose", model, workshop / "worn_600.npz", *facts[:-1], 600)
    assert code == 0 and " worn " in out
    code, out, err = run("diagnose", model, file, "--channel", "y;x;torque", *facts[2:])
    assert code == 1 and "in this order" in err
    code, out, _ = run("info", model)
    assert "SensorFusion" in out
    assert "20 healthy windows are too few to hold the rate 0.005" in " ".join(
        out.split()
    )
