"""The estimators of the package, listed once.

The public names, the types that a model file may hold, and the tests of scikit-learn's
contract are derived from this list.
"""

#: Module of each estimator, relative to the package.
ESTIMATORS = {
    "ARXLaguerre": "models.identification",
    "ConditionClassifier": "decisions.condition_classifier",
    "DiagnosisPipeline": "core.pipelines",
    "ExtendedStatePIObserver": "models.observers",
    "FaultDetector": "decisions.fault_detector",
    "FaultOrderClassifier": "decisions.fault_orders",
    "KnownConditions": "decisions.known_conditions",
    "LogSpectra": "measures.spectra",
    "OrderResidual": "distances.orders",
    "PIObserver": "models.observers",
    "SensorFusion": "decisions.fusion",
    "SpectralDistance": "distances.comparison",
    "StretchResidual": "distances.stretches",
    "ThresholdLadder": "decisions.ladder",
}
