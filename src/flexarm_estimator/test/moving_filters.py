"""Filters that are fed the record of a strongly moving arm."""

import numpy as np
from machines import machine_tree
from moving_truth import ARM, SENSORS, served

from flexarm_estimator.estimator import Estimator
from flexarm_estimator.settings import EstimatorConfig

QUIET = {"initial_position": 0.01, "initial_velocity": 0.1, "initial_disturbance": 0.1}


def estimator(name, sensors=None, **settings):
    """Return a filter by its name, for the moving arm."""
    config = EstimatorConfig(filter=name, **settings)
    specs = SENSORS if sensors is None else sensors
    return Estimator(served(), machine_tree(ARM), specs, config, use_compiler=False)


def run(name, record, delay=0, until=np.inf, **settings):
    """Feed a record; frames arrive ``delay`` instants late."""
    filtering, estimates = estimator(name, **settings), []
    for k, t in enumerate(record.t):
        now = [sample for sample in record.samples[k] if sample.sensor != "camera"]
        seen = record.samples[k - delay] if k >= delay else []
        now += [sample for sample in seen if sample.sensor == "camera" and sample.t <= until]
        estimates.append(filtering.step(now, record.tau[k], float(t)))
    return estimates


def tip_error(estimates, record):
    """Return the largest error of the tip after the start [m]."""
    pairs = list(zip(estimates, record.tip, strict=True))[40:]
    return max(np.linalg.norm(estimate.T_world_tip[:3, 3] - tip[:3, 3]) for estimate, tip in pairs)
