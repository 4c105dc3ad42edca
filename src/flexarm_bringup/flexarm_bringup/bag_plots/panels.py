"""The one table of panels, in reading order."""

from __future__ import annotations

from flexarm_bringup.bag_plots.control_panels import draw_energy, draw_limits, draw_rungs, draw_times
from flexarm_bringup.bag_plots.drift_panel import draw_drift
from flexarm_bringup.bag_plots.estimate_panels import (
    draw_inertial,
    draw_modes,
    draw_sensors,
    draw_strain,
)
from flexarm_bringup.bag_plots.motion_panels import draw_goals, draw_joints, draw_tip, draw_torques
from flexarm_bringup.bag_plots.panel import Panel

PANELS = (
    Panel("tip", "Where the tip is, against where the reference would have it rest (band: 0.5 mm).",
          ("end_effector",), draw_tip, ("reference", "truth"), 5.4),
    Panel("goals", "Goals of the tip, what became of them, and the distance (dots) against 0.5 mm.",
          ("motion_status",), draw_goals, (), 3.4),
    Panel("rungs", "Who spoke: rung of the controller's ladder, guard, estimator.",
          ("controller_status",), draw_rungs, ("guard_status", "modal_state"), 3.4),
    Panel("joints", "The axes, measured and asked for.", ("joint_states",), draw_joints, ("reference",), 4.6),
    Panel("torques", "Torques let through to the motors, and their limits (dashed red) where they come near.",
          ("applied_effort",), draw_torques, ("joint_commands",), 4.6),
    Panel("modes", "Modal amplitudes with three sigma.", ("modal_state",), draw_modes, (), 5.2),
    Panel("drift", "Running frequencies of the modes with three sigma; dashed: what the drift watch tells.",
          ("model", "joint_states", "applied_effort"), draw_drift, ("strain", "imu/*"), 4.0),
    Panel("energy", "Energy of the vibration, mode by mode, about where the modes rest.",
          ("modal_state", "model"), draw_energy, ("controller_debug",)),
    Panel("strain", "Strain at the gauges, and its limit (dashed red) where it comes near.", ("strain",),
          draw_strain, ("truth",)),
    Panel("accelerations", "What the accelerometers feel (+g at rest), and how fast gyroscopes turn.",
          ("imu/*",), draw_inertial),
    Panel("sensors", "Health of every sensor, and its innovations in sigmas (band: 3).",
          ("modal_state",), draw_sensors, (), 4.8),
    Panel("limits", "Limits of the controller's program that bound.", ("controller_status",), draw_limits,
          (), 2.6),
    Panel("times", "CPU time of the controller's steps, and iterations of its solver.",
          ("controller_status",), draw_times, ("controller_debug",), 4.2),
)  # fmt: skip
