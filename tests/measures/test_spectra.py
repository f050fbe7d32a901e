import numpy as np
import pytest
import sklearn
from numpy.testing import assert_array_equal

from skarxlag import ARXLaguerre, LogSpectra
from skarxlag.kernels.spectra import own_spectra

NAMES = ["spectral_shape", "steadiness"]


@pytest.fixture(scope="module")
def windows():
    return np.random.default_rng(0).normal(size=(70, 300))


def test_transform_is_the_kernel(windows):
    spectra = LogSpectra(spectrum_order=16).fit_transform(windows)
    assert_array_equal(spectra, own_spectra(windows, 16))


def test_groups_of_several_models_follow_each_other(windows):
    innovations = ARXLaguerre(order=4).fit_transform(windows, np.arange(70) % 2)
    both = LogSpectra().fit(innovations)
    for model in (0, 1):
        own = LogSpectra().fit_transform(innovations[:, model])
        assert_array_equal(np.split(both.transform(innovations), 2, axis=1)[model], own)
    assert both.get_feature_names_out(["a", "b"]).tolist() == [
        f"{model}_{name}" for model in "ab" for name in NAMES
    ]
    assert both.get_feature_names_out()[0] == "model0_spectral_shape"


def test_names_of_one_model_are_those_of_the_measures(windows):
    assert LogSpectra().fit(windows).get_feature_names_out().tolist() == NAMES


def test_an_order_out_of_range_is_named(windows):
    with pytest.raises(ValueError, match="spectrum_order"):
        LogSpectra(spectrum_order=0).fit(windows)


def test_windows_shorter_than_a_segment(windows):
    assert LogSpectra().fit_transform(windows[:, :40]).shape == (70, 2, 38)


def test_type_layout_and_threads(windows):
    single = windows.astype(np.float32)
    single.flags.writeable = False
    spectra = LogSpectra().fit_transform(single)
    assert spectra.dtype == np.float32
    assert_array_equal(LogSpectra().fit_transform(np.asfortranarray(single)), spectra)
    assert_array_equal(LogSpectra(n_jobs=2).fit_transform(single), spectra)


def test_a_setting_that_asks_for_tables_gives_arrays(windows):
    with sklearn.config_context(transform_output="pandas"):
        spectra = LogSpectra().fit_transform(windows)
    assert isinstance(spectra, np.ndarray)
