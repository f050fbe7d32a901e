import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.linalg import block_diag
from scipy.signal import lfilter

from skarxlag import ARXLaguerre
from skarxlag.kernels.laguerre import laguerre_matrices


def unit(windows):
    """Centred by channel and divided by the RMS of the output, on its own."""
    windows = windows if windows.ndim == 3 else windows[:, np.newaxis]
    centred = windows - windows.mean(axis=-1, keepdims=True)
    return centred / centred[:, :1].std(axis=-1, keepdims=True)


def states_of(windows, orders, poles):
    """Laguerre states of every window, (n_windows, n_samples, n_states), by scipy.signal."""
    columns = []
    for channel, (order, pole) in enumerate(zip(orders, poles, strict=True)):
        output = lfilter([0, np.sqrt(1 - pole**2)], [1, -pole], windows[:, channel])
        for _ in range(order):
            columns.append(output)
            output = lfilter([-pole, 1], [1, -pole], output)
    return np.stack(columns, axis=-1)


@pytest.fixture
def windows():
    rng = np.random.default_rng(0)
    noise = rng.normal(size=(6, 300))
    u = rng.normal(size=(6, 300))
    y = lfilter([1], [1, -1.2, 0.6], noise) + lfilter([0, 0.7, 0.4], [1, -0.5], u) + 3.0
    return np.stack([y, u], axis=1)


def test_pole_zero_is_plain_least_squares_on_lagged_samples(windows):
    n_y, n_u, transient = 3, 2, 3
    rows, outputs = [], []
    for y, u in unit(windows):
        for k in range(transient, len(y)):
            rows.append([*y[k - n_y : k][::-1], *u[k - n_u : k][::-1]])
            outputs.append(y[k])
    expected = np.linalg.lstsq(np.array(rows), np.array(outputs), rcond=None)[0]
    model = ARXLaguerre(order=(n_y, n_u), pole=0.0, alpha=0.0).fit(windows)
    assert_allclose(model.coef_, [expected], rtol=1e-9)
    error = np.array(outputs) - np.array(rows) @ expected
    assert_allclose(model.transform(windows).ravel(), error, atol=1e-10)
    assert_allclose(model.noise_level_, [np.sqrt(np.mean(error**2))], rtol=1e-9)


@pytest.mark.parametrize("forgetting_factor", [1.0, 0.7])
def test_fit_is_recursive_least_squares(windows, forgetting_factor):
    # Eq. (16) with its sign and its X(k) repaired, forgetting once a window.
    orders, poles, alpha, transient = [3, 2], [0.4, -0.2], 2.0, 7
    scaled = unit(windows)
    states = states_of(scaled, orders, poles)
    # In the recursion P0 fades with the windows; the ridge of `fit` does not.
    P = np.eye(5) * forgetting_factor ** len(windows) / alpha
    K = np.zeros(5)
    for w in range(len(windows)):
        P = P / forgetting_factor
        for x, y in zip(states[w, transient:], scaled[w, 0, transient:], strict=True):
            P = P - np.outer(P @ x, x @ P) / (1 + x @ P @ x)
            K = K + P @ x * (y - K @ x)
    model = ARXLaguerre(
        order=orders, pole=poles, alpha=alpha, forgetting_factor=forgetting_factor
    ).fit(windows)
    assert_allclose(model.coef_[0], K, rtol=1e-8)


def assert_same_models(one, other):
    assert_array_equal(one.classes_, other.classes_)
    assert_allclose(one.coef_, other.coef_, rtol=1e-8, atol=1e-10)
    assert_allclose(one.noise_level_, other.noise_level_, rtol=1e-8)
    assert_allclose(one.weights_, other.weights_, rtol=1e-12)


@pytest.mark.parametrize("forgetting_factor", [1.0, 0.8])
@pytest.mark.parametrize(
    "labels", [None, list("bbacab"), [2, 2, 1, 3, 1, 2], [True] * 2 + [False] * 4]
)
def test_partial_fit_in_batches_is_one_fit(windows, forgetting_factor, labels):
    settings = {"order": 4, "pole": 0.2, "forgetting_factor": forgetting_factor}
    whole = ARXLaguerre(**settings).fit(windows, labels)
    parts = ARXLaguerre(**settings)
    for batch in np.split(np.arange(6), [2, 3, 5]):
        of_batch = None if labels is None else np.array(labels)[batch]
        assert parts.partial_fit(windows[batch], of_batch) is parts
    assert_same_models(parts, whole)
    assert_allclose(
        parts.transform(windows), whole.transform(windows), rtol=1e-7, atol=1e-9
    )


def test_partial_fit_keeps_the_optimised_pole(windows):
    first = ARXLaguerre(order=4, pole="optimise").fit(windows[:3])
    parts = ARXLaguerre(order=4, pole="optimise").partial_fit(windows[:3])
    assert_array_equal(parts.poles_, first.poles_)
    parts.partial_fit(windows[3:])
    assert_array_equal(parts.poles_, first.poles_)
    assert_same_models(
        parts, ARXLaguerre(order=4, pole=list(first.poles_)).fit(windows)
    )


@pytest.mark.parametrize("changed", [{"order": 8}, {"pole": 0.5}, {"order": [4, 5]}])
def test_partial_fit_refuses_other_networks_than_those_so_far(windows, changed):
    model = ARXLaguerre(order=4, pole=0.2).partial_fit(windows[:3])
    with pytest.raises(ValueError, match=r"order|pole"):
        model.set_params(**changed).partial_fit(windows[3:])
    assert_same_models(model.set_params(order=[4, 4], pole=[0.2, 0.2]).partial_fit(windows[3:]),
                       ARXLaguerre(order=4, pole=0.2).fit(windows))  # fmt: skip


def test_an_order_beyond_the_window_is_refused():
    X = np.random.default_rng(0).normal(size=(4, 300))
    with pytest.raises(
        ValueError, match="order for windows of 300 samples == 1000000, must be <= 300"
    ):
        ARXLaguerre(order=10**6).fit(X)
    with pytest.raises(
        ValueError, match="order for windows of 3 samples == 65, must be <= 64"
    ):
        ARXLaguerre(order=65).fit(X[:, :3])
    assert ARXLaguerre(order=64).fit(X[:, :3]).orders_ == [64]


def test_windows_in_which_networks_do_not_settle_are_refused():
    X = np.random.default_rng(0).normal(size=(4, 2, 300))
    model = ARXLaguerre(order=16, pole=0.0).fit(X)
    assert model.transform(X[..., :32]).shape == (4, 1, 16)
    for use in (model.transform, model.partial_fit, model.predict_output):
        with pytest.raises(
            ValueError, match="Samples in a window of X == 31, must be >= 32"
        ):
            use(X[..., :31])
    short = ARXLaguerre(order=16, pole=0.0).fit(X[..., :20])
    assert short.transform(X[..., :20]).shape == (4, 1, 10)
    with pytest.raises(
        ValueError, match="Samples in a window of X == 19, must be >= 20"
    ):
        short.transform(X[..., :19])


@pytest.mark.parametrize("name", ["bank", "unit_rms"])
def test_flags_are_no_texts(windows, name):
    with pytest.raises(TypeError, match=name):
        ARXLaguerre(order=4, **{name: "no"}).fit(windows)


def test_fit_forgets_what_partial_fit_knew(windows):
    model = ARXLaguerre(order=4).partial_fit(windows, list("aabbcc")).fit(windows[:2])
    assert_same_models(model, ARXLaguerre(order=4).fit(windows[:2]))


def test_partial_fit_refuses_labels_of_another_type(windows):
    model = ARXLaguerre(order=4).partial_fit(windows, list("ababab"))
    with pytest.raises(ValueError, match=r"y == \['b', 1\], expected labels"):
        model.partial_fit(windows, [0, 1, 0, 1, 0, 1])


def test_bank_has_the_model_of_each_condition(windows):
    labels = np.array(list("bbacab"))
    bank = ARXLaguerre(order=4).fit(windows, labels)
    assert_array_equal(bank.classes_, ["a", "b", "c"])
    for c, name in enumerate(bank.classes_):
        alone = ARXLaguerre(order=4).fit(windows[labels == name])
        assert_allclose(bank.coef_[c], alone.coef_[0], rtol=1e-12)
        assert_allclose(bank.noise_level_[c], alone.noise_level_[0])
        own = ARXLaguerre(order=4, healthy=name).fit(windows, labels)
        assert_array_equal(own.classes_, [name])
        assert_allclose(own.coef_, bank.coef_[[c]], rtol=1e-12)
    assert_array_equal(bank.get_feature_names_out(), ["a", "b", "c"])


def test_optimised_pole_is_shared_by_the_bank_and_found_per_channel():
    rng = np.random.default_rng(0)
    u, noise = rng.normal(size=(2, 20, 1000))
    A, b = laguerre_matrices(2, 0.8)
    forced = np.zeros_like(u)
    state = np.zeros((2, 20))
    for k in range(1000):
        forced[:, k] = np.array([1.0, -1.0]) @ state
        state = A @ state + np.outer(b, u[:, k])
    y = lfilter([1], [1, -0.7], forced + noise)
    windows = np.stack([y, u], axis=1)
    # 0.7 q^-1 = g L_0(q) at pole 0.
    model = ARXLaguerre(order=(1, 2), pole=[0.0, "optimise"]).fit(windows, [0, 1] * 10)
    assert_allclose(model.poles_, [0.0, 0.8], atol=0.02)
    assert model.coef_.shape == (2, 3)
    assert_allclose(model.coef_, [[0.7, 1.0, -1.0]] * 2, atol=0.1)


def test_state_space_reproduces_transform_literally(windows):
    labels = list("ababab")
    model = ARXLaguerre(order=(3, 2), pole=(0.4, -0.6)).fit(windows, labels)
    space = model.state_space()
    blocks = [laguerre_matrices(3, 0.4), laguerre_matrices(2, -0.6)]
    assert_array_equal(space.A, block_diag(*[A for A, _ in blocks]))
    assert space.b_y.shape == (5,)
    assert space.b_u.shape == (5, 1)
    innovations = np.zeros((6, 2, 300))
    for w, (y, u) in enumerate(unit(windows)):
        x = np.zeros(5)
        for k in range(300):
            innovations[w, :, k] = y[k] - space.coef @ x
            x = space.A @ x + space.b_y * y[k] + space.b_u @ [u[k]]
    # The network with the pole -0.6 settles in 8 samples.
    assert_allclose(model.transform(windows), innovations[..., 8:], atol=1e-11)


@pytest.mark.parametrize("free_run", [False, True])
def test_predicted_output_and_fit_percentage_by_a_literal_loop(windows, free_run):
    transient = 6
    model = ARXLaguerre(order=(3, 2), pole=0.3).fit(windows)
    space = model.state_space()
    predicted = model.predict_output(windows, free_run=free_run)
    percentage = model.fit_percentage(windows, free_run=free_run)
    for w, (y, u) in enumerate(windows):
        mean, scale = y.mean(), y.std()
        x, expected = np.zeros(5), np.zeros(300)
        for k in range(300):
            expected[k] = space.coef[0] @ x
            measured = (y[k] - mean) / scale
            fed = expected[k] if free_run and k >= transient else measured
            x = (
                space.A @ x
                + space.b_y * fed
                + space.b_u[:, 0] * (u[k] - u.mean()) / scale
            )
        expected = (expected * scale + mean)[transient:]
        tail = y[transient:]
        assert_allclose(predicted[w, 0], expected, atol=1e-9)
        nrmse = np.linalg.norm(tail - expected) / np.linalg.norm(tail - tail.mean())
        assert percentage[w, 0] == pytest.approx(100 * (1 - nrmse), abs=1e-6)


def test_free_run_of_an_unstable_model_is_refused():
    y = 1.05 ** np.arange(200.0) * np.cos(np.arange(200.0))
    model = ARXLaguerre(order=2, pole=0.0, alpha=0.0).fit(y[np.newaxis], ["runaway"])
    assert np.isfinite(model.predict_output(y[np.newaxis])).all()
    with pytest.raises(
        ValueError,
        match=r"'runaway' is unstable in free run: its spectral radius is 1\.0",
    ):
        model.predict_output(y[np.newaxis], free_run=True)


def test_innovations_in_the_unit_of_the_sensor(windows):
    unit_rms = ARXLaguerre(order=4).fit(windows)
    physical = ARXLaguerre(order=4, unit_rms=False).fit(windows)
    scale = windows[:, 0].std(axis=-1)[:, np.newaxis, np.newaxis]
    assert_allclose(
        physical.transform(windows), unit_rms.transform(windows) * scale, rtol=1e-12
    )


@pytest.mark.parametrize("value", [0.0, 1e-3, 1e6])
def test_a_window_of_constant_output_is_ignored(windows, value):
    labels = np.array(list("aabbbb"))
    dead = windows[:1].copy()
    dead[0, 0] = value
    more, more_labels = np.concatenate([dead, windows]), np.append("a", labels)
    for pole in (0.3, "optimise"):
        expected = ARXLaguerre(order=3, pole=pole).fit(windows, labels)
        found = ARXLaguerre(order=3, pole=pole).fit(more, more_labels)
        assert_allclose(found.coef_, expected.coef_, rtol=1e-12)
        assert_allclose(found.noise_level_, expected.noise_level_, rtol=1e-12)
    assert_array_equal(found.transform(more)[1:], found.transform(windows))


def test_only_constant_windows_give_a_model_that_predicts_nothing():
    for pole in (0.3, "optimise"):
        model = ARXLaguerre(order=3, pole=pole).fit(np.full((2, 20), 7.0))
        assert_array_equal(model.coef_, 0)
        assert_array_equal(model.noise_level_, 0)
        assert_array_equal(model.transform(np.full((2, 20), 7.0)), 0)
        assert_array_equal(model.fit_percentage(np.full((2, 20), 7.0)), 100)


def test_partial_fit_goes_on_as_fit_began():
    X, y = np.random.default_rng(0).normal(size=(8, 60)), np.repeat(["a", "b"], 4)
    bank, one = ARXLaguerre(order=2).fit(X, y), ARXLaguerre(order=2).fit(X)
    with pytest.raises(ValueError, match=r"y is missing, expected conditions.*'a' 'b'"):
        bank.partial_fit(X)
    with pytest.raises(ValueError, match=r"y == .*'a', 'b'.*, expected None"):
        one.partial_fit(X, y)
    assert bank.partial_fit(X, y).classes_.tolist() == ["a", "b"]
    assert one.partial_fit(X).classes_.tolist() == ["model"]
    pooled = ARXLaguerre(order=2, bank=False).fit(X, y)
    assert pooled.partial_fit(X).classes_.tolist() == ["model"]


def test_two_orders_are_those_of_the_output_and_of_all_inputs():
    X = np.random.default_rng(0).normal(size=(6, 3, 200))
    found = [
        ARXLaguerre(order=order, pole=(0.2, 0.4)).fit(X)
        for order in [(2, 5), (2, 5, 5)]
    ]
    assert found[0].orders_.tolist() == [2, 5, 5] and found[0].poles_.tolist() == [
        0.2,
        0.4,
        0.4,
    ]
    assert_array_equal(found[0].coef_, found[1].coef_)
    assert ARXLaguerre(order=(2, 5)).fit(X[:, 0]).orders_.tolist() == [2]
    with pytest.raises(ValueError, match=r"order == .*, or 2, one for each channel"):
        ARXLaguerre(order=(2, 5, 5)).fit(X[:, :2])
