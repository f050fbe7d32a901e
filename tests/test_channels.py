import numpy as np
import pytest
from sklearn.calibration import CalibratedClassifierCV
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

from skarxlag import ChannelRows, DiagnosisPipeline, load_diagnoser, make_alpio, save_diagnoser
from skarxlag.commands.messages import CommandError
from skarxlag.commands.models import SavedModel

X = np.random.default_rng(0).normal(size=(20, 3, 50))
Y = np.repeat(["good", "worn"], 10)


def test_channels_follow_one_another_in_a_row():
    row = np.arange(6.0)[np.newaxis]
    windows = ChannelRows(n_channels=2).fit_transform(row)
    np.testing.assert_array_equal(windows, [[[0, 1, 2], [3, 4, 5]]])
    names = ChannelRows(n_channels=2).fit(row).get_feature_names_out()
    assert names.tolist() == ["channel0", "channel1"]


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_there_and_back_again(dtype):
    windows = X.astype(dtype)
    channels = ChannelRows(n_channels=3).fit(windows.reshape(20, -1))
    rows = channels.inverse_transform(windows)
    np.testing.assert_array_equal(rows, windows.reshape(20, -1))
    np.testing.assert_array_equal(channels.transform(rows), windows)
    assert rows.dtype == channels.transform(rows).dtype == dtype


def test_columns_that_cannot_be_divided_are_refused():
    with pytest.raises(ValueError, match="150 columns, expected a multiple of n_channels"):
        ChannelRows(n_channels=4).fit(X.reshape(20, -1))
    with pytest.raises(ValueError, match="n_channels == 0, must be >= 1"):
        ChannelRows(n_channels=0).fit(X.reshape(20, -1))


def test_windows_of_another_shape_are_not_made_rows():
    channels = ChannelRows(n_channels=3).fit(X.reshape(20, -1))
    with pytest.raises(ValueError, match=r"windows of shape \(3, 49\), expected \(3, 50\)"):
        channels.inverse_transform(X[..., 1:])


def test_what_was_learnt_must_fit_together():
    channels = ChannelRows(n_channels=3).fit(X.reshape(20, -1))
    channels.n_features_in_ = 151
    with pytest.raises(ValueError, match="n_features_in_ == 151 columns, expected"):
        channels.transform(X.reshape(20, -1))


def saved_as(diagnoser, path):
    save_diagnoser(diagnoser, path)
    return SavedModel(path)


def test_a_saved_diagnoser_of_rows_works_on_rows_and_without_its_first_step_in_commands(tmp_path):
    steps = [("channels", ChannelRows(n_channels=3)), *make_alpio().steps]
    diagnoser = DiagnosisPipeline(steps).fit(X.reshape(20, -1), Y)
    save_diagnoser(diagnoser, tmp_path / "d.skops")
    loaded, _ = load_diagnoser(tmp_path / "d.skops")
    expected = diagnoser.predict_proba(X.reshape(20, -1))
    np.testing.assert_array_equal(loaded.predict_proba(X.reshape(20, -1)), expected)
    model = saved_as(diagnoser[1:], tmp_path / "d.skops")
    assert (model.n_channels, model.window_length) == (3, 50)
    np.testing.assert_array_equal(model.diagnoser.predict_proba(X), expected)


def test_rows_of_one_channel_are_windows(tmp_path):
    steps = [("channels", ChannelRows(n_channels=1)), *make_alpio().steps]
    model = saved_as(DiagnosisPipeline(steps).fit(X[:, 0], Y), tmp_path / "d.skops")
    assert (model.n_channels, model.window_length) == (1, 50)
    assert model.diagnoser.predict_proba(X[:, 0]).shape == (20, 2)


@pytest.mark.parametrize(
    "wrap",
    [
        lambda inner: inner,
        lambda inner: make_pipeline(StandardScaler(), inner),
        lambda inner: CalibratedClassifierCV(inner, cv=2),
    ],
)
def test_rows_of_several_channels_are_refused_by_commands(tmp_path, wrap):
    inner = DiagnosisPipeline([("channels", ChannelRows(n_channels=3)), *make_alpio().steps])
    diagnoser = wrap(inner).fit(X.reshape(20, -1), Y)
    with pytest.raises(CommandError, match=r"ChannelRows\(n_channels=3\) expects rows, but"):
        saved_as(diagnoser, tmp_path / "d.skops")
