"""Small one-dimensional convolutional network as a scikit-learn classifier (PyTorch, CPU)."""

import numpy as np
import torch
from sklearn.base import BaseEstimator, ClassifierMixin
from torch import nn


class ConvolutionalClassifier(ClassifierMixin, BaseEstimator):
    """Wide first convolution, then three narrow ones, mean over time, one linear layer.

    The layout follows the WDCNN of Zhang et al. (2017, Sensors 17, 425), the usual
    baseline on bearing vibration, with fewer layers: 64 samples wide with stride 8 and
    16 channels, then 32, 64 and 64 channels 3 samples wide, each with batch
    normalisation, ReLU and a maximum over pairs. Cross-entropy, Adam with PyTorch's
    defaults, batches of 32, no augmentation.

    Parameters
    ----------
    epochs : int, default=50
        Passes through the training windows.
    random_state : int, default=0
        Seed of the weights and of the order of the windows.
    """

    def __init__(self, *, epochs=50, random_state=0):
        self.epochs = epochs
        self.random_state = random_state

    def fit(self, X, y):
        """Train from scratch on windows X of shape (n_windows, n_samples)."""
        self.classes_, codes = np.unique(y, return_inverse=True)
        with torch.random.fork_rng():
            torch.manual_seed(self.random_state)
            self.network_ = _network(len(self.classes_))
            self._train(_as_input(X), torch.from_numpy(codes))
        self.network_.eval()
        return self

    def _train(self, windows, codes):
        optimiser = torch.optim.Adam(self.network_.parameters())
        for _ in range(self.epochs):
            for rows in torch.randperm(len(windows)).split(32):
                if len(rows) == 1:  # no batch statistics in a single window
                    continue
                optimiser.zero_grad()
                nn.functional.cross_entropy(
                    self.network_(windows[rows]), codes[rows]
                ).backward()
                optimiser.step()

    def predict_proba(self, X):
        """Return the softmax of the network's outputs, of shape (n_windows, n_classes)."""
        with torch.no_grad():
            return torch.softmax(self.network_(_as_input(X)), dim=1).double().numpy()

    def predict(self, X):
        """Return the most probable class of each window."""
        return self.classes_[self.predict_proba(X).argmax(axis=1)]


def _as_input(X):
    return torch.from_numpy(np.asarray(X, dtype=np.float32))[:, None, :]


def _network(n_classes):
    layers = []
    for n_in, n_out, width, stride in [
        (1, 16, 64, 8),
        (16, 32, 3, 1),
        (32, 64, 3, 1),
        (64, 64, 3, 1),
    ]:
        layers += [
            nn.Conv1d(n_in, n_out, width, stride=stride, padding=width // 2),
            nn.BatchNorm1d(n_out),
            nn.ReLU(),
            nn.MaxPool1d(2),
        ]
    return nn.Sequential(
        *layers, nn.AdaptiveAvgPool1d(1), nn.Flatten(), nn.Linear(64, n_classes)
    )
