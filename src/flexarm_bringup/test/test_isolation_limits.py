"""Why two detached gauges are not named under MPC: one hardly bends, and one leaves the loop ringing.

``./flexarm test src/flexarm_bringup/test/test_isolation_limits.py -s`` prints the figures of
docs/sensor_health.md.
"""

from dataclasses import replace

import numpy as np
import pytest
from test_isolation_rig import NOISE_ONLY, Arm, arm, assert_named, from_the_move, plant

from flexarm_bringup.closed_loop import run_loop
from flexarm_bringup.sim.hardware import Hardware
from flexarm_bringup.sim.rig import RigSettings
from flexarm_bringup.sim_run.study import loop_settings
from flexarm_estimator.estimate import Estimate
from flexarm_model.tree.reduced_tree import ReducedTree

pytestmark = pytest.mark.slow
GAUGE = "forearm_strain_y"
OTHER = "lower_arm_strain_y"
AT_ONCE = 0.01  # s
SLOWER = 80.0  # Hz; what the arm is moved with is slower
SERVED = 100.0  # Hz; the modes of the 6R's file are below


def strains(name: str, law: str, faults: dict, end: float, gauge: str) -> tuple[np.ndarray, np.ndarray]:
    """Return stamps and what a sound gauge of that place would say without noise, over its sigma, (k,)."""
    it, rows = arm(name), []
    specs = [spec for spec in it.tree.config.sensors if spec.kind == "strain_gauge"]
    place = [spec.name for spec in specs].index(gauge)

    def observe(hardware: Hardware, estimate: Estimate) -> dict:
        rows.append((hardware.t, hardware.rig.truth().strain[place]))
        return {}

    rig = RigSettings()
    hardware = Hardware(it.tree.config, rig, plant=plant(name, rig), faults=faults)
    run_loop(hardware, it.tree, it.course.reference, end, loop_settings(it.task, law, rig), observe)
    t, strain = np.array(rows).T
    return t, strain / specs[place].sigma[0]


def test_under_mpc_the_leg_whose_gauge_comes_off_unseen_bends_by_a_few_sigma() -> None:
    """A window of 60 periods needs three times more than noise in its standard deviation."""
    start = arm("spatial_3tpt").course.legs[0].start
    largest = {}
    for law in ("mpc", "pd"):
        t, said = strains("spatial_3tpt", law, {}, start + 0.5, "strain_1y")
        windows = [said[k : k + 60].std() for k in np.flatnonzero(t >= start)[:-60]]
        largest[law] = max(windows)
        print(f"3-TPT strain_1y, {law}: a window of 60 periods shows {largest[law]:.1f} sigma at most")
    assert largest["mpc"] < 3.0 < largest["pd"]


def ringing(t: np.ndarray, said: np.ndarray) -> tuple[float, float]:
    """Return the frequency [Hz] and the standard deviation of what vibrates beyond 80 Hz."""
    spectrum = np.fft.rfft(said - said.mean())
    f = np.fft.rfftfreq(t.size, float(np.diff(t).mean()))
    spectrum[f < SLOWER] = 0.0
    return float(f[np.abs(spectrum).argmax()]), float(np.fft.irfft(spectrum, t.size).std())


def test_without_its_gauge_the_six_axis_arm_rings_in_a_mode_that_its_filter_does_not_know() -> None:
    """With that mode served the gauge is named at once, but the margins are not kept at all frequencies."""
    it, faults, found = arm("serial_6r"), from_the_move({GAUGE: NOISE_ONLY}, "serial_6r"), {}
    for words, these in (("in order", {}), ("off", faults)):
        t, said = strains("serial_6r", "mpc", these, 1.2, OTHER)
        found[words] = ringing(t[t > 0.7], said[t > 0.7])
        print(
            "6R with {} {}: {} rings at {:.0f} Hz by {:.1f} sigma".format(GAUGE, words, OTHER, *found[words])
        )
    assert found["off"][1] > 5.0 * found["in order"][1]
    assert found["off"][0] > SERVED
    more = replace(it.tree.config, modes=it.tree.config.modes + 1)
    six = Arm(it.task, ReducedTree(more), it.course)
    named = six.run("mpc", faults=faults, end=0.7, words="")
    print(f"6R with {more.modes} modes served: {named}")
    assert_named(named, [GAUGE], "has shifted", faults[GAUGE].start + AT_ONCE)
