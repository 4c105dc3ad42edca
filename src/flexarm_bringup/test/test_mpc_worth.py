"""What the predictive controller is worth on the single link with the noise of the notes, in the whole chain.

Bounds are those asked for (seed 002, section 6, is the base: 10 degrees in one second).
"""

from dataclasses import replace

import numpy as np
import pytest

from flexarm_bringup.closed_loop import LoopSettings, run_closed_loop
from flexarm_bringup.demo_run.motions import motions, out_and_back
from flexarm_bringup.demo_run.study import damping_ratio, tip_reach
from flexarm_bringup.record import judge
from flexarm_bringup.sim.rig import RigSettings
from flexarm_controller.settings import ControllerConfig
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator

pytestmark = pytest.mark.slow
BASE = 1.940  # m/s^2, the worst trapezoid on an ideal servo: seed 002, section 6
SCARCE = 0.56  # N m, half of what that trapezoid asks of the geared hub
SETTLED = 0.15  # s


def with_effort(config, effort):
    """Return the arm with another torque limit [N m], and as much less rate."""
    joints = []
    for joint in config.joints:
        axes = [
            replace(axis, effort=effort, effort_rate=100 * effort) if axis.actuated else axis
            for axis in joint.axes
        ]
        joints.append(replace(joint, axes=tuple(axes)))
    return replace(config, joints=tuple(joints))


def decibels(preset="geared", law="mpc", frequency=1.0, effort=None):
    """Return residuals [dB] and settling [s] of the worst profile (out) and the shaped one (back)."""
    config = load_config(find_manipulator("single_link"), preset)
    config = config if effort is None else with_effort(config, effort)
    moves = out_and_back([np.radians(10.0)], "A", "ZVD", motions(damping_ratio(config)))
    rig, laws = RigSettings(frequency_scale=frequency), ControllerConfig(law=law)
    record = run_closed_loop(config, moves, LoopSettings(controller=laws, rig=rig))
    figures = [judge(record, move, tip_reach(config)) for move in moves]
    return [20 * np.log10(f.residual / BASE) for f in figures], [f.settling for f in figures]


def test_as_described_the_worst_profile_and_the_shaped_one_are_as_quiet_as_asked():
    (worst, shaped), settling = decibels()
    assert worst <= -31.0
    assert shaped <= -34.0
    assert max(settling) <= SETTLED


@pytest.mark.parametrize("frequency", [0.9, 1.1])
@pytest.mark.parametrize("preset", ["geared", "light_hub"])
def test_frequencies_ten_percent_off_are_borne(preset, frequency):
    residuals, _ = decibels(preset, frequency=frequency)
    assert max(residuals) <= -28.0


def test_with_half_the_torque_it_beats_the_clipped_lqg_by_ten_decibels():
    (mpc, _), _ = decibels(effort=SCARCE)
    (lqg, _), _ = decibels(law="lqr", effort=SCARCE)
    assert mpc <= lqg - 10.0
