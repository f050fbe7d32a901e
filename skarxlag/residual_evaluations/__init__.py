"""Residual evaluations: what an observer keeps of the error of one window and one model."""

from . import power, switching_gain, whiteness

#: A residual evaluation is a module with two names. `levels(innovations, loop, observer)` takes
#: innovations of shape (n_windows, n_models, n_samples), the constants of the observer's loop and
#: the fitted observer, and returns levels of shape (n_windows, n_models). `TRAJECTORY` names the
#: trajectory of `observe` whose size the level measures, in its unit; None for a level that does
#: not change with the scale of the innovations.
RESIDUAL_EVALUATIONS = {
    "power": power,
    "switching_gain": switching_gain,
    "whiteness": whiteness,
}
